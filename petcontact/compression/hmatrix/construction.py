"""Construction of the blocks of an H-matrix. Each piece of memory is filled before the next one is
asked for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ... import native
from ...arrays import AnyArray, Array, Index
from ...record import record
from .block_tree import Blocks, Clusters, divided
from .entries import Callback, Entries

_build = native.function("petcontact_hmatrix_build", "ppiiNpN")

CHUNK = 1 << 24
"""Number of entries in one piece of memory."""
MOST_CROSSES = 160
"""Largest number of crosses in a block of low rank. A block that needs more is divided."""
KNOWN = 100_000
"""Largest number of entries of a block of low rank that is computed whole. For small blocks calls
cost more than entries."""
FULL = 16
"""Compiled code pads rows and columns with zeros to multiples of this number."""


@record
class Layout:
    """How the rows of U and V and the columns of whole blocks are stored. With 16 bits an entry, a
    scale in single precision comes first.

    Attributes
    ----------
    dtype : float64, float32 or int16
    """

    dtype: type

    def length(self, count: Index, beside: Index | int = 0) -> Index:
        """Return how many numbers a row or column takes, with its entries for nodes and its entries
        beside."""
        return (
            -(-count // FULL) * FULL
            + -(-beside // FULL) * FULL
            + (2 if self.dtype is np.int16 else 0)
        )


@dataclass
class Chunk:
    """The blocks in one piece of memory.

    Attributes
    ----------
    blocks : (b, 5) array
        First row node, their number, first column node, their number, kind.
    ranks : (b,) array
        Rank, or -1 of blocks that are kept whole.
    values : array
        Their numbers: rows of U and rows of V, or column after column.
    """

    blocks: Index
    ranks: Index
    values: AnyArray


def build_blocks(
    entries: Entries,
    tree: Clusters,
    blocks: Blocks,
    rows: tuple[int, int],
    tolerance: float,
    layout: Layout,
    threads: int,
    progress: Callable[[float], None],
) -> list[Chunk]:
    """Return the blocks within some rows. The function `progress` is called with the share of
    entries that is done."""
    chunks: list[Chunk] = []
    while len(blocks.row):
        tiles = _tiles(tree, blocks, rows)
        keep = tiles[:, 1] > 0
        blocks, tiles = blocks.take(keep), tiles[keep]
        made, failed = _built(entries, tiles, tolerance, layout, threads, progress)
        chunks += made
        blocks = divided(tree, blocks.take(failed))
    return chunks


def _tiles(tree: Clusters, blocks: Blocks, rows: tuple[int, int]) -> Index:
    first, last = (np.clip(bound[blocks.row], *rows) for bound in (tree.first, tree.last))
    columns = tree.first[blocks.column], tree.last[blocks.column] - tree.first[blocks.column]
    return np.column_stack([first, last - first, *columns, blocks.far])


def _built(
    entries: Entries,
    tiles: Index,
    tolerance: float,
    layout: Layout,
    threads: int,
    progress: Callable[[float], None],
) -> tuple[list[Chunk], Index]:
    """Return the finished pieces of memory and the numbers of the tiles to be divided."""
    pieces = _pieces(tiles, threads)
    total, done, lock = float((tiles[:, 1] * tiles[:, 3]).sum()), [0.0], threading.Lock()
    work = _Builder(entries, tolerance, layout)

    ended = threading.Event()

    def task(piece: Index) -> tuple[list[Chunk], Index]:
        made, failed, position = list[Chunk](), [np.empty(0, dtype=np.int64)], 0
        while position < len(piece) and not ended.is_set():
            chunk = work(tiles[piece[position:]])
            failed.append(piece[position : position + len(chunk.ranks)][chunk.ranks == -2])
            position += len(chunk.ranks)
            with lock:
                done[0] += float((chunk.blocks[:, 1] * chunk.blocks[:, 3]).sum())
                progress(done[0] / total)
            kept = chunk.ranks > -2
            made.append(Chunk(chunk.blocks[kept], chunk.ranks[kept], chunk.values))
        return made, np.concatenate(failed)

    if threads > 1 and entries.compiled is not None:
        with ThreadPoolExecutor(threads) as pool:
            try:
                results = list(pool.map(task, pieces))
            except BaseException:  # a signal: the pool waits for its threads
                ended.set()
                raise
    else:
        results = [task(piece) for piece in pieces]
    return [chunk for made, _ in results for chunk in made], np.concatenate(
        [failed for _, failed in results]
    )


def _pieces(tiles: Index, threads: int) -> list[Index]:
    """Return lists of consecutive tiles, some lists for each thread."""
    cost = np.cumsum(
        tiles[:, 1] * np.where(tiles[:, 4] > 0, 0, tiles[:, 3]) + 30 * (tiles[:, 1] + tiles[:, 3])
    )
    count = 1 if threads == 1 else 8 * threads
    cuts = np.searchsorted(cost, cost[-1] * np.arange(1, count) / count)
    return [part for part in np.split(np.arange(len(tiles)), cuts) if len(part)]


class _Builder:
    """The work of native/hmatrix.c on one list of tiles."""

    def __init__(self, entries: Entries, tolerance: float, layout: Layout) -> None:
        self.tolerance, self.layout, self.d = tolerance, layout, entries.components
        self.callback: Callback | None = None
        addresses = entries.compiled
        if addresses is None:
            self.callback = Callback(entries)
            addresses = self.callback.addresses
        self.addresses: tuple[int, int] = addresses
        self._owner = entries  # threads may outlive the caller, whom a second signal ends
        self.beside = native.contiguous(entries.beside, np.int64)
        self.nodes = np.arange(len(self.beside), dtype=np.int64)
        self.wide = int(np.diff(self.beside).max(initial=0))
        self._local = threading.local()

    def __call__(self, tiles: Index) -> Chunk:
        m, n = self.d * tiles[:, 1], self.d * tiles[:, 3]
        beside = self.beside[tiles[:, 2] + tiles[:, 3]] - self.beside[tiles[:, 2]]
        most = MOST_CROSSES
        length = self.layout.length
        low_rank, n = most * (length(m) + length(n, beside)), n + beside
        limit = np.where((tiles[:, 4] > 0) & (most * (m + n) < m * n), low_rank, n * length(m))
        some = max(1, int(np.searchsorted(np.cumsum(limit), 4 * CHUNK)))
        tiles, m, n, limit = (np.ascontiguousarray(a[:some]) for a in (tiles, m, n, limit))
        capacity = max(CHUNK, int(limit.max()))
        sizes = np.where((tiles[:, 4] == 0) | (m * n <= KNOWN), m * n, 0)
        crossed = np.where(tiles[:, 4] > 0, most, 0)
        values: AnyArray = np.empty(capacity, self.layout.dtype)
        ranks, done = np.empty(some, dtype=np.int64), np.empty(2, dtype=np.int64)
        operator = native.Struct(
            "ppiNNd", *self.addresses, self.d, self.nodes, self.beside, self.tolerance
        )
        work = native.Struct(
            10 * "D" + "VVi",
            *self._work(
                sizes.max(),
                (crossed * m).max(),
                (crossed * n).max(),
                most**2,
                most**2,
                most**2,
                most**2,
                most,
                np.maximum(self.d * n, m).max(),
                np.maximum(self.d * n, max(self.d, self.wide) * m).max(),
                m.max(),
                n.max(),
            ),
            most,
        )
        store = native.Struct("iViN", np.dtype(self.layout.dtype).itemsize, values, capacity, ranks)
        _build(operator.address, work.address, KNOWN, some, tiles, store.address, done)
        if self.callback is not None:
            self.callback.check()
        del store  # holds the values, which are cut off where they end
        values.resize(int(done[1]), refcheck=False)
        return Chunk(tiles[: done[0]], ranks[: done[0]], values)

    def _work(self, *sizes: int) -> list[Array]:
        """Return this thread's working memory. It is kept, because new memory costs a page fault
        each time that it is touched."""
        arrays: list[Array] = getattr(self._local, "work", [np.empty(0)] * len(sizes))
        self._local.work = [
            old if len(old) >= size else np.empty(size)
            for old, size in zip(arrays, sizes, strict=True)
        ]
        return self._local.work  # type: ignore[no-any-return]
