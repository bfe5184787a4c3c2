"""What acts on bodies in the plane: rigid obstacles, supports by the symbols of statics, and loads
and contact tractions as arrows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Index, Mask
from ...contact.law_protocol import OPEN
from ...geometry.rotation import MOTIONS
from ...given.conditions import Condition, Displacement, Symmetry, Traction
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...record import record
from ...round_off import TINY
from ...runtime.figure_style import COLOURS, new_label
from ...untyped import Axes
from ..data import SolutionData
from ..records import ObstacleResult, PairResult
from .view import View

ARROWS = 24
"""Most arrows of one interface or part: in a figure 7 inches wide their heads stay apart."""
LONG, LONGEST = 0.1, 0.15
"""Length of the arrow of a usual traction, and of the longest, over the size of the bodies."""
THICK = 0.03
"""Thickness of the drawn edge of obstacles and supports, over the size of the bodies."""
REACH = 0.15
"""Distance from a body, over the size of the bodies, up to which an obstacle is drawn: beyond it
would take more room than the bodies."""
BEHIND: dict[str, dict[str, str]] = {
    "obstacle": {"facecolor": "0.8"},
    "held": {"facecolor": "w", "hatch": "/////"},
    "moved": {"facecolor": "w", "hatch": "xxxxx"},
}
"""How what lies behind an edge is filled."""
WITHIN = np.linspace(0.0, 1.0, 9)
"""Places on an element at which its edge is drawn."""
EDGE, CONTACT, LOAD = "0.35", "0.25", COLOURS[3]
"""Colours."""


def size_of(solution: SolutionData) -> float:
    """Return the longer side of the box about all bodies [length]."""
    return float(np.ptp(np.vstack([mesh.x for mesh in solution.meshes.values()]), axis=0).max())


def moved(solution: SolutionData, name: str, factor: float) -> Array:
    """Where the secondary's nodes of an interface are drawn (m, d)."""
    x, (body, _) = solution.pairs[name].x, solution.sides[name]
    u = solution.bodies[body].u[solution.nodes[name], : x.shape[1]]
    return np.asarray(x + factor * u)


def draw_obstacles(axes: Axes, solution: SolutionData, view: View) -> None:
    """The edge of each rigid obstacle where it is not far from the body."""
    size = size_of(solution)
    for name, offset in obstacles(solution, view.factor):
        pair = solution.pairs[name]
        order = np.argsort(pair.arc_length)
        edge, normal = (pair.x + offset)[order], pair.normal[order]
        shown = np.isfinite(edge[:, 0])
        for run in np.split(np.arange(len(edge)), np.flatnonzero(np.diff(shown)) + 1):
            if shown[run[0]]:
                _band(axes, edge[run], edge[run] + THICK * size * normal[run], "obstacle")


def obstacles(solution: SolutionData, factor: float) -> Iterator[tuple[str, Array]]:
    """Each interface with a rigid obstacle, and how far this is from the nodes as they were (m, d):
    by the gap that was there along the normal, and by its magnified motion; far from the body NaN.
    """
    for interface in solution.posed.interfaces:
        if interface.primary is not None or interface.periodic:
            continue
        pair = solution.pairs[interface.name]
        motion = np.zeros_like(pair.x)
        if interface.obstacle is not None:
            obstacle = solution.problem.obstacle[interface.obstacle]
            motion = _rigid(pair.x, obstacle.centre, solution.last.obstacles[obstacle.name])
        away = moved(solution, interface.name, 1.0) - pair.x - motion
        gap = pair.gap + np.sum(away * pair.normal, axis=1)
        gap = np.where(gap <= REACH * size_of(solution), gap, np.nan)
        yield interface.name, factor * motion + gap[:, None] * pair.normal


def _rigid(x: Array, centre: object, found: ObstacleResult) -> Array:
    """Displacement (m, d) of an obstacle at points; a turn about the axis moves nothing that is
    drawn."""
    dim = x.shape[1]
    turned = np.atleast_1d(found.rotation) * float(len(found.displacement) == dim)
    about = np.broadcast_to(np.asarray(centre, dtype=float), dim)
    moved = np.append(found.displacement[:dim], turned)
    return np.asarray(MOTIONS[dim].every(x, about) @ moved)


def _band(axes: Axes, near: Array, far: Array, word: str) -> None:
    """The edge of something rigid: a line, and what `BEHIND` says."""
    axes.fill(
        *np.vstack([near, far[::-1]]).T,
        label=new_label(axes, word),
        zorder=0.5,
        edgecolor=EDGE,
        lw=0.0,
        **BEHIND[word],
    )
    axes.plot(*near.T, color=EDGE, lw=1.0, zorder=1.5)


def draw_supports(axes: Axes, solution: SolutionData, view: View) -> None:
    """What holds bodies at the end: hatching where all components are given, else rollers."""
    size, high = size_of(solution), THICK * size_of(solution)
    sides, even = _sides(solution, view), _sides(solution, view, size / ARROWS)
    for side, rollers in zip(sides, even, strict=True):
        condition = side.condition
        if isinstance(condition, Symmetry) or (
            isinstance(condition, Displacement) and any(condition.free)
        ):
            axes.plot(
                *(rollers.x + 0.5 * high * rollers.normal).T,
                "o",
                ms=4.0,
                mfc="w",
                mec=EDGE,
                mew=0.8,
                label=new_label(axes, "roller"),
            )
            axes.plot(*(side.x + high * side.normal).T, color=EDGE, lw=1.0)
        elif isinstance(condition, Displacement):
            still = all(datum is None or datum.is_zero for datum in condition.value)
            far = side.x + high * side.normal
            _band(axes, side.x, far, "held" if still else "moved")


def draw_loads(axes: Axes, solution: SolutionData, view: View) -> None:
    """Tractions that are given, at the end."""
    size = size_of(solution)
    even = _sides(solution, view, size / ARROWS)
    sides = [side for side in even if isinstance(side.condition, Traction)]
    every = np.vstack([np.zeros((1, 2)), *(side.traction for side in sides)])
    largest = float(np.hypot(*every.T).max())
    word = f"load, up to {largest:.3g} {solution.problem.units.stress or ''}".rstrip()
    if largest == 0.0:
        return
    for side in sides:
        pulls = np.sum(side.traction * side.normal, axis=1) > 0.0
        arrows = side.traction * (LONG * size / largest)
        draw_arrows(axes, side.x, arrows, pulls, word, LOAD)


USUAL = 0.9
"""Share of a contact whose tractions are drawn to scale."""


def draw_tractions(axes: Axes, solution: SolutionData, view: View) -> None:
    """Contact tractions on the secondaries; the largest are cut."""
    size, pairs = size_of(solution), solution.pairs
    largest = max(map(_usual, pairs.values()), default=0.0)
    unit = solution.problem.units.stress or ""
    word = (
        f"contact traction, {LONG * size:.2g} long is {float(f'{largest:.2g}'):g} {unit}".rstrip()
    )
    if largest == 0.0:
        return
    for name, pair in pairs.items():
        along = pair.sigma_t[:, :1] * pair.tangent[:, 0, :2]
        traction = along - pair.pressure[:, None] * pair.normal
        arrows = traction * (LONG * size / largest)
        arrows *= np.minimum(1.0, LONGEST * size / np.maximum(np.hypot(*arrows.T), TINY))[:, None]
        known = np.column_stack([moved(solution, name, view.factor), arrows, pair.pressure])
        order = np.argsort(pair.arc_length)
        closed = np.flatnonzero(pair.state[order] != OPEN)
        for run in np.split(closed, np.flatnonzero(np.diff(closed) > 1) + 1) if len(closed) else ():
            even = evenly(known[order[run]], 0.5 * size / ARROWS)
            draw_arrows(axes, even[:, :2], even[:, 2:4], even[:, 4] < 0.0, word, CONTACT)


def _usual(pair: PairResult) -> float:
    """The traction that nine tenths of what is closed stay below: nodes crowd at corners, where it
    has no bound."""
    order = np.argsort(pair.size)
    share = np.cumsum(np.where(pair.state == OPEN, 0.0, pair.weight)[order])
    return float(pair.size[order][np.searchsorted(share, USUAL * share[-1])])


def draw_arrows(axes: Axes, x: Array, arrows: Array, pulls: Mask, word: str, colour: str) -> None:
    """Arrows with their points at places (m, 2), or where they pull with their feet."""
    shown = np.any(arrows != 0.0, axis=1)
    if not shown.any():
        return
    arrows = arrows[shown]
    start = x[shown] - np.where(pulls[shown, None], 0.0, arrows)
    axes.quiver(
        *start.T,
        *arrows.T,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        units="inches",  # as lines and letters: a narrow picture has the same arrows
        width=0.014,
        headwidth=4.5,
        color=colour,
        zorder=3.0,
    )
    axes.update_datalim(np.vstack([start, start + arrows]))
    axes.autoscale_view()
    if new_label(axes, word):
        axes.plot([], [], ls="", marker=r"$\rightarrow$", color=colour, ms=10.0, label=word)


def evenly(known: Array, apart: float) -> Array:
    """Values (m, k) along a curve, of which the first two are its points in order, at points that
    are equally far from one another, about a distance apart, and `ARROWS` at most."""
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(known[:, :2], axis=0).T)))
    wanted = np.linspace(0.0, way[-1], min(ARROWS, max(round(way[-1] / apart) + 1, 3)))
    return np.column_stack([np.interp(wanted, way, column) for column in known.T])


@record
class _Side:
    """Points (m, 2) of a connected stretch of a part as they are drawn, in order, and its
    condition."""

    x: Array
    normal: Array
    traction: Array
    condition: Condition


def _sides(solution: SolutionData, view: View, apart: float = 0.0) -> Iterator[_Side]:
    """The stretches of all parts that have a condition at the end, at points that are about `apart`
    from one another [length], `ARROWS` at most; at several of each element by default."""
    for number, (name, mesh) in enumerate(solution.meshes.items()):
        found, curve = solution.bodies[name], as_curve(mesh)
        conditions = solution.posed.bodies[number].conditions[solution.last.step - 1]
        for part, condition in conditions.items():
            for elements in stretches(curve, part):
                rows, place = _places(curve, elements, apart)
                x, normal = curve.at(rows, place)
                basis = curve.basis_at(rows, place)
                yield _Side(
                    x + view.factor * (basis @ found.u[:, :2]),
                    normal,
                    basis @ found.traction[:, :2],
                    condition,
                )


def _places(mesh: CurveMesh, elements: Index, apart: float) -> tuple[Index, Array]:
    """Elements, and places on them in [0, 1], at which a stretch is drawn, see `_sides`."""
    if apart == 0.0:
        return np.repeat(elements, len(WITHIN)), np.tile(WITHIN, len(elements))
    whole = float(mesh.length[elements].sum())
    count = min(max(round(whole / apart), 2), ARROWS - 1) + 1
    return along(mesh, elements, np.linspace(0.0, whole, count))


def along(mesh: CurveMesh, elements: Index, s: Array) -> tuple[Index, Array]:
    """Elements, and places on them in [0, 1], at arc lengths (q,) of a stretch [length]."""
    way = np.cumsum(mesh.length[elements])
    k = np.searchsorted(way, s).clip(max=len(elements) - 1)
    return elements[k], 1.0 - (way[k] - s) / mesh.length[elements[k]]


def stretches(mesh: CurveMesh, part: str) -> list[Index]:
    """Elements of a part, stretch by stretch."""
    if part not in mesh.part_names:
        return []
    chosen = np.flatnonzero(mesh.part == mesh.part_names.index(part))
    ends, starts = mesh.end[chosen[:-1]], mesh.start[chosen[1:]]
    return np.split(chosen, np.flatnonzero(np.any(ends != starts, axis=1)) + 1)
