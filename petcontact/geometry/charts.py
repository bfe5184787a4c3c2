"""Charts of faces: a face unrolled onto a rectangle, on which panels are laid along lines."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array, Index, Mask
from ..record import field, record, replace
from ..round_off import SINGLE, TINY, WRITTEN
from .revolved.turned_surface import RevolvedSurface
from .round_surfaces import CylinderSurface, SphereSurface
from .surface import BOX_PARTS, BoxSurface, face_axes


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


@functools.singledispatch
def chart_of(surface: object, part: str, middle: Array | None = None) -> Chart | None:
    """Return the chart of a part of a surface, or None if it has none.

    Parameters
    ----------
    surface : Boundary
    part : str
    middle : (3,) array, optional
        A face that goes round is cut opposite to this point [length].

    Examples
    --------
    >>> from petcontact.geometry.surface import BoxSurface
    >>> box = BoxSurface(np.zeros(3), np.array([2.0, 1.0, 1.0]))
    >>> chart_of(box, "top").at(np.array([[0.5, 0.25]]))
    array([[0.5 , 0.25, 1.  ]])
    """
    return None


@chart_of.register
def _(surface: BoxSurface, part: str, middle: Array | None = None) -> Chart:
    axis, side = BOX_PARTS[part]
    uv, height = [*face_axes(axis, side)], (surface.lower, surface.upper)[side][axis]

    def at(place: Array) -> Array:
        x = np.full((len(place), 3), height)
        x[:, uv] = place
        return x

    return Chart(surface.lower[uv], surface.upper[uv], at, lambda x: x[:, uv], flat=True)


@chart_of.register
def _(surface: SphereSurface, part: str, middle: Array | None = None) -> Chart:
    """Angles from the middle of the part, times the radius: lines through it are great circles."""
    axis, side = BOX_PARTS[part]
    uv, way, end = [*face_axes(axis, side)], 2.0 * side - 1.0, 0.25 * math.pi * surface.radius

    def at(place: Array) -> Array:
        x = np.full((len(place), 3), way)
        x[:, uv] = np.tan(place / surface.radius)
        return surface.onto(np.zeros(1, dtype=np.int64), surface.centre + x)

    def local(x: Array) -> Array:
        away = x - surface.centre
        return surface.radius * np.arctan2(away[:, uv], way * away[:, [axis]])

    return Chart(np.full(2, -end), np.full(2, end), at, local)


@functools.singledispatch
def disc_of(surface: object, part: str) -> Chart | None:
    """Return the chart of a part of a surface on which its axis is a point, or None if it has none.

    The coordinates of a point are its distance from there along the face, and its direction.
    """
    return None


@disc_of.register
def _(surface: CylinderSurface, part: str) -> Chart | None:
    if part == "side":
        return None
    top = part == "top"
    frame = surface.start, surface.frame
    height, radius = surface.height if top else 0.0, surface.radius

    def section(s: Array) -> Array:
        return np.column_stack([s, np.full(len(s), height)])

    return _around_axis(frame, section, lambda x: x[:, 0], radius, 1.0 if top else -1.0)


@disc_of.register
def _(surface: RevolvedSurface, part: str) -> Chart | None:
    runs = [run for run in surface.runs if run.part == part]
    if len(runs) != 1 or surface.angle < 2.0 * math.pi:
        return None
    (run,), place = runs, (surface.centre, surface.frame)
    first, last = run.at(run.ends[[0, -1]])[:, 0] < WRITTEN * run.length
    if first == last:
        return None
    if first:  # the body is on its left
        return _around_axis(place, run.at, run.nearest, run.length, -1.0)
    length = run.length
    return _around_axis(
        place, lambda s: run.at(length - s), lambda x: length - run.nearest(x), length, 1.0
    )


def _around_axis(
    place: tuple[Array, Array],
    section: Callable[[Array], Array],
    along: Callable[[Array], Array],
    length: float,
    up: float,
) -> Chart:
    """Return the chart of a line (r, z) from an axis that is turned about it; `up` is 1 if the face
    looks along the axis, else -1. `place` holds the centre and the frame of `RevolvedSurface`."""
    (centre, frame), turn = place, np.array([1.0, up])

    def at(uv: Array) -> Array:
        s = np.linalg.norm(uv, axis=1)
        r, z = section(np.minimum(s, length)).T
        way = uv * turn * (r / np.maximum(s, TINY))[:, None]
        return np.asarray(centre + np.column_stack([way, z]) @ frame)

    def local(x: Array) -> Array:
        away = (x - centre) @ frame.T
        r = np.hypot(away[:, 0], away[:, 1])
        s = along(np.column_stack([r, away[:, 2]]))
        return np.asarray(away[:, :2] * turn * (s / np.maximum(r, TINY))[:, None])

    z = section(length * np.linspace(0.0, 1.0, 5))[:, 1]
    ends = np.full(2, length)
    return Chart(-ends, ends, at, local, flat=bool(np.ptp(z) < WRITTEN * length), round=True)


@chart_of.register
def _(surface: CylinderSurface, part: str, middle: Array | None = None) -> Chart | None:
    if part != "side":
        return None
    return _turned(
        (surface.start, surface.frame),
        2.0 * math.pi,
        lambda v: np.column_stack([np.full(len(v), surface.radius), v]),
        lambda section: section[:, 1],
        surface.height,
        surface.radius,
        middle,
    )


@chart_of.register
def _(surface: RevolvedSurface, part: str, middle: Array | None = None) -> Chart | None:
    runs = [run for run in surface.runs if run.part == part]
    if len(runs) != 1:
        return None
    (run,) = runs
    place, radius = (surface.centre, surface.frame), float(run.at(0.5 * run.ends[-1:])[0, 0])
    return _turned(place, surface.angle, run.at, run.nearest, run.length, radius, middle)


def _turned(
    place: tuple[Array, Array],
    angle: float,
    section: Callable[[Array], Array],
    along: Callable[[Array], Array],
    length: float,
    radius: float,
    middle: Array | None,
) -> Chart:
    """Return the chart of a line (r, z) that is turned about an axis; u goes round, v along it.

    `place` holds the centre and the frame of `RevolvedSurface`. The line has the body on its left.
    """
    (centre, frame), wraps = place, angle >= 2.0 * math.pi
    start = 0.0
    if wraps and middle is not None:
        away = (middle - centre) @ frame.T
        start = math.atan2(away[1], away[0]) - math.pi

    def at(uv: Array) -> Array:
        r, z = section(np.clip(uv[:, 1], 0.0, length)).T
        turn = start + uv[:, 0] / radius
        return np.asarray(centre + np.column_stack([r * np.cos(turn), r * np.sin(turn), z]) @ frame)

    def local(x: Array) -> Array:
        away = (x - centre) @ frame.T
        turn = np.arctan2(away[:, 1], away[:, 0]) - start
        turn = np.where(wraps | (turn < -WRITTEN), turn % (2.0 * math.pi), turn)
        meridian = np.column_stack([np.hypot(away[:, 0], away[:, 1]), away[:, 2]])
        return np.column_stack([radius * turn, along(meridian)])

    return Chart(np.zeros(2), np.array([radius * angle, length]), at, local, wraps=wraps)
