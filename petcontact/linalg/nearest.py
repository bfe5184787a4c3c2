"""Points near others, as arrays of numbers and of pairs."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import scipy

from ..arrays import Array, Index, ranked

MOST_APART, MOST_CLOSE = 300_000, 100_000
"""Pairs whose distances are all computed, and pairs that are compared one by one [-], both in some
ten milliseconds. More are left to a search tree; scipy's takes 35 ms to load."""


class Nearest:
    """What finds the nearest of some points (n, d)."""

    def __init__(self, points: Array) -> None:
        self._points = points

    @functools.cached_property
    def _tree(self) -> scipy.spatial.cKDTree:
        return scipy.spatial.cKDTree(self._points)

    def __call__(self, places: Array, count: int = 1) -> Index:
        """Numbers (m, count) of the points that are nearest to places (m, d), the nearest first; of
        fewer points all.

        Examples
        --------
        >>> Nearest(np.array([[0.0, 0.0], [3.0, 0.0]]))(np.array([[1.0, 0.0], [9.0, 0.0]]))
        array([[0],
               [1]])
        """
        count = min(count, len(self._points))
        if len(self._points) * len(places) > MOST_APART:
            return np.asarray(self._tree.query(places, range(1, count + 1))[1])
        axes = zip(places.T, self._points.T, strict=True)
        apart: Array = sum(np.subtract.outer(*axis) ** 2 for axis in axes)
        if count == 1:
            return np.asarray(apart.argmin(axis=1)[:, None])
        some = np.sort(np.argpartition(apart, count - 1, axis=1)[:, :count], axis=1)
        order = np.take_along_axis(apart, some, axis=1).argsort(axis=1, kind="stable")
        return np.take_along_axis(some, order, axis=1)


def within(points: Array, places: Array, reach: Array) -> tuple[Index, Index]:
    """Pairs of a place and a point no further from it than its reach (m,), place by place.

    Examples
    --------
    >>> points, others = np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[1.0, 0.0], [9.0, 0.0]])
    >>> within(points, others, np.array([2.0, 1.0]))
    (array([0, 0]), array([0, 1]))
    """
    if not len(points):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    # points in order along a line that is parallel to no side of a usual body
    line = np.array([0.7, 0.5, 0.3])[: points.shape[1]]
    order = np.argsort(points @ line, kind="stable")
    along, at = points[order] @ line, places @ line
    slack = 1e-12 * (np.abs(along).max() + np.abs(at).max(initial=0.0))
    first = np.searchsorted(along, at - reach - slack)
    close = np.searchsorted(along, at + reach + slack) - first
    if close.sum() > MOST_CLOSE:
        return _by_tree(points, places, reach)
    place, rank = ranked(close)
    point = order[first[place] + rank]
    near = ((points[point] - places[place]) ** 2).sum(axis=1) <= reach[place] ** 2
    place, point = place[near], point[near]
    listed = np.lexsort((point, place))
    return place[listed], point[listed]


def _by_tree(points: Array, places: Array, reach: Array) -> tuple[Index, Index]:
    # most places are far from the box about a few points
    low, high = points.min(axis=0), points.max(axis=0)
    beyond = np.maximum(low - places, places - high).max(axis=1)
    some = np.flatnonzero(beyond <= reach)
    tree = scipy.spatial.cKDTree(points)
    indices = tree.query_ball_point(places[some], reach[some], return_sorted=True)
    counts = np.fromiter(map(len, indices), dtype=np.int64, count=len(indices))
    number = np.fromiter(
        itertools.chain.from_iterable(indices), dtype=np.int64, count=int(counts.sum())
    )
    return np.repeat(some, counts), number
