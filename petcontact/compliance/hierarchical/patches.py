"""The nodes that the preconditioner takes together: patches on both sides of a contact, and coarse
groups."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy

from ...arrays import Array, Index
from ...compression.hmatrix.schwarz import Subdomain
from ...round_off import TINY
from .coupling import Coupling
from .rows import BodyRows

OWN = 64
"""Largest number of nodes of a cluster."""
MARGIN = 0.3
"""Margin of a patch on each side, over half the extent of its cluster [-]."""
CROWDED = 150
"""Largest number of nodes of a cluster with its margin; the nearest ones are taken."""


class Nodes:
    """The nodes of all bodies in one row, and the pairs of them that face one another.

    Attributes
    ----------
    first : (bodies + 1,) array
        First node of each body.
    leader : (n,) array
        For a node of a primary, the node of the secondary that it faces most; else the node itself.
    """

    def __init__(self, rows: Sequence[BodyRows], coupling: Coupling) -> None:
        self.rows, self._coupling = rows, coupling
        self.first = np.cumsum([0, *(len(body.x) for body in rows)])
        n, (m, k) = int(self.first[-1]), coupling.shape
        met, secondary = self.nodes_of(coupling.met), self.nodes_of(coupling.secondary[::k])
        # how much each secondary's node sees of each primary's node
        pair = abs(coupling.opposite).tocoo()
        faced = scipy.sparse.csr_array(
            scipy.sparse.coo_array((pair.data, (pair.row // k, met[pair.col])), shape=(m, n))
        )
        faced.sum_duplicates()
        seen, self.leader = faced.tocsc(), np.arange(n)
        for node in np.flatnonzero(np.diff(seen.indptr)).tolist():
            entries = slice(seen.indptr[node], seen.indptr[node + 1])
            self.leader[node] = secondary[seen.indices[entries][np.argmax(seen.data[entries])]]
        self.leader[secondary] = secondary
        most = np.maximum(faced.max(axis=1).toarray().ravel(), TINY) if m else np.ones(0)
        near = scipy.sparse.coo_array(
            scipy.sparse.csr_array(scipy.sparse.diags(1.0 / most) @ faced)
        )
        # a primary's node comes along with a secondary's that faces it to a twentieth at least
        keep = near.data >= 0.05
        first, second = secondary[near.row[keep]], near.col[keep]
        both = np.concatenate([first, second]), np.concatenate([second, first])
        self._partner = scipy.sparse.csr_array((np.ones(len(both[0])), both), shape=(n, n))
        self.is_met = np.zeros(n, dtype=bool)
        self.is_met[met] = True
        self._search = [scipy.spatial.cKDTree(body.x) for body in rows]

    def nodes_of(self, unknowns: Index) -> Index:
        """Return the nodes of patches of unknowns."""
        body = np.searchsorted(self._coupling.first, unknowns, side="right") - 1
        components = np.array([rows.components for rows in self.rows])[body]
        return np.asarray(self.first[body] + (unknowns - self._coupling.first[body]) // components)

    def unknowns(self, body: int, nodes: Index) -> Index:
        """Return the unknowns of some nodes of a body; nodes are numbered within the body."""
        components = self.rows[body].components
        return np.asarray(
            self._coupling.first[body]
            + (components * nodes[:, None] + np.arange(components)).ravel()
        )

    def patches(self) -> Iterator[Subdomain]:
        """Yield one patch a cluster.

        It has the nodes of the cluster, those that face them, a margin around both, and the nodes
        that face the margin.
        """
        led = [np.empty(0, dtype=np.int64)] * int(self.first[-1])
        follower = np.flatnonzero(self.leader != np.arange(len(self.leader)))
        order = follower[np.argsort(self.leader[follower], kind="stable")]
        for group in np.split(order, np.flatnonzero(np.diff(self.leader[order])) + 1):
            if len(group):
                led[self.leader[group[0]]] = group
        for b, body in enumerate(self.rows):
            for cluster in body.tree.cut(OWN).tolist():
                inside = (
                    np.arange(body.tree.first[cluster], body.tree.last[cluster]) + self.first[b]
                )
                leaders = inside[self.leader[inside] == inside]
                if len(leaders):
                    yield self._patch(np.concatenate([leaders, *(led[node] for node in leaders)]))

    def _patch(self, own: Index) -> Subdomain:
        taken = [self._around(b, own) for b in range(len(self.rows))]
        whole = np.concatenate(taken)
        met = whole[self.is_met[whole]]
        partners = np.unique(self._partner[met].indices) if len(met) else met
        nodes, unknowns, kept = list[Index](), list[Index](), list[Index]()
        for b, inside in enumerate(taken):
            there = partners[(partners >= self.first[b]) & (partners < self.first[b + 1])]
            of_body = np.union1d(inside, there) - self.first[b]
            nodes.append(of_body)
            unknowns.append(self.unknowns(b, of_body))
            kept.append(np.repeat(np.isin(of_body + self.first[b], own), self.rows[b].components))
        return Subdomain(
            nodes, np.concatenate(unknowns), np.flatnonzero(np.concatenate(kept)), bool(len(met))
        )

    def _around(self, b: int, own: Index) -> Index:
        """Return the nodes of body b in `own`, and the nearest other nodes of that body."""
        keep: Index = own[(own >= self.first[b]) & (own < self.first[b + 1])]
        if not len(keep):
            return keep
        x: Array = self.rows[b].x
        low, high = x[keep - self.first[b]].min(axis=0), x[keep - self.first[b]].max(axis=0)
        # flat clusters get a margin off their plane, too
        middle = 0.5 * (low + high)
        half = np.maximum((0.5 + 0.5 * MARGIN) * (high - low), 0.5 * MARGIN * (high - low).max())
        inside = np.array(
            self._search[b].query_ball_point(middle, float(half.max()) + TINY, p=np.inf),
            dtype=np.int64,
        )
        inside = inside[np.all(np.abs(x[inside] - middle) <= half * (1.0 + 1e-12), axis=1)]
        others = np.setdiff1d(inside, keep - self.first[b])
        if len(others) + len(keep) > CROWDED:
            gap = np.maximum(np.abs(x[others] - middle) - 0.5 * (high - low), 0.0).max(axis=1)
            others = others[np.argsort(gap, kind="stable")[: max(0, CROWDED - len(keep))]]
        return np.asarray(np.union1d(keep, others + self.first[b]), dtype=np.int64)

    def groups(self) -> tuple[Index, Index]:
        """Return the coarse group of each unknown, and of each column or -1.

        Tractions in contact have groups of their own, as many as unknowns. Nodes that face one
        another have the same group, else the coarse level couples the wrong nodes. A group holds
        nodes with nearly the same directions of components only: else sums over it cancel, and the
        coarse level is singular.
        """
        n = int(self.first[-1])
        # about 900 unknowns of the coarse level, whose LU every rank has
        most = max(OWN, OWN * int(np.ceil(3 * n / OWN / 900)))
        key = np.column_stack([np.empty((n, 3), dtype=np.int64), self._directions()])
        for b, body in enumerate(self.rows):
            node_slice, cut = slice(self.first[b], self.first[b + 1]), body.tree.cut(most)
            key[node_slice, 0] = b
            key[node_slice, 1] = np.repeat(
                np.arange(len(cut)), body.tree.last[cut] - body.tree.first[cut]
            )
            key[node_slice, 2] = body.part
        number = np.unique(key, axis=0, return_inverse=True)[1].ravel()
        led = self.leader != np.arange(n)
        key[led, 1], key[led, 2] = number[self.leader[led]], -1
        number = np.unique(key, axis=0, return_inverse=True)[1].ravel()
        of_unknowns = [
            3 * np.repeat(number[self.first[b] : self.first[b + 1]], body.components)
            + np.tile(np.arange(body.components), len(body.x))
            for b, body in enumerate(self.rows)
        ]
        group = np.unique(np.concatenate(of_unknowns), return_inverse=True)[1].ravel()
        count, columns = int(group.max()) + 1, np.full(self._coupling.columns, -1)
        for b, body in enumerate(self.rows):
            own_groups = group[self._coupling.first[b] : self._coupling.first[b + 1]]
            first_column = self._coupling.first_column[b]
            columns[first_column : first_column + len(own_groups)] = own_groups
            columns[first_column + body.beside] = count + own_groups[body.slot]
        return group, columns

    def _directions(self) -> Index:
        """Return the rounded directions of the components of each node."""
        first = self._coupling.first
        frames = np.concatenate([body.frame.reshape(-1, 3) for body in self.rows])
        rows = self._coupling.leading
        directions = self._coupling.directions.reshape(-1, 3)
        frames[self._coupling.secondary[rows]] = directions[rows]
        rounded = [
            np.rint(frames[first[b] : first[b + 1]]).reshape(len(body.x), -1)
            for b, body in enumerate(self.rows)
        ]
        return np.asarray(
            np.concatenate([np.pad(rows, ((0, 0), (0, 9 - rows.shape[1]))) for rows in rounded]),
            dtype=np.int64,
        )


def sums(rows: Sequence[BodyRows], coupling: Coupling, group: Index, columns: Index) -> Array:
    """Return the sums of this rank's entries of all bodies, (groups, column groups)."""
    count = int(group.max()) + 1
    result = np.zeros((count, 2 * count))
    for b, body in enumerate(rows):
        own_groups = group[coupling.first[b] : coupling.first[b + 1]]
        result += body.coarse(
            own_groups,
            columns[coupling.first_column[b] : coupling.first_column[b + 1]],
            (count, 2 * count),
        )
    return result
