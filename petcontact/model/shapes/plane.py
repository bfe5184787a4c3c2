"""Rectangles, polygons and outlines of lines and arcs."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pydantic

from ...arrays import Array
from ...errors import InputError
from ...geometry.arcs import turn_of_radius, turn_through
from ...geometry.outline import Outline, Side, arc, oriented
from ...given.tables.base import Finite, Model, Point, Positive, Shape


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
    to : point
        End of the side [length].
    through : point, optional
        Makes the side the circular arc through this point [length].
    radius : float, optional
        Makes the side a circular arc of at most half a circle: it turns left (bulges to the right)
        where positive, right where negative [length].
    """

    part: str = pydantic.Field(min_length=1)
    to: Point
    through: Point | None = None
    radius: Finite | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> OutlineSide:
        if self.through is not None and self.radius is not None:
            raise InputError(
                f"side {self.part!r}: an arc is given by through or by radius, not by both"
            )
        if self.radius == 0.0:
            raise InputError(
                f"side {self.part!r}: radius must not be 0; leave it out for a straight side"
            )
        return self

    def sides_from(self, start: Array) -> list[Side]:
        """The side as straight line or as arcs of at most a quarter circle."""
        end = np.array(self.to, dtype=float)
        alpha = 0.0
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

    def outline(self) -> Outline:
        """The outline.

        Raises
        ------
        InputError
            If an arc does not exist, a side has no length, or sides cross or touch.
        """
        return Outline(oriented(loops_of(self.loops), exterior=self.exterior), self.exterior)


def loops_of(given: Sequence[Sequence[OutlineSide] | Circle]) -> list[list[Side]]:
    """The sides of loops, or of circles.

    Raises
    ------
    InputError
        If an arc does not exist, or a side has no length.
    """
    return [
        loop.loop() if isinstance(loop, Circle) else _loop(loop, number)
        for number, loop in enumerate(given)
    ]


def _loop(given: Sequence[OutlineSide], number: int) -> list[Side]:
    if len(given) < 2:
        raise InputError(
            f"geometry.loops[{number}]: a loop needs at least two sides (or center and radius)"
        )
    start = np.array(given[-1].to, dtype=float)
    sides: list[Side] = []
    for side in given:
        if tuple(start) == side.to:
            raise InputError(
                f"geometry.loops[{number}]: side {side.part!r} at ({start[0]:g}, {start[1]:g}) has "
                f"no length"
            )
        sides += side.sides_from(start)
        start = sides[-1].end
    return sides
