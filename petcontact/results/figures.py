"""Figures of a result: the paper's figures 1-6 and the convergence history."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array, Mask
from ..runtime.atomic_write import temporary_name
from ..runtime.terminal import printable
from .solution import ContactFields, Solution
from .steps import AssemblySolution

SLIP, STICK = "#f3d9c4", "#d5e3ef"


def plot_all(solution: Solution | AssemblySolution, folder: str | Path, stem: str = "result") -> list[Path]:
    """Draw every figure of a solution as PNG.

    Parameters
    ----------
    solution : Solution or AssemblySolution
    folder : str or Path
        Made if it does not exist.
    stem : str
        Start of the file names.

    Returns
    -------
    list of Path
        STEM-deformed.png, STEM-displacement.png, STEM-traction.png, STEM-history.png; with bodies or load steps
        STEM-PAIR-traction.png and STEM-PAIR-motion.png of each interface instead of the second and third.
    """
    if isinstance(solution, AssemblySolution):
        from .steps_figures import drawings as of_steps

        return save_all(of_steps(solution), folder, stem, solution) if solution.steps else []
    drawings = {"deformed": draw_deformed, "displacement": draw_displacement, "traction": draw_traction,
                "history": draw_history}  # fmt: skip
    return save_all(drawings, folder, stem, solution)


def save_all(drawings: dict[str, Any], folder: str | Path, stem: str, *arguments: Any) -> list[Path]:
    """Figures by name as STEM-NAME.png in a folder, which is made if it does not exist; their paths."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    paths = {name: Path(folder) / f"{stem}-{name}.png" for name in drawings}
    for name, draw in drawings.items():
        save(paths[name], draw, *arguments)
    return list(paths.values())


def save(path: Path, draw: Any, *arguments: Any) -> None:
    """One figure, drawn without a display, written whole or not at all."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.2), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure, *arguments)
    with temporary_name(path) as temporary:
        figure.savefig(temporary, format="png")


def draw_deformed(figure: Any, solution: Solution) -> None:
    """Initial and deformed outline (figures 1 and 4), the displacement magnified to be seen."""
    axes = figure.add_subplot()
    mesh = solution.mesh
    size = float(np.ptp(mesh.x, axis=0).max())
    peak = float(np.abs(solution.u).max())
    factor = round_number(0.08 * size, peak)
    moved = mesh.x + factor * solution.u
    for first, last in _runs(mesh):
        start, end = mesh.start[mesh.element[first]], mesh.end[mesh.element[last - 1]]
        axes.plot(*np.vstack([start, mesh.x[first:last], end]).T, color="0.6", lw=1.0)
        axes.plot(*moved[first:last].T, color="C0", lw=1.4)
    contact = solution.contact
    slips = contact.state == 1
    axes.plot(*moved[contact.nodes[slips]].T, ".", color="C3", ms=3, label="slip")
    axes.plot(*moved[contact.nodes[~slips]].T, ".", color="C2", ms=3, label="stick")
    axes.plot([], [], color="0.6", lw=1.0, label="initial")
    axes.plot([], [], color="C0", lw=1.4, label=f"deformed, u × {factor:g}")
    axes.set(xlabel="x", ylabel="y", aspect="equal", title=_title(solution))
    axes.legend(loc="best", fontsize="small", framealpha=0.9)


def draw_displacement(figure: Any, solution: Solution) -> None:
    """Tangential displacement on Γ_C (figures 2 and 5)."""
    for axes, part, chosen in _panels(figure, solution):
        contact = solution.contact
        axes.plot(contact.arc_length[chosen], contact.u_t[chosen, 0], color="C0", lw=1.5)
        axes.axhline(0.0, color="0.5", lw=0.6)
        axes.set(xlabel=f"arc length along {plain(part)}", ylabel="tangential displacement $u_t$")


def draw_traction(figure: Any, solution: Solution) -> None:
    """Tangential traction on Γ_C with ±g (figures 3 and 6)."""
    for axes, part, chosen in _panels(figure, solution):
        contact = solution.contact
        s, bound = contact.arc_length[chosen], contact.friction_bound[chosen]
        axes.plot(s, contact.sigma_t[chosen, 0], color="C0", lw=1.5, label=r"$\sigma_t$")
        for sign in (1.0, -1.0):
            axes.plot(s, sign * bound, color="C3", lw=1.0, ls="--", label=r"$\pm g$" if sign > 0 else None)
        axes.margins(y=0.08)
        axes.set(xlabel=f"arc length along {plain(part)}", ylabel=r"tangential traction $\sigma_t$")
        axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 0.8), frameon=False)


def draw_history(figure: Any, solution: Solution) -> None:
    """Change and ‖R_ρ‖ over the iterations, and ρ_k."""
    history = solution.history
    k = np.arange(1, len(history) + 1)
    left, right = figure.subplots(1, 2)
    residual = np.array(history.residual)
    largest = residual.max() if len(residual) and residual.max() > 0.0 else 1.0
    left.semilogy(k, _positive(history.change), label="relative change")
    left.semilogy(k, _positive(residual / largest), label=r"$\|R_\rho\|$ / its maximum")
    left.axhline(solution.case.method.tolerance, color="0.5", lw=0.8, ls=":", label="tolerance")
    left.set(xlabel="iteration", title="convergence")
    left.legend(fontsize="small")
    right.semilogy(k, _positive(history.rho), label=r"$\rho_k$")
    if np.isfinite(_positive(history.w)).any():
        right.semilogy(k, _positive(history.w), ".", ms=4, label=r"$w_k$")
    right.set(xlabel="iteration", title="Robin parameter [stress/length]")
    right.legend(fontsize="small")


def _panels(figure: Any, solution: Solution) -> list[tuple[Any, str, Mask]]:
    """One panel a contact part, its stick and slip zones shaded."""
    contact: ContactFields = solution.contact
    parts = list(dict.fromkeys(contact.part.tolist()))
    if len(parts) > 1:
        figure.set_figheight(1.2 + 2.6 * len(parts))
    panels = []
    for axes, part in zip(np.atleast_1d(figure.subplots(len(parts), 1)), parts, strict=True):
        for zone in (z for z in solution.zones if z.part == part):
            axes.axvspan(zone.start, zone.end, color=SLIP if zone.sign else STICK, lw=0)
        for name, colour in (("slip", SLIP), ("stick", STICK)):
            if any(z.name == name and z.part == part for z in solution.zones):
                axes.fill_between([], [], [], color=colour, label=name)
        axes.set_xlim(0.0, max(z.end for z in solution.zones if z.part == part))
        axes.set_title(_title(solution) if part == parts[0] else "")
        panels.append((axes, part, contact.part == part))
    for axes, _, _ in panels:
        axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return panels


def _runs(mesh: Any) -> list[tuple[int, int]]:
    """Node ranges of the stretches of the outline that belong to one part."""
    cuts = np.flatnonzero(np.diff(mesh.node_part) != 0) + 1
    edges = [0, *cuts.tolist(), mesh.n_nodes]
    return list(itertools.pairwise(edges))


def _positive(values: Any) -> Array:
    array = np.array(values, dtype=float)
    return np.where(array > 0.0, array, np.nan)


def round_number(wanted: float, peak: float) -> float:
    """The number 1, 2 or 5 times a power of ten next below wanted/peak, by which to magnify."""
    if not peak > 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted / peak))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted / peak * (1.0 + 1e-12)) * power)


def _title(solution: Solution) -> str:
    title = plain(solution.case.title)
    return title if len(title) <= 70 else title[:67] + "..."


def plain(text: str) -> str:
    """A user's text for matplotlib, which would take what stands between dollars for a formula."""
    return printable(text).replace("$", r"\$")
