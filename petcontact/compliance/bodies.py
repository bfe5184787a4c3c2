"""Bodies and rigid obstacles composed on the nodes of all contact interfaces: v = v_0 + S σ + M α, E σ + f = 0.

σ = (σ_t, σ_n) at the secondary's nodes is the traction σ_t τ + σ_n n on the secondary; the primary carries -J times it.
v = (w, v_n) is the relative displacement, w = τ·(u_A - u_B) and v_n = n·(u_A - u_B) minus the initial gap. τ is n turned by
+90°. Of a rigid obstacle S = 0; its displacement opposite a node is taken at the node.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ..arrays import Array, Index
from .body.base import BodyCompliance


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
    normal : (m, 2) array
        n, from the secondary to the primary.
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
    gap: Array
    primary: int | None = None
    primary_nodes: Index | None = None
    values: scipy.sparse.csr_array | None = None
    loads: scipy.sparse.csr_array | None = None
    obstacle: int | None = None

    @property
    def tangent(self) -> Array:
        """τ, (m, 2)."""
        return np.column_stack([-self.normal[:, 1], self.normal[:, 0]])

    @property
    def frame(self) -> scipy.sparse.csr_array:
        """(2m, 2m): components x, y of vectors to (τ, n) components, node after node."""
        m = len(self.nodes)
        rows = np.repeat(np.arange(2 * m), 2)
        columns = np.repeat(2 * np.arange(m), 4) + np.tile([0, 1], 2 * m)
        entries = np.stack([self.tangent, self.normal], axis=1).ravel()
        return scipy.sparse.csr_array((entries, (rows, columns)), shape=(2 * m, 2 * m))


class BodiesSystem:
    """The contact problem of all interfaces.

    Attributes
    ----------
    interfaces : list of Interface
    bodies : list of BodyCompliance
    slices : list of slices
        The nodes of each interface among all M.
    weight : (M,) array
        Node weights of the secondaries [length].
    gap : (M,) array
    compliance : (2M, 2M) array
        S, component c of node i being 2i + c, tangential first.
    base : (K, 2M) array
        v in each load state without contact tractions and gap.
    modes, balance : (2M, r), (r, 2M) arrays
        M and E of the free motions of all bodies.
    resultant : (K, r) array
        f of the bodies in each load state.
    obstacle_modes : list of (2M, 3) arrays
        v for unit displacements along x and y and a unit rotation of each obstacle; E is their transpose, weighted.
    """

    def __init__(
        self, bodies: Sequence[BodyCompliance], interfaces: Sequence[Interface], x: Sequence[Array], centres: Sequence[Array]
    ) -> None:
        self.bodies, self.interfaces = list(bodies), list(interfaces)
        ends = np.cumsum([0, *(len(i.nodes) for i in interfaces)])
        self.slices = [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]
        m, states = int(ends[-1]), len(bodies[0].u_0)
        self.weight = np.concatenate([bodies[i.body].mesh.weight[i.nodes] for i in interfaces])
        self.gap = np.concatenate([i.gap for i in interfaces])
        self.compliance = np.zeros((2 * m, 2 * m))
        self.base = np.zeros((states, 2 * m))
        self._spread: list[scipy.sparse.csr_array] = []
        modes, balance, resultant = [], [], []
        for number, body in enumerate(self.bodies):
            seen, spread = self._maps(number, body, m)
            self._spread.append(spread)
            assert body.compliance is not None
            self.compliance += seen @ (spread.T @ body.compliance.T).T
            self.base += (seen @ body.u_0.reshape(states, -1).T).T
            modes.append(seen @ body.modes[body.contact].reshape(2 * len(body.contact), -1))
            balance.append((spread.T @ body.balance.T).T)
            resultant.append(body.resultant)
        self.modes, self.balance = np.concatenate(modes, axis=1), np.concatenate(balance)
        self.resultant = np.concatenate(resultant, axis=1)
        self.obstacle_modes = [self._obstacle_modes(k, centre, x, m) for k, centre in enumerate(centres)]

    def _maps(self, number: int, body: BodyCompliance, m: int) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        """Displacement of a body's contact nodes to v (2M, 2m_c), and σ to tractions there (2m_c, 2M)."""
        count = len(body.contact)
        seen = scipy.sparse.csr_array((2 * m, 2 * count))
        spread = scipy.sparse.csr_array((2 * count, 2 * m))
        for where, face in zip(self.slices, self.interfaces, strict=True):
            size = len(face.nodes)
            place = scipy.sparse.csr_array(
                (np.ones(2 * size), (2 * where.start + np.arange(2 * size), np.arange(2 * size))), shape=(2 * m, 2 * size)
            )
            if face.body == number:
                own = _pick(body.contact, face.nodes, count)
                seen = seen + place @ face.frame @ own
                spread = spread + own.T @ face.frame.T @ place.T
            if face.primary == number:
                assert face.values is not None and face.loads is not None and face.primary_nodes is not None
                other = _pick(body.contact, face.primary_nodes, count)
                two = scipy.sparse.identity(2, format="csr")
                seen = seen - place @ face.frame @ scipy.sparse.csr_array(scipy.sparse.kron(face.values, two)) @ other
                loads = scipy.sparse.csr_array(scipy.sparse.kron(face.loads, two))
                spread = spread - other.T @ loads @ face.frame.T @ place.T
        return scipy.sparse.csr_array(seen), scipy.sparse.csr_array(spread)

    def _obstacle_modes(self, number: int, centre: Array, x: Sequence[Array], m: int) -> Array:
        result = np.zeros((m, 2, 3))
        for where, face, points in zip(self.slices, self.interfaces, x, strict=True):
            if face.obstacle != number:
                continue
            away = points - centre
            motion = np.zeros((len(points), 2, 3))
            motion[:, 0, 0] = motion[:, 1, 1] = 1.0
            motion[:, :, 2] = np.column_stack([-away[:, 1], away[:, 0]])
            result[where, 0] = -np.einsum("mc,mck->mk", face.tangent, motion)
            result[where, 1] = -np.einsum("mc,mck->mk", face.normal, motion)
        return result.reshape(2 * m, 3)

    def weighted(self, modes: Array) -> Array:
        """E = MᵀW of an obstacle: the resultant of the tractions that it feels, (3, 2M)."""
        return np.ascontiguousarray((modes * np.repeat(self.weight, 2)[:, None]).T)

    def tractions(self, number: int, sigma: Array) -> Array:
        """Traction vectors (m_c, 2) at the contact nodes of a body for σ (M, 2)."""
        return np.asarray(self._spread[number] @ sigma.ravel()).reshape(-1, 2)

    def motion(self, number: int, alpha: Array) -> Array:
        """The part of α (r,) that belongs to one body."""
        ends = np.cumsum([0, *(body.modes.shape[2] for body in self.bodies)])
        return alpha[ends[number] : ends[number + 1]]


def _pick(contact: Index, nodes: Index, count: int) -> scipy.sparse.csr_array:
    """(2 len(nodes), 2 count): vectors at all contact nodes of a body to those at some of them."""
    place = np.searchsorted(contact, nodes)
    columns = (2 * place[:, None] + np.arange(2)).ravel()
    rows = np.arange(2 * len(nodes))
    return scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(2 * len(nodes), 2 * count))
