"""Outlines of bodies: closed loops of named sides, straight or circular, the body on the left of each."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pydantic
import shapely
from shapely.validation import explain_validity

from ..arrays import Array
from ..errors import InputError
from ..model.base import LARGEST_COORDINATE, Model, Point


@dataclass(frozen=True)
class Side:
    """A straight line or a circular arc from `start` to `end`, the body on its left.

    Attributes
    ----------
    start, end : (2,) arrays
        End points [length].
    part : str
        Name of the part of the boundary that the side belongs to.
    curvature : float
        0 for a straight side, +1/R where the arc turns left, -1/R where it turns right [1/length]; the arc is
        the smaller of the two through its end points, at most a half circle.
    """

    start: Array
    end: Array
    part: str
    curvature: float = 0.0

    @property
    def half_angle(self) -> float:
        """Half of the angle through which the side turns, signed [rad]."""
        return float(np.arcsin(np.clip(0.5 * self.curvature * np.hypot(*(self.end - self.start)), -1.0, 1.0)))

    @property
    def length(self) -> float:
        """Arc length [length]."""
        chord = float(np.hypot(*(self.end - self.start)))
        return chord if self.curvature == 0.0 else 2.0 * self.half_angle / self.curvature

    def point(self, fraction: Array) -> Array:
        """Points (n, 2) at fractions (n,) of the arc length; the ends are met exactly."""
        t = np.asarray(fraction, dtype=float)[:, None]
        if self.curvature == 0.0:
            straight: Array = self.start * (1.0 - t) + self.end * t
            return straight
        chord, alpha = self.end - self.start, self.half_angle
        # on a circle the chord of the sub-arc [0, t] is sin(αt)/sin(α) long and lies at -α(1-t) to the whole chord
        turn, scale = alpha * (1.0 - t), np.sin(alpha * t) / np.sin(alpha)
        rotated = np.hstack([
            np.cos(turn) * chord[0] + np.sin(turn) * chord[1],
            np.cos(turn) * chord[1] - np.sin(turn) * chord[0],
        ])
        points: Array = np.where(t == 1.0, self.end, self.start + scale * rotated)
        return points

    def reversed(self) -> Side:
        """The same side run through the other way."""
        return Side(self.end, self.start, self.part, -self.curvature)


@dataclass(frozen=True)
class Outline:
    """The boundary of a body: loops of sides, the outer one counter-clockwise, holes clockwise.

    Raises
    ------
    InputError
        If a loop is not closed, a side has no length, or sides cross or touch.
    """

    loops: tuple[tuple[Side, ...], ...]

    def __post_init__(self) -> None:
        for loop in self.loops:
            for side, following in zip(loop, (*loop[1:], loop[0]), strict=True):
                if not np.array_equal(side.end, following.start):
                    raise InputError(f"geometry: the loop is open after side {side.part!r} at {_text(side.end)}")
        self._check_digits()
        for side in self.sides:
            if side.length <= 1e-12 * self.diameter:
                raise InputError(f"geometry: side {side.part!r} at {_text(side.start)} has no length")
        self._check_simple()

    @functools.cached_property
    def sides(self) -> tuple[Side, ...]:
        """All sides, loop after loop, in the order in which elements are numbered."""
        return tuple(side for loop in self.loops for side in loop)

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts, in order of appearance."""
        return tuple(dict.fromkeys(side.part for side in self.sides))

    @functools.cached_property
    def diameter(self) -> float:
        """Length of the diagonal of the bounding box [length]."""
        points = np.vstack([_ring(loop, 9) for loop in self.loops])
        return float(np.hypot(*np.ptp(points, axis=0)))

    @functools.cached_property
    def log_length(self) -> float:
        """Length that the kernel's logarithm is measured in: 1/24 of the convex hull's perimeter [length].

        At a degenerate scale the single layer is singular. In units of the diameter these scales lie between
        0.092 = exp(-1)/4 (a thin body, ν = 1/2) and 0.5, since the logarithmic capacity lies between 1/4 and 1/2; this
        length is 0.083 for a thin body (whose lowest scale is 0.18 at ν = 0) and at most 0.131 for a disc (0.30 or more). It
        is 1 for both examples of the paper, whose digits depend on it through the discretisation error.
        """
        return float(self.polygon().convex_hull.length) / 24.0

    def polygon(self, points_per_arc: int = 64) -> shapely.Polygon:
        """The body as a shapely polygon, arcs as chords: for point-in-body tests and pictures."""
        rings = [_ring(loop, points_per_arc) for loop in self.loops]
        return shapely.Polygon(rings[0], rings[1:])

    def _check_digits(self) -> None:
        """Squares of lengths must not vanish, nor differences of coordinates lose what tells the sides apart."""
        farthest = max(float(np.abs(np.concatenate([side.start, side.end])).max()) for side in self.sides)
        if not self.diameter > max(1e-9 * farthest, 1.0 / LARGEST_COORDINATE):
            raise InputError(f"geometry: the outline is {self.diameter:.3g} wide at {farthest:.3g} from the origin: "
                             "too little for 16 digits, choose another origin or unit of length")  # fmt: skip

    def _check_simple(self) -> None:
        body = self.polygon()
        if body.is_valid:
            return
        for loop in self.loops:
            ring = shapely.Polygon(_ring(loop, 64))
            if not ring.is_valid:
                raise InputError(f"geometry: the outline crosses or touches itself ({explain_validity(ring)})")
        raise InputError(f"geometry: loops cross or touch, or a hole lies outside ({explain_validity(body)})")


def _ring(loop: Sequence[Side], points_per_arc: int) -> Array:
    """Corners of the loop, with points along its arcs (the first of each side, the last one is the next side's)."""
    arcs = np.linspace(0.0, 1.0, points_per_arc)[:-1]
    return np.vstack([side.start[None] if side.curvature == 0.0 else side.point(arcs) for side in loop])


def oriented(loops: Sequence[Sequence[Side]]) -> tuple[tuple[Side, ...], ...]:
    """The loops with the largest first and counter-clockwise, the others (holes) clockwise."""
    areas = [_signed_area(_ring(loop, 64)) for loop in loops]
    order = sorted(range(len(loops)), key=lambda k: -abs(areas[k]))
    turned = []
    for rank, k in enumerate(order):
        wanted = 1.0 if rank == 0 else -1.0
        loop = list(loops[k])
        turned.append(tuple(loop if areas[k] * wanted > 0 else [side.reversed() for side in reversed(loop)]))
    return tuple(turned)


def _signed_area(ring: Array) -> float:
    x, y = (ring - ring[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _text(point: Array) -> str:
    return f"({point[0]:g}, {point[1]:g})"


class Rectangle(Model):
    """`shape = "rectangle"`: axis-parallel, its sides named bottom, right, top, left."""

    shape: Literal["rectangle"] = "rectangle"
    lower_left: Point
    upper_right: Point

    @pydantic.model_validator(mode="after")
    def _has_area(self) -> Rectangle:
        if not (self.upper_right[0] > self.lower_left[0] and self.upper_right[1] > self.lower_left[1]):
            raise ValueError("upper_right must lie to the right of and above lower_left")
        return self

    def outline(self) -> Outline:
        """The outline, starting at the lower left corner."""
        (x0, y0), (x1, y1) = self.lower_left, self.upper_right
        return _polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], ["bottom", "right", "top", "left"])


class Polygon(Model):
    """`shape = "polygon"`: straight sides between vertices, one part name a side (side k starts at vertex k)."""

    shape: Literal["polygon"] = "polygon"
    vertices: tuple[Point, ...] = pydantic.Field(min_length=3)
    parts: tuple[str, ...]

    @pydantic.model_validator(mode="after")
    def _one_name_a_side(self) -> Polygon:
        if len(self.parts) != len(self.vertices):
            raise ValueError(f"{len(self.vertices)} vertices need as many part names in parts, got {len(self.parts)}")
        return self

    def outline(self) -> Outline:
        """The outline; vertices given clockwise are turned round, each side keeping its name."""
        return _polygon(self.vertices, self.parts)


def _polygon(vertices: Sequence[Point], parts: Sequence[str]) -> Outline:
    points = [np.array(v, dtype=float) for v in vertices]
    following = [*points[1:], points[0]]
    loop = [Side(a, b, part) for a, b, part in zip(points, following, parts, strict=True)]
    return Outline(oriented([loop]))
