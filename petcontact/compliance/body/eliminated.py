"""The common interface of eliminated bodies: load states, rigid motions, and results that follow
from S."""

from __future__ import annotations

import abc
import functools
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...bem.boundary_data import BoundaryData
from ...bem.operators import BoundaryOperators
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import HALF, ROUNDED, WRITTEN
from ..contact_compliance import ContactCompliance, MakeSurrogate

PROBED = 24
"""Number of nodes at which the integral equations are checked."""
VOLUME, CLOSED = 1e-6, 1e-4
"""VOLUME: work of volume loads on a rigid motion over the work of their sizes, up to which it
counts as 0 [-]. These loads are polynomials, integrated over the boundary. CLOSED: the same ratio
for the normals, up to which a boundary is closed and the ratio is an error of quadrature [-]."""


class ElasticBody(abc.ABC):
    """A body eliminated to its contact nodes.

    Attributes
    ----------
    operators : BoundaryOperators
    contact : (m,) array
        Numbers of the nodes that carry free tractions, in k directions each.
    u_0 : (K, m, k) array
        Displacement of these nodes in each load state without contact tractions [length].
    compliance : (k m, k m) array or None
        S [length/stress]. Component c of node i has number k i + c. It is None if S is known only
        by its products.
    modes : (n, d, r) array
        R: rigid motions that no known displacement holds [-].
    resultant : (K, r) array
        F = RᵀW(t̂ - t_p) + Rᵀ(point forces). t_p is the traction of the particular solution; -t_p
        has the resultant of the volume forces.
    tolerance : float
        Accepted relative error of compressed operators; 0 for dense ones [-].
    is_solved_jointly : bool
        Whether its equations are solved together with those of contact and of all other bodies.
    digits_lost : float
        Relative error of the elimination for a known solution, or nan if it is not measured [-].
    missed : (n, d, d) array, optional
        What is added to ½ + H at each node, so that its equations are exact for translations [-].
    """

    u_0: Array
    compliance: Any
    tolerance = 0.0
    is_solved_jointly = False
    digits_lost = np.nan
    missed: Array | None = None

    def __init__(self, operators: BoundaryOperators, modes: Array) -> None:
        self.operators, self.modes = operators, modes
        self.mesh, self.data = operators.mesh, operators.data
        self.contact = self.data.contact_nodes
        self.resultant = _resultant(operators, modes)

    def apply(self, traction: Array) -> Array:
        """Return S t for tractions (k m,), or for several (k m, s) [length]. Collective."""
        return np.asarray(self.compliance @ traction)

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """Return the unknowns of the operators and β, (d n + r,). Collective.

        They are zeros where nothing is solved for.

        `shares` (K,) are the weights of the load states, `traction` is t (m, k) [stress].
        """
        return np.zeros(self.operators.n_unknowns + self.modes.shape[2])

    @abc.abstractmethod
    def describe(self) -> str:
        """Return a text that says how the operators are stored."""

    def with_data(self, data: BoundaryData) -> ElasticBody | None:
        """Return the same body under other known values, or None if it must be eliminated again."""
        return None

    def contact_compliance(
        self, order: Index, surrogate: MakeSurrogate
    ) -> ContactCompliance | None:
        """Return S of this body alone for contact nodes in the given order.

        It is None if S is to be composed from `compliance` or `apply`.
        """
        return None

    def close(self) -> None:  # noqa: B027 (most have none)
        """Free PETSc objects, if there are any."""

    @property
    def contact_modes(self) -> Array:
        """Rigid motions R along the contact directions, (k m, r) [-]."""
        moved = np.einsum("mkc,mcr->mkr", self.data.contact_frame, self.modes[self.contact])
        return np.asarray(moved.reshape(self.data.contact_directions.size, self.modes.shape[2]))

    @property
    def balance(self) -> Array:
        """RᵀW along the contact directions, (r, k m)."""
        weight = np.repeat(self.mesh.weight[self.contact], self.data.contact_shape[1])
        return np.ascontiguousarray((self.contact_modes * weight[:, None]).T)

    def boundary(self, shares: Array, traction: Array, alpha: Array) -> tuple[Array, Array]:
        """Return displacement [length] and traction [stress] at all nodes, (n, d) each.

        `shares` (K,) are the weights of the load states, `traction` is t (m, k) and `alpha` α (r,).
        """
        unknowns = self.unknowns(shares, traction)[: self.operators.n_unknowns]
        u, t = self.operators.split(unknowns, shares, traction)
        return (u + self.modes @ alpha if alpha.size else u), t

    def residual(
        self, shares: Array, u: Array, traction: Array, sigma: Array, alpha: Array
    ) -> float:
        """Return the largest defect of the integral equations over the largest displacement [-].

        It uses exact entries at PROBED nodes. Hence it shows errors that no solver can see: a wrong
        or badly conditioned factorisation, or a compression that missed its tolerance.
        """
        rows = _probed(self.mesh.n_nodes)
        rigid = (
            np.zeros_like(u)
            if self.data.rigid is None
            else np.tensordot(shares, self.data.rigid, 1)
        )
        u = u - rigid
        held = u - self.modes @ alpha if alpha.size else u
        if self.data.volume is not None:
            u_p, t_p = np.tensordot(shares, self.data.volume[:2], (0, 1))
            held, traction = held - u_p, traction - t_p
        defect = self.operators.residual(rows, held, traction)
        if self.missed is not None:
            defect = defect + np.einsum("rja,ra->rj", self.missed[rows], held[rows])
        if alpha.size:
            defect = (
                defect
                + self.modes[rows] @ self.unknowns(shares, sigma)[self.operators.n_unknowns :]
            )
        if self.data.point.size:
            defect = defect - self.operators.point_displacement(
                rows, np.tensordot(shares, self.data.force, 1)
            )
        # u has no digits below the round-off of a rigid motion
        least = HALF * float(np.abs(rigid).max(initial=0.0))
        return float(np.abs(defect).max()) / (max(self.displaced(u, traction), least) or 1.0)

    def displaced(self, u: Array, traction: Array) -> float:
        """Return the largest displacement, or a thousandth of that by the mean traction if it is
        larger.

        If all nodes are held, u = 0 and the second value counts.

        Parameters
        ----------
        u, traction : (n, d) arrays
            Displacement [length] and traction [stress] at the nodes.
        """
        mean = float(self.mesh.weight @ np.abs(traction).max(axis=1)) / float(
            self.mesh.weight.sum()
        )
        # without a body's own displacement the mean traction gives the scale
        return max(float(np.abs(u).max(initial=0.0)), 1e-3 * mean / self.operators.traction_scale)


def _resultant(operators: BoundaryOperators, modes: Array) -> Array:
    """Return the work (K, r) of all loads on motions (n, d, r).

    It is 0 if it is no larger than round-off, of tractions that of numbers in files, or for volume
    loads than the error of quadrature.
    That error is estimated by the work of the normals, which is 0 on a closed boundary.
    """
    mesh, data = operators.mesh, operators.data
    if not modes.shape[2]:
        return np.zeros((data.states, 0))
    weight = mesh.weight[:, None]
    at_points = _modes_at(mesh, modes, data.point) if data.point.size else modes[:0]
    loads = [
        (data.known_traction * weight, modes, WRITTEN),
        (data.force * mesh.depth, at_points, ROUNDED),
    ]
    if data.volume is not None:
        # normals lie in the half section: no work on a rotation about the axis
        left, of_sizes = _works((weight * mesh.normal)[None], modes[:, : mesh.dim])
        error = float((np.abs(left) / np.where(of_sizes, of_sizes, 1.0)).max())
        loads.append(
            (-data.volume[2] * weight, modes, max(VOLUME, error if error < CLOSED else 0.0))
        )
    works, least = np.zeros((2, data.states, modes.shape[2]))
    for forces, motions, share in loads:
        work, size = _works(forces, motions)
        works, least = works + work, least + share * size
    return np.where(np.abs(works) > least, works, 0.0)


def _works(forces: Array, motions: Array) -> tuple[Array, Array]:
    """Return the work of forces (K, n, d) on motions (n, d, r), and that of their absolute values.

    Both are (K, r).
    """
    work, size = (
        np.einsum("kic,icr->kr", f, m)
        for f, m in ((forces, motions), (np.abs(forces), np.abs(motions)))
    )
    return np.asarray(work), np.asarray(size)


@functools.lru_cache(maxsize=16)
def _probed(n_nodes: int) -> Index:
    """Return the nodes at which the integral equations are checked, in increasing order."""
    chosen = np.random.default_rng(20190).choice(n_nodes, min(PROBED, n_nodes), replace=False)
    return np.sort(chosen)


def gauge(mesh: BoundaryMesh, data: BoundaryData, modes: Array) -> Array:
    """Return RᵀW over the size of the boundary, restricted to unknown displacements, (r, d n)."""
    weighted = (
        data.components(modes)
        * (mesh.weight / mesh.weight.sum())[:, None, None]
        * data.traction_known[:, :, None]
    )
    return np.ascontiguousarray(weighted.reshape(data.traction_known.size, modes.shape[2]).T)


def _modes_at(mesh: BoundaryMesh, modes: Array, point: Array) -> Array:
    """Return the rigid motions (f, d, r) at other points.

    They are affine functions, which their values at the nodes determine.
    """
    affine = np.column_stack([np.ones(mesh.n_nodes), mesh.x])
    coefficients = np.linalg.lstsq(affine, modes.reshape(mesh.n_nodes, -1), rcond=None)[0]
    return np.asarray(np.column_stack([np.ones(len(point)), point]) @ coefficients).reshape(
        len(point), *modes.shape[1:]
    )
