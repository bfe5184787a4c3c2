"""Which places of a body are one: corners, joints, kinks of data, edges, points of the user."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array

TOLERANCE = 4.0 * math.sqrt(np.finfo(float).eps)
"""Distance over the size of a body within which places of it are one.

A line that is tangent to a circle, to the round-off ε of its radius, meets it within sqrt(2ε) of
that radius on either side: 2.8 sqrt(ε) apart. No projection is known better. Differences of
displacements over such a length keep half of their digits, over shorter ones none that matter.
"""
SMALLEST = 1e-10
"""Smallest elements over the size of the body, or its distance from the origin: six digits of their
lengths are left of its coordinates."""


def distinct(places: Array, within: float, length: float) -> Array:
    """Places along a side, increasing, without those that are one with the place before.

    Parameters
    ----------
    places : (n,) array
        In any order.
    within : float
        Distance within which places are one.
    length : float
        Of the side: places that are one with its ends, 0 and the length, become these.

    Examples
    --------
    >>> distinct(np.array([1.0, 0.5, 1e-9, 0.5 + 1e-9]), 1e-8, 1.0)
    array([0. , 0.5, 1. ])
    """
    values: Array = np.sort(np.asarray(places, dtype=float))
    values[np.abs(values) <= within] = 0.0
    values[np.abs(values - length) <= within] = length
    return np.asarray(values[np.append(True, np.diff(values) > within)[: len(values)]])


def inside(places: Array, within: float, length: float) -> Array:
    """Return the distinct places on a side that do not coincide with its ends [length]."""
    fractions = distinct(places, within, length)
    return np.asarray(fractions[(fractions > 0.0) & (fractions < length)])
