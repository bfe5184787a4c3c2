"""A body whatever its operators are stored as: known data in several load states, rigid motions, and what follows from S."""

from __future__ import annotations

import abc
import functools
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index, Mask
from ...bem.boundary_data import BoundaryData
from ...bem.column_blocks import RightHandSides
from ...bem.kernels import kernel_for
from ...bem.operators import BoundaryOperators
from ...geometry.rotation import rigid_motions
from ...mesh.boundary_mesh import BoundaryMesh
from ...model.problem import Material

PROBED = 24
"""Nodes at which the integral equations are checked."""
PROBE_SEED = 20190


@dataclass(frozen=True)
class Loading:
    """Known data of one body in some load states.

    Attributes
    ----------
    traction_known : (n, d) bool array
        Components along the axes whose traction is known; of contact nodes all, their own being zero here.
    value : (K, n, d) array
        Known displacement [length] or traction [stress] in K load states.
    point : (f, d) array
        Points at which forces act [length].
    force : (K, f, d) array
        [force/length, in space force]
    """

    traction_known: Mask
    value: Array
    point: Array
    force: Array


@dataclass(frozen=True)
class BodyOperators(BoundaryOperators):
    """Operators with free tractions in all directions at contact nodes, and loads in several states.

    Attributes
    ----------
    loading : Loading
    """

    loading: Loading

    @classmethod
    def of(cls, mesh: BoundaryMesh, material: Material, loading: Loading, contact: Index) -> BodyOperators:
        """Those of a body with such loads and contact nodes (m,)."""
        n, d = mesh.x.shape
        data = BoundaryData(
            np.broadcast_to(np.eye(d), (n, d, d)), loading.traction_known, np.zeros((n, d)), contact,
            np.broadcast_to(np.arange(d), (len(contact), d)), np.zeros(len(contact)),
        )  # fmt: skip
        return cls(mesh, data, kernel_for(mesh, material), loading)

    @functools.cached_property
    def right_hand_sides(self) -> RightHandSides:
        """A column for each component of contact nodes, and of others that are loaded in any state."""
        node, component = np.nonzero(self._wanted)
        unit, known = np.eye(self.kernel.dim)[component], self.loading.traction_known[node, component, None]
        return RightHandSides(node, np.where(known, unit, 0.0), np.where(known, 0.0, unit), self.mesh.n_nodes)

    @functools.cached_property
    def amplitudes(self) -> Array:
        """Right-hand sides to the load of each state, (q, K)."""
        known = self.loading.traction_known
        values = np.where(known, self.loading.value / self.traction_scale, self.loading.value)
        return np.ascontiguousarray(values[:, self._wanted].T)

    @functools.cached_property
    def point_loads(self) -> Array:
        """What point forces add to the load of each state, (d n, K)."""
        mesh, loads = self.mesh, np.zeros((self.n_unknowns, len(self.loading.value)))
        if self.loading.point.size:
            for state, force in enumerate(self.loading.force):
                loads[:, state] = self.point_displacement(np.arange(mesh.n_nodes), force).ravel()
        return loads

    def point_displacement(self, nodes: Index, force: Array) -> Array:
        """Displacement (len(nodes), d) of the infinite plane or space at some nodes by forces (f, d) at the points."""
        return self.kernel.point_displacement(self.mesh.x[nodes], self.loading.point, force)

    @functools.cached_property
    def _wanted(self) -> Mask:
        wanted = np.any(self.loading.value != 0.0, axis=0)
        wanted[self.data.contact_nodes] = True
        return np.asarray(wanted)


class BodyCompliance(abc.ABC):
    """A body, eliminated.

    Attributes
    ----------
    operators : BodyOperators
    contact : (m,) array
        Numbers of the nodes that carry free tractions.
    u_0 : (K, m, d) array
        Displacement there for each load state without contact tractions [length].
    compliance : (d m, d m) array or None
        S, component c of node i being d i + c [length/stress]; None where it is known by its products only.
    modes : (n, d, r) array
        R: rigid motions that no known displacement holds [-].
    resultant : (K, r) array
        RᵀWt̂ + Rᵀ(point forces): F.
    digits_lost : float
        Relative error of the elimination for a solution that is known; nan where that is not measured [-].
    """

    u_0: Array
    compliance: Array | None
    digits_lost: float = np.nan

    def __init__(self, operators: BodyOperators, modes: Array) -> None:
        self.operators, self.modes = operators, modes
        self.mesh, self.loading, self.contact = operators.mesh, operators.loading, operators.data.contact_nodes
        loading = self.loading
        known = np.where(loading.traction_known, loading.value, 0.0) * self.mesh.weight[:, None]
        self.resultant = np.einsum("kic,icr->kr", known, modes)
        if loading.point.size:
            self.resultant += np.einsum("kfc,fcr->kr", loading.force, _modes_at(self.mesh, modes, loading.point))

    @abc.abstractmethod
    def apply(self, traction: Array) -> Array:
        """S t for tractions (d m,), or for several (d m, s). Collective."""

    @abc.abstractmethod
    def unknowns(self, shares: Array, traction: Array) -> Array:
        """The unknowns of the operators and β, (d n + r,), for load states weighted by `shares` (K,) and t_c (m, d).
        Collective."""

    @abc.abstractmethod
    def describe(self) -> str:
        """How the operators are stored."""

    @property
    def balance(self) -> Array:
        """RᵀW at the contact nodes, (r, d m)."""
        weighted = self.modes[self.contact] * self.mesh.weight[self.contact, None, None]
        return np.ascontiguousarray(weighted.reshape(self.mesh.dim * len(self.contact), self.modes.shape[2]).T)

    def boundary(self, shares: Array, traction: Array, alpha: Array) -> tuple[Array, Array]:
        """Displacement and traction (n, d) for load states weighted by `shares` (K,), t_c (m, d) and α (r,)."""
        unknowns = self.unknowns(shares, traction)[: self.operators.n_unknowns].reshape(self.mesh.x.shape)
        known, value = self.loading.traction_known, np.tensordot(shares, self.loading.value, 1)
        u = np.where(known, unknowns, value) + self.modes @ alpha
        t = np.where(known, value, unknowns * self.operators.traction_scale)
        t[self.contact] = traction
        return u, t

    def residual(self, shares: Array, u: Array, traction: Array, alpha: Array) -> float:
        """Largest defect of the integral equations at some nodes, from exact entries, over the largest displacement."""
        count = min(PROBED, self.mesh.n_nodes)
        rows = np.sort(np.random.default_rng(PROBE_SEED).choice(self.mesh.n_nodes, count, replace=False))
        multipliers = self.unknowns(shares, traction[self.contact])[self.operators.n_unknowns :]
        defect = self.operators.residual(rows, u - self.modes @ alpha, traction) + self.modes[rows] @ multipliers
        if self.loading.point.size:
            defect -= self.operators.point_displacement(rows, np.tensordot(shares, self.loading.force, 1))
        size = float(np.abs(u).max(initial=0.0))
        return float(np.abs(defect).max()) / size if size > 0.0 else float(np.abs(defect).max())


def free_motions(mesh: BoundaryMesh, traction_known: Mask, infinite: bool) -> Array:
    """Rigid motions (n, d, r) that change no known displacement; of an infinite body there are none."""
    n, d = mesh.x.shape
    if infinite:
        return np.zeros((n, d, 0))
    away = mesh.x - mesh.weight @ mesh.x / mesh.weight.sum()
    away /= np.abs(away).max()
    all_ = rigid_motions(away)
    seen = all_[~traction_known]
    if len(seen) == 0:
        return all_
    values, vectors = np.linalg.eigh(seen.T @ seen / len(seen))
    # translations along the axes stay what they are where they are free
    free = vectors[:, values < 1e-12]
    basis = free @ np.linalg.qr(free.T)[0] if free.shape[1] else free
    return np.asarray(all_ @ np.where(np.abs(basis) < 1e-12, 0.0, basis))


def gauge(mesh: BoundaryMesh, traction_known: Mask, modes: Array) -> Array:
    """RᵀW over the length of the boundary, on the unknown displacements, (r, d n)."""
    weighted = modes * (mesh.weight / mesh.weight.sum())[:, None, None] * traction_known[:, :, None]
    return np.ascontiguousarray(weighted.reshape(traction_known.size, modes.shape[2]).T)


def _modes_at(mesh: BoundaryMesh, modes: Array, point: Array) -> Array:
    """The rigid motions (f, d, r) at other points: affine functions are told by their values at the nodes."""
    affine = np.column_stack([np.ones(mesh.n_nodes), mesh.x])
    coefficients = np.linalg.lstsq(affine, modes.reshape(mesh.n_nodes, -1), rcond=None)[0]
    return np.asarray(np.column_stack([np.ones(len(point)), point]) @ coefficients).reshape(*point.shape, -1)
