"""The shapes of rigid tools: the set of points that the keys of an obstacle stand for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from ..arrays import Array, Mask
from ..errors import InputError
from ..geometry.arcs import signed_area
from ..given.profile import CurveProfile, Extruded, Profile, RoundedPolygon
from ..given.rounded_box import RoundedBox
from ..given.shapes import Aimed, Ball, HalfSpace, Rod, Shape
from ..given.tables.points import curve_of, table_of
from ..round_off import WRITTEN
from .obstacles import Obstacle

T = TypeVar("T")


def aimed(tool: Obstacle, direction: tuple[float, ...] | None, *, axial: bool) -> Aimed:
    """The shape of an obstacle as rays along a unit vector, or along outward normals, meet it.

    Raises
    ------
    InputError
        As of `shape_of`.
    """
    return Aimed(tool.name, needed(tool.shape), shape_of(tool, axial), direction, tool.hollow)


def shape_of(tool: Obstacle, axial: bool) -> Shape:
    """The set of points that the keys of an obstacle stand for.

    Raises
    ------
    InputError
        If the problem has no such shape, or it is not one of revolution in an axial problem.
    """
    head = f"obstacle {tool.name!r}: "
    try:
        return BUILT[needed(tool.shape)](tool, axial)
    except InputError as error:  # that of a centre begins with the name already
        raise InputError(f"{head}{str(error).removeprefix(head)}") from None


def needed(value: T | None) -> T:
    """The value of a key that the shape needs, and that `Obstacle` has found there."""
    assert value is not None
    return value


def _ball(tool: Obstacle, axial: bool) -> Shape:
    if tool.shape == "sphere" and not axial and np.size(tool.centre) == 2:
        raise InputError(
            "centre: needs 3 components, spheres being for space and for axial problems (in the "
            f'plane "circle"), got {tool.centre}'
        )
    centre = tool.centre_in(2 if axial or tool.shape == "circle" else 3)
    if axial and centre[0] != 0.0:
        raise InputError(f"centre: must lie on the axis x = 0, got {centre}")
    return Ball(tuple(centre), needed(tool.radius))


def _rod(tool: Obstacle, axial: bool) -> Shape:
    start, end, radius = getattr(tool, "from"), needed(tool.to), needed(tool.radius)
    if {len(start), len(end)} != {2 if axial else 3}:
        raise InputError(
            f"from, to: need {2 if axial else 3} components, of cylinders in "
            f"{'axial problems' if axial else 'space'}, got {start} and {end}"
        )
    if not axial:
        return Rod(start, end, radius, tool.hollow)
    if start[0] or end[0] or tool.hollow:
        raise InputError(
            'in axial problems a cylinder lies on the axis x = 0; a bore is a "box" around the body'
        )
    low, high = sorted((start[1], end[1]))
    corners = np.array([[0.0, low], [radius, low], [radius, high], [0.0, high]])
    return _rounded(tool, corners, axial)


def _half_space(tool: Obstacle, axial: bool) -> Shape:
    normal = needed(tool.normal)
    if axial and normal[0] != 0.0:
        raise InputError(f"normal: must be along the axis, got {normal}")
    point = tool.centre_in(len(normal)) if tool.point is None else tool.point
    if len(point) != len(normal):
        raise InputError(f"point: needs {len(normal)} components here, got {len(point)}")
    return HalfSpace(tuple(point), normal)


def _polygon(tool: Obstacle, axial: bool) -> Shape:
    vertices = np.array(tool.vertices, dtype=float)
    return _placed(tool, lambda frame: _rounded(tool, _turned(tool, vertices, frame), axial))


def _box(tool: Obstacle, axial: bool) -> Shape:
    low, high, fillet = np.array(tool.lower), np.array(tool.upper), tool.fillet or 0.0
    if len(low) != len(high) or not (low < high).all():
        raise InputError("each coordinate of upper must be greater than that of lower")
    if fillet > 0.5 * (high - low).min():
        raise InputError(
            f"fillet: must be at most half of the shortest side, {0.5 * (high - low).min():g}, "
            f"got {fillet:g}"
        )
    if len(low) == 2 and tool.along is not None:
        raise InputError("along: is for boxes in space, whose corners have three coordinates")
    if len(low) == 2:
        corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        return _rounded(tool, _turned(tool, corners, np.eye(2)), axial)
    along = np.array(tool.along or (0.0, 0.0, 1.0))
    turn = math.radians(tool.angle or 0.0) * along / np.linalg.norm(along)
    return RoundedBox(
        needed(tool.lower), needed(tool.upper), fillet, tuple(tool.centre_in(3)), tuple(turn)
    )


def _points(tool: Obstacle, axial: bool) -> Shape:
    table = table_of(needed(tool.points), tool.columns, "(x, y)")

    def section(frame: Array) -> Profile:
        from_centre = table + frame @ np.array(tool.centre_in(frame.shape[1]), dtype=float)
        rows = _turned(tool, from_centre, frame)
        if (rows[0] == rows[-1]).all() and signed_area(rows) < 0.0:
            rows = rows[::-1]
        curve = curve_of(tuple(map(tuple, rows.tolist())), tool.smooth or 0.0, axial=axial)
        if tool.hollow and not curve.closed:
            raise InputError("hollow: the last point is not the first one, and nothing is inside")
        return CurveProfile(curve, is_bore=tool.hollow)

    return _placed(tool, section)


BUILT: dict[str, Callable[[Obstacle, bool], Shape]] = {
    "circle": _ball,
    "sphere": _ball,
    "cylinder": _rod,
    "plane": _half_space,
    "polygon": _polygon,
    "box": _box,
    "points": _points,
}
"""What makes a shape of an obstacle."""


def _placed(tool: Obstacle, section: Callable[[Array], Profile]) -> Shape:
    """A profile in the plane, or in space the same along a direction.

    `section` makes it from the axes (2, d) of its plane. These are the other two axes in their
    order, where the direction is one of them, and else those that are nearest to them.
    """
    if tool.along is None:
        return section(np.eye(2))
    along = np.array(tool.along) / np.linalg.norm(tool.along)
    first, second = np.delete(np.eye(3), int(np.abs(along).argmax()), axis=0)
    first = first - (first @ along) * along
    first /= np.linalg.norm(first)
    across = np.cross(along, first)
    frame = np.array([first, across if across @ second > 0.0 else -across])
    return Extruded(section(frame), tuple(map(tuple, frame.tolist())))


def _turned(tool: Obstacle, rows: Array, frame: Array) -> Array:
    """Points (n, 2) of a profile, turned about the centre."""
    if tool.angle is None:
        return rows
    centre = frame @ np.array(tool.centre_in(frame.shape[1]), dtype=float)
    c, s = math.cos(turn := math.radians(tool.angle)), math.sin(turn)
    return np.asarray((rows - centre) @ np.array([[c, s], [-s, c]]) + centre)


def _rounded(tool: Obstacle, vertices: Array, axial: bool) -> Profile:
    """A polygon with rounded corners; one that reaches the axis of revolution goes on as its
    image."""
    small = WRITTEN * np.abs(vertices).max()
    if axial and vertices[:, 0].min() < -small:
        raise InputError(f"the {tool.shape} must lie in x >= 0, from the axis on")
    on = np.abs(vertices[:, 0]) <= small
    if axial and on.any():
        vertices = _mirrored(vertices, on)
    corners = tuple(map(tuple, vertices.tolist()))
    polygon = RoundedPolygon(corners, tool.fillet or 0.0, is_bore=tool.hollow)
    assert polygon.sides  # what is no polygon is refused
    return polygon


def _mirrored(vertices: Array, on: Mask) -> Array:
    """The polygon with its image, without the side on the axis."""
    first = int(np.flatnonzero(on & ~np.roll(on, -1))[0])
    chain = np.roll(vertices, -first, axis=0)
    last = 1 + int(np.flatnonzero(np.roll(on, -first)[1:])[0]) if on.sum() > 1 else len(chain)
    off = chain[1:last]
    image = off[::-1] * [-1.0, 1.0]
    ends = [chain[:1], chain[last : last + 1]]
    return np.vstack([ends[0], off, ends[1], image])
