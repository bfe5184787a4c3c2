"""Functions of the place through points, or near them."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..geometry.smooth_curve import quiet, smoothest
from ..round_off import SUMMED
from .sites import Sites
from .tables.points import Points
from .values import Given, as_given

BEYOND = 1e-9
"""Share of the extent of the points by which places may lie outside: round-off of positions."""
NEIGHBOURS = 5
"""Points of a fourth difference."""
NORMAL_MEDIAN = 0.6745
"""Median of the size of a normal variable over its deviation."""
ALTERNATE = 0.65
"""Half way between 0.5 of independent values and 0.8 of fourth differences of noise."""
Fit = Callable[[float], Callable[..., Array]]
"""From the largest sum of squared distances to a function of the columns of places."""


class Spline(Given):
    """A cubic spline of `Points`, with continuous curvature.

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 9)
    >>> gap = as_given(Points(np.column_stack([x, x**2])), "gap")
    >>> gap.at(Sites(np.array([[0.3, 5.0]]))).round(12).tolist()
    [0.09]
    >>> gap.at(Sites(np.array([[2.0, 5.0]])))
    Traceback (most recent call last):
    petcontact.errors.InputError: gap: its points reach from x = -1 to 1, asked for at x = 2
    """

    rough = False

    def values(self, sites: Sites) -> Array:
        table = self.source.table
        dim = table.shape[1] - 1
        if dim != sites.x.shape[1] - 1:
            names = "3 columns (x, y, value)" if dim == 1 else "2 columns (x, value)"
            raise InputError(f"{self.key}.columns: must be {names} here, got {dim + 1} columns")
        places = sites.x[:, :dim]
        low, high = table[:, :dim].min(axis=0), table[:, :dim].max(axis=0)
        inside = np.clip(places, low, high)
        for c, name in enumerate("xy"[:dim]):
            away = np.abs(places - inside)[:, c]
            if away.max(initial=0.0) > BEYOND * (high - low)[c]:
                raise InputError(
                    f"{self.key}: its points reach from {name} = {low[c]:g} to {high[c]:g}, asked "
                    f"for at {name} = {places[away.argmax(), c]:g}"
                )
        return np.asarray(self._spline(*inside.T))

    @functools.cached_property
    def _spline(self) -> Callable[..., Array]:
        """The function of the columns of places."""
        table, smooth = self.source.table, self.source.smooth
        places, given = table[:, :-1], table[:, -1]
        fit = _curve(*table.T) if len(table.T) == 2 else _surface(self.key, *table.T)

        def away(found: Callable[..., Array]) -> float:
            return float(np.abs(found(*places.T) - given).max())

        return smoothest(fit, away, smooth, len(given))

    @property
    def noise(self) -> tuple[float, float]:
        """Noise that the spline follows [length], and its share of second differences [-]."""
        table = self.source.table
        if table.shape[1] > 2:
            return 0.0, 0.0
        noise, share = noise_of(*table.T)
        # the largest of n normal values is about so large
        largest = noise * math.sqrt(2.0 * math.log(len(table)))
        return (largest, share) if self.source.smooth < largest else (0.0, 0.0)

    @property
    def words(self) -> str:
        return f"{self.key}: {self.source}"


def noise_of(x: Array, y: Array) -> tuple[float, float]:
    """Return the noise of values (n,) at increasing places (n,), and its share of their second
    differences.

    Fourth differences of a smooth function are small and keep their signs. Those of noise change
    sign from place to place with a probability of arccos(-0.8)/π = 0.80. The noise is their median
    over that of a normal distribution with the same weights. It is 0 if fewer than 0.65 change
    (J. J. Moré and S. M. Wild, Estimating computational noise, SIAM J. Sci. Comput. 33, 2011).
    """
    if len(x) < 2 * NEIGHBOURS:
        return 0.0, 0.0
    near, values = (np.lib.stride_tricks.sliding_window_view(c, NEIGHBOURS) for c in (x, y))
    apart = near[:, :, None] - near[:, None, :]
    weight = 1.0 / np.where(np.eye(NEIGHBOURS, dtype=bool), 1.0, apart).prod(axis=2)
    fourth = (weight * values).sum(axis=1) / np.linalg.norm(weight, axis=1)
    changes = np.mean(fourth[1:] * fourth[:-1] < 0.0)
    noise = float(np.median(np.abs(fourth))) / NORMAL_MEDIAN
    if changes < ALTERNATE or noise <= SUMMED * float(np.abs(y).max()):
        return 0.0, 0.0
    second = np.diff(np.diff(y) / np.diff(x)) * 0.5 * (x[2:] - x[:-2])
    return noise, min(1.0, math.sqrt(6.0) * noise / float(np.sqrt(np.mean(second**2))))


def _curve(x: Array, y: Array) -> Fit:
    from scipy import interpolate  # its import takes long, and most problems have no points

    def fit(squares: float) -> Callable[..., Array]:
        if not squares:
            through: Callable[..., Array] = interpolate.make_interp_spline(x, y)
            return through
        near: Callable[..., Array] = quiet(interpolate.UnivariateSpline, x, y, s=squares)
        return near

    return fit


def _surface(key: str, x: Array, y: Array, z: Array) -> Fit:
    from scipy import interpolate

    lines = [np.unique(column) for column in (x, y)]
    order = np.lexsort((y, x))
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    if len(grid) == len(z) and np.array_equal(np.column_stack([x, y])[order], grid):
        values = z[order].reshape(len(lines[0]), len(lines[1]))
        build = interpolate.RectBivariateSpline
        return lambda squares: quiet(build, *lines, values, s=squares).ev
    places = np.column_stack([x, y])
    if len(np.unique(places, axis=0)) < len(z) or np.linalg.matrix_rank(places - places[0]) < 2:
        raise InputError(f"{key}.points: must not repeat a place (x, y) nor lie on one line")

    def fit(squares: float) -> Callable[..., Array]:
        if squares:
            near: Callable[..., Array] = quiet(
                interpolate.SmoothBivariateSpline, x, y, z, s=squares
            ).ev
            return near
        through = interpolate.RBFInterpolator(places, z, kernel="quintic", degree=2)
        return lambda u, v: through(np.column_stack([u, v]))

    return fit


as_given.register(Points, lambda source, key: Spline(key, source))
