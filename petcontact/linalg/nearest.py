"""Points near others: few are compared with all, many are looked for in a tree, whose library takes
20 ms to load."""

from __future__ import annotations

import itertools

import numpy as np
import scipy

from ..arrays import Array, Index

FEW = 400_000
"""Pairs up to which all distances are computed: 5 ms and 7 MB."""


def nearest(
    points: Array, places: Array, count: int = 1, reach: float = np.inf
) -> tuple[Array, Index]:
    """The points next to some places, nearest first.

    Parameters
    ----------
    points : (n, d) array
    places : (m, d) array
    count : int
        How many are looked for, at most n.
    reach : float
        Distance beyond which nothing is looked for: infinite distances, and n for numbers.

    Returns
    -------
    distances, numbers : (m, count) arrays

    Examples
    --------
    >>> distance, number = nearest(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[1.0, 0.0]]), 2)
    >>> distance.tolist(), number.tolist()
    ([[1.0, 2.0]], [[0, 1]])
    """
    if len(points) * len(places) > FEW:
        distance, number = scipy.spatial.cKDTree(points).query(
            places, k=range(1, count + 1), distance_upper_bound=reach
        )
        return np.asarray(distance), np.asarray(number)
    square = squares(points, places)
    number = (
        np.argsort(square, axis=1, kind="stable")[:, :count]
        if count > 1
        else square.argmin(axis=1)[:, None]
    )
    distance = np.sqrt(np.take_along_axis(square, number, axis=1))
    beyond = distance >= reach
    return np.where(beyond, np.inf, distance), np.where(beyond, len(points), number)


def within(points: Array, places: Array, reach: Array) -> tuple[Index, Index]:
    """Pairs of a place and a point no further from it than its reach (m,), place by place.

    Examples
    --------
    >>> points, others = np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[1.0, 0.0], [9.0, 0.0]])
    >>> within(points, others, np.array([2.0, 1.0]))
    (array([0, 0]), array([0, 1]))
    """
    if len(points) * len(places) > FEW:
        indices = scipy.spatial.cKDTree(points).query_ball_point(places, reach, return_sorted=True)
        counts = np.fromiter(map(len, indices), dtype=np.int64, count=len(indices))
        number = np.fromiter(
            itertools.chain.from_iterable(indices), dtype=np.int64, count=int(counts.sum())
        )
        return np.repeat(np.arange(len(places)), counts), number
    place, number = np.nonzero(squares(points, places) <= reach[:, None] ** 2)
    return place, number


def squares(points: Array, places: Array) -> Array:
    """Squares of all distances, (m, n), without the cancellation of |x|² - 2xy + |y|²."""
    result = np.zeros((len(places), len(points)))
    for along, place in zip(points.T, places.T, strict=True):
        away = np.subtract.outer(place, along)
        away *= away
        result += away
    return result
