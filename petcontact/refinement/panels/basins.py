"""Basins of a gap: the places where a contact begins, and how these share its force."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from ...arrays import Array, Index, Mask, linked
from ...geometry.chart import Chart
from ...linalg.root import root_between
from .ridge import Gap, nearly_least, samples

JOINED = 7
"""Number of nearest bottoms, with itself, to which each one may be joined. Those of samples of a
slanted ridge are a row."""
BETWEEN = np.linspace(0.0, 1.0, 17)[1:-1, None, None]
"""Shares of the way between two bottoms at which the gap is looked at [-]."""
POWER = 1.5
"""Power of the approach with which the force of an ellipse grows. That of a line grows almost in
proportion, and each step then leaves about half of an error."""

Within = Callable[[Array], Mask]
"""Function that tells which places (n, 2) of a chart lie in a basin."""


def basins(gap: Gap, chart: Chart, approach: float) -> list[Within]:
    """Return the basins of a gap.

    Each sample of a face leads down to a bottom. Bottoms with less than the approach between them
    are in one basin; higher ones, at which nothing touches, count for all basins.
    """
    place, size = samples(chart), chart.high - chart.low
    tree = scipy.spatial.cKDTree((place - chart.low) / size, boxsize=[float(chart.wraps), 0.0])
    value, rank = gap(place), np.empty(len(place), dtype=np.int64)
    rank[np.argsort(value, kind="stable")] = np.arange(len(place))
    near = tree.query(tree.data, 9)[1]
    bottom = near[np.arange(len(place)), rank[near].argmin(axis=1)]
    while np.any(bottom[bottom] != bottom):
        bottom = bottom[bottom]
    low = np.unique(bottom[nearly_least(value, approach)[bottom]])
    basin = np.full(len(place), -1)
    basin[low] = _joined(gap, place[low], value[low], float(value.min()) + approach)

    def within(number: int) -> Within:
        own = np.isin(basin[bottom], [number, -1])
        return lambda there: own[tree.query((there - chart.low) / size)[1]]

    return [within(number) for number in range(basin.max() + 1)]


def _joined(gap: Gap, place: Array, value: Array, level: float) -> Index:
    """Return the basin (n,) of each of some bottoms."""
    count = min(JOINED, len(place))
    near = scipy.spatial.cKDTree(place).query(place, [*range(1, count + 1)])[1]
    pairs = np.array([np.repeat(np.arange(len(place)), count), near.ravel()])
    first, last = place[pairs]
    between = gap((first + BETWEEN * (last - first)).reshape(-1, 2)).reshape(len(BETWEEN), -1)
    open_ones = between.max(axis=0) > np.maximum(value[pairs].max(axis=0), level)
    return linked(pairs[:, ~open_ones], len(place))


def shares(forces: Array, least: Array, approach: Array) -> Array:
    """Return the forces (n,) that press basins by one approach, with the sum of the given ones.

    Parameters
    ----------
    forces : (n,) array
        [force]
    least : (n,) array
        The gap of each basin [length].
    approach : (n,) array
        What the given forces press each basin by [length].
    """

    def at(level: float) -> Array:
        return np.asarray(forces * (np.maximum(level - least, 0.0) / approach) ** POWER)

    low, total = float(least.min()), float(forces.sum())
    high = 2.0 * float((least - low + approach).max())
    found = at(root_between(lambda x: float(at(x).sum()) - total, low, low + high))
    return np.asarray(found * (total / found.sum()))
