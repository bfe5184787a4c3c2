"""Rectangles, polygons and outlines of lines and arcs."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pydantic

from ...arrays import Array
from ...errors import InputError
from ...geometry.arcs import turn_of_radius, turn_through
from ...geometry.outline import Outline, Side, arc, oriented
from ...geometry.smooth_curve import SmoothCurve
from ...given.tables.base import Finite, Model, NotNegative, Point, Positive, Shape
from ...given.tables.points import Columns, Rows, curve_of, table_of
from ...round_off import WRITTEN

NEXT = 2.0
"""Distance of the end of a side over that of the first two points of the next one, up to which it
is one of these points."""


class Rectangle(Shape):
    """Axis-parallel; its sides are named bottom, right, top, left.

    In a config::

        [geometry]
        shape = "rectangle"
        lower_left = [0.0, 0.0]
        upper_right = [8.0, 4.0]

    Attributes
    ----------
    shape : "rectangle", in 2D, axial
        The shape.
    lower_left, upper_right : points
        Opposite corners [length].
    """

    shape: Literal["rectangle"] = pydantic.Field(default="rectangle", kw_only=True)
    lower_left: Point
    upper_right: Point

    @pydantic.model_validator(mode="after")
    def _has_area(self) -> Rectangle:
        if not (
            self.upper_right[0] > self.lower_left[0] and self.upper_right[1] > self.lower_left[1]
        ):
            raise InputError(
                f"upper_right must lie to the right of and above lower_left; got lower_left "
                f"{list(self.lower_left)}, upper_right {list(self.upper_right)}"
            )
        return self

    def outline(self) -> Outline:
        """The outline, starting at the lower left corner."""
        (x0, y0), (x1, y1) = self.lower_left, self.upper_right
        return _polygon(
            ((x0, y0), (x1, y0), (x1, y1), (x0, y1)), ("bottom", "right", "top", "left")
        )


class Polygon(Shape):
    """Straight sides between vertices.

    In a config::

        [geometry]
        shape = "polygon"
        vertices = [[0, 0], [6, 0], [5, 3]]
        parts = ["bottom", "right", "top"]

    Attributes
    ----------
    shape : "polygon", in 2D, axial
        The shape.
    vertices : list of points
        Corners one after another, in either direction [length].
    parts : list of str
        Names of the parts, one a side; side k starts at vertex k, and sides may share a name.
    """

    shape: Literal["polygon"] = pydantic.Field(default="polygon", kw_only=True)
    vertices: tuple[Point, ...] = pydantic.Field(min_length=3)
    parts: tuple[str, ...]

    @pydantic.model_validator(mode="after")
    def _one_name_a_side(self) -> Polygon:
        if len(self.parts) != len(self.vertices):
            raise InputError(
                f"{len(self.vertices)} vertices need as many part names in parts, got "
                f"{len(self.parts)}"
            )
        return self

    def outline(self) -> Outline:
        """The outline; vertices given clockwise are turned round, each side keeping its name."""
        return _polygon(self.vertices, self.parts)


@functools.lru_cache(maxsize=16)
def _polygon(vertices: tuple[Point, ...], parts: tuple[str, ...]) -> Outline:
    points = [np.array(v, dtype=float) for v in vertices]
    following = [*points[1:], points[0]]
    loop = [Side(a, b, part) for a, b, part in zip(points, following, parts, strict=True)]
    return Outline(oriented([loop]))


class OutlineSide(Model):
    """One side of a loop, from the end of the side before it.

    In a config::

        [geometry]
        shape = "outline"
        loops = [[
            { part = "bottom", to = [2.0, 0.0] },
            { part = "arc", to = [0.0, 0.0], radius = 1.0 },
        ]]

    Attributes
    ----------
    part : str
        Name of the part.
    to : point, optional
        End of the side [length].
    through : point, optional
        Makes the side the circular arc through this point [length].
    radius : float, optional
        Makes the side a circular arc of at most half a circle: it turns left (bulges to the right)
        where positive, right where negative [length].
    points : file or rows of numbers, optional
        In place of `to`: columns x and y of points that the side goes through, in their order
        along it. It is a curve with continuous curvature, from the first point to the last one. It
        begins where the side before ends if that is one point spacing away; else that side goes on
        straight to it. See `gap` for the file [length].
    columns : list of int, optional
        Which two columns of the points these are, from 0 on.
    smooth : float
        The curve is at most so far away from the points; with 0 it goes through all [length].
    """

    part: str = pydantic.Field(min_length=1)
    to: Point | None = None
    through: Point | None = None
    radius: Finite | None = None
    points: Rows | None = None
    columns: Columns | None = None
    smooth: NotNegative = 0.0

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> OutlineSide:
        if (self.to is None) == (self.points is None):
            raise InputError(
                f"side {self.part!r}: needs its end, to, or the points that it goes through"
            )
        if self.through is not None and self.radius is not None:
            raise InputError(
                f"side {self.part!r}: an arc is given by through or by radius, not by both"
            )
        for keys, other in ((("through", "radius"), "points"), (("columns", "smooth"), "to")):
            given = [key for key in keys if getattr(self, key) not in (None, 0.0)]
            if given and getattr(self, other) is not None:
                raise InputError(f"side {self.part!r}: {given[0]} does not go with {other}")
        if self.radius == 0.0:
            raise InputError(
                f"side {self.part!r}: radius must not be 0; leave it out for a straight side"
            )
        if self.points is not None:
            table_of(self.points, self.columns, "(x, y)")
        return self

    @property
    def end(self) -> Array:
        """Its last point [length]."""
        return np.array(self._rows()[-1] if self.to is None else self.to, dtype=float)

    def _rows(self) -> list[tuple[float, ...]]:
        return list(map(tuple, table_of(self.points or (), self.columns, "(x, y)").tolist()))

    def curve(self, start: Array | None, axial: bool) -> SmoothCurve:
        """The curve through its points from the end of the side before it, or a closed one.

        Raises
        ------
        InputError
            As of `curve_of`.
        """
        rows = self._rows()
        if start is not None:
            away = math.dist(rows[0], start)
            size = max(map(math.hypot, *np.transpose(rows).tolist()))
            if away <= max(self.smooth, WRITTEN * size):
                rows[0] = tuple(start.tolist())
            elif away <= NEXT * math.dist(rows[0], rows[1]):
                rows.insert(0, tuple(start.tolist()))
        try:
            return curve_of(tuple(rows), self.smooth, start is None, axial)
        except InputError as error:
            raise InputError(f"geometry: side {self.part!r}: {error}") from None

    def sides_from(self, start: Array) -> list[Side]:
        """The side as straight line or as arcs of at most a quarter circle."""
        end, alpha = self.end, 0.0
        try:
            if self.through is not None:
                alpha = turn_through(start, np.array(self.through, dtype=float), end)
            elif self.radius is not None:
                alpha = turn_of_radius(start, end, self.radius)
        except InputError as error:
            raise InputError(f"geometry: side {self.part!r}: {error}") from None
        return arc(start, end, alpha, self.part)


class Circle(Model):
    """A loop that is a whole circle.

    In a config::

        [geometry]
        shape = "outline"
        loops = [{ part = "rim", center = [0.0, 1.0], radius = 1.0 }]

    Attributes
    ----------
    part : str
        Name of the part.
    center : point
        Centre of the circle [length].
    radius : float
        Radius of the circle [length].
    """

    part: str = pydantic.Field(min_length=1)
    center: Point
    radius: Positive

    def loop(self) -> list[Side]:
        """Four quarter circles, counter-clockwise, from the rightmost point."""
        x, y = self.center
        r = self.radius
        corners = [np.array(p) for p in ((x + r, y), (x, y + r), (x - r, y), (x, y - r))]
        return [
            Side(a, b, self.part, 1.0 / r)
            for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
        ]


class SideBySide(Shape):
    """`shape = "outline"`: loops of sides or circles, the largest being the body's outer boundary,
    the others holes; or, `exterior`, all of them holes of an infinite plate.

    In a config::

        [geometry]
        shape = "outline"
        exterior = true
        loops = [{ part = "hole", center = [0, 0], radius = 1.0 }]

    Attributes
    ----------
    shape : "outline", in 2D, axial
        The shape.
    loops : list of loops
        A loop is a list of sides, the first of which starts where the last one ends, or a circle.
        Loops may be given in either direction: the outer one is turned counter-clockwise, holes
        clockwise.
    exterior : bool, in 2D
        Whether the body is the infinite plate around the loops.
    """

    shape: Literal["outline"] = pydantic.Field(default="outline", kw_only=True)
    loops: tuple[tuple[OutlineSide, ...] | Circle, ...] = pydantic.Field(min_length=1)
    exterior: bool = False

    def outline(self, axial: bool = False) -> Outline:
        """The outline; `axial`: ends of curves on x = 0 lie on an axis of revolution.

        Raises
        ------
        InputError
            If an arc does not exist, a side has no length, or sides cross or touch.
        """
        return _side_by_side(self.loops, self.exterior, axial)


@functools.lru_cache(maxsize=16)
def _side_by_side(
    loops: tuple[tuple[OutlineSide, ...] | Circle, ...], exterior: bool, axial: bool
) -> Outline:
    return Outline(oriented(loops_of(loops, axial), exterior=exterior), exterior)


def loops_of(given: Sequence[Sequence[OutlineSide] | Circle], axial: bool) -> list[list[Side]]:
    """The sides of loops, or of circles.

    Raises
    ------
    InputError
        If an arc or a curve does not exist, or a side has no length.
    """
    return [
        loop.loop() if isinstance(loop, Circle) else _loop(loop, number, axial)
        for number, loop in enumerate(given)
    ]


def _loop(given: Sequence[OutlineSide], number: int, axial: bool) -> list[Side]:
    if len(given) < 2:
        if given and given[0].points is not None:
            return given[0].curve(None, axial).sides(given[0].part)
        raise InputError(
            f"geometry.loops[{number}]: a loop needs at least two sides (or center and radius, or "
            "points)"
        )
    start, last = given[-1].end, given[-1].part
    sides: list[Side] = []
    for side in given:
        if side.points is not None:
            pieces = side.curve(start, axial).sides(side.part)
            if (pieces[0].start != start).any():  # the side before goes on straight
                sides.append(Side(start, pieces[0].start, sides[-1].part if sides else last))
        elif (start == side.end).all():
            raise InputError(
                f"geometry.loops[{number}]: side {side.part!r} at ({start[0]:g}, {start[1]:g}) "
                "has no length"
            )
        else:
            pieces = side.sides_from(start)
        sides += pieces
        start = sides[-1].end
    # what leads to the first point belongs to the last side
    return sides[1:] + sides[:1] if sides[0].part != given[0].part else sides
