"""Boundary conditions evaluated at the nodes of a mesh: what is known, in which direction, and the friction bound."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, Index, Mask
from ..errors import InputError
from ..mesh.boundary_mesh import BoundaryMesh
from ..model.expressions import evaluate
from ..model.problem import Contact, Displacement, Problem, Traction


@dataclass(frozen=True)
class BoundaryData:
    """What each of n nodes knows, in d orthogonal directions a node.

    Attributes
    ----------
    frame : (n, d, d) array
        `frame[i, c]` is direction c of node i: the axes, or tangents and normal on contact parts, in the order in which
        they are nearest to the axes, so that equation c of a node belongs to unknown c and the diagonal is not small.
    traction_known : (n, d) bool array
        True where the traction component is known (the displacement is the unknown), also in the contact directions,
        whose traction is what a method looks for.
    value : (n, d) array
        The known displacement [length] or traction [stress]; 0 in the contact directions.
    contact_nodes : (m,) array
        Numbers of the contact nodes, increasing.
    contact_directions : (m, k) array
        The directions c of each contact node whose traction a method looks for: its d-1 tangents, and then, where it
        looks for the normal traction too, its normal.
    friction_bound : (m,) array
        g >= 0 [stress].
    rigid : (n, d) array, optional
        A rigid motion that was taken out of the known displacements, to be added to whatever follows from them [length].
    """

    frame: Array
    traction_known: Mask
    value: Array
    contact_nodes: Index
    contact_directions: Index
    friction_bound: Array
    rigid: Array | None = None

    @property
    def sliding(self) -> Array | float:
        """The rigid motion along the contact directions, (m, k), or 0."""
        if self.rigid is None:
            return 0.0
        return np.asarray(np.einsum("mkj,mj->mk", self.contact_frame, self.rigid[self.contact_nodes]))

    def reordered(self, nodes: Index) -> BoundaryData:
        """The same with node nodes[i] as node i."""
        place = np.argsort(nodes)[self.contact_nodes]
        order = np.argsort(place)
        return BoundaryData(
            self.frame[nodes], self.traction_known[nodes], self.value[nodes], place[order], self.contact_directions[order],
            self.friction_bound[order], None if self.rigid is None else self.rigid[nodes],
        )  # fmt: skip

    @property
    def contact_frame(self) -> Array:
        """The contact directions as vectors, (m, k, d)."""
        return np.asarray(self.frame[self.contact_nodes[:, None], self.contact_directions])

    @property
    def tangent(self) -> Array:
        """Tangents of the contact nodes, (m, d-1, d); in the plane the outward normal turned by +90°."""
        return self.contact_frame[:, : self.frame.shape[1] - 1]

    @property
    def contact_unknowns(self) -> Index:
        """Numbers of the displacements in the contact directions among the unknowns d·node + c, (m k,)."""
        return (self.frame.shape[1] * self.contact_nodes[:, None] + self.contact_directions).ravel()


def evaluate_boundary(
    problem: Problem, mesh: BoundaryMesh, *, normal_unknown: bool = False, held: bool = True
) -> BoundaryData:
    """The problem's conditions at the nodes of its mesh.

    Parameters
    ----------
    problem : Problem
    mesh : BoundaryMesh
    normal_unknown : bool
        Whether a method looks for the normal traction in contact too; else u_n = 0 there.
    held : bool
        Whether the conditions have to hold the body.

    Raises
    ------
    InputError
        If a part has no condition or two, a condition names no part, data are not finite, g is negative, or the
        conditions leave the body free to move as a rigid body.
    """
    _check_parts(problem, mesh)
    n, d = mesh.x.shape
    frame = np.broadcast_to(np.eye(d), (n, d, d)).copy()
    known = np.zeros((n, d), dtype=bool)
    value = np.zeros((n, d))
    bound = np.zeros(n)
    contact = np.zeros(n, dtype=bool)
    direction = np.zeros((n, d), dtype=np.int64)
    looked_for = d if normal_unknown else d - 1
    for number, condition in enumerate(problem.boundary):
        nodes = mesh.nodes_of(condition.part)
        variables = mesh.variables(nodes)
        key = f"boundary[{number}] ({condition.part})"
        if isinstance(condition, Displacement):
            check_components(condition.value, mesh, key)
            for c, component in enumerate(condition.value):
                if component == "free":
                    known[nodes, c] = True
                else:
                    value[nodes, c] = evaluate(component, variables, len(nodes), f"{key}.value[{c}]")
        elif isinstance(condition, Traction):
            known[nodes] = True
            check_components(condition.value or (0.0,) * d, mesh, key)
            value[nodes] = _traction(condition, variables, mesh.normal[nodes], key)
        else:
            bound[nodes] = _friction_bound(condition, variables, mesh.x[nodes], key)
            frame[nodes], direction[nodes] = _contact_frame(mesh, nodes)
            known[nodes[:, None], direction[nodes, :looked_for]] = True
            contact[nodes] = True
    contact_nodes = np.flatnonzero(contact)
    directions = direction[contact_nodes, :looked_for]
    data = BoundaryData(frame, known, value, contact_nodes, directions, bound[contact_nodes])
    if held:
        _check_rigid_modes(data, mesh)
    return data if normal_unknown else _without_rigid_motion(data, mesh)


def _contact_frame(mesh: BoundaryMesh, nodes: Index) -> tuple[Array, Index]:
    """Frames (m, d, d) of tangents and normal, and where in them the tangents and then the normal went, (m, d)."""
    vectors = np.concatenate([mesh.tangents(nodes), mesh.normal[nodes][:, None]], axis=1)
    # of all orders that in which the directions are nearest to the axes
    orders = np.array(list(itertools.permutations(range(mesh.dim))))
    along = np.abs(vectors[:, orders, np.arange(mesh.dim)]).sum(axis=2)
    order = orders[np.argmax(along, axis=1)]
    return np.take_along_axis(vectors, order[:, :, None], axis=1), np.argsort(order, axis=1)


def _traction(condition: Traction, variables: dict[str, Array], normal: Array, key: str) -> Array:
    count = len(normal)
    if condition.pressure is not None:
        return -evaluate(condition.pressure, variables, count, f"{key}.pressure")[:, None] * normal
    assert condition.value is not None
    return np.column_stack([
        evaluate(component, variables, count, f"{key}.value[{c}]") for c, component in enumerate(condition.value)
    ])


def check_components(value: Sequence[object], mesh: BoundaryMesh, key: str) -> None:
    """Refuse a vector that has not as many components as the body has dimensions."""
    if len(value) != mesh.dim:
        raise InputError(f"{key}.value: the body has {mesh.dim} dimensions, got {len(value)} components")


def _friction_bound(condition: Contact, variables: dict[str, Array], x: Array, key: str) -> Array:
    bound = evaluate(condition.friction_bound or 0.0, variables, len(x), f"{key}.friction_bound")
    if np.any(bound < 0.0):
        k = int(np.argmin(bound))
        place = ", ".join(f"{name} = {value:g}" for name, value in zip("xyz", x[k], strict=False))
        raise InputError(f"{key}.friction_bound: must be >= 0, is {bound[k]:g} at {place}")
    return bound


def _check_parts(problem: Problem, mesh: BoundaryMesh) -> None:
    given = [condition.part for condition in problem.boundary]
    parts = ", ".join(mesh.part_names)
    for number, name in enumerate(given):
        if name not in mesh.part_names:
            raise InputError(f"boundary[{number}].part: no part {name!r}; parts are {parts}")
        if name in given[:number]:
            raise InputError(f"boundary[{number}].part: {name!r} has a condition already")
    missing = [name for name in mesh.part_names if name not in given]
    if missing:
        raise InputError(f"boundary: part {missing[0]!r} has no condition; each of {parts} needs one")


def _without_rigid_motion(data: BoundaryData, mesh: BoundaryMesh) -> BoundaryData:
    """Known displacements without the rigid motion that they have in common, where that is larger than the body.

    It would swallow the digits of what strains the body. Motions that leave contact normals at rest are taken out only.
    """
    given = ~data.traction_known
    size = float(np.abs(data.value[given]).max(initial=0.0))
    if size <= float(np.ptp(mesh.x, axis=0).max()):
        return data
    modes = rigid_modes(mesh.x)
    along = np.einsum("icj,ijk->ick", data.frame, modes)
    contact = np.zeros(len(mesh.x), dtype=bool)
    contact[data.contact_nodes] = True
    _, strengths, ways = np.linalg.svd(along[given & contact[:, None]], full_matrices=True)
    free = ways[np.append(strengths, np.zeros(len(ways) - len(strengths))) <= 1e-12 * max(1.0, strengths.max(initial=0.0))].T
    elsewhere = given & ~contact[:, None]
    amplitudes = free @ np.linalg.lstsq(along[elsewhere] @ free, data.value[elsewhere], rcond=None)[0]
    value = data.value.copy()
    value[elsewhere] -= along[elsewhere] @ amplitudes
    return replace(data, value=value, rigid=modes @ amplitudes)


def rigid_modes(x: Array) -> Array:
    """Translations along the axes, then rotations about the centre of points x (n, d): (n, d, d(d+1)/2) [-]."""
    n, d = x.shape
    centred = x - x.mean(axis=0)
    centred /= np.abs(centred).max()
    modes = np.zeros((n, d, d * (d + 1) // 2))
    modes[:, :, :d] = np.eye(d)
    for k, (i, j) in enumerate(itertools.combinations(range(d), 2), start=d):
        modes[:, i, k], modes[:, j, k] = -centred[:, j], centred[:, i]
    return modes


def free_modes(data: BoundaryData, mesh: BoundaryMesh) -> Array:
    """Rigid modes that change no known displacement, as combinations of `rigid_modes`, (r, d(d+1)/2)."""
    seen = np.einsum("icj,ijk->ick", data.frame, rigid_modes(mesh.x))[~data.traction_known]
    values, vectors = np.linalg.eigh(seen.T @ seen / mesh.n_nodes)
    return np.asarray(vectors[:, values < 1e-12].T)


def _check_rigid_modes(data: BoundaryData, mesh: BoundaryMesh) -> None:
    """Refuse a body that can move rigidly without any known displacement changing.

    Friction does not count: with bilateral contact alone the elastic problem of each Robin step would be solvable, but
    the ρ-independent one would not.
    """
    for mode in free_modes(data, mesh)[:1]:
        along = ", ".join(f"{value:.2g}" for value in mode[: mesh.dim])
        name = "rotate" if np.abs(mode[mesh.dim :]).max() > 1e-6 else f"translate along ({along})"
        held = int((~data.traction_known).any(axis=1).sum())
        if 0 < held <= mesh.dim:
            raise InputError(f"boundary: the body can {name} freely: it is held at {held} nodes only; use smaller elements")
        raise InputError(
            f"boundary: the body can {name} freely (friction does not hold it); "
            "fix it with a displacement condition, a roller or another contact part"
        )
