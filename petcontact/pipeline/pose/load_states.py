"""What the nodes of a body know at the end of every step: its conditions, evaluated, in the
directions that suit them."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Array, Index, Mask
from ...bem.boundary_data import (
    BoundaryData,
    contact_frames,
    free_motions,
    motion_name,
    without_rigid_motion,
)
from ...compliance.bodies import Interface
from ...compliance.body.superelement import free_modes
from ...compliance.interface import directions_looked_for
from ...errors import InputError
from ...fields.interior import fields_at
from ...geometry.rotation import lifted
from ...geometry.superelement import CondensedSurface
from ...mesh.approximation import Function, approximated, sampled
from ...mesh.boundary_mesh import BoundaryMesh
from ...model.expressions import evaluate
from ...model.loads import forces_by_step
from ...model.problem import Body, Displacement, Periodic, Problem, Symmetry, Traction
from ...round_off import WRITTEN


def boundary_data(
    problem: Problem,
    number: int,
    mesh: BoundaryMesh,
    interfaces: Sequence[Interface],
    step: int = 1,
) -> BoundaryData:
    """Known data of a body: nothing in state 0, the conditions with the changes of steps 1 to k in
    state k; what is known, displacement or traction, is that of one step.

    Raises
    ------
    InputError
        If data are not finite, or have another number of components than the body has dimensions.
    """
    body, conditions = problem.body[number], problem.conditions(number)
    d = mesh.components
    frame, known, contact, places = _components(problem, number, mesh, interfaces, step)
    value = np.zeros((len(conditions) + 1, mesh.n_nodes, d))
    points = _inside(np.array([f.at for f in body.point_force]).reshape(-1, mesh.dim), body, mesh)
    forces = [np.zeros((len(points), d))]
    for state in forces_by_step(problem, number):
        forces.append(np.array([f.force for f in state]).reshape(-1, d))
    cache: dict[str, tuple[Any, Array]] = {}
    for s, of_step in enumerate(conditions, 1):
        for part, condition in of_step.items():
            nodes = mesh.nodes_of(part)
            if part not in cache or cache[part][0] is not condition:
                cache[part] = (
                    condition,
                    _given(condition, mesh, part, f"body {body.name!r}: {part}"),
                )
            value[s, nodes] = cache[part][1]
    directions = places[:, : directions_looked_for(d, interfaces)]
    for face in interfaces if directions.shape[1] < d else ():
        if face.body == number:
            value[:, face.nodes, places[np.searchsorted(contact, face.nodes), -1]] = face.gap
    return without_rigid_motion(
        BoundaryData(frame, known, value, contact, directions, points, np.array(forces)), mesh
    )


def _components(
    problem: Problem, number: int, mesh: BoundaryMesh, interfaces: Sequence[Interface], step: int
) -> tuple[Array, Mask, Index, Index]:
    """Frames (n, d, d) of a body in a step, components (n, d) along them whose traction is known,
    contact nodes (m,), and which directions of their frames (m, d) contact takes, the normal last
    where it is held."""
    body, n, d = problem.body[number], mesh.n_nodes, mesh.components
    frame, known = np.broadcast_to(np.eye(d), (n, d, d)).copy(), np.ones((n, d), dtype=bool)
    for part, condition in problem.conditions(number)[step - 1].items():
        if isinstance(condition, Displacement):
            check_components(condition.value, mesh, f"body {body.name!r}: {part}")
            known[mesh.nodes_of(part)] = [component == "free" for component in condition.value]
        elif isinstance(condition, Symmetry):
            nodes = mesh.nodes_of(part)
            if np.ptp(mesh.normal[nodes], axis=0).max() > WRITTEN:
                raise InputError(
                    f"body {body.name!r}: {part}.condition: symmetry needs a straight side or a "
                    f"plane face"
                )
            frame[nodes], places = contact_frames(mesh, nodes)
            known[nodes, places[:, -1]] = False
    contact = contact_nodes(interfaces, number)
    places = np.broadcast_to(np.arange(d), (len(contact), d))
    if len(contact) and directions_looked_for(d, interfaces) < d:
        frame[contact], places = contact_frames(mesh, contact)
        known[contact, places[:, -1]] = False
    return frame, known, contact, places


def _inside(points: Array, body: Body, mesh: BoundaryMesh) -> Array:
    """Where point forces act, if that is inside of the body."""
    if len(points):
        nothing = np.zeros((mesh.n_nodes, mesh.components, 1))
        with np.errstate(all="ignore"):  # on the boundary
            found = fields_at(mesh, nothing, nothing, body.material, points, outside=np.nan)[0]
        for k in np.flatnonzero(np.isnan(found).any(axis=(1, 2)))[:1]:
            raise InputError(
                f"body {body.name!r}: point_force[{k}].at: {points[k].tolist()} does not lie "
                f"inside the body"
            )
    return points


def later_data(
    problem: Problem,
    meshes: Sequence[BoundaryMesh],
    interfaces: Sequence[Interface],
    step: int,
    old: Sequence[BoundaryData],
    ends: Sequence[tuple[Array, Array]],
) -> list[BoundaryData] | None:
    """The data of all bodies from a step on, see `_data_from`; None where it holds and frees no
    component."""
    new = [
        _data_from(problem, b, meshes[b], interfaces, step, old[b], end)
        for b, end in enumerate(ends)
    ]
    return None if all(one is other for one, other in zip(new, old, strict=True)) else new


def _data_from(
    problem: Problem,
    number: int,
    mesh: BoundaryMesh,
    interfaces: Sequence[Interface],
    step: int,
    old: BoundaryData,
    end: tuple[Array, Array],
) -> BoundaryData:
    """The data from a step on, after the step before ended with u and traction (n, d); the old ones
    if the same is known.

    What is known instead of another thing starts where that ended: a component that was free from
    its displacement, one that was held from its traction.
    """
    if np.array_equal(_components(problem, number, mesh, interfaces, step)[1], old.traction_known):
        return old
    new = boundary_data(problem, number, mesh, interfaces, step)
    u, traction = (np.einsum("icj,ij->ic", new.frame, field) for field in end)
    start = np.where(new.traction_known, traction, u)
    start[new.contact_nodes[:, None], new.contact_directions] = 0.0
    new.value[step - 1] = np.where(
        new.traction_known == old.traction_known, new.value[step - 1], start
    )
    return replace(new, volume=old.volume)


def contact_nodes(interfaces: Sequence[Interface], number: int) -> Index:
    """Nodes of a body that may carry contact tractions, in increasing order."""
    found = [i.nodes for i in interfaces if i.body == number]
    found += [
        i.primary_nodes for i in interfaces if i.primary == number and i.primary_nodes is not None
    ]
    return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=np.int64)


@functools.singledispatch
def body_motions(boundary: Any, data: BoundaryData, mesh: BoundaryMesh) -> Array:
    """Rigid motions (n, d, r) that neither conditions nor, of a superelement, what it stands on
    hold: none of an infinite plate."""
    motions = free_motions(data, mesh)
    return motions[..., :0] if boundary.exterior else motions


@body_motions.register
def _(boundary: CondensedSurface, data: BoundaryData, mesh: BoundaryMesh) -> Array:
    modes = free_modes(boundary, mesh)
    return modes if data.traction_known.all() else modes[..., :0]


def check_held(data: BoundaryData, mesh: BoundaryMesh, bound: Array) -> None:
    """Refuse a body whose contact cannot hold what its conditions leave free: known normals, and no
    friction; and one that is free since its mesh is too coarse.

    Raises
    ------
    InputError
    """
    motions, held = free_motions(data, mesh), int((~data.traction_known).any(axis=1).sum())
    few = 0 < held <= mesh.dim
    if not motions.shape[2] or (bound.any() and not few):
        return
    name = motion_name(motions[:, :, 0], mesh)
    if few:
        raise InputError(
            f"boundary: the body can {name} freely: it is held at {held} nodes only; use smaller "
            f"elements"
        )
    raise InputError(
        f"boundary: the body can {name} freely (friction does not hold it); "
        "fix it with a displacement condition, a roller or another contact part"
    )


def check_components(value: Sequence[object], mesh: BoundaryMesh, key: str) -> None:
    """Refuse a vector that has not as many components as the body has dimensions."""
    if len(value) != mesh.components:
        raise InputError(
            f"{key}.value: the body has {mesh.components} dimensions, got {len(value)} components"
        )


def _given(
    condition: Displacement | Traction | Symmetry | Periodic,
    mesh: BoundaryMesh,
    part: str,
    key: str,
) -> Array:
    """What a condition says at the nodes of its part, (m, d)."""
    nodes = mesh.nodes_of(part)
    result = np.zeros((len(nodes), mesh.components))
    normal = lifted(mesh.normal[nodes], mesh.components)
    for one in () if isinstance(condition, Symmetry | Periodic) else condition.apart:
        if isinstance(one, Displacement) or one.pressure is None:
            check_components(one.value or (), mesh, key)
        nodal = given_values(one, mesh.variables(nodes), normal, key)
        function = known_function(one, mesh, key)
        if function is not None:
            nodal = approximated(sampled(mesh, part, function, one), nodes, nodal)
        result += nodal
    return result


def known_function(
    condition: Displacement | Traction, mesh: BoundaryMesh, key: str
) -> Function | None:
    """What a condition says anywhere on its part, 0 where it is not finite; None where that is a
    number, or known at nodes only."""
    of_pressure = isinstance(condition, Traction) and condition.pressure is not None
    pressure = condition.pressure if of_pressure else None  # type: ignore[union-attr]
    given = (pressure,) if of_pressure else condition.value or ()
    if any(isinstance(value, tuple) for value in given) or not any(
        callable(value) or (isinstance(value, str) and value != "free") for value in given
    ):
        return None

    def function(element: Index, place: Array, x: Array, normal: Array) -> Array:
        names = mesh.variables_at(element, place)
        return given_values(condition, names, lifted(normal, mesh.components), key, otherwise=0.0)

    return function


def given_values(
    condition: Displacement | Traction,
    names: Mapping[str, Array],
    normal: Array,
    key: str,
    *,
    otherwise: float | None = None,
) -> Array:
    """What a condition says where expressions have these variables, and normals are (q, d),
    (q, d)."""
    count = len(normal)
    if isinstance(condition, Traction) and condition.pressure is not None:
        pressure = evaluate(
            condition.pressure, names, count, f"{key}.pressure", otherwise=otherwise
        )
        return -pressure[:, None] * normal
    columns = [
        np.zeros(count)
        if component == "free" and isinstance(condition, Displacement)
        else evaluate(component, names, count, f"{key}.value[{c}]", otherwise=otherwise)
        for c, component in enumerate(condition.value or ())
    ]
    return np.column_stack(columns)
