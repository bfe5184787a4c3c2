"""How many Gauss points stand for a flat panel that is seen from afar."""

from __future__ import annotations

import functools
import math

import numpy as np

from ...arrays import Array, Index
from ...mesh.panels import Panels

MOST_POINTS = (64, 64, 144, 256)
"""Gauss points up to which a panel of each order is far: as dear as the closed form, which loses digits farther off."""
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24)
"""Numbers of points in one direction that are used."""
SAFETY = 2.5
RECTANGULAR = 0.9
"""Panels that fill less of their frame's box have slanting lines of Gauss points: the same number in both directions."""


@functools.cache
def least_log_rho(order: int, tolerance: float) -> Array:
    """ln ρ from which on each of `COUNTS` holds the tolerance on a panel of some order, decreasing; inf where none does.

    n points integrate polynomials of degree 2n-1 and the basis takes p of these: with k = 2n - p the rest is less than
    SAFETY k² ρ^-k of the largest integral, k² for the cubed distance of the traction (found for squares and for panels of
    1:5, all orders, from two half-lengths on).
    """
    k = 2.0 * np.array(COUNTS) - order
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(k > 0.0, (np.log(SAFETY * k * k) - math.log(tolerance)) / k, np.inf)


def point_counts(points: Array, panels: Panels, element: int, tolerance: float) -> Index:
    """Gauss points (m, 2) along both directions of a panel that hold the tolerance at each target, out of `COUNTS`, or 999.

    Along one direction the integrand is analytic inside the Bernstein ellipse of ρ whose foci are the ends, r vanishing at
    position ± i distance.
    """
    local = (points - panels.centre[element]) @ panels.frame[element].T / panels.size[element]
    low, high = panels.polygon[element].min(axis=0), panels.polygon[element].max(axis=0)
    half, offset = 0.5 * (high - low), local[:, :2] - 0.5 * (high + low)
    beyond = np.maximum(np.abs(offset) - half, 0.0)
    least = least_log_rho(panels.order, tolerance)
    counts = np.empty((len(points), 2), dtype=np.int64)
    for c in range(2):
        z = (np.abs(offset[:, c]) + 1j * np.hypot(beyond[:, 1 - c], local[:, 2])) / half[c]
        log_rho = np.log(np.abs(z + np.sqrt(z - 1.0) * np.sqrt(z + 1.0)))
        counts[:, c] = np.append(COUNTS, 999)[np.sum(log_rho[:, None] < least, axis=1)]
    x, y = panels.polygon[element].T
    if abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 2.0 * RECTANGULAR * np.prod(high - low):
        counts[:] = counts.max(axis=1, keepdims=True)
    return counts
