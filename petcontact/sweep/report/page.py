"""A sweep as one HTML page that needs no other file."""

from __future__ import annotations

from collections.abc import Sequence

from ...results.solution import Solution
from ...runtime.figure_style import png
from ..published import example_number
from ..store.case_table import CaseTable
from .formats import bad_cases, column_heads, counts_line, legend
from .pivot import ITERATIONS, Table, text
from .sweep_plots import Plot, draw

DRAWN = {
    "deformed": "initial and deformed outline",
    "displacement": "tangential displacement on the contact part",
    "traction": "tangential traction on the contact part",
    "normal": "pressure on the contact part",
    "stress": "von Mises stress in the deformed body",
    "hoop": "stress along the boundary",
    "history": "convergence",
}
OF_THE_PAPER = ("deformed", "displacement", "traction")
"""Figures 1 to 3 of the first example, 4 to 6 of the second."""
EMBEDDED = "data:image/png;base64,"
Figure = tuple[str, str]
"""A picture of the page: caption, and PNG as a data URI."""


def html(
    table: CaseTable,
    tables: Sequence[Table],
    quantities: Sequence[str] = (ITERATIONS,),
    plots: Sequence[Plot] = (),
) -> str:
    """Return a page with tables, plots, and the figures of one case of each problem.

    A case has figures if its fields are kept whole.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__, ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    drawn = [(plot.caption, EMBEDDED + png(draw, table, plot)) for plot in plots]
    pictures = [("Plots", drawn)] if plots else []
    pictures += [
        (table.values("id")[place], _figures(solution))
        for place in representatives(table)
        if isinstance(solution := table.kept(place), Solution)
    ]
    return environment.get_template("report.html").render(
        title=table.title or "Sweep",
        counts=counts_line(table),
        legend=legend(table, quantities, tables),
        tables=tables,
        text=text,
        heads=[column_heads(pivot, quantities) for pivot in tables],
        quantity=", ".join(quantities),
        pictures=pictures,
        bad=bad_cases(table),
    )


def representatives(table: CaseTable) -> list[int]:
    """Return the places of the last case of each problem that has a solution."""
    problems = table.values("problem") if "problem" in table.coordinates else [""] * len(table)
    solved = (
        k for k, status in enumerate(table.status) if status in ("converged", "not converged")
    )
    return list({problems[place]: place for place in solved}.values())


def _figures(solution: Solution) -> list[Figure]:
    from ...results.figures.plots import drawings

    number, figures = example_number(solution.problem), []
    for kind, drawing in drawings(solution).items():
        caption = DRAWN.get(kind, kind)
        if number is not None and kind in OF_THE_PAPER:
            own = 3 * (number - 1) + 1 + OF_THE_PAPER.index(kind)
            caption = f"Figure {own} of the paper: {caption}"
        figures.append((caption, EMBEDDED + png(drawing, solution)))
    return figures
