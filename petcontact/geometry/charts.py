"""Charts of faces: a face unrolled onto a rectangle, on which panels are laid along lines."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..record import record
from ..round_off import SINGLE, WRITTEN
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
    """

    low: Array
    high: Array
    at: Callable[[Array], Array]
    local: Callable[[Array], Array]
    flat: bool = False
    wraps: bool = False

    def tangents(self, place: Array) -> Array:
        """Return unit vectors (2, n, 3) along u and v at coordinates (n, 2), nan where lines of one
        coordinate meet."""
        step = 1e-5 * float((self.high - self.low).min())
        ways = [self.at(place + step * unit) - self.at(place - step * unit) for unit in np.eye(2)]
        with np.errstate(invalid="ignore"):
            return np.asarray(ways / np.linalg.norm(ways, axis=2, keepdims=True))

    @property
    def slack(self) -> float:
        """Distance up to which points are one [length]."""
        return SINGLE * float((self.high - self.low).max())

    def room(self, place: Array, way: Array) -> float:
        """Return how far a point (2,) may go along a unit vector to the rim [length]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(way > 0.0, self.high - place, self.low - place) / way
        least = float(room[np.abs(way) > SINGLE].min())
        return least if least > self.slack else 0.0

    def normal(self, place: Array) -> Array:
        """Return outward unit normals (n, 3) at coordinates (n, 2)."""
        normal = np.cross(*self.tangents(place))
        return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


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


@chart_of.register
def _(surface: CylinderSurface, part: str, middle: Array | None = None) -> Chart | None:
    if part != "side":
        return None
    axis = (surface.end - surface.start) / surface.height
    return _turned(
        (surface.start, np.array([*surface._across(), axis])),
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
