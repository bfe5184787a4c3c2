"""The shapes of rigid tools: keys of an obstacle, and the set of points that they stand for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Array, Mask
from ..errors import InputError
from ..geometry.arcs import signed_area
from ..given.profile import CurveProfile, Extruded, Profile, RoundedPolygon
from ..given.rounded_box import RoundedBox
from ..given.shapes import Ball, HalfSpace, Rod, Shape
from ..given.tables.points import curve_of, table_of
from ..round_off import WRITTEN

SHAPED = {
    "circle": ("radius",),
    "sphere": ("radius",),
    "cylinder": ("from", "to", "radius"),
    "plane": ("normal",),
    "polygon": ("vertices",),
    "box": ("lower", "upper"),
    "points": ("points",),
}
"""Keys that a shape needs."""
MAY: dict[str | None, tuple[str, ...]] = {
    **dict.fromkeys(SHAPED, ("hollow",)),
    "plane": ("point",),
    "polygon": ("fillet", "along", "angle", "hollow"),
    "box": ("fillet", "along", "angle", "hollow"),
    "points": ("columns", "smooth", "along", "angle", "hollow"),
}
"""Keys that a shape may have besides."""
KEYS = tuple(dict.fromkeys(key for keys in (*SHAPED.values(), *MAY.values()) for key in keys))
"""All of them."""
SMALL = 0.1
"""Rotation up to which linear displacements are those of a turned profile, to 0.5 % [rad]."""


def check_keys(tool: Any) -> None:
    """Refuse keys of an obstacle that its shape has not, or that are missing.

    Raises
    ------
    InputError
    """
    given = [key for key in KEYS if getattr(tool, key) not in (None, False)]
    if tool.shape is None:
        for key in given:
            raise InputError(f"{key}: belongs to a shape; give shape, as in shape = 'circle'")
        return
    needed = SHAPED[tool.shape]
    for key in given:
        if key not in (allowed := (*needed, *MAY[tool.shape])):
            raise InputError(f"{key}: a {tool.shape} has none; its keys are {', '.join(allowed)}")
    for key in needed:
        if key not in given:
            raise InputError(f"{key}: this key is required of a {tool.shape}")
    if tool.shape == "cylinder" and getattr(tool, "from") == tool.to:
        raise InputError("from and to are the same point: a cylinder has a length")
    if "angle" in MAY[tool.shape]:
        _check_rotation(tool)


def _check_rotation(tool: Any) -> None:
    turns = tool.rotation if isinstance(tool.rotation, tuple) else (tool.rotation,)
    if any(isinstance(turn, float) and abs(turn) > SMALL for turn in turns):
        raise InputError(
            f"rotation: is a small motion, at most {SMALL} rad with shape = {tool.shape!r}; angle "
            "(in degrees) turns it before"
        )


def shape_of(tool: Any, axial: bool) -> Shape:
    """The set of points that the keys of an obstacle stand for.

    Raises
    ------
    InputError
        If the problem has no such shape, or it is not one of revolution in an axial problem.
    """
    head = f"obstacle {tool.name!r}: "
    try:
        return BUILT[tool.shape](tool, axial)
    except InputError as error:  # that of a centre begins with the name already
        raise InputError(f"{head}{str(error).removeprefix(head)}") from None


def _ball(tool: Any, axial: bool) -> Shape:
    centre = tool.centre_in(2 if axial or tool.shape == "circle" else 3)
    if axial and centre[0] != 0.0:
        raise InputError(f"centre: must lie on the axis x = 0, got {centre}")
    return Ball(tuple(centre), tool.radius)


def _rod(tool: Any, axial: bool) -> Shape:
    return Rod(getattr(tool, "from"), tool.to, tool.radius, tool.hollow)


def _half_space(tool: Any, axial: bool) -> Shape:
    if axial and tool.normal[0] != 0.0:
        raise InputError(f"normal: must be along the axis, got {tool.normal}")
    d = len(tool.normal)
    point = tool.centre_in(d) if tool.point is None else tool.point
    if len(point) != d:
        raise InputError(f"point: needs {d} components here, got {len(point)}")
    return HalfSpace(tuple(point), tool.normal)


def _polygon(tool: Any, axial: bool) -> Shape:
    vertices = np.array(tool.vertices, dtype=float)
    return _placed(tool, lambda frame: _rounded(tool, _turned(tool, vertices, frame), axial))


def _box(tool: Any, axial: bool) -> Shape:
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
    return RoundedBox(tool.lower, tool.upper, fillet, tuple(tool.centre_in(3)), tuple(turn))


def _points(tool: Any, axial: bool) -> Shape:
    table = table_of(tool.points, tool.columns, "(x, y)")

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


BUILT: dict[str, Callable[[object, bool], Shape]] = {
    "circle": _ball,
    "sphere": _ball,
    "cylinder": _rod,
    "plane": _half_space,
    "polygon": _polygon,
    "box": _box,
    "points": _points,
}
"""What makes a shape of an obstacle."""


def _placed(tool: Any, section: Callable[[Array], Profile]) -> Shape:
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


def _turned(tool: Any, rows: Array, frame: Array) -> Array:
    """Points (n, 2) of a profile, turned about the centre."""
    if tool.angle is None:
        return rows
    centre = frame @ np.array(tool.centre_in(frame.shape[1]), dtype=float)
    c, s = math.cos(turn := math.radians(tool.angle)), math.sin(turn)
    return np.asarray((rows - centre) @ np.array([[c, s], [-s, c]]) + centre)


def _rounded(tool: Any, vertices: Array, axial: bool) -> Profile:
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
