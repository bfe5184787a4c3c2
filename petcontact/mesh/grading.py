"""Ends of the elements on each side: uniform, or graded geometrically towards singular points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from ..arrays import Array, Index, ranked
from ..errors import InputError
from ..geometry.outline import Outline, Side
from ..geometry.same_place import TOLERANCE, distinct
from ..given.tables.solver_options import MeshOptions
from ..round_off import SOLVED, least_pieces, whole
from .curve_building import build_mesh
from .curve_mesh import CurveMesh

T = TypeVar("T")
CORNER = math.radians(10.0)
"""A joint that turns by more is a corner [rad]."""


LARGEST_MESH = 1_000_000
"""Largest number of nodes; compressed operators of more do not fit into a machine's memory."""


def mesh_outline(outline: Outline, options: MeshOptions) -> CurveMesh:
    """Return the boundary mesh for the given options.

    Raises
    ------
    InputError
        If an element size names a part that does not exist, a graded point lies off the boundary,
        or there were more than a million nodes.
    """
    unknown = sorted(set(options.element_sizes) - set(outline.parts))
    if unknown:
        raise InputError(
            f"mesh.element_sizes.{unknown[0]}: no such part; parts are {', '.join(outline.parts)}"
        )
    corners = singular_ends(outline)
    _check_count(outline, options, sum(map(sum, corners)))
    given = points_on_sides(outline, options)
    breaks = []
    for side, fractions, ends in zip(outline.sides, given, corners, strict=True):
        size = options.element_sizes.get(side.part, options.element_size)
        if options.graded:
            breaks.append(graded_breaks(side, fractions, ends, size, options))
        else:
            count = 1 if size is None else max(1, whole(side.length / size))
            breaks.append(np.linspace(0.0, 1.0, count + 1))
        smallest = float(np.diff(breaks[-1]).min())
        if smallest < SOLVED:
            raise InputError(
                f"mesh: an element of {smallest:.1g} of part {side.part!r} is lost in round-off; "
                "use fewer levels or a grading nearer to 1"
            )
    order = options.resolved_order
    return build_mesh(outline, breaks, [np.full(len(b) - 1, order) for b in breaks])


def _check_count(outline: Outline, options: MeshOptions, graded_ends: int) -> None:
    sizes = [
        options.element_sizes.get(side.part, options.element_size) or side.length
        for side in outline.sides
    ]
    count = sum(side.length / size for side, size in zip(outline.sides, sizes, strict=True))
    count = (count + options.levels * graded_ends * options.graded) * (options.resolved_order + 1)
    if not count <= LARGEST_MESH:
        raise InputError(
            f"mesh: these element sizes give {count:.2g} nodes, more than {LARGEST_MESH:.0e}; use "
            "larger ones"
        )


def singular_ends(outline: Outline) -> list[tuple[bool, bool]]:
    """Return whether a mesh is graded towards the start and the end of each side.

    It is at corners and where parts meet. It is not at smooth joints inside a part, nor at vertices
    of a polyline that stands for a curve.
    """
    return at_ends(
        outline,
        lambda before, after: before.part != after.part or abs(turn(before, after)) > CORNER,
    )


def at_ends(outline: Outline, joint: Callable[[Side, Side], T]) -> list[tuple[T, T]]:
    """Return the values of a function of two sides that meet, at the start and end of each side."""
    result: list[tuple[T, T]] = []
    for loop in outline.loops:
        first, last = outline.beyond(loop)
        joints = [
            joint(before, after) for before, after in itertools.pairwise((first, *loop, last))
        ]
        result += itertools.pairwise(joints)
    return result


def turn(before: Side, after: Side) -> float:
    """Return the angle from the tangent of a side to that of the next one where they meet [rad].

    It is positive at a convex corner.
    """
    a, b = before.tangents(np.ones(1))[0], after.tangents(np.zeros(1))[0]
    return math.atan2(a[0] * b[1] - a[1] * b[0], float(a @ b))


def graded_breaks(
    side: Side, given: Array, ends: tuple[bool, bool], size: float | None, options: MeshOptions
) -> Array:
    """Return the ends of elements that shrink towards the singular ends of a side and its given
    points."""
    inner = given[(given > 0.0) & (given < 1.0)]
    marks = np.concatenate([[0.0], inner, [1.0]])
    singular = [ends[0] or 0.0 in given, *[True] * len(inner), ends[1] or 1.0 in given]
    graded = np.concatenate(
        [[0.0], options.resolved_grading ** np.arange(options.levels, -1.0, -1.0)]
    )
    pieces = [np.array([0.0])]
    largest = min(math.inf if size is None else size / side.length, largest_turn(side))
    for (a, b), (first, last) in zip(
        itertools.pairwise(marks), itertools.pairwise(singular), strict=True
    ):
        reach = (0.5 if first and last else 1.0) * (b - a)
        up, down = (reach * (graded if towards else graded[:1]) for towards in (first, last))
        # where both are graded they meet in the middle, which is one point
        points = np.concatenate([a + up, (b - down)[-2::-1]] if first or last else [[a], [b]])
        points[0], points[-1] = a, b
        pieces.append(cut_equally(points, least_pieces(np.diff(points) / largest))[1:])
    return np.concatenate(pieces)


def largest_turn(side: Side) -> float:
    """Return the largest element of a graded arc, which turns by 30 degrees, as a fraction of
    it."""
    turn = abs(2.0 * side.half_angle)
    return math.pi / 6.0 / turn if turn > 0.0 else math.inf


def cut_equally(points: Array, count: Index) -> Array:
    """Return the ends after each element is cut into `count` (n,) equal ones."""
    owner, within = ranked(count)
    begins, width = points[:-1][owner], np.diff(points)[owner]
    return np.append(begins + width * within / count[owner], points[-1])


def points_on_sides(outline: Outline, options: MeshOptions) -> list[Array]:
    """Return the fractions of the graded points on each side, 0 and 1 at its ends."""
    by_side: list[list[float]] = [[] for _ in outline.sides]
    within = TOLERANCE * outline.diameter
    for point in options.graded_points:
        at = [float(side.nearest(np.array([point]))[0]) for side in outline.sides]
        feet = [side.point(np.array([t]))[0] for side, t in zip(outline.sides, at, strict=True)]
        apart = [float(np.hypot(*(foot - point))) for foot in feet]
        nearest = min(apart)
        if nearest > 1e-6 * outline.diameter:
            raise InputError(
                f"mesh.graded_points: {list(point)} lies {nearest:.3g} off the boundary"
            )
        for fractions, distance, fraction in zip(by_side, apart, at, strict=True):
            if distance <= nearest + within:
                fractions.append(fraction)
    return [
        distinct(np.array(fractions), within / side.length, 1.0)
        for fractions, side in zip(by_side, outline.sides, strict=True)
    ]
