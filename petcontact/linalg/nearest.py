"""Points near others, as arrays of pairs."""

from __future__ import annotations

import itertools

import numpy as np
import scipy

from ..arrays import Array, Index


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
