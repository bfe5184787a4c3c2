"""First points of contact: the smallest values of a gap along a side."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..round_off import HALF
from .expression_features import SAMPLES
from .known_data import SideData

MOST_MINIMA = 4
"""Largest number of minima on one side to which meshes are graded; the lowest ones are taken."""


def gap_minima(field: SideData) -> Array:
    """Return the `MOST_MINIMA` lowest minima of a gap inside a side, as increasing fractions.

    Samples of the interval around each minimum leave two of its parts, until these are as short as
    a minimum is known (`HALF`). All minima are evaluated together.

    Parameters
    ----------
    field : SideData
        The gap along the side. Its samples resolve every minimum of the expression.
    """
    fractions, gap = field.samples, field.sampled[:, 0]
    # the ends of an interval of equal values are minima, too
    before, after = np.sign(gap[1:-1] - gap[:-2]), np.sign(gap[1:-1] - gap[2:])
    minima = np.flatnonzero((before <= 0.0) & (after <= 0.0) & (before + after < 0.0))
    minima = 1 + minima[np.argsort(gap[1 + minima], kind="stable")][:MOST_MINIMA]
    low, high = fractions[minima - 1], fractions[minima + 1]
    share = np.arange(1, SAMPLES)[:, None] / SAMPLES
    while (high - low).max(initial=0.0) > HALF:
        width = high - low
        inside = field.values((low + share * width).ravel())[:, 0].reshape(SAMPLES - 1, -1)
        best = inside.argmin(axis=0)
        low, high = low + best * width / SAMPLES, low + (best + 2) * width / SAMPLES
    return np.asarray(np.unique(0.5 * (low + high)))
