"""Figures of an assembly's solution: deformed bodies, tractions, gap and slip along each interface, hysteresis."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...mesh.surface_mesh import SurfaceMesh
from ...runtime.figure_style import COLOURS, SHADES, STATES, draw_states, label, legend_beside, plain, round_number
from ...runtime.figure_style import title as cut
from ..figures import outlines
from .solution import AssemblySolution, PairResult, StepResult

BODIES = (COLOURS[2], COLOURS[3], COLOURS[6], COLOURS[5])
"""Colours of the bodies' outlines: not those of the states."""
CURVES = 5
"""Step ends drawn into one panel at most."""


def drawings(solution: AssemblySolution) -> dict[str, Any]:
    """Functions that draw a solution into a figure, by the name of the figure."""
    whole, *of_pairs = kinds(next(iter(solution.meshes.values()))).items()
    result: dict[str, Any] = dict([whole])
    for name in solution.nodes:
        stem = "".join(c if c.isalnum() or c in "-_" else "-" for c in name)
        for kind, draw in of_pairs:
            result[f"{stem}-{kind}"] = lambda figure, solution, name=name, draw=draw: draw(figure, solution, name)
    result["history"] = draw_history
    return result


@functools.singledispatch
def kinds(mesh: Any) -> dict[str, Any]:
    """What is drawn of bodies with meshes of a kind: first all of them, then each interface."""
    raise TypeError(f"no figures of {type(mesh).__name__}")


@kinds.register
def _(mesh: CurveMesh) -> dict[str, Any]:
    return {"deformed": draw_deformed, "traction": draw_traction, "motion": draw_motion}


@kinds.register
def _(mesh: SurfaceMesh) -> dict[str, Any]:
    from .surface_figures import draw_bodies, draw_states_by_step, draw_surface_motion, draw_surface_traction

    return {"surface": draw_bodies, "traction": draw_surface_traction, "motion": draw_surface_motion,
            "states": draw_states_by_step}  # fmt: skip


def step_ends(solution: AssemblySolution) -> list[StepResult]:
    """The last increment of each step."""
    return [step for k, step in enumerate(solution.steps)
            if k + 1 == len(solution.steps) or solution.steps[k + 1].step != step.step]  # fmt: skip


def draw_deformed(figure: Any, solution: AssemblySolution) -> None:
    """Initial and deformed outlines of all bodies at the end, and the contact forces on the secondaries."""
    axes = figure.add_subplot()
    last = solution.last
    every = np.vstack([mesh.x for mesh in solution.meshes.values()])
    size = float(np.ptp(every, axis=0).max())
    peak = max(float(np.abs(body.u).max()) for body in last.bodies.values())
    factor = round_number(0.05 * size, peak)
    for number, (name, mesh) in enumerate(solution.meshes.items()):
        for initial, deformed in outlines(as_curve(mesh), last.bodies[name].u, factor):
            axes.plot(*initial.T, color="0.7", lw=0.8, ls="--")
            axes.plot(*deformed.T, color=BODIES[number % len(BODIES)], lw=1.3)
        axes.plot([], [], color=BODIES[number % len(BODIES)], lw=1.3, label=f"{name}, u × {factor:g}")
    largest = max((float(np.percentile(np.abs(pair.pressure), 95.0)) for pair in last.pairs.values()), default=0.0)
    for name, pair in last.pairs.items():
        moved = pair.x + factor * last.bodies[solution.sides[name][0]].u[solution.nodes[name]]
        draw_states(axes, moved, np.where(pair.state == 2, -1, pair.state))
        if largest > 0.0:
            traction = pair.sigma_t * pair.tangent[:, 0] - pair.pressure[:, None] * pair.normal
            arrows = traction * (0.1 * size / largest)
            arrows *= np.minimum(1.0, 0.15 * size / np.maximum(np.hypot(*arrows.T), 1e-300))[:, None]
            shown = _spread(pair, 60)
            axes.quiver(*(moved - arrows)[shown].T, *arrows[shown].T, angles="xy", scale_units="xy", scale=1.0, width=0.002,
                        color="0.35")  # fmt: skip
    unit = solution.assembly.units.length
    axes.set(xlabel=label("x", unit), ylabel=label("y", unit), aspect="equal", title=_title(solution, last.name))
    legend_beside(axes)


def _spread(pair: PairResult, count: int) -> Index:
    """Closed nodes about equally far from one another."""
    closed = np.flatnonzero(pair.state != 2)
    if len(closed) <= count:
        return closed
    s = pair.arc_length[closed]
    places = np.searchsorted(s, np.linspace(s.min(), s.max(), count)).clip(0, len(closed) - 1)
    return np.asarray(np.unique(closed[places]))


def _shaded(axes: Any, pair: PairResult) -> None:
    """Stick, slip and open stretches of the arc length behind the curves."""
    order = np.argsort(pair.arc_length)
    s, state = pair.arc_length[order], pair.state[order]
    cuts = np.flatnonzero(np.diff(state)) + 1
    ends = np.concatenate([[s[0]], 0.5 * (s[cuts - 1] + s[cuts]), [s[-1]]])
    for first, a, b in zip([0, *cuts.tolist()], ends[:-1], ends[1:], strict=True):
        axes.axvspan(a, b, color=SHADES[STATES[int(state[first])][0]], lw=0)
    for number, (name, _, _) in STATES.items():
        if np.any(state == number):
            axes.fill_between([], [], [], color=SHADES[name], label=name)


def _window(axes: Any, pairs: list[PairResult]) -> None:
    """The stretch that was closed, with a margin."""
    closed = np.any([pair.state != 2 for pair in pairs], axis=0)
    s = pairs[-1].arc_length
    if closed.any():
        low, high = s[closed].min(), s[closed].max()
        margin = 0.15 * (high - low) + 1e-12
        axes.set_xlim(max(low - margin, s.min()), min(high + margin, s.max()))


def draw_traction(figure: Any, solution: AssemblySolution, name: str) -> None:
    """p and q along an interface with the bounds of q; the states of the end behind them."""
    axes = figure.add_subplot()
    ends = step_ends(solution)
    pair = ends[-1].pairs[name]
    order = np.argsort(pair.arc_length)
    s = pair.arc_length[order]
    _shaded(axes, pair)
    axes.plot(s, pair.pressure[order], color="C0", lw=1.5, label="pressure p")
    axes.plot(s, pair.sigma_t[order, 0], color="C1", lw=1.5, label="shear q")
    if np.isfinite(pair.bound).all():
        for sign in (1.0, -1.0):
            axes.plot(s, sign * pair.bound[order], color="C1", lw=0.8, ls="--", label="± bound of q" if sign > 0 else None)
    for step in ends[:-1][-CURVES:]:
        axes.plot(s, step.pairs[name].sigma_t[order, 0], color="C1", lw=0.7, alpha=0.5, label=f"q, {step.name}")
    axes.axhline(0.0, color="0.5", lw=0.6)
    _window(axes, [step.pairs[name] for step in ends])
    along, units = f"arc length along {plain('.'.join(solution.sides[name]))}", solution.assembly.units
    axes.set(xlabel=label(along, units.length), ylabel=label("traction", units.stress), title=_title(solution, name))
    legend_beside(axes)


def draw_motion(figure: Any, solution: AssemblySolution, name: str) -> None:
    """What is left of the gap, and the slip of every step, along an interface."""
    upper, lower = figure.subplots(2, 1, sharex=True)
    ends = step_ends(solution)
    shown = ends if len(ends) <= CURVES else [*ends[: CURVES - 1], ends[-1]]
    order = np.argsort(ends[-1].pairs[name].arc_length)
    for number, step in enumerate(shown):
        pair = step.pairs[name]
        s, gap = pair.arc_length[order], pair.gap[order]
        upper.plot(s, np.where(np.isfinite(gap), gap, np.nan), color=f"C{number}", lw=1.3, label=step.name)
        closed = np.where(pair.state[order] == 2, np.nan, pair.slip[order, 0])
        lower.plot(s, closed, color=f"C{number}", lw=1.3)
    pairs = [step.pairs[name] for step in ends]
    _window(lower, pairs)
    low, high = lower.get_xlim()
    inside = (pairs[-1].arc_length >= low) & (pairs[-1].arc_length <= high)
    seen = [pair.gap[inside] for pair in pairs]
    top = max((float(g[np.isfinite(g)].max(initial=0.0)) for g in seen), default=0.0)
    unit, along = solution.assembly.units.length, f"arc length along {plain('.'.join(solution.sides[name]))}"
    upper.set(ylabel=label("gap", unit), title=_title(solution, name), ylim=(-0.05 * top, 1.05 * top) if top > 0.0 else None)
    lower.set(xlabel=label(along, unit), ylabel=label("slip w", unit))
    lower.axhline(0.0, color="0.5", lw=0.6)
    legend_beside(upper)


def draw_history(figure: Any, solution: AssemblySolution) -> None:
    """Tangential force over mean slip of each interface (a loop where loads are cyclic), and the energy dissipated."""
    left, right = figure.subplots(1, 2)
    for number, name in enumerate(solution.nodes):
        pairs = [step.pairs[name] for step in solution.steps]
        slip, force = mean_motion(pairs)
        left.plot([0.0, *slip], [0.0, *force], ".-", color=f"C{number}", lw=1.2, ms=4, label=name)
        energy = np.cumsum([pair.dissipated for pair in pairs])
        right.plot(np.arange(1, len(pairs) + 1), energy, ".-", color=f"C{number}", lw=1.2, ms=4)
    units = solution.assembly.units
    along = "" if all(pair.slip.shape[1] == 1 for pair in solution.last.pairs.values()) else " along the largest slip"
    left.set(xlabel=label(f"mean slip w{along}", units.length), ylabel=label("tangential force on the primary", units.force),
             title=_title(solution, "hysteresis"))  # fmt: skip
    right.set(xlabel="increment", title="energy dissipated")
    right.xaxis.get_major_locator().set_params(integer=True)
    left.locator_params(axis="x", nbins=5)
    left.legend()


def mean_motion(pairs: list[PairResult]) -> tuple[Array, Array]:
    """Mean slip and tangential force on the primary after each increment, along the way of the largest mean slip."""
    weight = pairs[0].weight
    touched = np.any([pair.state != 2 for pair in pairs], axis=0)
    area = float(weight[touched].sum()) or 1.0
    slip = np.array([weight[touched] @ pair.slip[touched] / area for pair in pairs])
    force = np.array([-weight @ pair.sigma_t for pair in pairs])
    way = np.eye(1, slip.shape[1])[0]
    largest = slip[np.argmax(np.linalg.norm(slip, axis=1))]
    if np.any(largest):
        way = largest / np.linalg.norm(largest) * np.sign(largest[np.argmax(np.abs(largest))])
    return slip @ way, force @ way


def _title(solution: AssemblySolution, what: str) -> str:
    return ": ".join(filter(None, (cut(solution.assembly.title), plain(what))))
