"""Clusters that are translates of one another. On a straight stretch of equal elements they share
one set of blocks.

Bases are fitted to the cluster's neighbours on its own stretch, and these are alike. What lies
elsewhere is seen through analytic functions, which the bases for neighbours contain, if it is about
a diameter away: of all such translates the one that comes nearest to anything else is fitted, and
is the leader of the others.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from ...arrays import Array, Index
from ...record import record
from .block_batches import Block
from .clusters import halved
from .sampling import ProxySample

TOGETHER = 32
"""Number of clusters that are sampled in one pass."""


@record
class Stretch:
    """Nodes start..stop on a straight line. After a shift by `period` nodes the entries between
    them are the same again.

    Attributes
    ----------
    beside : bool
        Whether those of the operators beside are, too.
    """

    start: int
    stop: int
    period: int = 1
    beside: bool = True


@record
class Basis:
    """Active rows (or columns) `kept` (k,) and `rest` (m-k,). Outside a cluster the rest are
    combinations of the kept ones.

    Of rows: A[rest] ≈ combine A[kept], combine (m-k, k). Of columns: A[:, rest] ≈ A[:, kept]
    combine, combine (k, m-k).
    """

    kept: Index
    rest: Index
    combine: Array


@dataclass
class Cluster:
    """Nodes start..stop, their active rows and columns (global numbers), and the dense blocks
    between those.

    The rows and columns of a near block are places among the active ones. Bases are None until
    compressed. What its columns were fitted on is kept for operators with the same rows. Clusters
    of a level that have one `key` are translates of one another, blocks included; those that also
    have one `leader` share its bases.
    """

    start: int
    stop: int
    rows: Index
    columns: Index
    near: list[Block] = field(default_factory=list)
    row_basis: Basis | None = None
    column_basis: Basis | None = None
    felt_by: ProxySample | None = None
    key: Hashable = None
    leader: Cluster | None = None

    @property
    def follows(self) -> bool:
        """Whether its bases are those of another cluster."""
        return self.leader is not None and self.leader is not self

    def border(self) -> Cluster:
        """Return the cluster without its near blocks, as the tree above needs it."""
        return replace(self, near=[], key=None, leader=None)


class Translations:
    """The clusters that are translates of one another.

    Parameters
    ----------
    stretches : sequence of Stretch
        Increasing, without common nodes.
    points : (n, 2) array
    """

    def __init__(self, stretches: Sequence[Stretch], points: Array) -> None:
        self._points = points
        self.stretches = sorted(stretches, key=lambda stretch: stretch.start)
        self._starts = np.array([s.start for s in self.stretches], dtype=np.int64)

    def shared(self) -> Translations:
        """Return the translations of operators that share the rows of this one."""
        return Translations([s for s in self.stretches if s.beside], self._points)

    def leaves(self, start: int, stop: int, leaf: int) -> Index:
        """Return the bounds of ranges of start..stop with at most `leaf` nodes. On stretches the
        ranges are equal."""
        bounds = [np.array([start])]
        for s in self.stretches:
            first = s.start + -(-max(start - s.start, 0) // s.period) * s.period
            size = leaf // s.period * s.period
            count = (min(stop, s.stop) - first) // size if size else 0
            # a stretch of fewer leaves is not divided into equal ones
            if count >= 6:
                before = (
                    halved(int(bounds[-1][-1]), first, leaf)
                    if first > bounds[-1][-1]
                    else bounds[-1][-1:]
                )
                bounds += [before[1:], first + size * np.arange(1, count + 1)]
        if bounds[-1][-1] < stop or len(bounds) == 1:
            bounds.append(halved(int(bounds[-1][-1]), stop, leaf)[1:])
        return np.concatenate(bounds)

    def key(self, start: int, stop: int) -> Hashable:
        """Return a key that all translates of a leaf share, or None off all stretches."""
        number = int(np.searchsorted(self._starts, start, "right")) - 1
        if number < 0 or stop > self.stretches[number].stop:
            return None
        return (
            number,
            (start - int(self._starts[number])) % self.stretches[number].period,
            stop - start,
        )

    def clear(self, clusters: Sequence[Cluster]) -> Array:
        """Return a lower bound of the distance of clusters on one stretch from its ends and from
        all other nodes, over their length, (c,) [-]."""
        first, last = (
            self._points[[getattr(c, name) - k for c in clusters]]
            for name, k in (("start", 0), ("stop", 1))
        )
        middle, length = 0.5 * (first + last), np.hypot(*(last - first).T)
        own = int(np.searchsorted(self._starts, clusters[0].start, "right")) - 1
        nearest = (
            np.full(len(clusters), np.inf) if self._rest is None else self._rest.query(middle)[0]
        )
        for number, stretch in enumerate(self.stretches):
            if number != own:
                begin, end = self._points[stretch.start], self._points[stretch.stop - 1]
                along = np.clip(
                    (middle - begin) @ (end - begin) / ((end - begin) @ (end - begin)), 0.0, 1.0
                )
                nearest = np.minimum(
                    nearest, np.hypot(*(begin + along[:, None] * (end - begin) - middle).T)
                )
        start, stop = (np.array([getattr(c, name) for c in clusters]) for name in ("start", "stop"))
        inside = np.minimum(start - self.stretches[own].start, self.stretches[own].stop - stop) / (
            stop - start
        )
        around = (nearest - 0.5 * length) / np.maximum(length, np.finfo(np.float64).tiny)
        return np.asarray(np.minimum(inside, around))

    @functools.cached_property
    def _rest(self) -> scipy.spatial.cKDTree | None:
        """Numbers of the nodes that lie on no stretch of equal elements."""
        apart = np.ones(len(self._points), dtype=bool)
        for s in self.stretches:
            apart[s.start : s.stop] = False
        return scipy.spatial.cKDTree(self._points[apart]) if apart.any() else None

    def leaders(self, clusters: Sequence[Cluster]) -> list[int | None]:
        """Return, for each cluster of a level, the place of the cluster whose bases it shares, or
        None."""
        leaders: list[int | None] = [None] * len(clusters)
        alike: dict[Hashable, list[int]] = {}
        for i, cluster in enumerate(clusters):
            if cluster.key is not None:
                alike.setdefault(cluster.key, []).append(i)
        for members in alike.values():
            clear = self.clear([clusters[i] for i in members])
            # a cluster shares the bases of others where what is not on its stretch is a length
            # away
            sharing = np.flatnonzero(clear >= 1.0)
            if len(sharing) > 1:
                leader = members[int(sharing[np.argmin(clear[sharing])])]
                for k in sharing:
                    leaders[members[k]] = leader
        return leaders


def noted(cluster: Cluster, by_key: dict[Hashable, Cluster]) -> Cluster:
    """Return the cluster, after it is stored under its key."""
    if cluster.key is not None:
        by_key[cluster.key] = cluster
    return cluster


def follow(clusters: list[Cluster]) -> None:
    """Give all followers the bases of their leaders."""
    for cluster in clusters:
        if cluster.leader is not None:
            cluster.row_basis = cluster.leader.row_basis
            cluster.column_basis = cluster.leader.column_basis


def adjacent(clusters: list[Cluster]) -> Iterator[list[Cluster]]:
    """Yield a few neighbouring clusters at a time."""
    apart = [
        i
        for i, (before, after) in enumerate(itertools.pairwise(clusters), 1)
        if before.stop != after.start
    ]
    for first, last in itertools.pairwise([0, *apart, len(clusters)]):
        yield from (clusters[i : min(i + TOGETHER, last)] for i in range(first, last, TOGETHER))
