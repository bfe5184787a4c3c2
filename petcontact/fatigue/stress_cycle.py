"""The stress of a cycle of load steps at points on the surfaces of the bodies and below them."""

from __future__ import annotations

import numpy as np
import scipy

from ..arrays import Array, Index, Names
from ..contact.law_protocol import OPEN
from ..errors import InputError
from ..fields.boundary.places import best_places
from ..record import record
from ..results.body_fields import BodyFields, states_at
from ..results.data import SolutionData
from ..results.evaluated import NOWHERE
from ..results.records import StepResult
from ..runtime.hints import demand_name


@record
class Sites:
    """Points of one body, and their stress over a cycle.

    Attributes
    ----------
    body : str
    part : (n,) array of str
        Of the surface that the points lie on or below.
    x : (n, d) array
        [length]
    depth : (n,) array
        Below the surface, along its normal [length].
    along : (n,) array
        Arc length along the part, in space 0 [length].
    stress : (k, n, 3, 3) array
        At the end of k increments [stress].
    """

    body: str
    part: Names
    x: Array
    depth: Array
    along: Array
    stress: Array


def cycle_of(solution: SolutionData, first: str | None, last: str | None) -> list[StepResult]:
    """The increments of the steps from one to another, the last time they were done; by default of
    the problem's cycle, or of all steps.

    Raises
    ------
    InputError
        If there are no such steps, in this order, or fewer than two increments of them.
    """
    names, cycle = [step.name for step in solution.problem.step], solution.problem.cycle
    if first is None and last is None and cycle is not None:
        first, last = cycle.first, cycle.last
    low = 1 if first is None else _step_number("--first", first, names)
    high = max(len(names), 1) if last is None else _step_number("--last", last, names)
    if low > high:
        raise InputError(f"--last: step {last!r} comes before step {first!r}")
    increments: list[StepResult] = []
    for step in reversed(solution.steps):
        inside = low <= step.step <= high
        if increments and (not inside or step.step > increments[-1].step):
            break
        if inside:
            increments.append(step)
    if len(increments) < 2:
        raise InputError(
            f"--first, --last: a cycle has at least two increments, these steps have "
            f"{len(increments)}"
        )
    return increments[::-1]


def _step_number(option: str, name: str, names: list[str]) -> int:
    """The number of the only step of a name, from 1."""
    demand_name(f"{option}: no step", name, names)
    if names.count(name) > 1:
        raise InputError(f"{option}: {names.count(name)} steps are called {name!r}")
    return names.index(name) + 1


def sites_of(
    solution: SolutionData, increments: list[StepResult], body: str, parts: list[str], depths: Array
) -> Sites:
    """Nodes of parts of a body, the best places between them, and points below the nodes next to
    contact.

    Parameters
    ----------
    solution : SolutionData
    increments : list of StepResult
    body : str
    parts : list of str
        At least one.
    depths : (m,) array
        Increasing, the first may be 0 [length].
    """
    mesh = solution.meshes[body]
    chosen = np.isin(mesh.part, [mesh.part_names.index(part) for part in parts])
    element, place = (
        np.concatenate(both)
        for both in zip((mesh.element, mesh.places), best_places(mesh), strict=True)
    )
    element, place = element[chosen[element]], place[chosen[element]]
    surface = mesh.sites_at(element, place)
    below = [depth for depth in depths.tolist() if depth > 0.0]
    # below the surface: points under nodes that are no farther from contact than two depths
    under = np.flatnonzero(chosen[mesh.element])
    under = under[
        _next_to_contact(solution, increments, body, mesh.x[under], 2.0 * max(below, default=0.0))
    ]
    x = np.concatenate(
        [surface.x, *(mesh.x[under] - depth * mesh.normal[under] for depth in below)]
    )
    depth = np.concatenate([np.zeros(len(surface)), np.repeat(below, len(under))])
    owner = np.concatenate([mesh.part[element], np.tile(mesh.node_part[under], len(below))])
    along = np.concatenate([surface.along, np.tile(mesh.sites(under).along, len(below))])
    stress = _stresses(
        [solution.body_fields(body, step) for step in increments],
        element,
        place,
        x[len(surface) :],
    )
    kept = np.isfinite(stress).all(axis=(0, 2, 3))
    names = np.array(mesh.part_names)[owner]
    return Sites(body, names[kept], x[kept], depth[kept], along[kept], stress[:, kept])


def _stresses(increments: list[BodyFields], element: Index, place: Array, inside: Array) -> Array:
    """Stress (k, m, 3, 3) at places of elements, then at points inside; NaN outside [stress]."""
    tensors = [[fields.on_boundary(element, place).tensor] for fields in increments]
    if len(inside):
        for rows, state in zip(tensors, states_at(increments, inside, outside=np.nan), strict=True):
            rows.append(state.tensor)
    return np.array([np.concatenate(rows) for rows in tensors])


def parts_in_contact(solution: SolutionData) -> dict[str, list[str]]:
    """Parts by body on either side of an interface."""
    parts: dict[str, list[str]] = {name: [] for name in solution.meshes}
    sides = [solution.sides[name] for name in solution.nodes]
    for body, part in [*sides, *solution.primaries.values()]:
        if part not in parts[body]:
            parts[body].append(part)
    return parts


def _next_to_contact(
    solution: SolutionData, increments: list[StepResult], body: str, x: Array, reach: float
) -> Index:
    """Which points (n, d) of a surface are at most so far from nodes that were closed."""
    closed = [
        pair.x[pair.state != OPEN]
        for step in increments
        for name, pair in step.pairs.items()
        if body in (solution.sides[name][0], solution.primaries.get(name, NOWHERE)[0])
    ]
    touched = np.concatenate([np.empty((0, x.shape[1])), *closed])
    if not len(touched) or reach == 0.0:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(scipy.spatial.cKDTree(touched).query(x)[0] <= reach)
