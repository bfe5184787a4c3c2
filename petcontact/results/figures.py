"""Figures of a result: the paper's figures 1-6, the normal traction, and the convergence history."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..mesh.basis import lagrange
from ..mesh.curve_mesh import CurveMesh, as_curve
from ..mesh.surface_mesh import SurfaceMesh
from ..runtime.figure_style import (
    COLOURS,
    SHADES,
    closed,
    draw_states,
    label,
    legend_below,
    legend_beside,
    plain,
    round_number,
    save_all,
    title,
)
from .solution import ContactFields, Solution
from .steps.solution import AssemblySolution

SMALLEST = 1e-17
"""Where a residual of zero is drawn, relative to the largest."""


def plot_all(
    solution: Solution | AssemblySolution, folder: str | Path, stem: str = "result", formats: Sequence[str] = ("png",)
) -> list[Path]:
    """Draw every figure of a solution.

    Parameters
    ----------
    solution : Solution or AssemblySolution
    folder : str or Path
        Made if it does not exist.
    stem : str
        Start of the file names.
    formats : sequence of str
        Of "png", "pdf", "svg".

    Returns
    -------
    list of Path
        STEM-deformed.png, STEM-displacement.png, STEM-traction.png, STEM-normal.png, STEM-history.png; in space
        STEM-surface.png in place of the first and no STEM-normal.png;
        with bodies or load steps STEM-PAIR-traction.png and STEM-PAIR-motion.png of each interface instead of those between
        the first and the last.

    Raises
    ------
    InputError
        If there is no such format.
    OutputError
        If a file cannot be written.
    """
    if isinstance(solution, AssemblySolution):
        from .steps.figures import drawings as of_steps

        return save_all(of_steps(solution), folder, stem, solution, formats=formats) if solution.steps else []
    return save_all(drawings_of(solution.mesh), folder, stem, solution, formats=formats)


@functools.singledispatch
def drawings_of(mesh: Any) -> dict[str, Any]:
    """The figures of a mesh's kind, by name."""
    raise TypeError(f"no figures of {type(mesh).__name__}")


@drawings_of.register
def _(mesh: CurveMesh) -> dict[str, Any]:
    return {"deformed": draw_deformed, "displacement": draw_displacement, "traction": draw_traction,
            "normal": draw_normal, "history": draw_history}  # fmt: skip


@drawings_of.register
def _(mesh: SurfaceMesh) -> dict[str, Any]:
    from .surface_figures import draw_slip, draw_surface, draw_tangential_traction

    return {"surface": draw_surface, "displacement": draw_slip, "traction": draw_tangential_traction,
            "history": draw_history}  # fmt: skip


def draw_deformed(figure: Any, solution: Solution) -> None:
    """Initial and deformed outline (figures 1 and 4), the displacement magnified to be seen."""
    deformed_on(figure.add_subplot(), solution)


def deformed_on(axes: Any, solution: Solution) -> None:
    """The same on given axes."""
    size, peak = float(np.ptp(solution.mesh.x, axis=0).max()), float(np.abs(solution.u).max())
    factor, contact = round_number(0.08 * size, peak), solution.contact
    for initial, deformed in outlines(as_curve(solution.mesh), solution.u, factor):
        axes.plot(*initial.T, color="0.55", lw=0.9, ls="--")
        axes.plot(*deformed.T, color="black", lw=1.1)
    draw_states(axes, contact.x + factor * solution.u[contact.nodes], contact.state)
    axes.plot([], [], color="0.55", lw=0.9, ls="--", label="initial")
    axes.plot([], [], color="black", lw=1.1, label=f"deformed, u × {factor:g}")
    place(axes, solution)
    legend_below(axes, 4)


def place(axes: Any, solution: Solution) -> None:
    """Axes of the plane of the body: lengths alike in both directions, title and units."""
    unit = solution.case.units.length
    axes.set(xlabel=label("x", unit), ylabel=label("y", unit), aspect="equal", title=title(solution.case.title))


def outlines(mesh: CurveMesh, u: Array, factor: float) -> list[tuple[Array, Array]]:
    """Closed curves (k, 2), initial and deformed, one pair a loop; arcs are round."""
    everywhere = np.linspace(-1.0, 1.0, 7)
    number, initial, moved, deformed = [], [], [], []
    curved = mesh.curvature != 0.0
    for order, bent in sorted({*zip(mesh.order.tolist(), curved.tolist(), strict=True)}):
        chosen = np.flatnonzero((mesh.order == order) & (curved == bent))
        # constant elements by their middle, which is where their displacement is accurate
        at, xi = everywhere if bent else everywhere[:1], everywhere if order else np.zeros(1)
        nodal = u[mesh.first_node[chosen][:, None] + np.arange(order + 1)]
        values = np.einsum("jk,ejc->ekc", lagrange(order, xi), nodal)
        number.append(np.repeat(chosen, len(at)))
        initial.append(mesh.on_elements(chosen, at)[0].reshape(-1, 2))
        moved.append(np.repeat(chosen, len(xi)))
        deformed.append((mesh.on_elements(chosen, xi)[0] + factor * values).reshape(-1, 2))
    starts = [int(loop[0]) for loop in mesh.loops()]
    return list(zip(_curves(number, initial, starts), _curves(moved, deformed, starts), strict=True))


def _curves(numbers: list[Index], points: list[Array], starts: list[int]) -> list[Array]:
    """Closed curves, one a loop, through points given by the number of their element."""
    number = np.concatenate(numbers)
    order = np.argsort(number, kind="stable")
    pieces = np.split(np.concatenate(points)[order], np.searchsorted(number[order], starts[1:]))
    return [closed([piece]) for piece in pieces]


def draw_displacement(figure: Any, solution: Solution) -> None:
    """Tangential displacement on Γ_C (figures 2 and 5)."""
    for axes, chosen in _panels(figure, solution):
        contact = solution.contact
        axes.plot(contact.arc_length[chosen], contact.u_t[chosen, 0], label="$u_t$")
        axes.axhline(0.0, color="0.5", lw=0.6)
        axes.set_ylabel(label("tangential displacement", solution.case.units.length))
        legend_beside(axes)


def draw_traction(figure: Any, solution: Solution) -> None:
    """Tangential traction on Γ_C with ±g (figures 3 and 6)."""
    for axes, chosen in _panels(figure, solution):
        contact = solution.contact
        s, bound = contact.arc_length[chosen], contact.friction_bound[chosen]
        axes.plot(s, contact.sigma_t[chosen, 0], label=r"$\sigma_t$")
        for sign in (1.0, -1.0):
            axes.plot(s, sign * bound, color="black", lw=0.9, ls="--", label=r"$\pm g$" if sign > 0 else None)
        axes.margins(y=0.08)
        axes.set_ylabel(label("tangential traction", solution.case.units.stress))
        legend_beside(axes)


def draw_normal(figure: Any, solution: Solution) -> None:
    """Normal traction on Γ_C; where it pulls, a foundation that does not would let go."""
    for axes, chosen in _panels(figure, solution):
        contact = solution.contact
        s, normal = contact.arc_length[chosen], contact.sigma_n[chosen]
        axes.plot(s, normal, label=r"$\sigma_n$")
        if (normal > 0.0).any():
            axes.fill_between(s, 0.0, np.maximum(normal, 0.0), color=COLOURS[3], alpha=0.4, lw=0, label="tension")
        axes.axhline(0.0, color="0.5", lw=0.6)
        axes.set_ylabel(label("normal traction", solution.case.units.stress))
        legend_beside(axes)


def draw_history(figure: Any, solution: Solution) -> None:
    """How the method converged: residuals, and what it adapts, ρ_k or the set of sticking nodes."""
    history = solution.history
    k = np.arange(1, len(history) + 1)
    left, right = figure.subplots(1, 2)
    # a row holds the residual of the iterate that its step starts from: the last iterate's comes after
    residual = np.array([*history.residual, solution.residual])
    largest = residual.max(initial=0.0) or 1.0
    scaled = np.maximum(residual / largest, SMALLEST)
    left.semilogy(np.arange(len(residual)), scaled, marker=".", label=r"$\|R_\rho\|$ / largest")
    newton = np.array(history.exchanged, dtype=float)
    if len(newton):
        k = k[-len(newton):]
        right.plot(k, newton, marker="o", label="nodes on the wrong side")
        right.set(title="set of sticking nodes", ylim=(0.0, 1.05 * max(newton.max(), 1.0)))
    else:
        left.semilogy(k, _positive(history.change), label="relative change")
        left.axhline(solution.case.method.tolerance, color="0.5", lw=0.8, ls=":", label="tolerance")
        right.semilogy(k, _positive(history.rho), label=r"$\rho_k$")
        if np.isfinite(_positive(history.w)).any():
            right.semilogy(k, _positive(history.w), ".", ms=4, label=r"$w_k$")
        right.set_title(label("Robin parameter", solution.case.units.stiffness))
    left.set_title("convergence")
    for axes in (left, right):
        axes.set_xlabel("iteration")
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.minorticks_off()
        axes.grid(alpha=0.3, lw=0.5)
        legend_below(axes, 3)


def _panels(figure: Any, solution: Solution) -> list[tuple[Any, Mask]]:
    """One panel a contact part, its zones shaded, and which of the contact nodes it shows."""
    contact: ContactFields = solution.contact
    parts = list(dict.fromkeys(contact.part.tolist()))
    if len(parts) > 1:
        figure.set_figheight(1.2 + 2.6 * len(parts))
    panels = []
    for axes, part in zip(np.atleast_1d(figure.subplots(len(parts), 1)), parts, strict=True):
        zones = [zone for zone in solution.zones if zone.part == part]
        for zone in zones:
            axes.axvspan(zone.start, zone.end, color=SHADES[zone.name], lw=0)
        for name, colour in SHADES.items():
            if any(zone.name == name for zone in zones):
                axes.fill_between([], [], [], color=colour, label=name)
        axes.set_xlim(0.0, max(zone.end for zone in zones))
        axes.set_xlabel(label(f"arc length along {plain(part)}", solution.case.units.length))
        axes.set_title(title(solution.case.title) if part == parts[0] else "")
        panels.append((axes, contact.part == part))
    return panels


def _positive(values: Any) -> Array:
    array = np.array(values, dtype=float)
    return np.where(array > 0.0, array, np.nan)
