"""Known data at the nodes of a body at the end of every step: its conditions, evaluated along
suitable directions."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array, Index, Mask
from ...bem.boundary_data import (
    BoundaryData,
    contact_frames,
    free_motions,
    motion_name,
    without_rigid_motion,
)
from ...compliance.interface import directions_looked_for
from ...compliance.reduced_bodies import Interface
from ...errors import InputError, in_body
from ...fields.interior import InteriorField
from ...geometry.condensed_surface import CondensedSurface
from ...geometry.rotation import lifted
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...given.conditions import Condition, Displacement, Symmetry, Term
from ...given.sites import Sites
from ...given.values import Given
from ...mesh.approximation import MEAN, TOTAL, Samples, approximated, sampled
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import SOLVED, WRITTEN


def boundary_data(
    body: Body,
    mesh: BoundaryMesh,
    interfaces: Sequence[Interface],
    step: int = 1,
    begins: tuple[Mask | bool, Array | float] = (False, 0.0),
) -> BoundaryData:
    """Return the known data of a body in all load states.

    State 0 has zeros, state k the conditions with the changes of steps 1 to k. `step` says which
    components of displacement and traction are known, in all states. `begins` says which
    components (n, d) the step takes as they were at its begin, and their values.

    Raises
    ------
    InputError
        If data are not finite, or have another number of components than the body has dimensions.
    """
    frame, traction_known, contact, axes = _components(body, mesh, interfaces, step)
    value, d = _values(body, mesh, step, begins), mesh.components
    directions = axes[:, : directions_looked_for(d, interfaces)]
    for face in interfaces if directions.shape[1] < d else ():
        if face.body == body.number:
            gap = face.gap - (0.0 if face.overlap is None else face.overlap)
            value[:, face.nodes, axes[np.searchsorted(contact, face.nodes), -1]] = gap
    points, forces = _point_forces(body, mesh)
    return without_rigid_motion(
        BoundaryData(frame, traction_known, value, contact, directions, points, forces), mesh
    )


def _values(
    body: Body, mesh: BoundaryMesh, step: int, begins: tuple[Mask | bool, Array | float]
) -> Array:
    """Return the values of all conditions in all load states, (K, n, d)."""
    value = np.zeros((len(body.conditions) + 1, mesh.n_nodes, mesh.components))
    cache: dict[str, tuple[object, Array]] = {}
    for s, of_step in enumerate(body.conditions, 1):
        value[s - 1] = np.where(begins[0] & (s == step), begins[1], value[s - 1])
        for part, condition in of_step.items():
            nodes = mesh.nodes_of(part)
            if part not in cache or cache[part][0] is not condition:
                cache[part] = condition, _nodal_values(condition, mesh)
            before = np.array(getattr(condition, "onward", 0.0)) * value[s - 1, nodes]
            value[s, nodes] = before + cache[part][1]
    return value


def _point_forces(body: Body, mesh: BoundaryMesh) -> tuple[Array, Array]:
    """Return the points (f, d) where forces act, and the forces in all load states (K, f, d)."""
    points = _inside(np.array(body.points).reshape(-1, mesh.dim), body, mesh)
    shape = len(points), mesh.components
    later = [np.reshape([f.force for f in state], shape) for state in body.forces]
    return points, np.array([np.zeros(shape), *later]) / mesh.depth


def _components(
    body: Body, mesh: BoundaryMesh, interfaces: Sequence[Interface], step: int
) -> tuple[Array, Mask, Index, Index]:
    """Return frames, known components and contact directions of a body in a step.

    Returns
    -------
    frame : (n, d, d) array
        Orthonormal directions at each node.
    known : (n, d) array
        Whether the traction along each direction is known.
    contact : (m,) array
        Numbers of the contact nodes.
    places : (m, d) array
        Numbers of their frames' directions in the order that contact uses. If normals are held,
        the normal comes last.
    """
    n, d = mesh.n_nodes, mesh.components
    frame = np.broadcast_to(np.eye(d), (n, d, d)).copy()
    traction_known = np.ones((n, d), dtype=bool)
    for part, condition in body.conditions[step - 1].items():
        if isinstance(condition, Displacement):
            _check_values(condition.value, d)
            traction_known[mesh.nodes_of(part)] = condition.free
        elif isinstance(condition, Symmetry):
            nodes = mesh.nodes_of(part)
            if np.ptp(mesh.normal[nodes], axis=0).max() > WRITTEN:
                raise InputError(
                    f"{in_body(body.name)}{part}.condition: symmetry needs a straight side or a "
                    "plane face"
                )
            frame[nodes], axes = contact_frames(mesh, nodes)
            traction_known[nodes, axes[:, -1]] = False
    contact = contact_nodes(interfaces, body.number)
    axes = np.broadcast_to(np.arange(d), (len(contact), d))
    if len(contact) and directions_looked_for(d, interfaces) < d:
        frame[contact], axes = contact_frames(mesh, contact)
        traction_known[contact, axes[:, -1]] = False
    return frame, traction_known, contact, axes


def _inside(points: Array, body: Body, mesh: BoundaryMesh) -> Array:
    """Return the points (f, d) where point forces act.

    Raises
    ------
    InputError
        If a point does not lie inside the body.
    """
    if len(points):
        nothing = np.zeros((mesh.n_nodes, mesh.components, 1))
        with np.errstate(all="ignore"):  # on the boundary
            field = InteriorField(mesh, nothing, nothing, body.material).at(points, outside=np.nan)
        for k in np.flatnonzero(np.isnan(field[0]).any(axis=(1, 2)))[:1]:
            raise InputError(
                f"{in_body(body.name)}point_force[{k}].at: {points[k].tolist()} does not lie "
                f"inside the body"
            )
    return points


def later_data(
    bodies: Sequence[Body],
    meshes: Sequence[BoundaryMesh],
    interfaces: Sequence[Interface],
    step: int,
    old: Sequence[BoundaryData],
    ends: Sequence[tuple[Array, Array]],
) -> list[BoundaryData] | None:
    """Return the data of all bodies from a step on, see `_data_from`.

    It is None if the step holds and frees no component.
    """
    new = [
        _data_from(body, meshes[b], interfaces, step, old[b], ends[b])
        for b, body in enumerate(bodies)
    ]
    return None if all(data is old_data for data, old_data in zip(new, old, strict=True)) else new


def _data_from(
    body: Body,
    mesh: BoundaryMesh,
    interfaces: Sequence[Interface],
    step: int,
    old: BoundaryData,
    end: tuple[Array, Array],
) -> BoundaryData:
    """Return the data from a step on, after the step before ended with u and traction (n, d).

    They are the old data if the same components are known, and components that go on from where
    they are begin there. A component that was free and is now held starts from its displacement. A
    component that was held and is now free starts from its traction.
    """
    frame, known, contact, axes = _components(body, mesh, interfaces, step)
    onward = np.zeros_like(known)
    for part, condition in body.conditions[step - 1].items():
        onward[mesh.nodes_of(part)] = getattr(condition, "onward", False)
    u, traction = (np.einsum("icj,ij->ic", frame, field) for field in end)
    start = np.where(known, traction, u)
    start[contact[:, None], axes[:, : old.contact_directions.shape[1]]] = 0.0
    if np.array_equal(known, old.traction_known):
        before = old.known_displacement[step - 1]
        before = before if old.rigid is None else before + old.rigid[step - 1]
        off = np.abs(before - u)[onward].max(initial=0.0)
        if off <= SOLVED * np.abs(u[onward]).max(initial=0.0):
            return old
    begins = (known != old.traction_known) | onward, start
    return replace(boundary_data(body, mesh, interfaces, step, begins), volume=old.volume)


def contact_nodes(interfaces: Sequence[Interface], number: int) -> Index:
    """Return the nodes of a body that may carry contact tractions, in increasing order."""
    nodes = [i.nodes for i in interfaces if i.body == number]
    nodes += [
        i.primary_nodes for i in interfaces if i.primary == number and i.primary_nodes is not None
    ]
    return np.unique(np.concatenate(nodes)) if nodes else np.empty(0, dtype=np.int64)


@functools.singledispatch
def body_motions(boundary: Boundary, data: BoundaryData, mesh: BoundaryMesh) -> Array:
    """Return the rigid motions (n, d, r) of a body that no condition holds [-].

    An infinite plate has none. A superelement has only those that its file leaves free, and none if
    a part is held.
    """
    motions = free_motions(data, mesh)
    return motions[..., :0] if boundary.exterior else motions


@body_motions.register
def _(boundary: CondensedSurface, data: BoundaryData, mesh: BoundaryMesh) -> Array:
    from ...compliance.body.superelement import free_modes

    modes = free_modes(boundary, mesh)
    return modes if data.traction_known.all() else modes[..., :0]


def check_held(data: BoundaryData, mesh: BoundaryMesh) -> None:
    """Refuse a body that its conditions hold at too few nodes, because the mesh is too coarse.

    Raises
    ------
    InputError
    """
    held = int((~data.traction_known).any(axis=1).sum())
    motions = free_motions(data, mesh) if 0 < held <= mesh.dim else np.zeros((0, 0, 0))
    if motions.shape[2]:
        raise InputError(
            f"boundary: the body can {motion_name(motions[:, :, 0], mesh)} freely: it is held at "
            f"{held} nodes only; use smaller elements (mesh.element_size)"
        )


def check_components(key: str, value: Sequence[object] | Array, d: int) -> None:
    """Refuse a vector with another number of components than the body has dimensions."""
    if len(value) != d:
        given = ", ".join("free" if each is None else str(each) for each in value)
        raise InputError(
            f"{key}: the body has {d} dimensions, got {len(value)} components, [{given}]"
        )


def _check_values(value: Sequence[Given | None], d: int) -> None:
    """Refuse values with another number of components than d, by the key of the first one."""
    key = next((each.key for each in value if each is not None), "value[0]")
    check_components(key.rpartition("[")[0], value, d)


def _nodal_values(condition: Condition, mesh: BoundaryMesh) -> Array:
    """Return the values of a condition at the nodes of its part, (m, d)."""
    nodes = mesh.nodes_of(condition.part)
    result = np.zeros((len(nodes), mesh.components))
    normal = lifted(mesh.normal[nodes], mesh.components)
    for term in condition.terms:
        if not term.is_pressure:
            _check_values(term.data, mesh.components)
        nodal = term.at(mesh.sites(nodes), normal)
        samples = samples_of_term(term, mesh, condition.part)
        if samples is not None:
            nodal = stand_ins(term, samples, nodes, nodal)
        result += nodal
    return result


def samples_of_term(term: Term, mesh: BoundaryMesh, part: str) -> Samples | None:
    """Return samples of the values of a term on its part, 0 where not finite.

    The result is None if all values are numbers, or known at nodes only.
    """
    if not term.varies:
        return None

    def function(element: Index, local: Array, x: Array, normal: Array) -> Array:
        sites = Sites(x, normal, mesh.arc_lengths(element, local))
        return term.near(sites, lifted(normal, mesh.components))

    return sampled(mesh, part, function, term.given, term)


def stand_ins(term: Term, samples: Samples, nodes: Index, nodal: Array) -> Array:
    """Return nodal values (m, c) that stand for a term on its part, see `approximated`."""
    return approximated(samples, nodes, nodal, TOTAL if term.kind == "traction" else MEAN)
