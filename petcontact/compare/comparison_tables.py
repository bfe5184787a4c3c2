"""Tables and figures of a comparison of methods."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ..runtime.figure_style import plain, save_all
from ..runtime.text_table import aligned, as_csv
from ..untyped import Axes, Figure
from .side_by_side import Trial

COLUMNS = (
    "problem",
    "contender",
    "rho",
    "converged",
    "iterations",
    "elastic_solves",
    "applications",
    "seconds",
    "residual",
    "error_u",
    "error_sigma",
)


def markdown(rows: Sequence[Trial]) -> str:
    """Two tables a problem: costs and errors, worst over ρ_0; iterations by ρ_0."""
    parts = []
    for problem in dict.fromkeys(row.problem for row in rows):
        chosen = [row for row in rows if row.problem == problem]
        parts += [f"## {problem}", "\n".join(aligned(_costs(chosen)))]
        if len({row.rho for row in chosen} - {None}) > 1:
            parts += [
                "Iterations by ρ_0 (> where the limit was reached):",
                "\n".join(aligned(_by_rho(chosen))),
            ]
    parts.append(
        "Times are those of a method on a prepared system that all share, where a Robin solve "
        "takes a few\n"
        "products with the Hessenberg form of S unless options of the KSP ask for another solver."
    )
    if any(row.contender == "tao" for row in rows):
        parts.append(
            "TAO's products with its own symmetrised matrix are not among the applications."
        )
    return "\n\n".join(parts) + "\n"


def _groups(rows: Sequence[Trial]) -> Iterator[tuple[str, list[Trial]]]:
    for name in dict.fromkeys(row.contender for row in rows):
        yield name, [row for row in rows if row.contender == name]


def _costs(rows: Sequence[Trial]) -> Iterator[list[str]]:
    yield [
        "method",
        "iterations",
        "elastic solves",
        "applications",
        "time/ms",
        "‖R‖/‖σ_t‖",
        "error u_t",
        "error σ_t",
    ]
    for name, group in _groups(rows):
        bad = sum(not row.converged for row in group)
        yield [
            name + (f" ({bad} of {len(group)} not converged)" if bad else ""),
            _span([row.iterations for row in group]),
            _span([row.elastic_solves for row in group]),
            _span([row.applications for row in group]),
            _span([round(1e3 * row.seconds, 1) for row in group]),
            *(
                f"{max(getattr(row, key) for row in group):.1e}"
                for key in ("residual", "error_u", "error_sigma")
            ),
        ]


def _span(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _by_rho(rows: Sequence[Trial]) -> Iterator[list[str]]:
    rhos = sorted({row.rho for row in rows if row.rho is not None})
    yield ["method", *(f"{rho:g}" for rho in rhos)]
    for name, group in _groups(rows):
        by_rho = {row.rho: f"{'' if row.converged else '> '}{row.iterations}" for row in group}
        yield [name, *(by_rho.get(rho, by_rho.get(None, "")) for rho in rhos)]


def csv_text(rows: Sequence[Trial]) -> str:
    """The runs as CSV, a line each."""
    return as_csv(COLUMNS, ([getattr(row, key) for key in COLUMNS] for row in rows))


def write_figures(rows: Sequence[Trial], folder: str | Path) -> list[Path]:
    """Draw compare-residual.png (over applications of S) and compare-iterations.png (over ρ_0);
    returns their paths."""
    drawings = {"residual": draw_residuals}
    if len({row.rho for row in rows} - {None}) > 1:
        drawings["iterations"] = draw_iterations
    return save_all(drawings, folder, "compare", rows)


def _panels(
    figure: Figure, rows: Sequence[Trial], across: str, up: str
) -> Iterable[tuple[Axes, list[Trial]]]:
    """Yield axes for each problem with its runs; the labels of both axes are those given."""
    problems = list(dict.fromkeys(row.problem for row in rows))
    columns = min(2, len(problems))
    lines = -(-len(problems) // columns)
    figure.set_size_inches(4.4 * columns + 2.4, 3.4 * lines)
    # a column of its own for the legend: matplotlib 3.6 has no legends outside of constrained axes
    grid = figure.subplots(
        lines, columns + 1, squeeze=False, gridspec_kw={"width_ratios": [4.4] * columns + [1.8]}
    )
    panels = grid[:, :-1].ravel()
    for axes in [*grid[:, -1], *panels[len(problems) :]]:
        axes.set_axis_off()
    for axes, problem in zip(panels, problems, strict=False):
        axes.set_title(plain(problem), fontsize=9)
        axes.set(xlabel=across, ylabel=up)
        yield axes, [row for row in rows if row.problem == problem]
        axes.grid(alpha=0.3)
    handles, labels = panels[0].get_legend_handles_labels()
    grid[0, -1].legend(handles, labels, loc="center left", fontsize=7, frameon=False)


def draw_residuals(figure: Figure, rows: Sequence[Trial]) -> None:
    """Relative friction residual over applications of S, of the runs that were followed."""
    for axes, group in _panels(figure, rows, "applications of S", "‖R‖ / ‖σ_t‖"):
        for row in (row for row in group if row.path):
            applications, residuals = np.array(row.path).T
            label = row.contender + (f", ρ_0 = {row.rho:g}" if row.rho is not None else "")
            axes.loglog(
                applications,
                np.maximum(residuals, 1e-17),
                marker=".",
                markersize=4,
                linewidth=1.0,
                label=label,
            )


def draw_iterations(figure: Figure, rows: Sequence[Trial]) -> None:
    """Iterations over ρ_0; hollow where the method did not converge."""
    for axes, group in _panels(figure, rows, "ρ_0", "iterations"):
        rhos = sorted({row.rho for row in group if row.rho is not None})
        for name, runs in _groups(group):
            line = {row.rho: row for row in runs}
            chosen = [line.get(rho, line.get(None)) for rho in rhos]
            counts = [row.iterations if row else np.nan for row in chosen]
            (drawn,) = axes.loglog(rhos, counts, marker=".", linewidth=1.0, label=name)
            failed = [
                (rho, row.iterations)
                for rho, row in zip(rhos, chosen, strict=True)
                if row and not row.converged
            ]
            if failed:
                axes.plot(
                    *np.array(failed).T, "o", mfc="white", color=drawn.get_color(), markersize=6
                )
