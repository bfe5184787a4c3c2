"""Outlines of bodies: closed loops of named sides, straight or circular, the body on the left of
each."""

from __future__ import annotations

import cmath
import functools
import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Array, Index, shown
from ..errors import InputError
from ..record import Keeping, fields, record, replace
from ..round_off import ROUNDED
from .arcs import (
    arc_lengths,
    check_digits,
    divided,
    feet_on_arcs,
    half_angles,
    on_arcs,
    perimeter,
    signed_area,
    turns_left_once,
)
from .same_place import TOLERANCE
from .surface import Boundary

if TYPE_CHECKING:
    import shapely

RUNS_ON = 1e-7
"""Turn, and change of curvature over a side, within which one side goes on into the next [rad]."""

HULL = 24.0
"""Perimeter of the convex hull over the unit of length of logarithms."""


@record
class Side:
    """A straight line or a circular arc from `start` to `end`, the body on its left.

    Attributes
    ----------
    start, end : (2,) arrays
        End points [length].
    part : str
        Name of the part of the boundary that the side belongs to.
    curvature : float
        0 for a straight side, +1/R where the arc turns left, -1/R where it turns right [1/length];
        the arc is the smaller of the two through its end points, at most a half circle.
    """

    start: Array
    end: Array
    part: str
    curvature: float = 0.0

    @functools.cached_property
    def half_angle(self) -> float:
        """Half of the angle through which the side turns, signed [rad]."""
        return float(half_angles(self._chord, self.curvature))

    @functools.cached_property
    def _chord(self) -> Array:
        return np.asarray(np.hypot(*(self.end - self.start)))

    @functools.cached_property
    def length(self) -> float:
        """Length of the side [length]."""
        return float(arc_lengths(self._chord, self.half_angle))

    @property
    def whole(self) -> float:
        """Length of the curve of which it is a piece [length]."""
        return self.length

    def point(self, fraction: Array) -> Array:
        """Points (n, 2) at fractions (n,) of the arc length; the ends are met exactly."""
        t = np.asarray(fraction, dtype=float)
        straight: Array = self.start * (1.0 - t[:, None]) + self.end * t[:, None]
        if self.curvature == 0.0 or self._chord == 0.0:
            return straight
        inner = (t > 0.0) & (t < 1.0)
        points = on_arcs(self.start, self.end, self.half_angle, 2.0 * t - 1.0)[0]
        return np.where(inner[:, None], points, straight)

    def tangents(self, fraction: Array) -> Array:
        """Unit vectors (n, 2) along the side at fractions (n,) of the arc length."""
        if self.curvature == 0.0:
            return np.full((len(fraction), 2), (self.end - self.start) / self._chord)
        nx, ny = on_arcs(self.start, self.end, self.half_angle, 2.0 * fraction - 1.0)[1].T
        return np.column_stack([-ny, nx])

    def arcs(self, breaks: Array) -> tuple[Array, Array]:
        """Return unit vectors (n, 2) along the chords of the pieces between fractions (n + 1,) of
        the arc length, and the curvatures (n,) of the pieces [1/length]."""
        middle = 0.5 * (breaks[1:] + breaks[:-1])
        return self.tangents(middle), np.full(len(middle), self.curvature)

    def nearest(self, x: Array) -> Array:
        """Fractions (n,) of the arc length at which the side is nearest to points (n, 2), on arcs
        within a radius."""
        place, _ = feet_on_arcs(x, self.start, self.end, self.curvature, self.half_angle)
        return np.clip(place, 0.0, 1.0)

    def reversed(self) -> Side:
        """The side from its end to its start."""
        return Side(self.end, self.start, self.part, -self.curvature)


def arc(start: Array, end: Array, alpha: float, part: str) -> list[Side]:
    """Sides along the arc that turns by 2α, each by a quarter circle at most; one straight side
    where α = 0."""
    points = divided(start, end, alpha)
    curvature = 2.0 * math.sin(alpha) / float(np.hypot(*(end - start)))
    return [Side(a, b, part, curvature) for a, b in itertools.pairwise(points)]


@record
class Outline(Keeping, Boundary):
    """The boundary of a body: loops of sides, the outer one counter-clockwise, holes clockwise.

    Attributes
    ----------
    loops : tuple of tuples of Side
    exterior : bool
        Whether there is no outer loop: the body is the infinite plate around the loops.
    depth : float
        Thickness of the body across the plane, 0 where it is not given [length].

    Raises
    ------
    InputError
        If a loop is not closed, a side has no length, or sides cross or touch.
    """

    loops: tuple[tuple[Side, ...], ...]
    exterior: bool = False
    depth: float = 0.0
    dim = components = 2
    known = graded = True

    def of_thickness(self, thickness: float) -> Outline:
        """Return the outline of a body of so much thickness [length], the same one each time."""
        return self.once(("thickness", thickness), lambda: self._as_thick(thickness))

    def _as_thick(self, thickness: float) -> Outline:
        # what was checked need not be checked again; what was computed is of another thickness
        outline = object.__new__(type(self))
        vars(outline).update({key.name: getattr(self, key.name) for key in fields(self)})
        vars(outline)["depth"] = thickness
        return outline

    def __post_init__(self) -> None:
        for loop in self.loops:
            for side, following in zip(loop, (*loop[1:], loop[0]), strict=True):
                if not np.array_equal(side.end, following.start):
                    raise InputError(
                        f"geometry: the loop is open after side {side.part!r} at {shown(side.end)}"
                    )
            if len(_ring(loop, 4)) < 3:
                raise InputError(
                    f"geometry: a loop of two straight sides at {shown(loop[0].start)} encloses "
                    "nothing"
                )
        # squares of lengths must not vanish, nor differences of coordinates lose the digits that
        # distinguish the sides
        check_digits(
            self.diameter, [end for side in self.sides for end in (side.start, side.end)], "outline"
        )
        for side in self.sides:
            if side.length <= TOLERANCE * self.diameter:
                raise InputError(
                    f"geometry: side {side.part!r} at {shown(side.start)} has no length: "
                    f"{side.length:.2g}, and places of the body are one within "
                    f"{TOLERANCE * self.diameter:.2g}"
                )
        for side, following in zip(self.sides, self.neighbours[1].tolist(), strict=True):
            if _is_cusp(side, self.sides[following]):
                raise InputError(
                    f"geometry: sides {side.part!r} and {self.sides[following].part!r} meet at "
                    f"{shown(side.end)} in a cusp, which has no width; a radius of the other sign "
                    "bends an arc the other way"
                )
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
        points = np.vstack([_ring(loop, 9) for loop in self.around])
        return float(np.hypot(*np.ptp(points, axis=0)))

    @functools.cached_property
    def log_length(self) -> float:
        """Unit of length in the kernel's logarithm: 1/24 of the convex hull's perimeter [length].

        The single layer is singular at a degenerate scale. The logarithmic capacity of a body lies
        between 1/4 and 1/2 of its diameter. In diameters, degenerate scales therefore lie between
        0.092 = exp(-1)/4, that of a thin body at ν = 1/2, and 0.5. This length is smaller than the
        scales of each body: 0.083 for a thin one, whose lowest scale is 0.18 at ν = 0, and at most
        0.131 for a disc, whose scales are 0.30 or more. It is 1 for both examples of the paper,
        whose digits depend on it through the discretisation error.
        """
        points = np.vstack([_ring(loop, 64) for loop in self.around])
        if self._is_convex:
            return perimeter(points) / HULL
        return hull_scale(points)

    @functools.cached_property
    def _is_convex(self) -> bool:
        """Whether there is one loop that turns left everywhere: simple, and its own convex hull."""
        return (
            not self.exterior
            and len(self.around) == 1
            and turns_left_once(_ring(self.around[0], 64))
        )

    @functools.cached_property
    def joined(self) -> Outline:
        """The same boundary with sides that run on straight, or along one circle, joined within
        their parts.

        Meshes of Gmsh have a side for every line; a graded mesh is to have elements where the body
        has corners. Arcs are joined up to a quarter circle.
        """
        loops = tuple(_joined(loop) for loop in self.loops)
        return self if sum(map(len, loops)) == len(self.sides) else replace(self, loops=loops)

    @property
    def offsets(self) -> list[float]:
        """Arc length along its part at the start of each side [length]."""
        travelled: dict[str, float] = {}
        result = []
        for side in self.sides:
            result.append(travelled.get(side.part, 0.0))
            travelled[side.part] = result[-1] + side.length
        return result

    @functools.cached_property
    def neighbours(self) -> tuple[Index, Index]:
        """Numbers of the side before and of the side after each one."""
        return round_loops([len(loop) for loop in self.loops])

    @property
    def around(self) -> tuple[tuple[Side, ...], ...]:
        """Closed loops around the body."""
        return self.loops

    def beyond(self, loop: tuple[Side, ...]) -> tuple[Side, Side]:
        """The sides before the first and after the last one of a loop."""
        return loop[-1], loop[0]

    @property
    def axis_ends(self) -> list[tuple[int, int]]:
        """Sides that start (0) or end (1) on the axis of a body of revolution: here none."""
        return []

    def _rings(self, points_per_arc: int = 64) -> list[Array]:
        """Corners of each loop, arcs as chords; of an infinite plate those of a box around come
        first."""
        rings = [_ring(loop, points_per_arc) for loop in self.around]
        if not self.exterior:
            return rings
        low, high = np.min(np.vstack(rings), axis=0), np.max(np.vstack(rings), axis=0)
        (left, bottom), (right, top) = 2.0 * low - high, 2.0 * high - low
        return [np.array([[left, bottom], [right, bottom], [right, top], [left, top]]), *rings]

    def polygon(self, points_per_arc: int = 64) -> shapely.Polygon:
        """The body as a shapely polygon, arcs as chords: for tests and pictures; of an infinite
        plate a piece."""
        import shapely

        rings = self._rings(points_per_arc)
        return shapely.Polygon(rings[0], rings[1:])

    @functools.cached_property
    def thickness(self) -> float:
        """Twice the area over the perimeter: of a strip its thickness; of an infinite plate that of
        a piece [length]."""
        rings = self._rings()
        outer, *holes = (abs(signed_area(ring)) for ring in rings)
        return 2.0 * (outer - sum(holes)) / sum(map(perimeter, rings))

    def _check_simple(self) -> None:
        if self._is_convex or (body := self.polygon()).is_valid:
            return
        import shapely
        from shapely.validation import explain_validity

        for loop in self.loops:
            ring = shapely.Polygon(_ring(loop, 64))
            if not ring.is_valid:
                raise InputError(
                    f"geometry: the outline crosses or touches itself ({explain_validity(ring)})"
                )
        outer = shapely.Polygon(_ring(self.loops[0], 64))
        for loop in self.loops[1:]:
            if not self.exterior and outer.disjoint(shapely.Polygon(_ring(loop, 64))):
                places = f"{shown(self.loops[0][0].start)} and {shown(loop[0].start)}"
                raise InputError(
                    f"geometry: two separate pieces, at {places}; a hole lies outside, or "
                    "each piece is to be a [[body]] of its own"
                )
        raise InputError(
            f"geometry: loops cross or touch, or a hole lies outside ({explain_validity(body)})"
        )


def as_outline(boundary: object, what: str) -> Outline:
    """The boundary of a plane body.

    Raises
    ------
    InputError
        If it is that of a body in space; `what` is what asks for a plane one.
    """
    if not isinstance(boundary, Outline):
        raise InputError(f"{what}: for plane bodies only, this one is in space")
    return boundary


def round_loops(counts: Sequence[int]) -> tuple[Index, Index]:
    """Who comes before and who after each member of loops of so many members, numbered one loop
    after another."""
    first = np.concatenate([[0], np.cumsum(counts)])
    before, after = np.arange(first[-1]) - 1, np.arange(first[-1]) + 1
    before[first[:-1]], after[first[1:] - 1] = first[1:] - 1, first[:-1]
    return before, after


def _is_cusp(before: Side, after: Side) -> bool:
    """Return whether the interior angle between two sides is 0; a re-entrant one of 2π is none."""
    along = before.tangents(np.ones(1)) @ after.tangents(np.zeros(1)).T
    return bool(along < ROUNDED - 1.0) and before.curvature + after.curvature < 0.0


def _ring(loop: Sequence[Side], points_per_arc: int) -> Array:
    """Corners of the loop, with points along its arcs (the first of each side, the last one is the
    next side's)."""
    arcs = np.linspace(0.0, 1.0, points_per_arc)[:-1]
    return np.vstack(
        [side.start[None] if side.curvature == 0.0 else side.point(arcs) for side in loop]
    )


def _joined(loop: tuple[Side, ...]) -> tuple[Side, ...]:
    """The sides of a loop, those joined that go on into each other."""
    result = [loop[0]]
    for side in loop[1:]:
        before = result[-1]
        alpha = before.half_angle + side.half_angle
        if (
            before.part != side.part
            or {type(before), type(side)} != {Side}
            or not _goes_on(before, side)
            or abs(alpha) > 0.25 * math.pi + RUNS_ON
        ):
            result.append(side)
            continue
        chord = float(np.hypot(*(side.end - before.start)))
        result[-1] = Side(
            before.start, side.end, side.part, 2.0 * math.sin(alpha) / chord if alpha else 0.0
        )
    return tuple(result)


def _goes_on(before: Side, side: Side) -> bool:
    """Whether a side has the direction and the curvature with which the one before it ends."""
    chords = [complex(*(piece.end - piece.start)) for piece in (before, side)]
    ends = (
        chords[0] * cmath.exp(1j * before.half_angle),
        chords[1] * cmath.exp(-1j * side.half_angle),
    )
    turn = abs(cmath.phase(ends[1] / ends[0]))
    return (
        turn < RUNS_ON and abs(before.curvature - side.curvature) * min(map(abs, chords)) < RUNS_ON
    )


def hull_scale(points: Array) -> float:
    """1/24 of the perimeter of the convex hull of points (n, 2), see `Outline.log_length`
    [length]."""
    import shapely

    return float(shapely.MultiPoint(points).convex_hull.length) / HULL


def oriented(
    loops: Sequence[Sequence[Side]], *, exterior: bool = False
) -> tuple[tuple[Side, ...], ...]:
    """The loops with the largest first and counter-clockwise, the others (holes) clockwise;
    `exterior`: all clockwise."""
    areas = [signed_area(_ring(loop, 64)) for loop in loops]
    order = sorted(range(len(loops)), key=lambda k: -abs(areas[k]))
    turned = []
    for rank, k in enumerate(order):
        wanted = 1.0 if rank == 0 and not exterior else -1.0
        loop = list(loops[k])
        turned.append(
            tuple(loop if areas[k] * wanted > 0 else [side.reversed() for side in reversed(loop)])
        )
    return tuple(turned)
