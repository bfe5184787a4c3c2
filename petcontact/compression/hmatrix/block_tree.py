"""Clusters of whole elements in space, and the blocks between them. Blocks of near clusters are
dense, those of far clusters have low rank."""

from __future__ import annotations

import itertools

import numpy as np

from ...arrays import Array, Index, Mask, Rows
from ...record import record

ETA = 4.0
"""Two clusters are far from one another if the smaller diameter is at most this many times their
distance. The value 4 takes a fifth less memory than 2 in the same time."""


@record
class Clusters:
    """A binary tree over elements. Elements and nodes are ordered so that each cluster is a range
    of them.

    Attributes
    ----------
    order : (n_elements,) array
        The elements in the order of the tree.
    first, last : (c,) arrays
        Nodes of each cluster, last exclusive, counted in that order; cluster 0 is the whole.
    low, high : (c, d) arrays
        Corners of its box, which holds its elements [length].
    children : (c, 2) array
        Clusters, or -1 of leaves.
    """

    order: Index
    first: Index
    last: Index
    low: Array
    high: Array
    children: Index

    @property
    def leaves(self) -> Index:
        """The numbers of clusters without children, in the order of their nodes."""
        leaves = np.flatnonzero(self.children[:, 0] < 0)
        return leaves[np.argsort(self.first[leaves])]

    def cut(self, most: int) -> Index:
        """Return the largest clusters with at most `most` nodes, or leaves. Together they hold
        every node once, and they follow the order of the nodes."""
        small = (self.last - self.first <= most) | (self.children[:, 0] < 0)
        parent = np.full(len(self.first), -1)
        inner = np.flatnonzero(self.children[:, 0] >= 0)
        parent[self.children[inner]] = inner[:, None]
        clusters = np.flatnonzero(small & ~((parent >= 0) & small[parent]))
        return clusters[np.argsort(self.first[clusters])]


def cluster(low: Array, high: Array, nodes: Index, leaf: int) -> Clusters:
    """Halve elements across their longest extent until no cluster has more than `leaf` nodes, or
    only one element.

    Parameters
    ----------
    low, high : (n, d) arrays
        Boxes of the elements [length].
    nodes : (n,) array
        Nodes of each.
    leaf : int
    """
    middle, order = 0.5 * (low + high), np.arange(len(nodes))
    ranges, children, waiting = [(0, len(nodes))], [[-1, -1]], [0]
    while waiting:
        number = waiting.pop()
        start, stop = ranges[number]
        members = order[start:stop]
        sizes = np.cumsum(nodes[members])
        if sizes[-1] <= leaf or stop - start == 1:
            continue
        axis = int(np.argmax(high[members].max(axis=0) - low[members].min(axis=0)))
        members = members[np.argsort(middle[members, axis], kind="stable")]
        order[start:stop] = members
        half = int(
            np.clip(
                np.searchsorted(np.cumsum(nodes[members]), 0.5 * sizes[-1]) + 1, 1, stop - start - 1
            )
        )
        for part in ((start, start + half), (start + half, stop)):
            children[number][0 if part[0] == start else 1] = len(ranges)
            waiting.append(len(ranges))
            ranges.append(part)
            children.append([-1, -1])
    count = np.concatenate([[0], np.cumsum(nodes[order])])
    start, stop = np.array(ranges).T
    lowest = np.array([low[order[a:b]].min(axis=0) for a, b in ranges])
    highest = np.array([high[order[a:b]].max(axis=0) for a, b in ranges])
    return Clusters(order, count[start], count[stop], lowest, highest, np.array(children))


@record
class Blocks(Rows):
    """Blocks that tile the rows of a matrix: their row clusters, their column clusters, and whether
    they have low rank.

    Attributes
    ----------
    row, column : (b,) arrays
    far : (b,) bool array
    """

    row: Index
    column: Index
    far: Mask


def are_far(tree: Clusters, row: Index, column: Index) -> Mask:
    """Return whether the smaller diameter is at most `ETA` times the distance of the boxes."""
    gap = np.maximum(
        np.maximum(tree.low[row] - tree.high[column], tree.low[column] - tree.high[row]), 0.0
    )
    diameter = np.linalg.norm(tree.high - tree.low, axis=1)
    distance = np.linalg.norm(gap, axis=1)
    return np.asarray(
        (distance > 0.0) & (np.minimum(diameter[row], diameter[column]) <= ETA * distance)
    )


def block_tree(tree: Clusters) -> Blocks:
    """Return the blocks between all pairs of nodes, ordered by their rows."""
    root = np.zeros(1, dtype=np.int64)
    blocks, finished, leaf = Blocks(root, root, root > 0), list[Blocks](), tree.children[:, 0] < 0
    while len(blocks.row):
        far = are_far(tree, blocks.row, blocks.column)
        blocks = Blocks(blocks.row, blocks.column, far)
        done = far | (leaf[blocks.row] & leaf[blocks.column])
        finished.append(blocks.take(done))
        blocks = divided(tree, blocks.take(~done))
    all_ = Blocks.joined(finished)
    return all_.take(np.lexsort((tree.first[all_.column], tree.first[all_.row])))


def divided(tree: Clusters, blocks: Blocks) -> Blocks:
    """Return the parts of blocks. Both clusters are halved, or the one that has children. A block
    of two leaves becomes near."""
    leaf = tree.children[:, 0] < 0
    whole = leaf[blocks.row] & leaf[blocks.column]
    parts = [
        Blocks(blocks.row[whole], blocks.column[whole], np.zeros(int(whole.sum()), dtype=bool))
    ]
    row, column, far = (values[~whole] for values in (blocks.row, blocks.column, blocks.far))
    for a, b in itertools.product(range(2), repeat=2):
        # a leaf stands for its own first half
        keep = ~((a == 1) & leaf[row]) & ~((b == 1) & leaf[column])
        row_cluster, column_cluster = row[keep], column[keep]
        parts.append(
            Blocks(
                np.where(leaf[row_cluster], row_cluster, tree.children[row_cluster, a]),
                np.where(leaf[column_cluster], column_cluster, tree.children[column_cluster, b]),
                far[keep],
            )
        )
    return Blocks.joined(parts)
