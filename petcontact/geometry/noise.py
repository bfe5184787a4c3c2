"""Noise of measured points, and what it does to curvatures of smooth curves near them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..record import record
from ..round_off import SUMMED, TINY

NEIGHBOURS = 5
"""Points of a fourth difference."""
NORMAL_MEDIAN = 0.6745
"""Median of the size of a normal variable over its deviation."""
ALTERNATE = 0.65
"""Half way between 0.5 of independent values and 0.8 of fourth differences of noise."""
FOLLOWED = 3.0
"""Distance from the points over the deviation of their noise, below which a curve follows them: 3
of 1000 normal values are larger, and values that are rounded deviate by √3 at most."""
REPLICAS = 16
"""Number of repeated measurements that are drawn: the root of a mean square is then known to
1/√32, a fifth of it."""


@record
class Noise:
    """What the noise of points does to a curve near them.

    Attributes
    ----------
    largest : float
        Largest noise of the points [length].
    share : float
        Share of the second differences of the points that is noise, which the curve follows; 0 if
        it does not [-].
    spread : float
        Root mean square of the relative change of the curvature at a place [-].
    """

    largest: float = 0.0
    share: float = 0.0
    spread: float = 0.0


def noise_of(
    places: Array,
    values: Array,
    across: Array,
    smooth: float,
    bend: Callable[[Array | None], float] | None,
) -> Noise:
    """Return the noise of points, and its effect on a curve.

    Fourth differences of a smooth function are small and keep their signs. Those of noise change
    sign from place to place with a probability of arccos(-0.8)/π = 0.80. The noise is their median
    over that of a normal distribution with the same weights. It is 0 if fewer than 0.65 change
    (J. J. Moré and S. M. Wild, Estimating computational noise, SIAM J. Sci. Comput. 33, 2011). Its
    effect is that of as much noise on points of the curve itself, to which a curve is fitted again
    (the parametric bootstrap of B. Efron and R. J. Tibshirani, An Introduction to the Bootstrap,
    1993, section 6.5).

    Parameters
    ----------
    places : (n,) array
        Increasing parameters of the points [length].
    values, across : (n, c) arrays
        Coordinates, and unit vectors along which noise counts.
    smooth : float
        Distance within which the curve stays from the points [length].
    bend : callable, optional
        Function from noise (n,) to the curvature of the curve that is fitted to points of the curve
        with this noise; without noise, that of the curve [1/length]. Without it the spread is 0.

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 101)
    >>> noise = np.random.default_rng(0).normal(0.0, 1e-3, 101)
    >>> rows, up = np.column_stack([x, x**2 + noise]), np.tile([0.0, 1.0], (101, 1))
    >>> found = noise_of(x, rows, up, 0.0, None)
    >>> 2e-3 < found.largest < 4e-3, found.share > 0.9
    (True, True)
    """
    if not (noise := _deviation(places, values, across)):
        return Noise()
    # the largest of n normal values is about so large
    largest = noise * math.sqrt(2.0 * math.log(len(places)))
    if smooth < FOLLOWED * noise:
        step = np.diff(places)[:, None]
        second = np.diff(np.diff(values, axis=0) / step, axis=0) * 0.5 * (step[1:] + step[:-1])
        size = np.sqrt(np.mean(np.einsum("nc,nc->n", second, across[1:-1]) ** 2))
        return Noise(largest, min(1.0, math.sqrt(6.0) * noise / float(size)))
    if bend is None:
        return Noise(largest)
    rng, own = np.random.default_rng(0), bend(None) or TINY
    changed = [bend(rng.normal(0.0, noise, len(places))) / own - 1.0 for _ in range(REPLICAS)]
    return Noise(largest, 0.0, float(np.sqrt(np.mean(np.square(changed)))))


def _deviation(places: Array, values: Array, across: Array) -> float:
    """Return the standard deviation of the noise, 0 if there is none that shows."""
    if len(places) < 2 * NEIGHBOURS:
        return 0.0
    near, rows = (
        np.lib.stride_tricks.sliding_window_view(c, NEIGHBOURS, axis=0) for c in (places, values)
    )
    apart = near[:, :, None] - near[:, None, :]
    weight = 1.0 / np.where(np.eye(NEIGHBOURS, dtype=bool), 1.0, apart).prod(axis=2)
    middle = slice(NEIGHBOURS // 2, -(NEIGHBOURS // 2))
    fourth = np.einsum("nk,nck,nc->n", weight, rows, across[middle])
    fourth /= np.linalg.norm(weight, axis=1)
    changes = np.mean(fourth[1:] * fourth[:-1] < 0.0)
    noise = float(np.median(np.abs(fourth))) / NORMAL_MEDIAN
    if changes < ALTERNATE or noise <= SUMMED * float(np.abs(values).max()):
        return 0.0
    return noise
