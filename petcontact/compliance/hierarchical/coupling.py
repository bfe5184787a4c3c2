"""The coupling of the unknowns of bodies by contact: displacements and tractions there follow from
the unknowns of a linearised law.

At each node of the secondaries v and σ satisfy a linear law with the orthonormal basis [V; W]:

    v = v_0 + V η,   σ = σ_0 + s W η.

With o the displacement that is opposite (of the primary's nodes and of free obstacles, along the
same directions) and the unknown y = η + Vᵀo in the place of the secondary's displacement,

    u = v_0 + (I - V Vᵀ) o + V y,   σ = σ_0 + s W (y - Vᵀo).

Where nodes stick u = o and y is the traction; where they are open y is u, and the bodies are
uncoupled.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import scipy

from ...arrays import Array, Index, marked, scattered
from ...errors import InputError
from ...record import record, replace
from ..body.eliminated import ElasticBody
from ..interface import ContactMaps, Interface
from .rows import BodyRows

Sparse: TypeAlias = scipy.sparse.csr_array
TWICE = (
    "bem.mat_type: compressed bodies in space can be secondary once at each place; let the "
    'other contact have this part as its primary, or choose "dense"'
)


@record
class Relation:
    """A linear law at M nodes.

    Attributes
    ----------
    v_0, sigma_0 : (M, k) arrays
        [length], [stress]
    of_v, of_sigma : (M, k, k) arrays
        V and W.
    """

    v_0: Array
    sigma_0: Array
    of_v: Array
    of_sigma: Array

    @classmethod
    def given_traction(cls, shape: tuple[int, int]) -> Relation:
        """Return the relation σ = 0 with v unknown."""
        eye = np.broadcast_to(np.eye(shape[1]), (*shape, shape[1]))
        return cls(np.zeros(shape), np.zeros(shape), eye, np.zeros_like(eye))

    @classmethod
    def normalised(
        cls, v_0: Array, sigma_0: Array, n_v: Array, n_sigma: Array, scale: Array
    ) -> Relation:
        """Return the relation v = v_0 + N_v y, σ = σ_0 + N_σ y; `scale` is s (M,)."""
        k = v_0.shape[1]
        both = np.concatenate([n_v, n_sigma / scale[:, None, None]], axis=1)
        size = np.sqrt(np.sum(both**2, axis=1, keepdims=True))
        both /= np.where(size > 0.0, size, 1.0)
        # bases that are alike: V + W as near the identity as can be, as it is where nodes stick or
        # are open
        slanted = np.abs(both[:, :k] + both[:, k:] - np.eye(k)).max(axis=(1, 2)) > 0.0
        basis = np.linalg.svd(both[slanted], full_matrices=False)[0]
        left, _, right = np.linalg.svd(basis[:, :k] + basis[:, k:])
        both[slanted] = basis @ (left @ right).transpose(0, 2, 1)
        return cls(v_0, sigma_0, both[:, :k], both[:, k:])

    def nearest(self, v: Array, scale: Array) -> Relation:
        """Return the same law with the v_0 nearest to some v (M, k), so that open gaps are no
        load."""
        eta = np.einsum("mji,mj->mi", self.of_v, v - self.v_0)
        sigma = scale[:, None] * np.einsum("mij,mj->mi", self.of_sigma, eta)
        return replace(
            self,
            v_0=self.v_0 + np.einsum("mij,mj->mi", self.of_v, eta),
            sigma_0=self.sigma_0 + sigma,
        )

    @property
    def basis(self) -> Array:
        """The basis [V; W], (M, 2k, k)."""
        return np.concatenate([self.of_v, self.of_sigma], axis=1)


@record
class ColumnExpansion:
    """The factors of all columns and the tractions in contact as functions of the unknowns.

    Attributes
    ----------
    relation : Relation
    factors : (columns, N + r) sparse array
        P: of N unknowns of the bodies, and r motions of obstacles.
    traction : (k M, N + r) sparse array
        [stress/length]
    """

    relation: Relation
    factors: Sparse
    traction: Sparse


class Coupling:
    """The unknowns of bodies that meet, and the expansion of a relation between them.

    Unknowns and columns are those of the first body, then those of the second, and so on.

    Attributes
    ----------
    size, columns : int
        Number of unknowns and of columns.
    first, first_column : (bodies + 1,) arrays
        First unknown and first column of each body.
    shape : (M, k)
    directions : (M, k, 3) array
        Directions of v and σ.
    scale : (M,) array
        s [stress/length].
    met : (q,) array
        Unknowns that stand for displacements in contact.
    secondary : (k M,) array
        The part of `met` at the nodes of the secondaries, node by node.
    leading : (n,) array
        Of these the components whose law has the unknowns of their node. Other laws of a node,
        with nothing opposite, are open, and follow.
    opposite : (k M, q) sparse array
        Matrix from all displacements in contact to -o, along the directions of the interfaces.

    Raises
    ------
    InputError
        If a node is a secondary twice, and both times something is opposite.
    """

    def __init__(
        self,
        bodies: Sequence[ElasticBody],
        rows: Sequence[BodyRows],
        interfaces: Sequence[Interface],
        maps: Sequence[ContactMaps],
    ) -> None:
        sizes = [body.components * len(body.x) for body in rows]
        self.first, self.first_column = (
            np.cumsum([0, *counts]) for counts in (sizes, [body.columns for body in rows])
        )
        self.size, self.columns = int(self.first[-1]), int(self.first_column[-1])
        self.met = np.concatenate(
            [offset + body.slot.ravel() for offset, body in zip(self.first, rows, strict=False)]
        )
        columns = zip(self.first_column, rows, strict=False)
        self._u, self._t = (
            np.concatenate(c)
            for c in zip(
                *(
                    (offset + body.slot.ravel(), offset + body.beside.ravel())
                    for offset, body in columns
                ),
                strict=True,
            )
        )
        frames = np.concatenate([body.data.contact_frame for body in bodies])
        directions = np.concatenate([frames[:0], *(face.directions for face in interfaces)])
        self.directions, (m, k) = directions, directions.shape[:2]
        self.shape = m, k
        node, self.leading = _secondary_nodes(bodies, rows, interfaces, k)
        self._place = (k * node[:, None] + np.arange(k)).ravel()
        self.secondary = self.met[self._place]
        turned = np.einsum("mad,mbd->mab", directions, frames[node])
        self._turn = blocks(turned)
        self._turn_back = blocks(turned.transpose(0, 2, 1))
        q = len(self.met)
        factors, numbers = np.arange(q), np.arange(k * m)
        self._pick = _selection(numbers, self._place, (k * m, q))
        moved, carried = _joined(maps)
        self.opposite = Sparse(moved - self._turn @ self._pick)
        self.opposite.data[np.abs(self.opposite.data) < 1e-14] = 0.0
        self.opposite.eliminate_zeros()
        self.seen, self._carried = Sparse(moved), Sparse(carried.T)
        # a primary's node may itself be another's secondary
        self._depth = len(interfaces) if np.isin(self.opposite.indices, self._place).any() else 0
        stress = np.concatenate([np.full(body.slot.size, body.scale) for body in rows])
        self._felt = Sparse(scipy.sparse.diags(1.0 / stress) @ self._carried)
        self.scale = _stiffness(rows, interfaces)
        self._own, self._primary = self._of_others()
        self._y = _selection(numbers, self.secondary, (k * m, self.size))
        self._to_u, self._to_t = (
            _selection(offset, factors, (self.columns, q)) for offset in (self._u, self._t)
        )
        self._to_secondary = Sparse(
            self._pick.T @ self._turn_back @ _selection(self.leading, self.leading, (k * m, k * m))
        )
        self._unknowns = np.concatenate(
            [offset + np.arange(n) for offset, n in zip(self.first_column, sizes, strict=False)]
        )

    def _of_others(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        """Return the selections of unknowns that belong to no secondary: of all, and of contact."""
        free = ~marked(self.secondary, self.size)
        others = np.flatnonzero(free)
        owner = np.searchsorted(self.first, others, side="right") - 1
        column = others - self.first[owner] + self.first_column[owner]
        kept = np.flatnonzero(free[self.met])
        return (
            _selection(column, others, (self.columns, self.size)),
            _selection(kept, self.met[kept], (len(self.met), self.size)),
        )

    def expansion(self, relation: Relation, motion: Array) -> ColumnExpansion:
        """Return the expansion P for free motions of obstacles (M, k, r)."""
        m, k = self.shape
        of_v = blocks(relation.of_v)
        of_sigma = blocks(relation.of_sigma * self.scale[:, None, None])
        moved = Sparse(motion.reshape(m * k, motion.shape[2]))
        u = _wider(self._primary, moved.shape[1])
        y = _wider(self._y, moved.shape[1])
        along = Sparse(of_v @ of_v.T)
        for _ in range(1 + self._depth):
            opposite = -(self.opposite @ u) - _behind(moved, self.size)
            own = of_v @ y + opposite - along @ opposite
            u = _wider(self._primary, moved.shape[1]) + self._to_secondary @ own
        traction = Sparse(of_sigma @ (y - of_v.T @ opposite))
        primary = _wider(self._own, moved.shape[1])
        factors = (
            primary + self._to_u @ (self._to_secondary @ own) - self._to_t @ (self._felt @ traction)
        )
        factors = Sparse(factors)
        factors.eliminate_zeros()
        return ColumnExpansion(relation, factors, traction)

    def known(self, relation: Relation, offset: Array) -> tuple[Array, Array]:
        """Return the factors of all columns and σ (k M,) for unknowns that are 0.

        v exceeds the displacements by `offset` (M, k).
        """
        u, opposite = np.zeros(len(self.met)), np.zeros(self.scale.size * self.shape[1])
        start = (relation.v_0 - offset).ravel()
        for _ in range(1 + self._depth):
            opposite = -(self.opposite @ u)
            u = self._to_secondary @ (
                start + opposite - self._by(relation.of_v, self._by(relation.of_v, opposite, True))
            )
        sigma = self.scale.repeat(self.shape[1]) * self._by(
            relation.of_sigma, self._by(relation.of_v, opposite, True)
        )
        sigma = relation.sigma_0.ravel() - sigma
        return self._to_u @ u - self._to_t @ (self._felt @ sigma), sigma

    def nearest(self, relation: Relation, v: Array, sigma: Array, opposite: Array) -> Array:
        """Return the y (k M,) of a relation that is nearest to v and σ (M, k), given o (k M,)."""
        left = (sigma - relation.sigma_0) / self.scale[:, None]
        eta = self._by(relation.of_v, (v - relation.v_0).ravel(), True) + self._by(
            relation.of_sigma, left.ravel(), True
        )
        return eta + self._by(relation.of_v, opposite, True)

    def uncoupled(self, z: Array) -> Array:
        """Return the unknowns (N, r) of displacements (N, r) in open contact.

        Those of secondaries are along the directions of the contact.
        """
        unknowns, rows = z.copy(), self.leading
        unknowns[self.secondary[rows]] = (self._turn @ (self._pick @ z[self.met]))[rows]
        return unknowns

    def tractions(self, sigma: Array) -> Array:
        """Return the factors of all columns on the right for the tractions σ (M, k) on all
        bodies."""
        return np.asarray(self._to_t @ (self._felt @ sigma.ravel()))

    def given(self, number: int, traction: Array) -> Array:
        """Return the factors of all columns on the right for tractions (m, k) on one body, over its
        scale."""
        first, last = self.first_column[number : number + 2]
        columns = self._t[(self._t >= first) & (self._t < last)]
        return scattered(traction.ravel(), columns, self.columns)

    def of_unknowns(self, factors: Sparse) -> Sparse:
        """Return the factors of the unknowns' columns, (N, ...), out of those of all columns,
        (columns, ...)."""
        return factors[self._unknowns]

    def padded(self, unknowns: Array) -> Array:
        """Return factors of all columns, (columns, r): those of the unknowns (N, r) and zeros."""
        return scattered(unknowns, self._unknowns, self.columns)

    def _by(self, matrices: Array, x: Array, transposed: bool = False) -> Array:
        """Return each node's matrix times its components."""
        return np.asarray(
            np.einsum("mji,mj->mi" if transposed else "mij,mj->mi", matrices, x.reshape(self.shape))
        ).ravel()


def blocks(matrices: Array) -> Sparse:
    """Return the block diagonal matrix of (m, k, k)."""
    m, k = matrices.shape[:2]
    rows = np.ascontiguousarray(matrices), np.arange(m), np.arange(m + 1)
    return Sparse(scipy.sparse.bsr_array(rows, shape=(k * m, k * m)))


def _wider(matrix: Sparse, more: int) -> Sparse:
    """Return the matrix with columns of zeros after its own."""
    shape = matrix.shape[0], matrix.shape[1] + more
    return Sparse((matrix.data, matrix.indices, matrix.indptr), shape=shape)


def _behind(matrix: Sparse, before: int) -> Sparse:
    """Return the matrix with columns of zeros before its own."""
    shape = matrix.shape[0], matrix.shape[1] + before
    return Sparse((matrix.data, matrix.indices + before, matrix.indptr), shape=shape)


def _joined(maps: Sequence[ContactMaps]) -> list[Sparse]:
    """Return the maps of displacements and of tractions of all bodies beside one another."""
    pairs = ((of_body.displacement, of_body.traction) for of_body in maps)
    return [scipy.sparse.hstack(parts).tocsr() for parts in zip(*pairs, strict=True)]


def _selection(rows: Index, columns: Index, shape: tuple[int, int]) -> Sparse:
    """Return the matrix with a 1 at each of these rows and columns."""
    return Sparse((np.ones(len(rows)), (rows, columns)), shape=shape)


def _secondary_nodes(
    bodies: Sequence[ElasticBody], rows: Sequence[BodyRows], interfaces: Sequence[Interface], k: int
) -> tuple[Index, Index]:
    """Return the numbers of the secondaries' nodes (M,) among the contact nodes of all bodies, and
    the components `leading` of one each: with something opposite, if there is any.

    Raises
    ------
    InputError
        If a node belongs to two secondaries with something opposite.
    """
    start = np.cumsum([0, *(body.slot.size for body in rows)]) // k
    numbers = [
        start[face.body] + np.searchsorted(bodies[face.body].contact, face.nodes)
        for face in interfaces
    ]
    node: Index = np.concatenate([start[:0], *numbers])
    met = np.isfinite(np.concatenate([np.zeros(0), *(face.gap for face in interfaces)]))
    order = np.lexsort((~met, node))
    leads = marked(order[np.unique(node[order], return_index=True)[1]], len(node))
    if np.any(met & ~leads):
        raise InputError(TWICE)
    return node, np.flatnonzero(np.repeat(leads, k))


def _stiffness(rows: Sequence[BodyRows], interfaces: Sequence[Interface]) -> Array:
    """Return the unit of tractions at the secondaries' nodes (M,): that of the softer body
    [stress/length]."""
    softness = [
        sum(1.0 / rows[b].scale for b in (face.body, face.primary) if b is not None)
        for face in interfaces
    ]
    return np.asarray(1.0 / np.repeat(softness, [len(face.nodes) for face in interfaces]))
