"""Bodies and rigid obstacles composed on the nodes of all contact interfaces: v = v_0 + S σ + M α, E σ + f = 0.

σ = (σ_t, σ_n) at the secondary's nodes is the traction σ_t τ + σ_n n on the secondary; the primary carries -J times it.
v = (w, v_n) is the relative displacement, w = τ·(u_A - u_B) and v_n = n·(u_A - u_B) minus the initial gap. τ are d-1
tangents a node. Of a rigid obstacle S = 0; its displacement opposite a node is taken at the node.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ..arrays import Array, Index
from ..contact.system import Modes
from ..geometry.rotation import rigid_motions
from ..mesh.curve_mesh import CurveMesh, as_curve
from .body.base import BodyCompliance
from .layer.kernel import Strip, body_thickness, strips
from .layer.operator import LayerOperator
from .reduced import ComposedSystem, ProductSystem, ReducedSystem


@dataclass(frozen=True)
class Interface:
    """Where one part of a body meets a part of another body, an obstacle, or fixed rigid ground.

    Attributes
    ----------
    name : str
    body : int
        Of the secondary.
    nodes : (m,) array
        Of its mesh.
    normal : (m, d) array
        n, from the secondary to the primary.
    tangent : (m, d-1, d) array
        τ, orthonormal and normal to n.
    gap : (m,) array
        Initial gap, infinite where nothing is faced [length].
    primary : int, optional
        Number of the body of the primary.
    primary_nodes : (k,) array, optional
    values : (m, k) sparse array, optional
        Values at the primary's nodes to values at the points that are faced.
    loads : (k, m) sparse array, optional
        Traction at the secondary's nodes to J times it at the primary's.
    obstacle : int, optional
        Number of the obstacle; with neither a body nor an obstacle the primary is fixed.
    """

    name: str
    body: int
    nodes: Index
    normal: Array
    tangent: Array
    gap: Array
    primary: int | None = None
    primary_nodes: Index | None = None
    values: scipy.sparse.csr_array | None = None
    loads: scipy.sparse.csr_array | None = None
    obstacle: int | None = None

    @property
    def frame(self) -> scipy.sparse.csr_array:
        """(d m, d m): cartesian components of vectors to (τ, n) components, node after node."""
        m, d = self.normal.shape
        rows = np.repeat(np.arange(d * m), d)
        columns = np.repeat(d * np.arange(m), d * d) + np.tile(np.arange(d), d * m)
        entries = np.concatenate([self.tangent, self.normal[:, None]], axis=1).ravel()
        return scipy.sparse.csr_array((entries, (rows, columns)), shape=(d * m, d * m))


class BodiesSystem:
    """The contact problem of all interfaces.

    Attributes
    ----------
    interfaces : list of Interface
    bodies : list of BodyCompliance
    slices : list of slices
        The nodes of each interface among all M.
    dim : int
        d.
    weight : (M,) array
        Node weights of the secondaries [length, in space area].
    gap : (M,) array
    compliance : (d M, d M) array or None
        S, component c of node i being d i + c, tangential first; None where that of a body is known by its products only.
    base : (K, d M) array
        v in each load state without contact tractions and gap.
    modes, balance : (d M, r), (r, d M) arrays
        M and E of the free motions of all bodies.
    resultant : (K, r) array
        f of the bodies in each load state.
    obstacle_modes : list of (d M, d(d+1)/2) arrays
        v for unit displacements along the axes and unit rotations of each obstacle; E is their transpose, weighted.
    """

    def __init__(
        self, bodies: Sequence[BodyCompliance], interfaces: Sequence[Interface], x: Sequence[Array], centres: Sequence[Array]
    ) -> None:
        self.bodies, self.interfaces = list(bodies), list(interfaces)
        self.dim = d = bodies[0].mesh.dim
        ends = np.cumsum([0, *(len(i.nodes) for i in interfaces)])
        self.slices = [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]
        m, states = int(ends[-1]), len(bodies[0].u_0)
        self.weight = np.concatenate([bodies[i.body].mesh.weight[i.nodes] for i in interfaces])
        self.gap = np.concatenate([i.gap for i in interfaces])
        formed = all(body.compliance is not None for body in bodies)
        self.compliance = np.zeros((d * m, d * m)) if formed else None
        self.base = np.zeros((states, d * m))
        self._seen: list[scipy.sparse.csr_array] = []
        self._spread: list[scipy.sparse.csr_array] = []
        self._x, self._layer = np.concatenate(x), list[LayerOperator]()
        modes, balance, resultant = [], [], []
        for number, body in enumerate(self.bodies):
            seen, spread = self._maps(number, body, m)
            self._seen.append(seen)
            self._spread.append(spread)
            if self.compliance is not None and body.compliance is not None:
                self.compliance += seen @ (spread.T @ body.compliance.T).T
            self.base += (seen @ body.u_0.reshape(states, -1).T).T
            modes.append(seen @ body.modes[body.contact].reshape(d * len(body.contact), -1))
            balance.append((spread.T @ body.balance.T).T)
            resultant.append(body.resultant)
        self.modes, self.balance = np.concatenate(modes, axis=1), np.concatenate(balance)
        self.resultant = np.concatenate(resultant, axis=1)
        self.obstacle_modes = [self._obstacle_modes(k, centre, x, m) for k, centre in enumerate(centres)]

    def _maps(self, number: int, body: BodyCompliance, m: int) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        """Displacement of a body's contact nodes to v (d M, d m_c), and σ to tractions there (d m_c, d M)."""
        count, d = len(body.contact), self.dim
        each = scipy.sparse.identity(d, format="csr")
        seen = scipy.sparse.csr_array((d * m, d * count))
        spread = scipy.sparse.csr_array((d * count, d * m))
        for where, face in zip(self.slices, self.interfaces, strict=True):
            size = len(face.nodes)
            place = scipy.sparse.csr_array(
                (np.ones(d * size), (d * where.start + np.arange(d * size), np.arange(d * size))), shape=(d * m, d * size)
            )
            if face.body == number:
                own = _pick(body.contact, face.nodes, d)
                seen = seen + place @ face.frame @ own
                spread = spread + own.T @ face.frame.T @ place.T
            if face.primary == number:
                assert face.values is not None and face.loads is not None and face.primary_nodes is not None
                other = _pick(body.contact, face.primary_nodes, d)
                seen = seen - place @ face.frame @ scipy.sparse.csr_array(scipy.sparse.kron(face.values, each)) @ other
                loads = scipy.sparse.csr_array(scipy.sparse.kron(face.loads, each))
                spread = spread - other.T @ loads @ face.frame.T @ place.T
        return scipy.sparse.csr_array(seen), scipy.sparse.csr_array(spread)

    def _obstacle_modes(self, number: int, centre: Array, x: Sequence[Array], m: int) -> Array:
        d = self.dim
        result = np.zeros((m, d, d * (d + 1) // 2))
        for where, face, points in zip(self.slices, self.interfaces, x, strict=True):
            if face.obstacle == number:
                motion = rigid_motions(points - centre)
                result[where, :-1] = -np.einsum("mtc,mck->mtk", face.tangent, motion)
                result[where, -1] = -np.einsum("mc,mck->mk", face.normal, motion)
        return result.reshape(d * m, -1)

    def reduced(self, u_0: Array, modes: Modes) -> ComposedSystem:
        """The contact system with this v for σ = 0, (M, d)."""
        if self.compliance is not None:
            return ReducedSystem(u_0, self.compliance, self.weight, modes, self.surrogate)
        return ProductSystem(u_0, self.apply, self.weight, modes, self.surrogate)

    def apply(self, sigma: Array) -> Array:
        """S σ, (M, d), body by body. Collective."""
        flat, result = sigma.ravel(), np.zeros(sigma.size)
        for body, seen, spread in zip(self.bodies, self._seen, self._spread, strict=True):
            result += seen @ body.apply(spread @ flat)
        return result.reshape(sigma.shape)

    def surrogate(self) -> LayerOperator | None:
        """T in all directions, unscaled: on each interface the layers of both bodies; none on surfaces."""
        if not all(isinstance(body.mesh, CurveMesh) for body in self.bodies):
            return None
        if not self._layer:
            self._layer.append(LayerOperator(self._strips(), self.weight, self._x))
        return copy.copy(self._layer[0])

    def _strips(self) -> list[Strip]:
        found: list[Strip] = []
        for where, face in zip(self.slices, self.interfaces, strict=True):
            others: tuple[tuple[float, float], ...] = ()
            if face.primary is not None and face.primary_nodes is not None:
                other = self.bodies[face.primary].operators
                thickness = body_thickness(as_curve(other.mesh), face.primary_nodes)
                others = ((other.kernel.half_space_compliance, thickness),)
            directions = np.concatenate([face.tangent, face.normal[:, None]], axis=1)
            mine = strips(self.bodies[face.body].operators, face.nodes, directions, others)
            found += [replace(strip, nodes=strip.nodes + where.start) for strip in mine]
        return found

    def weighted(self, modes: Array) -> Array:
        """E = MᵀW of an obstacle: the resultant of the tractions that it feels, (d(d+1)/2, d M)."""
        return np.ascontiguousarray((modes * np.repeat(self.weight, self.dim)[:, None]).T)

    def tractions(self, number: int, sigma: Array) -> Array:
        """Traction vectors (m_c, d) at the contact nodes of a body for σ (M, d)."""
        return np.asarray(self._spread[number] @ sigma.ravel()).reshape(-1, self.dim)

    def motion(self, number: int, alpha: Array) -> Array:
        """The part of α (r,) that belongs to one body."""
        ends = np.cumsum([0, *(body.modes.shape[2] for body in self.bodies)])
        return alpha[ends[number] : ends[number + 1]]


def _pick(contact: Index, nodes: Index, d: int) -> scipy.sparse.csr_array:
    """(d len(nodes), d len(contact)): vectors at all contact nodes of a body to those at some of them."""
    place = np.searchsorted(contact, nodes)
    columns = (d * place[:, None] + np.arange(d)).ravel()
    rows = np.arange(d * len(nodes))
    return scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(len(rows), d * len(contact)))
