"""Boundary conditions evaluated at the nodes of a mesh: what is known, in which direction, and the friction bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Index, Mask
from ..errors import InputError
from ..mesh.curve_mesh import BoundaryMesh
from ..model.expressions import evaluate
from ..model.problem import Contact, Displacement, Problem, Traction


@dataclass(frozen=True)
class BoundaryData:
    """What each node knows, in two orthogonal directions a node.

    Attributes
    ----------
    frame : (n, 2, 2) array
        `frame[i, c]` is direction c of node i: x and y, or tangent and normal on contact parts. The direction nearer
        to the x axis comes first, so that equation c of a node belongs to unknown c and the diagonal is not small.
    traction_known : (n, 2) bool array
        True where the traction component is known (the displacement is the unknown), also in the tangential direction
        of contact nodes, whose traction is what a method looks for.
    value : (n, 2) array
        The known displacement [length] or traction [stress]; 0 in the tangential direction of contact nodes.
    contact_nodes : (m,) array
        Numbers of the contact nodes, in the order of the outline.
    contact_direction : (m,) array
        The direction c that is the tangent of each contact node.
    tangent : (m, 2) array
        Outward normal turned by +90° (counter-clockwise).
    friction_bound : (m,) array
        g >= 0 [stress].
    """

    frame: Array
    traction_known: Mask
    value: Array
    contact_nodes: Index
    contact_direction: Index
    tangent: Array
    friction_bound: Array

    @property
    def contact_unknowns(self) -> Index:
        """Numbers of the tangential displacements u_t among the unknowns 2·node + c, (m,)."""
        return 2 * self.contact_nodes + self.contact_direction


def evaluate_boundary(problem: Problem, mesh: BoundaryMesh) -> BoundaryData:
    """The problem's conditions at the nodes of its mesh.

    Raises
    ------
    InputError
        If a part has no condition or two, a condition names no part, data are not finite, g is negative, or the
        conditions leave the body free to move as a rigid body.
    """
    _check_parts(problem, mesh)
    n = mesh.n_nodes
    frame = np.broadcast_to(np.eye(2), (n, 2, 2)).copy()
    known = np.zeros((n, 2), dtype=bool)
    value = np.zeros((n, 2))
    bound = np.zeros(n)
    contact = np.zeros(n, dtype=bool)
    direction = np.zeros(n, dtype=np.int64)
    for number, condition in enumerate(problem.boundary):
        nodes = mesh.nodes_of(condition.part)
        variables = _variables(mesh, nodes)
        key = f"boundary[{number}] ({condition.part})"
        if isinstance(condition, Displacement):
            for c, component in enumerate(condition.value):
                if component == "free":
                    known[nodes, c] = True
                else:
                    value[nodes, c] = evaluate(component, variables, len(nodes), f"{key}.value[{c}]")
        elif isinstance(condition, Traction):
            known[nodes] = True
            value[nodes] = _traction(condition, variables, mesh.normal[nodes], key)
        else:
            bound[nodes] = _friction_bound(condition, variables, mesh.x[nodes], key)
            normal = mesh.normal[nodes]
            tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
            across = np.where(np.abs(tangent[:, 0]) >= np.abs(normal[:, 0]), 0, 1)
            frame[nodes, across], frame[nodes, 1 - across] = tangent, normal
            known[nodes, across] = True
            contact[nodes], direction[nodes] = True, across
    contact_nodes = np.flatnonzero(contact)
    along = direction[contact_nodes]
    data = BoundaryData(frame, known, value, contact_nodes, along, frame[contact_nodes, along], bound[contact_nodes])
    _check_rigid_modes(data, mesh)
    return data


def _variables(mesh: BoundaryMesh, nodes: Index) -> dict[str, Array]:
    (x, y), (nx, ny) = mesh.x[nodes].T, mesh.normal[nodes].T
    return {"x": x, "y": y, "nx": nx, "ny": ny, "s": mesh.arc_length[nodes]}


def _traction(condition: Traction, variables: dict[str, Array], normal: Array, key: str) -> Array:
    count = len(normal)
    if condition.pressure is not None:
        return -evaluate(condition.pressure, variables, count, f"{key}.pressure")[:, None] * normal
    assert condition.value is not None
    return np.column_stack([
        evaluate(component, variables, count, f"{key}.value[{c}]") for c, component in enumerate(condition.value)
    ])


def _friction_bound(condition: Contact, variables: dict[str, Array], x: Array, key: str) -> Array:
    bound = evaluate(condition.friction_bound, variables, len(x), f"{key}.friction_bound")
    if np.any(bound < 0.0):
        k = int(np.argmin(bound))
        raise InputError(f"{key}.friction_bound: must be >= 0, is {bound[k]:g} at x = {x[k, 0]:g}, y = {x[k, 1]:g}")
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


def _check_rigid_modes(data: BoundaryData, mesh: BoundaryMesh) -> None:
    """Refuse a body that can move rigidly without any known displacement changing.

    Friction does not count: with bilateral contact alone the elastic problem of each Robin step would be solvable, but
    the ρ-independent one would not.
    """
    centred = mesh.x - mesh.x.mean(axis=0)
    radius = np.abs(centred).max()
    rotation = np.column_stack([-centred[:, 1], centred[:, 0]]) / radius
    modes = np.stack([np.tile([1.0, 0.0], (mesh.n_nodes, 1)), np.tile([0.0, 1.0], (mesh.n_nodes, 1)), rotation], axis=2)
    seen = np.einsum("icj,ijk->ick", data.frame, modes)[~data.traction_known]
    values, vectors = np.linalg.eigh(seen.T @ seen / mesh.n_nodes)
    if len(seen) == 0 or values[0] < 1e-12:
        free = vectors[:, 0]
        name = "rotate" if abs(free[2]) > 1e-6 else "translate along ({:.2g}, {:.2g})".format(*free[:2])
        raise InputError(
            f"boundary: the body can {name} freely (friction does not hold it); "
            "fix it with a displacement condition, a roller or another contact part"
        )
