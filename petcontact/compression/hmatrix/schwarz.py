"""A preconditioner with two levels. Overlapping patches are solved exactly; constants on groups of
unknowns represent distant effects.

Restricted additive Schwarz: a patch's equations are solved with those of a margin around it, and of
the solution only its own part is kept. The coarse level knows a constant for each group of
unknowns; the levels follow one another (multiplicative). The matrix is A P: A has more columns than
unknowns, in blocks of sources, and P is sparse and may change.

References
----------
X.-C. Cai, M. Sarkis, SIAM J. Sci. Comput. 21 (1999) 792-797.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import scipy
import scipy.linalg.lapack as lapack
from numpy.typing import NDArray

from ... import native
from ...arrays import Array, Index, Mask
from ...record import record, replace
from .construction import FULL

Single = NDArray[np.float32]
FEW = 0.35
"""Largest share of a patch's columns that may change before the patch is factored again."""
_patches = native.function("petcontact_patches_multiply", "iNDDD")


class Source(Protocol):
    """Entries of A between some nodes."""

    def block(self, nodes: Index) -> tuple[Array, Index]:
        """Return a block by columns, (c, d k), and the numbers of these columns in the source,
        (c,)."""
        ...


@record
class Subdomain:
    """Unknowns that are solved for together.

    Attributes
    ----------
    nodes : list of arrays
        Of each source.
    unknowns : (n,) array
        Of these nodes, source by source: also the numbers of their equations.
    own : (o,) array
        Places among them of those whose solution is kept.
    coupled : bool
        Whether P is not the identity there.
    """

    nodes: list[Index]
    unknowns: Index
    own: Index
    coupled: bool


@record
class Factored:
    """A patch's matrix A P, factored for one P. The inverse for another P follows from it.

    Attributes
    ----------
    lu : (n, n) array
    pivots : (n,) array
    own : (o, n) array
        Rows of the inverse, of the own unknowns.
    expansion : list of sparse arrays
        P of each source, (c, n).
    """

    lu: Single
    pivots: Index
    own: Single
    expansion: list[scipy.sparse.csr_array]

    @classmethod
    def from_columns(
        cls, columns: Single, own: Index, expansion: list[scipy.sparse.csr_array]
    ) -> Factored:
        """Factor a matrix (columns, n) in place. A singular matrix raises LinAlgError."""
        lu, pivots, zero_pivot = lapack.sgetrf(columns.T, overwrite_a=True)
        if zero_pivot:
            raise np.linalg.LinAlgError("the equations of a patch are singular")
        return cls(lu, pivots, _rows(lu, pivots, own), expansion)

    def changed(
        self, expansion: list[scipy.sparse.csr_array]
    ) -> tuple[Index, list[scipy.sparse.csr_array]]:
        """Return which columns of P have changed, and the change of each, (c, changed)."""
        difference = [
            scipy.sparse.csc_array(new - old)
            for new, old in zip(expansion, self.expansion, strict=True)
        ]
        size = np.max([abs(part).max(axis=0).toarray().ravel() for part in difference], axis=0)
        # changes of a column of P by a thousandth count as none
        columns = np.flatnonzero(size > 1e-3)
        return columns, [part[:, columns] for part in difference]

    def rows(self, columns: Index, change: Single) -> Single:
        """Return the own rows of the inverse after some columns have changed by (changed, n), by
        Woodbury's formula."""
        inverse_rows = _rows(self.lu, self.pivots, columns)
        core = np.eye(len(columns), dtype=np.float32) + inverse_rows @ change.T
        return np.asarray(self.own - np.linalg.solve(core.T, change @ self.own.T).T @ inverse_rows)


def _rows(lu: Single, pivots: Index, which: Index) -> Single:
    """Return some rows of the inverse, (len(which), n). They cost a third of the whole inverse, or
    less."""
    units = np.zeros((len(lu), len(which)), np.float32, order="F")
    units[which, np.arange(len(which))] = 1.0
    return np.asarray(lapack.sgetrs(lu, pivots, units, trans=1, overwrite_b=True)[0].T)


class LocalSolves:
    """Inverses on patches in single precision, of which only the rows of the own unknowns are
    stored.

    A patch whose P changes a second time keeps its factors, which changes of few columns correct by
    as low a rank.

    Parameters
    ----------
    sources : sequence of Source
    first_column : (sources + 1,) array
    patches : list of Subdomain
    size : int
        Unknowns in all.

    References
    ----------
    W. W. Hager, SIAM Review 31 (1989) 221-239.
    """

    def __init__(
        self, sources: Sequence[Source], first_column: Index, patches: list[Subdomain], size: int
    ) -> None:
        self._sources, self._first, self._patches, self._size = sources, first_column, patches, size
        self._inverse = [np.empty((0, 0), np.float32)] * len(patches)
        self._factored: dict[int, Factored] = {}
        self._kept: dict[int, list[tuple[Single, Index]]] = {}
        self._own = [np.ascontiguousarray(patch.unknowns[patch.own]) for patch in patches]
        self._table = np.zeros((len(patches), 5), dtype=np.int64)
        self._work = np.empty(max([1, *(len(patch.unknowns) for patch in patches)]) + FULL)

    def copy(self) -> LocalSolves:
        """Return an independent copy that shares unchanged arrays."""
        result = copy.copy(self)
        result._inverse = list(self._inverse)
        result._factored = dict(self._factored)
        result._table = self._table.copy()
        return result

    @property
    def nbytes(self) -> int:
        """Memory of inverses, factors and exact entries [bytes]."""
        kept = sum(values.nbytes for blocks in self._kept.values() for values, _ in blocks)
        # own rows are the inverse until a change corrects it
        whole = sum(
            factored.lu.nbytes + factored.own.nbytes * (factored.own.base is not inverse)
            for number, factored in self._factored.items()
            for inverse in [self._inverse[number]]
        )
        return kept + whole + sum(inverse.nbytes for inverse in self._inverse)

    def update(self, expansion: scipy.sparse.csr_array, moved: Mask) -> tuple[int, int]:
        """Change to another P on all patches with unknowns whose columns have changed. Return the
        numbers of patches that were factored and corrected.

        Returns
        -------
        inverted, corrected : int
            Patches that were inverted, and those whose inverses were corrected by low rank.
        """
        position, counts = np.full(expansion.shape[1], -1), [0, 0]
        for number, patch in enumerate(self._patches):
            if not moved[patch.unknowns].any():
                continue
            position[patch.unknowns] = np.arange(len(patch.unknowns))
            entries = self._entries(number)
            local = [
                _restricted(expansion[columns], position, len(patch.unknowns))
                for _, columns in entries
            ]
            position[patch.unknowns] = -1
            counts[self._corrected(number, entries, local)] += 1
        return counts[0], counts[1]

    def _corrected(
        self, number: int, entries: list[tuple[Single, Index]], local: list[scipy.sparse.csr_array]
    ) -> bool:
        """Store the inverse of a patch. Return whether an older inverse was corrected."""
        patch, before = self._patches[number], self._factored.get(number)
        n = len(patch.unknowns)
        if before is not None:
            columns, change = before.changed(local)
            if len(columns) <= FEW * n:
                self._put(number, before.rows(columns, _combined(change, entries)))
                return True
        factored = Factored.from_columns(_combined(local, entries), patch.own, local)
        again = bool(self._inverse[number].size)
        self._put(number, factored.own)
        if again:
            self._factored[number] = replace(factored, own=self._inverse[number][:, :n])
        return False

    def _entries(self, number: int) -> list[tuple[Single, Index]]:
        """Return the exact entries of a patch by sources, stored if they are needed again."""
        if number in self._kept:
            return self._kept[number]
        blocks = list[tuple[Single, Index]]()
        for source, first, nodes in zip(
            self._sources, self._first, self._patches[number].nodes, strict=False
        ):
            if len(nodes):
                values, columns = source.block(nodes)
                blocks.append((values.astype(np.float32), first + columns))
        if self._patches[number].coupled:
            self._kept[number] = blocks
        return blocks

    def _put(self, number: int, rows: Single) -> None:
        patch = self._patches[number]
        inverse = self._inverse[number] = np.zeros(
            (len(rows), -(-rows.shape[1] // FULL) * FULL), np.float32
        )
        inverse[:, : rows.shape[1]] = rows
        self._table[number] = (
            native.pointer(self._own[number]) or 0,
            len(patch.own),
            native.pointer(patch.unknowns) or 0,
            len(patch.unknowns),
            native.pointer(inverse) or 0,
        )

    def solve(self, r: Array) -> Array:
        """Return the own parts of the local solutions for a residual (size,). They are 0 where
        there is no patch."""
        r, result = native.contiguous(r), np.zeros(self._size)
        _patches(len(self._table), self._table, r, result, self._work)
        return result


def _restricted(rows: scipy.sparse.csr_array, position: Index, n: int) -> scipy.sparse.csr_array:
    """Return the columns of some rows of P that have a place, (c, n), in single precision."""
    local = position[rows.indices]
    kept = local >= 0
    ends = np.concatenate([[0], np.cumsum(kept)])[rows.indptr]
    return scipy.sparse.csr_array(
        (rows.data[kept].astype(np.float32), local[kept], ends), shape=(rows.shape[0], n)
    )


def _combined(local: list[scipy.sparse.csr_array], entries: list[tuple[Single, Index]]) -> Single:
    """Return A P of a patch by the columns of P, (columns, n)."""
    parts = [
        np.asarray(factors.T @ values) for factors, (values, _) in zip(local, entries, strict=True)
    ]
    return np.ascontiguousarray(np.concatenate(parts, axis=1))


class CoarseLevel:
    """Constants on groups of unknowns. R sums the equations, Q repeats the values, and R A P Q is
    solved.

    Parameters
    ----------
    group : (size,) array
        Of each unknown, and of its equation.
    column_group : (columns,) array
        Of each column of A, or -1.
    sums : (groups, column groups) array
        Of the entries of A.
    """

    def __init__(self, group: Index, column_group: Index, sums: Array) -> None:
        self.group, self._sums, self.count = group, sums, len(sums)
        columns = np.flatnonzero(column_group >= 0)
        ones, wide = np.ones(len(columns)), sums.shape[1]
        gathered = scipy.sparse.csr_array(
            (ones, (column_group[columns], columns)), shape=(wide, len(column_group))
        )
        size = np.bincount(column_group[columns], minlength=wide)
        self._mean = scipy.sparse.csr_array(
            scipy.sparse.diags(1.0 / np.maximum(size, 1)) @ gathered
        )
        self.repeat = scipy.sparse.csr_array((np.ones(len(group)), (np.arange(len(group)), group)))

    def copy(self) -> CoarseLevel:
        """Return an independent copy that shares unchanged arrays."""
        return copy.copy(self)

    def factor(self, expansion: scipy.sparse.csr_array, more: Array | float = 0.0) -> None:
        """Factor R A P Q plus a given matrix (groups, groups). P (columns, size) is averaged over
        groups."""
        grouped = (self._mean @ (expansion @ self.repeat)).T
        whole = np.asarray(grouped @ self._sums.T).T + more
        self._lu = scipy.linalg.lu_factor(whole, overwrite_a=True, check_finite=False)

    def solve(self, r: Array) -> Array:
        """Return Q (R A P Q)⁻¹ R r."""
        sums = np.bincount(self.group, r, minlength=self.count)
        return np.asarray(scipy.linalg.lu_solve(self._lu, sums, check_finite=False)[self.group])
