"""Smooth curves through points of the plane, or near them, and sides of outlines along them."""

from __future__ import annotations

import functools
import itertools
import math
import warnings
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import scipy

from ..arrays import Array
from ..record import field, record, replace
from ..round_off import TINY
from .arcs import turn_between
from .noise import Noise, noise_of
from .outline import Side

Fit = TypeVar("Fit")
HALVINGS = 16
"""Halvings of the range of the logarithm of the sum of squares, which leave less than 1e-3 of
it."""
PIECE = math.radians(30.0)
"""Largest turn of a side [rad]."""
OFF = 1e-3
"""Largest distance of a side from its own arc, over its length: those who know arcs only, as the
search for what lies opposite, are off by so much."""
WITHIN = np.linspace(0.0, 1.0, 17)
"""Places on a side at which this is looked at."""
AROUND = np.linspace(-1.0, 1.0, 33)
"""Places over which curvature is averaged, over the reach."""
LOCAL = 0.1
"""Over the distance of points: the curvature of shorter elements is that in their middle, of longer
ones that of the arc through it. Round-off of the latter is 1e-16 over the square, times the radius
over the distance of points."""
FLAT = 1e-9
"""Least curvature of an arc, over the inverse of the length of its curve: it then is no straight
line, of which others lie on one line."""
HELD = 1e6
"""Weight of points that the curve meets: its distance from them is 1e-6 of that from others."""
NEWTON = 6
"""Steps of Newton's method from a place that is off by 1e-3: three give all digits."""


def smoothest(
    fit: Callable[[float], Fit], away: Callable[[Fit], float], smooth: float, count: int
) -> tuple[Fit, float]:
    """Return the fit with the largest sum of squares that is nowhere further away than `smooth`,
    and this sum.

    Each of `count` points is at most so far away where the sum of squares is at most its square.
    """
    if not smooth:
        return fit(0.0), 0.0
    low, high = 0.0, math.log(count)
    if away(widest := fit(most := smooth**2 * math.exp(high))) <= smooth:
        return widest, most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        nearer = away(fit(smooth**2 * math.exp(middle))) <= smooth
        low, high = (middle, high) if nearer else (low, middle)
    return fit(most := smooth**2 * math.exp(low)), most


T = TypeVar("T")


def quiet(build: Callable[..., T], *arguments: object, **options: object) -> T:
    """A spline of FITPACK, whose warnings are about sums of squares that no caller gave."""
    with warnings.catch_warnings(action="ignore"):
        return build(*arguments, **options)


@record
class SmoothCurve:
    """A cubic spline near points, in the order given, with continuous curvature.

    It begins at the first point and ends at the last one. Its parameter is the arc length up to
    1e-4, which is all that arc lengths are used for.

    Attributes
    ----------
    points : tuple of n points
        At least 4 [length].
    smooth : float
        Largest distance from the points [length].
    closed : bool
        Whether it is periodic; the last point then repeats the first one.
    mirrored : pair of bool
        Whether the first and the last point lie on the axis x = 0 of revolution, beyond which its
        image goes on.

    Examples
    --------
    >>> turn = np.linspace(0.0, 2.0 * np.pi, 65)
    >>> circle = SmoothCurve(tuple(zip(np.cos(turn), np.sin(turn))), closed=True)
    >>> round(circle.length / np.pi, 4), circle.bends(np.array([1.0])).round(4).tolist()
    (2.0, [1.0001])
    """

    points: tuple[tuple[float, ...], ...]
    smooth: float = 0.0
    closed: bool = False
    mirrored: tuple[bool, bool] = (False, False)

    @functools.cached_property
    def _given(self) -> tuple[Array, Array, int]:
        """All points with the images of some (m, 2), their weights, and how many come before."""
        given = np.array(self.points)
        image = given[::-1] * [-1.0, 1.0]
        before, after = (image[:-1] if side else image[:0] for side in self.mirrored)
        points, first = np.vstack([before, given, after[1:]]), len(before)
        weight = np.ones(len(points))
        if not self.closed:
            weight[[0, first, first + len(given) - 1, -1]] = HELD
        return points, weight, first

    @functools.cached_property
    def _fitted(self) -> tuple[object, Array, float]:
        """The spline as FITPACK has it, the parameters of all points, and its sum of squares."""
        points = self._given[0]
        chords = np.insert(np.cumsum(np.hypot(*np.diff(points, axis=0).T)), 0, 0.0)

        def fit(squares: float) -> tuple[object, Array]:
            u = _arc_lengths(self._spline(points, chords, squares), chords)
            return self._spline(points, u, squares), u

        def away(found: tuple[object, Array]) -> float:
            off = np.array(scipy.interpolate.splev(found[1], found[0])) - points.T
            return float(np.hypot(*off).max())

        (spline, u), squares = smoothest(fit, away, self.smooth, len(points))
        return spline, u, squares

    def _spline(self, points: Array, u: Array, squares: float) -> object:
        weight, closed = self._given[1], self.closed
        return quiet(scipy.interpolate.splprep, points.T, weight, u, s=squares, per=closed)[0]

    def noise_at(self, x: Array, reach: float) -> Noise:
        """What the noise of the points does to the mean curvature so far on either side of a place
        (2,), see `noise_of`; without a reach only what it is."""
        _, u, squares = self._fitted
        own, along = self.at(u), self.tangents(u)
        across = np.column_stack([-along[:, 1], along[:, 0]])
        middle = u[int(np.hypot(*(own - x).T).argmin())]
        places = np.clip(middle + reach * AROUND, *u[[0, -1]])

        def bend(noise: Array | None) -> float:
            if noise is None:
                return float(self.bends(places).mean())
            again = self._spline(own + noise[:, None] * across, u, squares)
            return float(_bends(again, places).mean())

        return noise_of(u, self._given[0], across, self.smooth, bend if reach else None)

    @property
    def reach(self) -> tuple[float, float]:
        """Parameters of the first and of the last point [length]."""
        u, first = self._fitted[1], self._given[2]
        return float(u[first]), float(u[first + len(self.points) - 1])

    @property
    def length(self) -> float:
        """Range of the parameter [length]."""
        first, last = self.reach
        return last - first

    def at(self, u: Array, derivative: int = 0) -> Array:
        """Points or derivatives (n, 2) at parameters (n,)."""
        if not len(u):  # FITPACK takes no empty arrays
            return np.empty((0, 2))
        return np.array(scipy.interpolate.splev(u, self._fitted[0], derivative)).T

    def tangents(self, u: Array) -> Array:
        """Unit vectors (n, 2)."""
        along = self.at(u, 1)
        return np.asarray(along / np.hypot(*along.T)[:, None])

    def bends(self, u: Array) -> Array:
        """Curvatures (n,), positive where the curve turns left [1/length]."""
        return _bends(self._fitted[0], u)

    def sides(self, part: str) -> list[Side]:
        """The sides of an outline along the curve, each nearly an arc."""
        ends = [self.reach[0], *self._cut(*self.reach)]
        points = self.at(np.array(ends))
        if not self.closed:
            points[[0, -1]] = np.array(self.points)[[0, -1]]
        points[-1] = points[0] if self.closed else points[-1]
        pairs = zip(itertools.pairwise(ends), itertools.pairwise(points), strict=True)
        return [self._side(*reach, *points, part) for reach, points in pairs]

    def _cut(self, first: float, last: float) -> list[float]:
        """Ends of sides from one parameter to another."""
        u = first + (last - first) * WITHIN
        x, angle = self.at(u), np.unwrap(np.arctan2(*self.tangents(u).T[::-1]))
        own = self._side(first, last, x[0], x[-1])
        off = float(np.hypot(*(Side.point(own, WITHIN) - x).T).max())
        short = last - first <= self.length / len(self.points)
        if short or (np.ptp(angle) <= PIECE and off <= OFF * own.length):
            return [last]
        middle = float(u[len(u) // 2])
        return [*self._cut(first, middle), *self._cut(middle, last)]

    def _side(
        self, first: float, last: float, start: Array, end: Array, part: str = ""
    ) -> SmoothSide:
        bend = float(self.arcs(np.array([first]), np.array([last]))[1][0])
        return SmoothSide(start, end, part, bend, curve=self, first=first, last=last)

    def arcs(self, first: Array, last: Array) -> tuple[Array, Array]:
        """Unit vectors (n, 2) along the chords between parameters, and the curvatures (n,) of the
        arcs between, never quite 0 [1/length]."""
        way = np.copysign(1.0, last - first)
        a, b, c = (self.at(u) for u in (first, 0.5 * (first + last), last))
        chord, half, rest = c - a, b - a, c - b
        size = np.hypot(*chord.T)
        tiny = np.abs(last - first) < LOCAL * self.length / len(self.points)
        middle = 0.5 * (first + last)
        along = np.where(
            tiny[:, None],
            way[:, None] * self.tangents(middle),
            chord / np.maximum(size, TINY)[:, None],
        )
        turn = turn_between(half, rest)
        bend = np.where(tiny, way * self.bends(middle), 2.0 * np.sin(turn) / np.maximum(size, TINY))
        return along, np.copysign(np.maximum(np.abs(bend), FLAT / self.length), bend)


@record
class SmoothSide(Side):
    """A piece of a smooth curve, from one parameter of it to another.

    Its curvature is that of the arc that is closest to it.

    Attributes
    ----------
    curve : SmoothCurve
    first, last : float
        Parameters at the start and at the end.
    """

    curve: SmoothCurve = field(kw_only=True)
    first: float = field(kw_only=True)
    last: float = field(kw_only=True)

    @functools.cached_property
    def length(self) -> float:
        """Length of the side [length]."""
        return abs(self.last - self.first)

    @property
    def whole(self) -> float:
        """As of `Side`."""
        return self.curve.length

    def _places(self, fraction: Array) -> Array:
        return np.asarray(self.first + (self.last - self.first) * np.asarray(fraction))

    def point(self, fraction: Array) -> Array:
        """As of `Side`."""
        t = np.asarray(fraction, dtype=float)[:, None]
        points = np.where(t == 0.0, self.start, self.curve.at(self._places(fraction)))
        return np.where(t == 1.0, self.end, points)

    def tangents(self, fraction: Array) -> Array:
        """As of `Side`."""
        way = math.copysign(1.0, self.last - self.first)
        return way * self.curve.tangents(self._places(fraction))

    def arcs(self, breaks: Array) -> tuple[Array, Array]:
        """As of `Side`."""
        u = self._places(breaks)
        return self.curve.arcs(u[:-1], u[1:])

    def nearest(self, x: Array) -> Array:
        """As of `Side`, by Newton's method from the place on the arc."""
        t = super().nearest(x)
        for _ in range(NEWTON):
            u = self._places(t)
            away, along, bent = self.curve.at(u) - x, self.curve.at(u, 1), self.curve.at(u, 2)
            slope = np.einsum("ij,ij->i", along, along) + np.einsum("ij,ij->i", away, bent)
            step = np.einsum("ij,ij->i", away, along) / np.where(slope > 0.0, slope, np.inf)
            t = np.clip(t - step / (self.last - self.first), 0.0, 1.0)
        return t

    def reversed(self) -> Side:
        """As of `Side`."""
        back = replace(self, start=self.end, end=self.start, first=self.last, last=self.first)
        return replace(back, curvature=-self.curvature)


def _bends(spline: object, u: Array) -> Array:
    """Curvatures (n,) of a spline at parameters (n,)."""
    (x, y), (ddx, ddy) = (scipy.interpolate.splev(u, spline, derivative) for derivative in (1, 2))
    return np.asarray((x * ddy - y * ddx) / np.hypot(x, y) ** 3)


def _arc_lengths(spline: object, u: Array) -> Array:
    """Arc lengths (n,) of a spline at parameters (n,)."""
    xi, weight = np.polynomial.legendre.leggauss(4)
    half = 0.5 * np.diff(u)[:, None]
    places = (u[:-1, None] + half * (1.0 + xi)).ravel()
    speed = np.hypot(*scipy.interpolate.splev(places, spline, 1))
    pieces = (half * weight * speed.reshape(half.shape[0], -1)).sum(axis=1)
    return np.insert(np.cumsum(pieces), 0, 0.0)
