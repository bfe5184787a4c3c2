"""A cluster tree, or one subtree of it, level by level: its blocks in batches, and products with
them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import TypeVar

import numpy as np

from ...arrays import Array, Index
from ...record import record, replace
from .block_batches import Batches, Block
from .skeleton import Operator
from .translations import Cluster

TOGETHER = 256  # clusters whose arrays are packed together


@record
class TreeLevel:
    """All clusters of one level, with their active rows and columns one after another.

    Attributes
    ----------
    near : Batches (m, n)
        Blocks between the m active rows and the n active columns.
    kept_rows, kept_columns : (k,) and (l,) arrays
        Places of those that stay active on the level above, in its order; none at the root.
    row_combine : Batches (m, k)
        The other rows from the kept ones.
    column_combine : Batches (l, n)
        The other columns' shares in the kept ones.
    clusters : list of Cluster
        Their blocks and bases are views of the batches.
    """

    near: Batches
    kept_rows: Index
    kept_columns: Index
    row_combine: Batches
    column_combine: Batches
    clusters: list[Cluster]


def pack(clusters: list[Cluster], near: Batches, like: TreeLevel | None = None) -> TreeLevel:
    """Return one level from its compressed clusters, whose blocks are in `near`. The clusters'
    bases are replaced by views, some clusters at a time, to free memory. Bases of rows are those of
    `like`, if given."""
    compressed = [c for c in clusters if c.row_basis and c.column_basis]
    above = [
        sum(len(c.row_basis.kept) for c in compressed if c.row_basis),
        sum(len(c.column_basis.kept) for c in compressed if c.column_basis),
    ]
    by_column = Batches(above[1], near.shape[1])
    by_row = Batches(near.shape[0], above[0]) if like is None else like.row_combine
    kept_rows, kept_columns = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    rows = columns = up_rows = up_columns = 0
    for group in grouped(clusters):
        row_blocks, column_blocks = [], []
        for c in group:
            if c.row_basis and c.column_basis:
                r, s = c.row_basis, c.column_basis
                row_blocks.append(Block(rows + r.rest, up_rows + np.arange(len(r.kept)), r.combine))
                column_blocks.append(
                    Block(up_columns + np.arange(len(s.kept)), columns + s.rest, s.combine)
                )
                kept_rows.append(rows + r.kept)
                kept_columns.append(columns + s.kept)
                up_rows, up_columns = up_rows + len(r.kept), up_columns + len(s.kept)
            rows, columns = rows + len(c.rows), columns + len(c.columns)
        column_views = iter(by_column.take(column_blocks))
        row_views = iter(
            by_row.take(row_blocks) if like is None else [block.values for block in row_blocks]
        )
        del row_blocks, column_blocks
        for c in group:
            if c.row_basis and c.column_basis:
                views = next(row_views), next(column_views)
                # what several share is not copied
                if c.leader is None:
                    c.row_basis = replace(c.row_basis, combine=views[0])
                    c.column_basis = replace(c.column_basis, combine=views[1])
    return TreeLevel(
        near, np.concatenate(kept_rows), np.concatenate(kept_columns), by_row, by_column, clusters
    )


T = TypeVar("T")


def grouped(items: Sequence[T]) -> Iterator[Sequence[T]]:
    """Yield some clusters at a time."""
    for first in range(0, len(items), TOGETHER):
        yield items[first : first + TOGETHER]


def _made(
    make: Callable[[T], Cluster], of: Sequence[T], n_rows: int, n_columns: int
) -> tuple[list[Cluster], Batches]:
    """Return the clusters of one level with this many active rows and columns, and their blocks.
    Blocks are packed as they are made."""
    clusters, near, rows, columns = list[Cluster](), Batches(n_rows, n_columns), 0, 0
    for group in grouped(of):
        made, blocks = [make(item) for item in group], []
        for c in made:
            blocks += [Block(rows + b.rows, columns + b.columns, b.values) for b in c.near]
            rows, columns = rows + len(c.rows), columns + len(c.columns)
        views = iter(near.take(blocks))
        for c in made:
            c.near = [Block(b.rows, b.columns, next(views)) for b in c.near]
        clusters += made
    return clusters, near


def padded(x: Array) -> Array:
    """Return a copy of x (n, s) with the zero slot that `Batches` needs."""
    return np.concatenate([x, np.zeros((1, x.shape[1]))])


class Stack:
    """All levels, from the leaves (first) to a root, which may be compressed, too."""

    def __init__(self, levels: list[TreeLevel]) -> None:
        self.levels = levels

    @property
    def root(self) -> Cluster:
        """The one cluster of the last level."""
        return self.levels[-1].clusters[0]

    def ascend(self, x: Array) -> tuple[list[Array], Array]:
        """Return what each level sees of x (n, s) on the leaves' columns, and what the tree above
        sees."""
        seen, above = [], padded(x)
        for level in self.levels:
            seen.append(above)
            above = padded(above[level.kept_columns])
            level.column_combine.add(seen[-1], above)
        return seen, above[:-1]

    def descend(self, seen: list[Array], outside: Array) -> Array:
        """Return the product on the leaves' rows from the result of `ascend` and from the values
        outside the root."""
        above = padded(outside)
        for level, x in zip(reversed(self.levels), reversed(seen), strict=True):
            y = np.zeros((level.near.shape[0] + 1, x.shape[1]))
            level.near.add(x, y)
            y[level.kept_rows] += above[:-1]
            level.row_combine.add(above, y)
            above = y
        return above[:-1]


def build_part(
    operator: Operator, start: int, stop: int, leaf: int, whole: bool, like: Stack | None = None
) -> Stack:
    """Return the subtree over nodes start..stop. Its root is compressed unless it is the whole
    tree.

    `like` is that of another operator with the same rows, whose bases serve both.
    """
    if like is None:
        leaves = list(itertools.pairwise(operator.translations.leaves(start, stop, leaf).tolist()))
    else:
        leaves = [(cluster.start, cluster.stop) for cluster in like.levels[0].clusters]
    sizes = [
        int(axis.offsets[stop] - axis.offsets[start])
        for axis in (operator.row_axis, operator.column_axis)
    ]
    by_key: dict[Hashable, Cluster] = {}
    return _climb(
        operator, *_made(lambda ends: operator.leaf(*ends, by_key), leaves, *sizes), whole, like
    )


def build_top(operator: Operator, roots: list[Cluster], like: Stack | None = None) -> Stack:
    """Return the tree above the compressed roots of all parts."""
    return _climb(operator, *_merged(operator, roots), True, like)


def _climb(
    operator: Operator, clusters: list[Cluster], near: Batches, whole: bool, like: Stack | None
) -> Stack:
    levels: list[TreeLevel] = []
    usual = 0
    while True:
        level = None if like is None else like.levels[len(levels)]
        if len(clusters) > 1 or not whole:
            if level is None:
                usual = operator.compress(clusters, usual)
            else:
                operator.compress_columns(clusters, level.clusters)
        levels.append(pack(clusters, near, level))
        if len(clusters) == 1:
            return Stack(levels)
        clusters, near = _merged(operator, clusters)


def _merged(operator: Operator, clusters: list[Cluster]) -> tuple[list[Cluster], Batches]:
    rows = sum(len(c.row_basis.kept) for c in clusters if c.row_basis)
    columns = sum(len(c.column_basis.kept) for c in clusters if c.column_basis)
    pairs = [clusters[i : i + 2] for i in range(0, len(clusters), 2)]
    by_key: dict[Hashable, Cluster] = {}
    return _made(lambda pair: operator.merge(pair, by_key), pairs, rows, columns)
