"""Where surfaces touch first: the lowest places of a gap along a side."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .known_data import Field

MOST = 4
"""Minima of one side, the lowest ones, that meshes are graded to."""
SECTIONS = 60
"""Of the interval around a minimum, by thirds."""


def gap_minima(field: Field) -> Array:
    """Places inside a side at which a gap is least, the lowest `MOST` of them, as fractions, increasing.

    Parameters
    ----------
    field : Field
        The gap along the side; its samples miss no minimum that its text shows.
    """
    at, gap = field.samples, field.sampled[:, 0]
    # the ends of flat stretches are minima, too
    before, after = np.sign(gap[1:-1] - gap[:-2]), np.sign(gap[1:-1] - gap[2:])
    here = np.flatnonzero((before <= 0.0) & (after <= 0.0) & (before + after < 0.0))
    here = 1 + here[np.argsort(gap[1 + here], kind="stable")][:MOST]
    low, high = at[here - 1], at[here + 1]
    for _ in range(SECTIONS if len(here) else 0):
        left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
        lower = field.values(left)[:, 0] <= field.values(right)[:, 0]
        low, high = np.where(lower, low, left), np.where(lower, right, high)
    return np.asarray(np.unique(0.5 * (low + high)))
