"""A preconditioner in two levels: overlapping patches solved exactly, and constants on groups for what goes far.

Restricted additive Schwarz: a patch's equations are solved with those of a margin around it, and of the solution only its
own part is kept. The coarse level knows a constant for each group of unknowns; the levels follow one another
(multiplicative). The matrix is A P: A has more columns than unknowns, in blocks of sources, and P is sparse and may change.

References
----------
X.-C. Cai, M. Sarkis, SIAM J. Sci. Comput. 21 (1999) 792-797.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from ... import native
from ...arrays import Array, Index, Mask

Single = NDArray[np.float32]
_patches = native.function("petcontact_patches_multiply", "ipppp")


class Source(Protocol):
    """Entries of A between some nodes."""

    def block(self, nodes: Index) -> tuple[Array, Index]:
        """By columns, (c, d k), and which of the source's columns these are, (c,)."""
        ...


@dataclass(frozen=True)
class Patch:
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


class LocalSolves:
    """Inverses on patches, in single precision: rows of the own unknowns.

    Parameters
    ----------
    sources : sequence of Source
    first_column : (sources + 1,) array
    patches : list of Patch
    size : int
        Unknowns in all.
    """

    def __init__(self, sources: Sequence[Source], first_column: Index, patches: list[Patch], size: int) -> None:
        self._sources, self._first, self._patches, self._size = sources, first_column, patches, size
        self._inverse = [np.empty((0, 0), np.float32)] * len(patches)
        self._kept: dict[int, list[tuple[Single, Index]]] = {}
        self._own = [np.ascontiguousarray(patch.unknowns[patch.own]) for patch in patches]
        self._table = np.zeros((len(patches), 5), dtype=np.int64)
        self._work = np.empty(max([1, *(len(patch.unknowns) for patch in patches)]))

    def copy(self) -> LocalSolves:
        """One that goes its own way, and shares what has not changed."""
        other = copy.copy(self)
        other._inverse, other._table = list(self._inverse), self._table.copy()
        return other

    @property
    def nbytes(self) -> int:
        """Memory of the inverses and of exact entries [bytes]."""
        kept = sum(values.nbytes for blocks in self._kept.values() for values, _ in blocks)
        return kept + sum(inverse.nbytes for inverse in self._inverse)

    def update(self, expansion: scipy.sparse.csr_array, moved: Mask) -> int:
        """Invert anew the patches that hold unknowns whose columns of P have changed; how many."""
        place, count = np.full(expansion.shape[1], -1), 0
        for number, patch in enumerate(self._patches):
            if not moved[patch.unknowns].any():
                continue
            n = len(patch.unknowns)
            place[patch.unknowns] = np.arange(n)
            # transposed: by columns of the matrix
            system, at = np.empty((n, n), np.float32), 0
            for values, columns in self._entries(number):
                chosen = expansion[columns]
                local = place[chosen.indices]
                kept = local >= 0
                ends = np.concatenate([[0], np.cumsum(kept)])[chosen.indptr]
                combined = scipy.sparse.csr_array(
                    (chosen.data[kept].astype(np.float32), local[kept], ends), shape=(len(columns), n)
                )
                system[:, at : at + values.shape[1]] = combined.T @ values
                at += values.shape[1]
            place[patch.unknowns] = -1
            unit = np.zeros((n, len(patch.own)), np.float32)
            unit[patch.own, np.arange(len(patch.own))] = 1.0
            # rows of the inverse solve with the array as it is
            self._put(number, np.ascontiguousarray(np.linalg.solve(system, unit).T))
            count += 1
        return count

    def _entries(self, number: int) -> list[tuple[Single, Index]]:
        """Exact entries of a patch by sources; kept where they are needed more than once."""
        if number in self._kept:
            return self._kept[number]
        found = list[tuple[Single, Index]]()
        for source, first, nodes in zip(self._sources, self._first, self._patches[number].nodes, strict=False):
            if len(nodes):
                values, columns = source.block(nodes)
                found.append((values.astype(np.float32), first + columns))
        if self._patches[number].coupled:
            self._kept[number] = found
        return found

    def _put(self, number: int, inverse: Single) -> None:
        patch, self._inverse[number] = self._patches[number], inverse
        self._table[number] = (native.pointer(self._own[number]) or 0, len(patch.own), native.pointer(patch.unknowns) or 0,
                               len(patch.unknowns), native.pointer(inverse) or 0)  # fmt: skip

    def solve(self, r: Array) -> Array:
        """The own parts of the local solutions for a residual (size,); 0 where no patch is."""
        r, result = native.contiguous(r), np.zeros(self._size)
        if _patches is not None:
            _patches(len(self._table), *(native.pointer(a) for a in (self._table, r, result, self._work)))
            return result
        for patch, own, inverse in zip(self._patches, self._own, self._inverse, strict=True):
            result[own] = inverse @ r[patch.unknowns]
        return result


class CoarseLevel:
    """Constants on groups of unknowns: R sums the equations, Q repeats the values, and R A P Q is solved.

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
        gathered = scipy.sparse.csr_array((ones, (column_group[columns], columns)), shape=(wide, len(column_group)))
        size = np.bincount(column_group[columns], minlength=wide)
        self._mean = scipy.sparse.csr_array(scipy.sparse.diags(1.0 / np.maximum(size, 1)) @ gathered)
        self.repeat = scipy.sparse.csr_array((np.ones(len(group)), (np.arange(len(group)), group)))

    def copy(self) -> CoarseLevel:
        """One that goes its own way."""
        return copy.copy(self)

    def factor(self, expansion: scipy.sparse.csr_array, more: Array | float = 0.0) -> None:
        """LU, with P (columns, size) averaged over groups, and a matrix (groups, groups) that is added."""
        grouped = (self._mean @ (expansion @ self.repeat)).T
        whole = np.asarray(grouped @ self._sums.T).T + more
        self._lu = scipy.linalg.lu_factor(whole, overwrite_a=True, check_finite=False)

    def solve(self, r: Array) -> Array:
        """Q (R A P Q)⁻¹ R r."""
        sums = np.bincount(self.group, r, minlength=self.count)
        return np.asarray(scipy.linalg.lu_solve(self._lu, sums, check_finite=False)[self.group])
