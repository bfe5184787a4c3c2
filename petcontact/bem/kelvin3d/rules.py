"""How many Gauss points stand for a flat panel that is seen from afar."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Index
from ...mesh.panels import Panels

MOST_POINTS = (64, 64, 100, 144)
"""Gauss points up to which a panel of each order is far: as dear as the closed form, which loses digits farther off."""
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24)
"""Numbers of points in one direction that are used."""
RECTANGULAR = 0.9
"""Panels that fill less of their frame's box have slanting lines of Gauss points: the same number in both directions."""


def point_counts(points: Array, panels: Panels, element: int, tolerance: float) -> Index:
    """Gauss points (m, 2) along both directions of a panel that hold the tolerance at each target, out of `COUNTS`.

    Along one direction the integrand is analytic inside the Bernstein ellipse of ρ whose foci are the ends, r vanishing at
    position ± i distance; n points err by about ρ^(p-2n).
    """
    local = (points - panels.centre[element]) @ panels.frame[element].T / panels.size[element]
    low, high = panels.polygon[element].min(axis=0), panels.polygon[element].max(axis=0)
    half, offset = 0.5 * (high - low), local[:, :2] - 0.5 * (high + low)
    beyond = np.maximum(np.abs(offset) - half, 0.0)
    counts = np.empty((len(points), 2), dtype=np.int64)
    for c in range(2):
        z = (np.abs(offset[:, c]) + 1j * np.hypot(beyond[:, 1 - c], local[:, 2])) / half[c]
        log_rho = np.maximum(np.log(np.abs(z + np.sqrt(z - 1.0) * np.sqrt(z + 1.0))), 1e-3)
        asked = 0.5 * (-math.log(tolerance) / log_rho + panels.order + 2)
        counts[:, c] = np.append(COUNTS, 999)[np.searchsorted(COUNTS, asked)]
    x, y = panels.polygon[element].T
    if abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 2.0 * RECTANGULAR * np.prod(high - low):
        counts[:] = counts.max(axis=1, keepdims=True)
    return counts
