"""A body given by a condensed stiffness or compliance of its contact surface, from any code.

Displacement and traction at the nodes of the surface satisfy u = u_f + S t + R α and RᵀW t + F = 0.
A file may give a stiffness K on the points of linear faces instead, K u = f + f_0. With their shape
functions P, u = P u_K and f = PᵀW t, virtual work gives S = P K⁻¹ PᵀW. If K leaves rigid motions
free, K⁻¹ is its inverse on all other motions. Conditions on parts of the surface, and normals that
contact holds, are unknown tractions t_D. They are eliminated as in any body.

Tractions with more unknowns than K has would not be unique. The part (I - Π) t that no continuous
linear field represents therefore gets the compliance of a half space under one face. This follows
polynomial pressure projection (C. R. Dohrmann, P. B. Bochev, Int. J. Numer. Meth. Fluids 46, 2004).
The additional compliance vanishes with the size of the faces, and does not act on linear tractions.
"""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array
from ...bem.operators import BoundaryOperators
from ...errors import InputError
from ...geometry.condensed_surface import CondensedSurface, expect
from ...linalg.dense_elimination import PREFIX
from ...linalg.dense_solver import DenseSolver
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.panels import linear_shapes, reference_nodes
from ...record import record
from ...round_off import HALF
from ...runtime.petsc import petsc
from .eliminated import ElasticBody


@record
class Condensed:
    """The relation u = free + S t + R α, RᵀW t + F = 0 at n nodes, in K load states.

    Component c of node i has number d i + c.

    Attributes
    ----------
    compliance : (d n, d n) array
        S [length/stress].
    free : (K, d n) array
        Displacement without tractions [length].
    modes : (n, d, r) array
        R [-].
    resultant : (K, r) array
        F of the loads inside the body.
    """

    compliance: Array
    free: Array
    modes: Array
    resultant: Array


def shape_functions(surface: CondensedSurface, mesh: BoundaryMesh) -> scipy.sparse.csr_array:
    """Return the map from values at the points of linear faces to those at the nodes, (n, p)."""
    rows, columns, entries = [], [], []
    for batch in mesh.batches():
        points = surface.elements[batch.elements.index]
        points = points[:, : np.count_nonzero(points[0] >= 0)]
        if surface.dim == 2:
            xi = mesh.xi[: mesh.first_node[1]]  # type: ignore[attr-defined]
            shape = 0.5 * np.stack([1.0 - xi, 1.0 + xi])
        else:
            corners = points.shape[1]
            shape = linear_shapes(reference_nodes(corners, batch.elements.order)[0], corners)
        count = shape.shape[1]
        rows.append(np.repeat(batch.nodes, len(shape)))
        columns.append(np.repeat(points, count, axis=0).ravel())
        entries.append(np.tile(shape.T.ravel(), len(points)))
    triples = np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))
    return scipy.sparse.csr_array(
        scipy.sparse.coo_array(triples, shape=(mesh.n_nodes, len(surface.points)))
    )


def free_modes(surface: CondensedSurface, mesh: BoundaryMesh) -> Array:
    """Return the rigid motions at the nodes that the body does not resist, (n, d, r) [-]."""
    if "stiffness" not in surface.arrays:
        if "modes" not in surface.arrays:
            return np.zeros((*mesh.x.shape, 0))
        modes = surface.arrays["modes"]
        return np.asarray(expect(surface, "modes", (*mesh.x.shape, modes.shape[-1])))
    at_points = _free_at_points(surface, mesh).reshape(*surface.points.shape, -1)
    shapes = shape_functions(surface, mesh)
    return np.stack([shapes @ at_points[:, c] for c in range(surface.dim)], axis=1)


def _free_at_points(surface: CondensedSurface, mesh: BoundaryMesh) -> Array:
    """Return the rigid motions (d p, r) of the points without stiffness, of about unit size [-]."""
    stiffness, away = surface.arrays["stiffness"], surface.points - surface.points.mean(axis=0)
    motions = mesh.motions.modes(away / np.abs(away).max()).reshape(surface.points.size, -1)
    values, vectors = np.linalg.eigh(motions.T @ stiffness @ motions)
    largest = float(np.linalg.eigvalsh(stiffness)[-1]) * len(surface.points)
    free = vectors[:, np.abs(values) <= HALF * largest]
    # free translations remain translations along the axes
    return np.asarray(
        motions @ (free @ np.linalg.qr(free.T)[0]) if free.shape[1] else motions[:, :0]
    )


def condensed(
    surface: CondensedSurface, mesh: BoundaryMesh, states: int, half_space_compliance: float
) -> Condensed:
    """Return the relation that a file gives, at the nodes of its mesh.

    If the file gives a stiffness, the compliance of unresolved tractions is added (see above). It
    is `half_space_compliance` [1/stress] times the size of the faces.

    Raises
    ------
    InputError
        If the shape of an array does not fit the mesh or the steps, or the stiffness is not that of
        a body.
    """
    n, d = mesh.x.shape
    modes = free_modes(surface, mesh)
    r = modes.shape[2]
    if "compliance" in surface.arrays:
        compliance = expect(surface, "compliance", (d * n, d * n))
        free = _by_state(surface, "u_0", (n, d), states).reshape(states, d * n)
        return Condensed(compliance, free, modes, _by_state(surface, "resultant", (r,), states))
    motions, size = _free_at_points(surface, mesh), surface.points.size
    scale = float(np.abs(surface.arrays["stiffness"]).max())
    bordered = np.block(
        [[surface.arrays["stiffness"] / scale, motions], [motions.T, np.zeros((r, r))]]
    )
    lowest = float(np.linalg.eigvalsh(surface.arrays["stiffness"] / scale + motions @ motions.T)[0])
    if lowest <= HALF / size:
        raise InputError(
            f"{surface.source}: stiffness: it resists some motion that is not rigid by "
            f"{lowest:.1e} of its largest entry only; it must be that of a connected body, "
            "positive semi-definite"
        )
    scalar = shape_functions(surface, mesh)
    shapes = scipy.sparse.csr_array(scipy.sparse.kron(scalar, scipy.sparse.identity(d)))
    force = _by_state(surface, "force", (size,), states)
    solver = DenseSolver(petsc().COMM_SELF, PREFIX)
    solver.take(bordered)
    moved = solver.solve_all(np.pad(shapes.toarray(), ((0, 0), (0, r))))[:, :size] / scale
    solver.close()
    compliance = (shapes @ moved.T).T * np.repeat(mesh.weight, d)
    compliance += np.kron(half_space_compliance * _unresolved(scalar.toarray(), mesh), np.eye(d))
    return Condensed(compliance, (moved @ force.T).T, modes, force @ motions)


def _unresolved(shapes: Array, mesh: BoundaryMesh) -> Array:
    """Return (I - Π) h (I - Π), (n, n) [length].

    h are the sizes of the faces, Π is the projection onto continuous linear fields.
    """
    weighted = shapes.T * mesh.weight
    left = np.eye(mesh.n_nodes) - shapes @ np.linalg.solve(weighted @ shapes, weighted)
    size = np.bincount(mesh.element, mesh.measure)[mesh.element] ** (1.0 / (mesh.dim - 1))
    return np.asarray((left * size) @ left)


def _by_state(surface: CondensedSurface, name: str, shape: tuple[int, ...], states: int) -> Array:
    """Return an optional array in all load states, zeros if the file does not give it.

    An array for one state is 0 in the first state and the same in all others.
    """
    if name not in surface.arrays:
        return np.zeros((states, *shape))
    values = expect(surface, name, shape, (states, *shape))
    if values.shape != shape:
        return np.asarray(values)
    return np.concatenate([np.zeros((1, *shape)), np.broadcast_to(values, (states - 1, *shape))])


def _reactions(
    source: object, parts: tuple[Array, Array, Array], wanted: tuple[Array, Array]
) -> list[Array]:
    """Return the tractions at held components, and α: S t + R α = wanted, RᵀW t = wanted.

    `parts` are S, R and RᵀW of these components. `source` names the superelement.

    Raises
    ------
    InputError
        If the conditions hold only some of the rigid motions.
    """
    compliance, modes, balance = parts
    r = modes.shape[1]
    if r and np.linalg.matrix_rank(modes) < r:
        raise InputError(
            f"{source}: the conditions on its parts hold the body in part only, which moves "
            "freely; hold it altogether, or by contact only"
        )
    bordered = np.block([[compliance, modes], [balance, np.zeros((r, r))]])
    return np.split(np.linalg.solve(bordered, np.vstack(wanted)), [len(modes)])


class SuperelementBody(ElasticBody):
    """A superelement eliminated to its contact directions.

    Parameters
    ----------
    operators : BoundaryOperators
        Operators on its mesh, of which only the data and the units are used.
    surface : CondensedSurface

    Raises
    ------
    InputError
        As for `condensed`, or if conditions hold only some of the free rigid motions.
    """

    compliance: Array

    def __init__(self, operators: BoundaryOperators, surface: CondensedSurface) -> None:
        mesh, data = operators.mesh, operators.data
        given = condensed(surface, mesh, data.states, operators.kernel.half_space_compliance)
        r = given.modes.shape[2]
        super().__init__(
            operators, given.modes if data.traction_known.all() else given.modes[..., :0]
        )
        frame, (n, d) = data.frame, mesh.x.shape
        compliance = np.einsum(
            "icj,ijkl,kml->ickm", frame, given.compliance.reshape(n, d, n, d), frame, optimize=True
        )
        compliance = compliance.reshape(d * n, d * n)
        free = np.einsum("icj,sij->sic", frame, given.free.reshape(-1, n, d))
        modes = data.components(given.modes).reshape(d * n, r)
        balance = (modes * np.repeat(mesh.weight, d)[:, None]).T
        value = (
            data.value
            if data.rigid is None
            else data.value + np.einsum("icj,sij->sic", frame, data.rigid)
        )
        traction = np.where(data.traction_known, data.value, 0.0).reshape(-1, d * n)
        held, contact = ~data.traction_known.ravel(), data.contact_unknowns
        # columns: the load states, then a unit traction in each contact direction
        loads = np.hstack([traction.T, np.eye(d * n)[:, contact]])
        resultant = np.hstack([given.resultant.T, np.zeros((r, len(contact)))])
        moved, alpha = compliance @ loads, np.zeros((r, loads.shape[1]))
        moved[:, : data.states] += free.reshape(-1, d * n).T
        if held.any():
            wanted = np.hstack([value.reshape(-1, d * n).T, np.zeros((d * n, len(contact)))])[held]
            loads[held], alpha = _reactions(
                surface.source,
                (compliance[np.ix_(held, held)], modes[held], balance[:, held]),
                (wanted - moved[held], -resultant - balance @ loads),
            )
            moved = moved + compliance[:, held] @ loads[held] + modes @ alpha
        elif r:
            self.resultant = (resultant + balance @ loads)[:, : data.states].T
        self._given, self._u, self._t, self._alpha = given, moved, loads, alpha
        self.compliance = moved[contact, data.states :]
        self.u_0 = moved[contact, : data.states].T.reshape(-1, *data.contact_shape)

    def boundary(self, shares: Array, traction: Array, alpha: Array) -> tuple[Array, Array]:
        """Return displacement [length] and traction [stress] at the nodes, (n, d) each."""
        u, t = (
            self.data.vectors(field.reshape(self.mesh.x.shape))
            for field in self._fields(shares, traction)
        )
        return (u + self.modes @ alpha if alpha.size else u), t

    def _fields(self, shares: Array, traction: Array) -> tuple[Array, Array]:
        """Return displacement and traction by components along the frames, (d n,) each."""
        factors = np.concatenate([shares, traction.ravel()])
        return self._u @ factors, self._t @ factors

    def residual(
        self, shares: Array, u: Array, traction: Array, sigma: Array, alpha: Array
    ) -> float:
        """Return the largest defect of u = u_f + S t + R α, over the largest displacement [-]."""
        held = self._alpha @ np.concatenate([shares, sigma.ravel()])
        motion = self._given.modes @ (alpha if alpha.size else held)
        expected = (
            self._given.free.T @ shares + self._given.compliance @ traction.ravel()
        ).reshape(u.shape) + motion
        return float(np.abs(u - expected).max()) / (self.displaced(u, traction) or 1.0)

    def describe(self) -> str:
        """Return the text for the verdict: the kind of body."""
        return "superelement"
