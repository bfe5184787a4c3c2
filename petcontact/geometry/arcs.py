"""Outlines given side by side: loops of straight lines and circular arcs, with holes (`shape = "outline"`)."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pydantic

from ..arrays import Array
from ..errors import InputError
from ..model.base import Finite, Model, Point, Positive
from .outline import Outline, Side, oriented

LARGEST_TURN = 0.5 * math.pi
"""Arcs are cut into pieces that turn by no more: near half a circle the chord says nothing about the angle."""


class OutlineSide(Model):
    """One side of a loop, from the end of the side before it.

    Attributes
    ----------
    part : str
    to : point
        End of the side [length].
    through : point, optional
        Makes the side the circular arc through this point [length].
    radius : float, optional
        Makes the side a circular arc of at most half a circle: it turns left (bulges to the right) where positive,
        right where negative [length].
    """

    part: str = pydantic.Field(min_length=1)
    to: Point
    through: Point | None = None
    radius: Finite | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> OutlineSide:
        if self.through is not None and self.radius is not None:
            raise ValueError(f"side {self.part!r}: an arc is given by through or by radius, not by both")
        if self.radius == 0.0:
            raise ValueError(f"side {self.part!r}: radius must not be 0; leave it out for a straight side")
        return self

    def sides_from(self, start: Array) -> list[Side]:
        """The side as straight line or as arcs of at most a quarter circle."""
        end = np.array(self.to, dtype=float)
        if self.through is not None:
            return arc_through(start, np.array(self.through, dtype=float), end, self.part)
        if self.radius is not None:
            return arc_of_radius(start, end, self.radius, self.part)
        return [Side(start, end, self.part)]


class Circle(Model):
    """A loop that is a whole circle.

    Attributes
    ----------
    part : str
    center : point
        [length]
    radius : float
        [length]
    """

    part: str = pydantic.Field(min_length=1)
    center: Point
    radius: Positive

    def loop(self) -> list[Side]:
        """Four quarter circles, counter-clockwise, from the rightmost point."""
        x, y = self.center
        r = self.radius
        corners = [np.array(p) for p in ((x + r, y), (x, y + r), (x - r, y), (x, y - r))]
        return [Side(a, b, self.part, 1.0 / r) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]


class SideBySide(Model):
    """`shape = "outline"`: loops of sides or circles, the largest being the body's outer boundary, the others holes.

    Attributes
    ----------
    loops : list of loops
        A loop is a list of sides, the first of which starts where the last one ends, or a circle. Loops may be given in
        either direction: the outer one is turned counter-clockwise, holes clockwise.
    """

    shape: Literal["outline"] = "outline"
    loops: tuple[tuple[OutlineSide, ...] | Circle, ...] = pydantic.Field(min_length=1)

    def outline(self) -> Outline:
        """The outline.

        Raises
        ------
        InputError
            If an arc does not exist, a side has no length, or sides cross or touch.
        """
        return Outline(oriented([
            loop.loop() if isinstance(loop, Circle) else _loop(loop, number) for number, loop in enumerate(self.loops)
        ]))


def _loop(given: tuple[OutlineSide, ...], number: int) -> list[Side]:
    if len(given) < 2:
        raise InputError(f"geometry.loops[{number}]: a loop needs at least two sides (or center and radius)")
    start = np.array(given[-1].to, dtype=float)
    sides: list[Side] = []
    for side in given:
        if tuple(start) == side.to:
            raise InputError(f"geometry.loops[{number}]: side {side.part!r} at ({start[0]:g}, {start[1]:g}) has no length")
        sides += side.sides_from(start)
        start = sides[-1].end
    return sides


def arc_of_radius(start: Array, end: Array, radius: float, part: str) -> list[Side]:
    """The smaller arc between two points, turning left for a positive radius.

    Raises
    ------
    InputError
        If the points lie further apart than two radii.
    """
    ratio = float(np.hypot(*(end - start))) / (2.0 * abs(radius))
    if ratio > 1.0 + 1e-9:
        raise InputError(
            f"geometry: side {part!r}: radius {radius:g} is less than half the distance {2.0 * ratio * abs(radius):g} "
            "of its ends"
        )
    return _arcs(start, end, math.copysign(2.0 * math.asin(min(1.0, ratio)), radius), part)


def arc_through(start: Array, middle: Array, end: Array, part: str) -> list[Side]:
    """The arc from start to end through a point, of any angle below a whole circle; a straight side if it is straight.

    Raises
    ------
    InputError
        If the three points lie on a line with `middle` outside.
    """
    a, b = middle - start, end - middle
    cross, dot = float(a[0] * b[1] - a[1] * b[0]), float(a @ b)
    # inscribed angle: the tangent turns by twice the angle between the two chords
    turn = 2.0 * math.atan2(cross, dot)
    if abs(cross) <= 1e-13 * (float(a @ a) + float(b @ b)):
        if dot <= 0.0:
            raise InputError(f"geometry: side {part!r}: through = [{middle[0]:g}, {middle[1]:g}] makes no arc")
        return [Side(start, end, part)]
    return _arcs(start, end, turn, part)


def _arcs(start: Array, end: Array, turn: float, part: str) -> list[Side]:
    """Equal pieces of the arc that turns by `turn`, each by no more than LARGEST_TURN."""
    count = max(1, math.ceil(abs(turn) / LARGEST_TURN - 1e-9))
    chord, alpha = end - start, 0.5 * turn
    t = np.linspace(0.0, 1.0, count + 1)
    lean, scale = alpha * (1.0 - t), np.sin(alpha * t) / math.sin(alpha)
    points = start + scale[:, None] * np.column_stack([
        np.cos(lean) * chord[0] + np.sin(lean) * chord[1], np.cos(lean) * chord[1] - np.sin(lean) * chord[0]
    ])
    points[0], points[-1] = start, end
    curvature = 2.0 * math.sin(alpha) / float(np.hypot(*chord))
    return [Side(points[k], points[k + 1], part, curvature) for k in range(count)]
