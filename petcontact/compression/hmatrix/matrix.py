"""A matrix in blocks. Near blocks are dense, far blocks have low rank. Each number takes as few
bytes as the tolerance allows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ... import native
from ...arrays import Array, Index
from ..workers import Workers
from .block_tree import Blocks, Clusters
from .construction import FULL, Chunk, Layout, build_blocks
from .entries import Entries, block

_multiply = native.function("petcontact_hmatrix_multiply", "iNiDDD")
_coarse = native.function("petcontact_hmatrix_coarse", "iNipD")

TIGHTEST = 1e-7
"""Smallest tolerance. Gram matrices resolve singular values only to half of the digits."""
PROBED_COLUMNS = 4096
"""Number of columns of exact rows that are in memory at once."""


class HMatrix:
    """The rows of some nodes of a matrix with all columns: d for each node, then those beside.

    Parameters
    ----------
    entries : Entries
        Between nodes that are numbered in the order of the tree.
    tree : Clusters
    blocks : Blocks
        Of the whole matrix.
    tolerance : float
        Relative error of each block in Frobenius' norm, TIGHTEST to 0.1.
    rows : (int, int)
        First and last node (exclusive) of the rows.
    threads : int
        Over which the blocks are built and multiplied, where the entries are compiled.
    progress : callable, optional
        Called with the share that is built, from any of the threads.

    Attributes
    ----------
    shape : (int, int)
        Of these rows and all columns.
    """

    def __init__(
        self,
        entries: Entries,
        tree: Clusters,
        blocks: Blocks,
        tolerance: float,
        rows: tuple[int, int],
        *,
        threads: int = 1,
        progress: Callable[[float], None] = lambda share: None,
    ) -> None:
        if not TIGHTEST <= tolerance < 1.0:
            raise ValueError(f"tolerance must be {TIGHTEST:g} or more, and less than 1")
        self.tolerance, self.rows, self.entries, self.threads = tolerance, rows, entries, threads
        self._workers = Workers(threads)
        d, beside = entries.components, np.asarray(entries.beside)
        self.shape = d * (rows[1] - rows[0]), d * (len(beside) - 1) + int(beside[-1])
        self._layout = Layout(number_type(tolerance))
        self._width = np.dtype(self._layout.dtype).itemsize
        self._chunks = build_blocks(
            entries, tree, blocks, rows, tolerance, self._layout, threads, progress
        )
        self._tables = [self._table(chunk) for chunk in self._chunks]
        self.largest_rank = max(
            (int(chunk.ranks.max(initial=0)) for chunk in self._chunks), default=0
        )

    def _table(self, chunk: Chunk) -> Index:
        """Return the table of a chunk: first row, rows, first column, columns of nodes, first
        column beside, their number, rank, and address of the numbers in memory."""
        d, beside = self.entries.components, self.entries.beside
        first, m, column, n, _ = chunk.blocks.T
        q = beside[column + n] - beside[column]
        table = np.column_stack(
            [
                d * (first - self.rows[0]),
                d * m,
                d * column,
                d * n,
                d * (len(beside) - 1) + beside[column],
                q,
                chunk.ranks,
                np.zeros_like(q),
            ]
        )
        _, rows, _, columns, _, q, rank, _ = table.T
        column, row = self._layout.length(rows), self._layout.length(columns, q)
        size = np.where(rank < 0, (columns + q) * column, rank * (column + row))
        start = native.pointer(chunk.values) or 0
        table[:, 7] = start + chunk.values.itemsize * (np.cumsum(size) - size)
        return table

    @property
    def nbytes(self) -> int:
        """Memory of the blocks [bytes]."""
        return sum(chunk.values.nbytes for chunk in self._chunks)

    def mult(self, x: Array) -> Array:
        """Return the product of these rows with a vector over all columns, (rows,)."""
        filled = np.concatenate([x, np.zeros(FULL)])
        sums = np.zeros((self.threads, self.shape[0] + FULL))  # a vector for each thread
        shares = np.array_split(np.arange(len(self._chunks)), self.threads)

        def work(thread: int) -> None:
            for chunk in shares[thread].tolist():
                self._multiply(chunk, filled, sums[thread])

        self._workers.share(work)
        return np.asarray(sums.sum(axis=0) if self.threads > 1 else sums[0])[: self.shape[0]]

    __matmul__ = mult

    def _multiply(self, number: int, x: Array, y: Array) -> None:
        work, table = np.empty(max(1, self.largest_rank)), self._tables[number]
        _multiply(len(table), table, self._width, x, y, work)

    def coarse(self, row_group: Index, column_group: Index, groups: tuple[int, int]) -> Array:
        """Return the sums of the entries over groups of rows and columns, in one pass over the
        blocks.

        Parameters
        ----------
        row_group, column_group : (rows,) and (columns,) arrays
            Group of each, or -1.
        groups : (int, int)
            Numbers of them.

        Returns
        -------
        (row groups, column groups) array
        """
        result = np.zeros(groups)
        row_group, column_group = (
            native.contiguous(group, np.int64) for group in (row_group, column_group)
        )
        for number in range(len(self._chunks)):
            table = self._tables[number]
            scratch = [
                np.zeros(k, dtype)
                for dtype in (np.float64, np.int64, np.int8)
                for k in result.shape
            ]
            grouping = native.Struct(
                "NNiDDNNBB", row_group, column_group, result.shape[1], *scratch
            )
            _coarse(len(table), table, self._width, grouping.address, result)
        return result

    def error_estimate(self, rng: np.random.Generator, probes: int = 8) -> float:
        """Return the largest error of the product of exact rows with a random vector, over the norm
        of these rows [-]."""
        d, (first, last) = self.entries.components, self.rows
        nodes = np.sort(
            rng.choice(np.arange(first, last), min(probes, last - first), replace=False)
        )
        x = rng.standard_normal(self.shape[1])
        difference = -self.mult(x).reshape(-1, d)[nodes - first]
        size, count = np.zeros(difference.shape), len(self.entries.beside) - 1
        for start in range(0, count, PROBED_COLUMNS):
            columns = np.arange(start, min(start + PROBED_COLUMNS, count))
            exact = block(self.entries, nodes, columns)
            beside = slice(*(d * count + self.entries.beside[[start, columns[-1] + 1]]))
            some = np.concatenate([x[d * start : d * (columns[-1] + 1)], x[beside]])
            difference += (some @ exact).reshape(-1, d)
            size += np.sum(exact**2, axis=0).reshape(-1, d)
        scale = float(np.sqrt(size.max(initial=0.0))) or 1.0
        return float(np.abs(difference).max(initial=0.0)) / scale


def number_type(tolerance: float) -> type:
    """Return the type of the numbers in blocks for a tolerance."""
    # from 1e-6 on numbers are kept in single precision
    if tolerance < 1e-6:
        return np.float64
    # from 5e-4 on in 16 bits, with a scale for each row or column: products, which read all
    # numbers once, are bound by memory; rounding changes a product by 5e-5
    return np.float32 if tolerance < 5e-4 else np.int16


def predicted_bytes(tree: Clusters, blocks: Blocks, tolerance: float, components: int) -> Array:
    """Return the predicted memory of the rows of each node, without the columns beside, (n,)
    [bytes]."""
    m, n = (tree.last[side] - tree.first[side] for side in (blocks.row, blocks.column))
    # far blocks have a mean rank of 5 for each digit: to share out rows and to foretell memory
    rank = -5.0 * np.log10(tolerance)
    entries = np.where(blocks.far, rank * components * (m + n), components**2 * m * n) / m
    ends = np.concatenate([tree.first[blocks.row], tree.last[blocks.row]])
    change = np.bincount(ends, np.concatenate([entries, -entries]), int(tree.last[0]) + 1)
    return np.asarray(np.dtype(number_type(tolerance)).itemsize * np.cumsum(change[:-1]))


def shared_rows(tree: Clusters, memory: Array, ranks: int) -> Index:
    """Return the bounds (ranks + 1,) of row ranges that take about the same memory. Each range
    consists of whole leaves."""
    held = np.concatenate([[0.0], np.cumsum(memory)])
    borders = np.append(tree.first[tree.leaves], tree.last[0])
    ideal = held[-1] * np.arange(1, ranks) / ranks
    nearest = borders[np.abs(held[borders][None] - ideal[:, None]).argmin(axis=1)]
    return np.concatenate([[0], nearest, [tree.last[0]]])
