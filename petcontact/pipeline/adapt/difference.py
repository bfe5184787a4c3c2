"""Differences between two solutions of a plane problem, with and without the ends of parts."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Array, Index
from ...fields.boundary.places import located, sizes
from ...geometry.outline import as_outline
from ...given.posed import Posed
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import field, record
from ...refinement.panels.tail import FADE
from ...results.evaluated import displacement_scale
from ...results.records import PairResult, StepResult, step_ends
from ...results.solution import Solution
from .part_ends import pressed_sides, singular_places


@record
class Difference:
    """Relative L2 difference of tractions, the largest over interfaces and step ends.

    Attributes
    ----------
    inside : float
        Difference of p or q with weights that fade out towards singular points [-].
    whole : float
        Difference of p or q without that fading [-].
    singular : dict of lists of float
        For each interface, arc lengths of points where tractions grow from mesh to mesh and differ
        by more than `inside` [length].
    each : dict of float
        `inside` of each interface [-].
    """

    inside: float = 0.0
    whole: float = 0.0
    singular: dict[str, list[float]] = field(default_factory=dict)
    each: dict[str, float] = field(default_factory=dict)


class Ends(NamedTuple):
    """Arc lengths along a part at which tractions may be infinite, and its length [length]."""

    arc_lengths: Array
    length: float


Compared = tuple[float, float, dict[float, float]]
"""Differences on an interface with and without fading, and the shares of growing places."""


def difference(coarse: Solution, fine: Solution, ends: dict[str, Ends] | None = None) -> Difference:
    """Return the difference of tractions at the nodes of that solution which has more of them.

    A first mesh that has seen no edges may have smaller elements than the next one, which shows at
    its own nodes only. `ends` are the singular points from `fading_places`. Without contact it is
    the difference of u.
    """
    if not fine.nodes:
        apart = displacement_difference(coarse, fine)
        return Difference(apart, apart)
    ends = fading_places(fine.posed) if ends is None else ends
    compared = [
        (name, _on_interface((coarse, fine), steps, name, ends[name]))
        for steps in zip(step_ends(coarse.steps), step_ends(fine.steps), strict=True)
        for name in steps[1].pairs
    ]
    each = dict[str, float]()
    for name, (apart, _, _) in compared:
        each[name] = max(apart, each.get(name, 0.0))
    inside = max(each.values(), default=0.0)
    whole = max((apart for _, (_, apart, _) in compared), default=0.0)
    return Difference(inside, whole, _growing_places(compared, inside), each)


def _growing_places(compared: list[tuple[str, Compared]], inside: float) -> dict[str, list[float]]:
    """Return the places of each interface whose share exceeds the difference away from them."""
    result = dict[str, set[float]]()
    for name, (_, _, growing) in compared:
        places = {s for s, share in growing.items() if share > inside}
        result[name] = result.get(name, set()) | places
    return {name: sorted(places) for name, places in result.items() if places}


def _on_interface(
    solutions: tuple[Solution, Solution],
    steps: tuple[StepResult, StepResult],
    name: str,
    ends: Ends,
) -> Compared:
    """Return the difference of an interface at the end of a step, with and without fading.

    The third value is the share that the surroundings of each point have in it at which tractions
    grow from the coarse solution to the fine one.
    """
    old, new = (step.pairs[name] for step in steps)
    fewer, rough, pair = solutions[0], old, new
    if len(old.weight) > len(new.weight):
        fewer, rough, pair = solutions[1], new, old
    side = fewer.sides[name]
    to_more = _interpolation(fewer.meshes[side[0]], side[1], pair.x)[:, fewer.nodes[name]]
    square = pair.weight[:, None] * (to_more @ _tractions(rough) - _tractions(pair)) ** 2
    near, fade = _fading(pair, ends)
    size, whole = (
        float(np.sqrt(weight @ pair.size**2)) for weight in (pair.weight * fade**2, pair.weight)
    )
    if size <= solutions[1].posed.idle_traction * math.sqrt(float(pair.weight.sum())):
        return 0.0, 0.0, {}
    inside, everywhere = (
        float(np.sqrt((factor @ square).max())) for factor in (fade**2, np.ones(len(square)))
    )
    growing = np.array(_peaks(new, ends)) > np.array(_peaks(old, ends))
    shares = {
        float(ends.arc_lengths[k]): float(
            np.sqrt(square[(near == k) & (fade < 1.0)].sum(axis=0).max()) / whole
        )
        for k in np.flatnonzero(growing)
    }
    return inside / size, everywhere / whole, shares


def displacement_difference(coarse: Solution, fine: Solution) -> float:
    """Return the largest ‖u_coarse - u_fine‖/‖u_fine‖ over bodies and step ends, in L2 at fine
    nodes [-]."""
    worst = 0.0
    for coarse_step, fine_step in zip(step_ends(coarse.steps), step_ends(fine.steps), strict=True):
        for name, mesh in fine.meshes.items():
            old, new = coarse_step.bodies[name].u, fine_step.bodies[name].u
            change = np.zeros_like(new)
            for part in mesh.part_names:
                rows = mesh.nodes_of(part)
                carried = _interpolation(coarse.meshes[name], part, mesh.x[rows]) @ old
                change[rows] = carried - new[rows]
            size, error = (
                float(np.sqrt(mesh.weight @ (values**2).sum(axis=1))) for values in (new, change)
            )
            worst = max(worst, error / size if size > 0.0 else 0.0)
    return worst


def apart_on_one_mesh(solution: Solution, second: Solution) -> float:
    """Return the relative L2 difference of two solutions on one mesh, the largest over step ends
    [-].

    It is that of u_t in the paper's problem, else that of p and q over all interfaces.
    """
    if second.kind == "bilateral":
        change = second.contact.u_t - solution.contact.u_t
        square = float(second.contact.weight @ np.sum(change**2, axis=1))
        return math.sqrt(square) / displacement_scale(second)
    worst = 0.0
    for one, two in zip(step_ends(solution.steps), step_ends(second.steps), strict=True):
        for name, pair in two.pairs.items():
            old, size = one.pairs[name], float(np.sqrt(pair.weight @ pair.size**2)) or math.inf
            shear = np.linalg.norm(pair.sigma_t - old.sigma_t, axis=1)
            for change in (pair.pressure - old.pressure, shear):
                worst = max(worst, float(np.sqrt(pair.weight @ change**2)) / size)
    return worst


def fading_places(posed: Posed) -> dict[str, Ends]:
    """Return where tractions may be infinite along the secondary part of each interface."""
    outlines = [as_outline(boundary, "the error").joined for boundary in posed.boundaries]
    pressed = pressed_sides(outlines, posed.interfaces)
    return {
        side.name: Ends(
            singular_places(outlines[side.body], side.part, pressed[side.body]),
            sum(
                segment.length for segment in outlines[side.body].sides if segment.part == side.part
            ),
        )
        for side in posed.interfaces
    }


def _fading(pair: PairResult, ends: Ends) -> tuple[Index, Array]:
    """Return the nearest singular point of each node, and the node's weight factor.

    The factor falls from 1 to 0 towards the point over the share FADE of the part.
    """
    if len(ends.arc_lengths) == 0:
        return np.zeros(len(pair.weight), dtype=np.int64), np.ones(len(pair.weight))
    apart = np.abs(pair.arc_length[:, None] - ends.arc_lengths[None])
    return apart.argmin(axis=1), np.minimum(1.0, apart.min(axis=1) / (FADE * ends.length))


def _peaks(pair: PairResult, ends: Ends) -> list[float]:
    """Return the largest traction near each singular point, 0 where no node is near."""
    near, fade = _fading(pair, ends)
    size = np.abs(_tractions(pair)).max(axis=1)
    return [
        float(size[(near == k) & (fade < 1.0)].max(initial=0.0))
        for k in range(len(ends.arc_lengths))
    ]


def _tractions(pair: PairResult) -> Array:
    """Return p and the components of q, (m, d)."""
    return np.column_stack([pair.pressure, pair.sigma_t])


def _interpolation(mesh: BoundaryMesh, part: str, x: Array) -> Any:
    """Return the sparse matrix (q, n) from values at nodes to values at points (q, d) of a part."""
    return mesh.basis_at(*located(mesh, x, part, sizes(mesh)))
