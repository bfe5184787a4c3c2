"""Charts of the faces of surfaces, on which panels are laid along lines."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..round_off import TINY, WRITTEN
from .chart import Chart
from .revolved.turned_surface import RevolvedSurface
from .round_surfaces import CylinderSurface, SphereSurface
from .surface import BOX_PARTS, BoxSurface, face_axes


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
