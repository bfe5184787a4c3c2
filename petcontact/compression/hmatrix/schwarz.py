"""A preconditioner in two levels: overlapping clusters solved exactly, and constants on clusters for what goes far.

Restricted additive Schwarz: a cluster's equations are solved with those of a margin around it, and of the solution only its
own part is kept, so that rows of the local inverse are all that is stored. The coarse level knows for each cluster, part of
the boundary and component a constant; the levels follow one another (multiplicative).

References
----------
X.-C. Cai, M. Sarkis, SIAM J. Sci. Comput. 21 (1999) 792-797.
"""

from __future__ import annotations

import numpy as np
import scipy

from ... import native
from ...arrays import Array, Index
from .block_tree import Clusters
from .entries import Entries, block
from .matrix import HMatrix
from .substitution import Substitution

_local = native.function("petcontact_local_multiply", "ipppp")

OWN = 64
"""Nodes of a cluster."""
MARGIN = 0.3
"""Of half its extent, on each side."""
CROWDED = 300
"""Nodes of a cluster with its margin, of which the nearest are taken."""
COARSE = 900
"""Unknowns of the coarse level, about, whose LU every rank has."""


class LocalSolves:
    """Rows of the inverses on clusters with margins, of those clusters that begin within some rows.

    Parameters
    ----------
    entries : Entries
    tree : Clusters
    x : (n, 3) array
        Nodes in the order of the tree [length].
    rows : (int, int)
        Nodes of the rows; the clusters are cut by them.
    """

    def __init__(self, entries: Entries, tree: Clusters, x: Array, rows: tuple[int, int]) -> None:
        self.entries, self.rows, d = entries, rows, entries.components
        search, self._nodes, self._own = scipy.spatial.cKDTree(x), list[Index](), list[tuple[int, int]]()
        for number in tree.cut(OWN).tolist():
            first, last = (int(np.clip(bound[number], *rows)) for bound in (tree.first, tree.last))
            if first == last:
                continue
            low, high = tree.low[number], tree.high[number]
            middle, half = 0.5 * (low + high), (0.5 + 0.5 * MARGIN) * (high - low)
            # flat clusters get a margin off their plane, too
            half = np.maximum(half, 0.5 * MARGIN * (high - low).max())
            inside = np.array(search.query_ball_point(middle, float(half.max()) + 1e-300, p=np.inf), dtype=np.int64)
            inside = inside[np.all(np.abs(x[inside] - middle) <= half * (1.0 + 1e-12), axis=1)]
            others = inside[(inside < first) | (inside >= last)]
            if len(others) + last - first > CROWDED:
                gap = np.maximum(np.abs(x[others] - middle) - 0.5 * (high - low), 0.0).max(axis=1)
                others = others[np.argsort(gap, kind="stable")[: max(0, CROWDED - (last - first))]]
            self._nodes.append(np.sort(np.concatenate([np.arange(first, last), others])))
            self._own.append((first, last))
        self._inverse = [np.empty((0, 0), np.float32)] * len(self._own)
        self._columns = [(d * nodes[:, None] + np.arange(d)).ravel() for nodes in self._nodes]
        self._with: Substitution | None = None
        self._table = np.zeros((len(self._own), 5), dtype=np.int64)

    @property
    def nbytes(self) -> int:
        """Memory of the inverses [bytes]."""
        return sum(inverse.nbytes for inverse in self._inverse)

    def update(self, substitution: Substitution, change: float = 0.0) -> None:
        """Invert anew where the columns of a node have changed by more than `change`, all of them at first."""
        old, contact = self._with, np.zeros(len(self.entries.beside), dtype=bool)
        if old is not None:
            moved = np.abs(substitution.n_u - old.n_u).max(axis=(1, 2)) + np.abs(substitution.n_t - old.n_t).max(axis=(1, 2))
            contact[substitution.node[moved > change]] = True
        d, largest = self.entries.components, 0
        for number, (nodes, (first, last)) in enumerate(zip(self._nodes, self._own, strict=True)):
            largest = max(largest, len(nodes))
            if old is not None and not contact[nodes].any():
                continue
            columns = block(self.entries, nodes, nodes)
            system, beside = np.split(columns, [d * len(nodes)])
            substitution.combine(nodes, system, beside, d, np.asarray(self.entries.beside))
            own = d * np.searchsorted(nodes, first) + np.arange(d * (last - first))
            # systemᵀ is the matrix: rows of its inverse solve with the array as it is
            unit = np.zeros((len(system), len(own)))
            unit[own, np.arange(len(own))] = 1.0
            self._inverse[number] = np.ascontiguousarray(np.linalg.solve(system, unit).T, dtype=np.float32)
            self._table[number] = (d * (first - self.rows[0]), len(own), native.pointer(self._columns[number]) or 0,
                                   len(system), native.pointer(self._inverse[number]) or 0)  # fmt: skip
        self._with, self._work = substitution, np.empty(max(1, d * largest))

    def solve(self, r: Array) -> Array:
        """The own parts of all local solutions, for a residual of all rows: these rows."""
        r, result = native.contiguous(r), np.zeros(self.entries.components * (self.rows[1] - self.rows[0]))
        if _local is not None:
            _local(len(self._table), *(native.pointer(a) for a in (self._table, r, result, self._work)))
            return result
        for (first, count, *_), columns, inverse in zip(self._table.tolist(), self._columns, self._inverse, strict=True):
            result[first : first + count] = inverse @ r[columns]
        return result


class CoarseLevel:
    """Constants on (cluster, part, component): R sums the equations, P repeats the values, and R A P is solved.

    Parameters
    ----------
    matrix : HMatrix
    tree : Clusters
    part : (n,) array
        Of the boundary, of each node in the order of the tree.
    """

    def __init__(self, matrix: HMatrix, tree: Clusters, part: Index) -> None:
        d, n = matrix.entries.components, len(part)
        cut = tree.cut(max(OWN, OWN * int(np.ceil(d * n / OWN / COARSE))))
        cluster = np.repeat(np.arange(len(cut)), tree.last[cut] - tree.first[cut])
        pair = np.unique(cluster * (part.max() + 1) + part, return_inverse=True)[1]
        self.group = (d * pair[:, None] + np.arange(d)).ravel()
        self.count = int(self.group.max()) + 1
        self._size = np.bincount(self.group, minlength=self.count)
        self._beside = np.asarray(matrix.entries.beside)
        self._matrix, self._sums = matrix, np.zeros((0, 0))

    def gather(self, substitution: Substitution) -> Array:
        """Sums of this rank's entries by groups, (groups, 2 groups): those of the unknowns and of the tractions in contact.

        The whole array is their sum over the ranks.
        """
        d = self._matrix.entries.components
        column = np.full(self._matrix.shape[1], -1)
        column[: len(self.group)] = self.group
        column[len(self.group) + substitution.beside] = self.count + self.group[substitution.slot]
        rows = self.group[d * self._matrix.rows[0] : d * self._matrix.rows[1]]
        return self._matrix.coarse(rows, column, (self.count, 2 * self.count))

    def factor(self, sums: Array, substitution: Substitution) -> None:
        """R A P and its LU, with the columns of contact groups combined as those of their nodes are on average."""
        whole = sums[:, : self.count].copy()
        group = self.group[substitution.slot]
        met, place = np.unique(group, axis=0, return_inverse=True)
        place = np.ravel(place)
        number = np.bincount(place)[:, None, None]
        mean = [np.zeros((len(met), *n.shape[1:])) for n in (substitution.n_u, substitution.n_t)]
        for total, each in zip(mean, (substitution.n_u, substitution.n_t), strict=True):
            np.add.at(total, place, each)
            total /= number
        of_u, of_t = (np.einsum("rgj,gji->rgi", sums[:, met + k * self.count], mean[k]) for k in range(2))
        whole[:, met] = of_u - of_t
        self._lu = scipy.linalg.lu_factor(whole, overwrite_a=True, check_finite=False)

    def solve(self, r: Array) -> Array:
        """P (R A P)⁻¹ R r, for a residual of all rows."""
        sums = np.bincount(self.group, r, minlength=self.count)
        return np.asarray(scipy.linalg.lu_solve(self._lu, sums, check_finite=False)[self.group])
