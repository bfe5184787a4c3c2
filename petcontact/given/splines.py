"""Functions of the place through points, or near them."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import cast

import numpy as np
import scipy

from ..arrays import Array
from ..errors import InputError
from ..geometry.noise import Noise, noise_of
from ..geometry.smooth_curve import quiet, smoothest
from ..round_off import WRITTEN
from .sites import Sites
from .tables.points import Points
from .values import Given, as_given

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
    >>> gap.at(Sites(np.array([[2.0, 5.0]]))) # doctest: +ELLIPSIS
    Traceback (most recent call last):
    petcontact.errors.InputError: gap: its points reach from x = -1 to 1, asked for at x = 2; an ...
    """

    rough = False

    def values(self, sites: Sites) -> Array:
        table = self._table
        dim = table.shape[1] - 1
        if dim != sites.x.shape[1] - 1:
            names = "3 columns (x, y, value)" if dim == 1 else "2 columns (x, value)"
            raise InputError(f"{self.key}.columns: must be {names} here, got {dim + 1} columns")
        places = sites.x[:, :dim]
        low, high = table[:, :dim].min(axis=0), table[:, :dim].max(axis=0)
        inside = np.clip(places, low, high)
        for c, name in enumerate("xy"[:dim]):
            away = np.abs(places - inside)[:, c]
            if away.max(initial=0.0) > WRITTEN * (high - low)[c]:
                raise InputError(
                    f"{self.key}: its points reach from {name} = {low[c]:g} to {high[c]:g}, asked "
                    f"for at {name} = {places[away.argmax(), c]:g}; an obstacle of the shape "
                    '"points" may be narrower than the part'
                )
        return np.asarray(self._spline(*inside.T))

    @functools.cached_property
    def _table(self) -> Array:
        """The columns of places and of values."""
        return np.asarray(self.source.table)

    @property
    def _spline(self) -> Callable[..., Array]:
        """The function of the columns of places."""
        return self._fitted[0]

    @functools.cached_property
    def _fitted(self) -> tuple[Callable[..., Array], float]:
        """The function, and its sum of squared distances."""
        table, smooth = self._table, self.source.smooth
        places, given = table[:, :-1], table[:, -1]
        fit = _curve(*table.T) if len(table.T) == 2 else _surface(self.key, *table.T)

        def away(found: Callable[..., Array]) -> float:
            return float(np.abs(found(*places.T) - given).max())

        return smoothest(fit, away, smooth, len(given))

    def noise_at(self, x: Array, reach: float) -> Noise:
        places, *values = self._table.T
        if len(values) > 1:
            return Noise()
        own, squares = self._fitted
        ends = np.clip(x[0] + reach * np.array([-1.0, 1.0]), *places[[0, -1]])

        def bend(noise: Array | None) -> float:
            again = own if noise is None else _curve(places, own(places) + noise)(squares)
            slope = again.derivative()  # type: ignore[attr-defined]
            return float(np.diff(slope(ends))[0] / np.diff(ends)[0])

        across = np.ones((len(places), 1))
        return noise_of(
            places, values[0][:, None], across, self.source.smooth, bend if reach else None
        )

    @property
    def words(self) -> str:
        return f"{self.key}: {self.source}"


def _curve(x: Array, y: Array) -> Fit:
    def fit(squares: float) -> Callable[..., Array]:
        if not squares:
            return cast(Callable[..., Array], scipy.interpolate.make_interp_spline(x, y))
        return cast(
            Callable[..., Array], quiet(scipy.interpolate.UnivariateSpline, x, y, s=squares)
        )

    return fit


def _surface(key: str, x: Array, y: Array, z: Array) -> Fit:
    lines = [np.unique(column) for column in (x, y)]
    order = np.lexsort((y, x))
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    if len(grid) == len(z) and np.array_equal(np.column_stack([x, y])[order], grid):
        values = z[order].reshape(len(lines[0]), len(lines[1]))
        build = scipy.interpolate.RectBivariateSpline
        return lambda squares: quiet(build, *lines, values, s=squares).ev
    places = np.column_stack([x, y])
    if len(np.unique(places, axis=0)) < len(z) or np.linalg.matrix_rank(places - places[0]) < 2:
        raise InputError(f"{key}.points: must not repeat a place (x, y) nor lie on one line")

    def fit(squares: float) -> Callable[..., Array]:
        if squares:
            return cast(
                Callable[..., Array],
                quiet(scipy.interpolate.SmoothBivariateSpline, x, y, z, s=squares).ev,
            )
        through = scipy.interpolate.RBFInterpolator(places, z, kernel="quintic", degree=2)
        return lambda u, v: through(np.column_stack([u, v]))

    return fit


as_given.register(Points, lambda source, key: Spline(key, source))
