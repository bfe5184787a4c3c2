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
    indices = scipy.spatial.cKDTree(points).query_ball_point(places, reach, return_sorted=True)
    counts = np.fromiter(map(len, indices), dtype=np.int64, count=len(indices))
    number = np.fromiter(
        itertools.chain.from_iterable(indices), dtype=np.int64, count=int(counts.sum())
    )
    return np.repeat(np.arange(len(places)), counts), number
