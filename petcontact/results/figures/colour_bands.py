"""Colours in bands between contour levels: the levels, their colours, and triangles cut along
them."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...untyped import ScalarMappable

BANDS = 10
"""About as many as are told apart."""
UNIFORM, SIGNED = "viridis", "coolwarm"
"""Colour maps: perceptually uniform, and of values of two signs."""
UNKNOWN = (0.85, 0.85, 0.85, 1.0)
"""Colour of what has no value."""


def band_colours(values: Array, top: float | None = None) -> ScalarMappable:
    """Colours from 0, or where values are negative from minus the largest, to the largest or a
    given one, in bands."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm
    from matplotlib.ticker import MaxNLocator

    known = values[np.isfinite(values)]
    largest = top or float(np.abs(known).max(initial=0.0)) or 1.0
    signed = bool(known.min(initial=0.0) < 0.0)
    levels = MaxNLocator(BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(
        -largest if signed else 0.0, largest
    )
    name = SIGNED if signed else UNIFORM
    return ScalarMappable(BoundaryNorm(levels, colormaps[name].N, clip=True), name)


def beyond(values: Array, least: float, most: float) -> str:
    """On which side values lie beyond bounds, as colour bars have it."""
    low, high = np.nanmin(values, initial=np.inf) < least, np.nanmax(values, initial=-np.inf) > most
    return "both" if low and high else "min" if low else "max" if high else "neither"


def cut(corners: Array, values: Array, levels: Array) -> tuple[list[Array], Index, Index]:
    """Triangles cut along levels.

    Parameters
    ----------
    corners : (t, 3, d) array
    values : (t, 3) array
        Of a function that is linear on each; triangles with a NaN stay whole.
    levels : (l,) array
        Increasing; what lies beyond belongs to the first and the last band.

    Returns
    -------
    polygons : list of (k, d) arrays
    band : (p,) array
        Number of the band of each, -1 where it is not known.
    owner : (p,) array
        Number of the triangle.
    """
    known = np.isfinite(values).all(axis=1)
    within = np.clip(values, levels[0], levels[-1])
    low, high = (
        np.clip(np.searchsorted(levels, ends, "right") - 1, 0, len(levels) - 2)
        for ends in (within.min(axis=1), within.max(axis=1))
    )
    whole = np.flatnonzero(~known | (low == high))
    polygons = [*corners[whole]]
    band, owner = [*np.where(known, low, -1)[whole].tolist()], [*whole.tolist()]
    for k in np.flatnonzero(known & (low < high)).tolist():
        for number in range(low[k], high[k] + 1):
            piece = np.column_stack([corners[k], within[k]])
            for sign, level in ((1.0, levels[number]), (-1.0, levels[number + 1])):
                piece = _above(piece, sign, sign * level)
            if len(piece) > 2:
                polygons.append(piece[:, :-1])
                band.append(number)
                owner.append(k)
    return polygons, np.array(band, dtype=np.int64), np.array(owner, dtype=np.int64)


def _above(polygon: Array, sign: float, level: float) -> Array:
    """What of a convex polygon has sign times its last column at or above a level."""
    over = sign * polygon[:, -1] - level
    result = []
    for k in range(len(polygon)):
        a, b = over[k - 1], over[k]
        if a < 0.0 < b or b < 0.0 < a:
            result.append(polygon[k - 1] + a / (a - b) * (polygon[k] - polygon[k - 1]))
        if b >= 0.0:
            result.append(polygon[k])
    return np.array(result).reshape(-1, polygon.shape[1])
