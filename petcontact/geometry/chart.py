"""A face unrolled onto a rectangle or a disc, with its images in planes of symmetry."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from ..arrays import Array, Index, Mask
from ..record import field, record, replace
from ..round_off import SINGLE


@record
class Chart:
    """A rectangle in coordinates (u, v) [length], right-handed seen from outside the body.

    Lengths are those of the face, on a surface of revolution those of its middle.

    Attributes
    ----------
    low, high : (2,) arrays
        Of the rectangle [length].
    at, local : callable
        Points (n, 3) of the face at coordinates (n, 2), and coordinates of points.
    flat : bool
        Whether the face is plane.
    wraps : bool
        Whether the ends of u are one line on the face, which then has no rim there.
    round : bool
        Whether the face is the disc in the rectangle, a square about 0.
    cuts : (k, 3) array
        Lines that end a disc: unit vectors away from it, and their distances from 0 [length].
    own : (2, 2) array, optional
        `low` and `high` of the face itself where the rectangle goes on beyond planes of symmetry,
        with the images of the face [length].
    """

    low: Array
    high: Array
    at: Callable[[Array], Array]
    local: Callable[[Array], Array]
    flat: bool = False
    wraps: bool = False
    round: bool = False
    cuts: Array = field(default_factory=lambda: np.zeros((0, 3)))
    own: Array | None = None

    @property
    def itself(self) -> Chart:
        """The chart of the face without images in planes of symmetry."""
        low, high = self.sides
        return replace(self, low=low, high=high, own=None)

    @property
    def sides(self) -> Array:
        """`low` and `high` of the face itself (2, 2) [length]."""
        return np.array([self.low, self.high]) if self.own is None else self.own

    @property
    def mirrored(self) -> Mask:
        """At which of its sides the face goes on with its images, (2, 2)."""
        return np.asarray(np.abs(np.array([self.low, self.high]) - self.sides) > self.slack)

    def unfolded(self, mirrored: Mask) -> Chart:
        """Return the chart of a face with its images in the planes at some of its sides (2, 2), at
        most one along each coordinate."""
        return functools.reduce(_with_image, np.argwhere(mirrored), self)

    def part(self, sides: Array) -> Chart:
        """Return the chart of the part of the face between coordinates (2, 2), with its images."""
        reach = np.where(self.mirrored, 2.0 * sides - sides[::-1], sides)
        return replace(
            self, low=reach[0], high=reach[1], own=sides if self.own is not None else None
        )

    @property
    def copies(self) -> int:
        """Number of images of the face, with itself."""
        return int(2 ** np.count_nonzero(self.mirrored))

    def images(self, place: Array) -> Array:
        """Return places (n, 2) of the face with those of their images, (c n, 2)."""
        for side, axis in np.argwhere(self.mirrored):
            image = place.copy()
            image[:, axis] = 2.0 * self.sides[side, axis] - image[:, axis]
            place = np.concatenate([place, image])
        return place

    def folded(self, place: Array) -> Array:
        """Return the places on the face itself whose images are at places (n, 2)."""
        result = place.copy()
        for side, axis in np.argwhere(self.mirrored):
            result[:, axis] = _in_front(result[:, axis], self.sides[side, axis], side)
        return result

    def holds(self, place: Array, slack: float) -> Mask:
        """Return which coordinates (n, 2) are on the face, or at most `slack` beyond its rim."""
        if self.round:
            off = place @ self.cuts[:, :2].T - self.cuts[:, 2]
            inner = np.linalg.norm(place, axis=1) <= self.high[0] + slack
            return np.asarray(inner & (off <= slack).all(axis=1))
        inside = (place >= self.low - slack) & (place <= self.high + slack)
        return np.asarray(inside.all(axis=1))

    def tangents(self, place: Array) -> Array:
        """Return unit vectors (2, n, 3) along u and v at coordinates (n, 2), nan where lines of one
        coordinate meet."""
        ways = self.slopes(place)
        with np.errstate(invalid="ignore"):
            return np.asarray(ways / np.linalg.norm(ways, axis=2, keepdims=True))

    def slopes(self, place: Array) -> Array:
        """Return how points move with each coordinate at coordinates (n, 2), (2, n, 3) [-]."""
        step = 1e-5 * float((self.high - self.low).min())
        ways = [self.at(place + step * unit) - self.at(place - step * unit) for unit in np.eye(2)]
        return np.array(ways) / (2.0 * step)

    @property
    def slack(self) -> float:
        """Distance up to which points are one [length]."""
        return SINGLE * float((self.high - self.low).max())

    def room(self, place: Array, way: Array) -> float:
        """Return how far a point (2,) may go along a unit vector to the rim [length]."""
        if self.round:
            return float(self.rays(place, way[None])[0])
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(way > 0.0, self.high - place, self.low - place) / way
        least = float(room[np.abs(way) > SINGLE].min())
        return least if least > self.slack else 0.0

    def rays(self, place: Array, ways: Array) -> Array:
        """Return how often vectors (n, 2) lead from a point (2,) of a disc to its rim, (n,) [-]."""
        along, square = ways @ place, np.sum(ways**2, axis=1)
        room = float(self.high[0] ** 2 - place @ place)
        share = (np.sqrt(np.maximum(along**2 + square * room, 0.0)) - along) / square
        towards, left = ways @ self.cuts[:, :2].T, self.cuts[:, 2] - self.cuts[:, :2] @ place
        lines = np.divide(left, towards, out=np.full_like(towards, np.inf), where=towards > 0.0)
        return np.asarray(np.minimum(share, lines.min(axis=1, initial=np.inf)))

    @property
    def corners(self) -> Array:
        """Where lines that end a disc meet one another on it, and where they meet its rim, (n, 2)
        [length]."""
        ways, away = self.cuts[:, :2], self.cuts[:, 2:]
        half = np.sqrt(np.maximum(self.high[0] ** 2 - away**2, 0.0))
        along = half * np.column_stack([-ways[:, 1], ways[:, 0]])
        pairs = np.transpose(np.triu_indices(len(ways), 1))
        pairs = pairs[np.abs(np.linalg.det(ways[pairs])) > SINGLE]
        met = np.linalg.solve(ways[pairs], away[pairs])[..., 0]
        place = np.concatenate([away * ways + along, away * ways - along, met])
        return np.asarray(place[self.holds(place, self.slack)])

    def normal(self, place: Array) -> Array:
        """Return outward unit normals (n, 3) at coordinates (n, 2)."""
        normal = np.cross(*self.tangents(place))
        return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def _in_front(values: Array, end: float, side: int) -> Array:
    """Return values (n,) reflected to one side of an end: below it if `side` is 1."""
    return np.asarray(end + (1.0 - 2.0 * side) * np.abs(values - end))


def _with_image(chart: Chart, rim: Index) -> Chart:
    """Return a chart that goes on beyond one of its sides, low or high u or v, with the image of
    the face in the plane there."""
    side, axis = rim.tolist()
    end, place = chart.sides[side, axis], 0.5 * (chart.low + chart.high)
    place[axis] = end
    normal = chart.tangents(place[None])[axis, 0]
    foot, sign = chart.at(place[None])[0], 2.0 * side - 1.0

    def mirrored(x: Array, beyond: Mask) -> Array:
        return np.asarray(x - np.outer(2.0 * beyond * ((x - foot) @ normal), normal))

    def at(place: Array) -> Array:
        inner = place.copy()
        inner[:, axis] = _in_front(place[:, axis], end, side)
        return mirrored(chart.at(inner), sign * (place[:, axis] - end) > 0.0)

    def local(x: Array) -> Array:
        beyond = sign * ((x - foot) @ normal) > 0.0
        place = chart.local(mirrored(x, beyond))
        place[beyond, axis] = 2.0 * end - place[beyond, axis]
        return place

    own = chart.sides
    reach = np.array([chart.low, chart.high])
    reach[side, axis] = 2.0 * end - reach[1 - side, axis]
    return replace(chart, low=reach[0], high=reach[1], at=at, local=local, own=own)
