"""Where surfaces touch first: the lowest places of a gap along a side."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .known_data import Field

MOST = 4
"""Minima of one side, the lowest ones, that meshes are graded to."""
PARTS, ROUNDS = 1024, 4
"""Into how many parts the interval around a minimum is cut, and how often: all places of a round
are looked at together."""


def gap_minima(field: Field) -> Array:
    """Places inside a side at which a gap is least, the lowest `MOST` of them, as fractions,
    increasing.

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
    share = np.arange(1, PARTS)[:, None] / PARTS
    for _ in range(ROUNDS if len(here) else 0):
        width = high - low
        inside = field.values((low + share * width).ravel())[:, 0].reshape(PARTS - 1, -1)
        best = inside.argmin(axis=0)
        low, high = low + best * width / PARTS, low + (best + 2) * width / PARTS
    return np.asarray(np.unique(0.5 * (low + high)))
