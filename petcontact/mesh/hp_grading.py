"""Meshes graded geometrically towards marked points, with orders that grow away from them.

An adaptive mesh is described by its marks and a `Grading`. Marks are points of each side at which
the solution is not smooth, with the size of the smallest element there. The ends of the side are
marks, too. A refined mesh has a better grading, smaller elements at the marks, or other marks.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array, Index, shown, smallest_by
from ..errors import InputError
from ..geometry.outline import Outline, Side
from ..linalg.nearest import within
from ..record import record
from ..round_off import WRITTEN
from .curve_building import build_mesh
from .curve_mesh import CurveMesh
from .grading import LARGEST_MESH, at_ends, cut_equally, largest_turn, turn

NEIGHBOUR = 4.0
"""Largest ratio of the lengths of two neighbouring elements [-]."""
SLOPE = 0.7
"""Increase of the order from one element to the next, away from a mark. Elements next to a mark are
small and need no high order."""
FALL = 2.0
"""Largest decrease of the order from one element to the next, from the longest one towards a
mark."""
NEAR = 1.2
"""Largest ratio of an element's length to its distance from sides that do not meet its own, on the
coarsest meshes [-]. The field of a nearer side is not smooth on the element."""
OPPOSITE = -0.9
"""Cosine of the normals of two sides of a body, below which one lies behind the other. If such
sides meet, at a corner of less than 26 degrees, they are treated like near sides that do not
meet."""


Resolve = Callable[[int, Array, Index], tuple[Array, Index]]


@record
class Grading:
    """How elements shrink towards marks.

    Attributes
    ----------
    order : int
        Largest order, reached away from the marks.
    ratio : float
        Ratio in (0, 1) of neighbouring elements.
    largest : float
        Length of the largest elements over NEAR times their distance from other sides, and over 30
        degrees of an arc [-].
    """

    order: int
    ratio: float
    largest: float = 1.0


@record
class Marks:
    """Marked points of one side.

    Attributes
    ----------
    position : (k,) array
        Arc length along the side, increasing from 0 to its length [length].
    size : (k,) array
        Length of the smallest elements at each point, infinite where the mesh is not graded towards
        it [length].
    powers : pair of float
        λ where the first and the last element are powers of the distance to the end, 0 where they
        are polynomials.
    """

    position: Array
    size: Array
    powers: tuple[float, float] = (0.0, 0.0)


def graded_mesh(
    outline: Outline,
    marks: list[Marks],
    grading: Grading,
    largest: list[float],
    resolve: Resolve | None = None,
) -> CurveMesh:
    """Return a mesh graded towards marks.

    No element is longer than NEIGHBOUR times its neighbours.

    Parameters
    ----------
    outline : Outline
    marks : list of Marks, one a side
    grading : Grading
    largest : list of float, one a side
        Largest length of elements on the side [length].
    resolve : callable, optional
        Function of the number of a side, its breaks (as fractions) and orders. It returns finer
        ones that resolve the given data.
    """
    pieces = [graded_side(points, grading) for points in marks]
    breaks = [p[0] / side.length for p, side in zip(pieces, outline.sides, strict=True)]
    for fractions in breaks:
        fractions[-1] = 1.0
    orders = [p[1] for p in pieces]
    most = [
        np.minimum(top, grading.largest * side.length * largest_turn(side))
        for top, side in zip(largest, outline.sides, strict=True)
    ]
    # distances are those from the ends and middles of other elements, which are far apart at first
    room = 1.0
    while _cut_near(outline, breaks, orders, NEAR * grading.largest, most, room):
        room = 3.0
    if resolve is not None:
        for k in range(len(breaks)):
            breaks[k], orders[k] = resolve(k, breaks[k], orders[k])
    _smooth(outline, breaks, orders)
    return build_mesh(outline, breaks, orders, [points.powers for points in marks])


def _cut_near(
    outline: Outline,
    breaks: list[Array],
    orders: list[Index],
    near: float,
    most: list[float],
    room: float,
) -> bool:
    """Cut elements that are more than `room` times too long, in place; return whether there are
    any.

    They are at most `near` times as long as far from other sides, and `most` of their side.
    """
    before, nodes = sum(map(len, orders)), 0.0
    limits = _distance_limits(outline, breaks, near, most)
    for k, (side, ends) in enumerate(zip(outline.sides, at_ends(outline, _spread), strict=True)):
        length = np.diff(breaks[k]) * side.length
        middles = 0.5 * (breaks[k][1:] + breaks[k][:-1]) * side.length
        apart = limits[k]
        if room == 1.0:  # an element at a tip is as long over its depth however short it is
            apart = np.minimum(apart, middles * ends[0])
            apart = np.minimum(apart, (side.length - middles) * ends[1])
        limit = np.minimum(near * apart, most[k])
        count = np.maximum(1.0, np.ceil(length / limit - WRITTEN))
        nodes += float(count @ (orders[k] + 1.0))
        if nodes > LARGEST_MESH:
            place, thin = side.point(middles / side.length)[count.argmax()], limits[k].min()
            raise InputError(
                f"geometry: part {side.part!r} lies {thin:.2g} from another at {shown(place)}, and "
                f"the outline is {outline.diameter / thin:.2g} times as large: elements as short "
                f"give more than {LARGEST_MESH:.0e} nodes"
            )
        count[count <= room] = 1.0
        breaks[k], orders[k] = _split(breaks[k], orders[k], count.astype(np.int64))
    return sum(map(len, orders)) > before


def graded_side(marks: Marks, grading: Grading) -> tuple[Array, Index]:
    """Return breaks (n + 1,) [length] and orders (n,) of one side."""
    pieces, orders = [np.zeros(1)], []
    position, size = marks.position, marks.size
    for k in range(len(position) - 1):
        a, b = float(position[k]), float(position[k + 1])
        graded = np.isfinite(size[k : k + 2])
        reach = 0.5 * (b - a) if graded.all() else b - a
        left = _steps(reach, float(size[k]), grading.ratio) if graded[0] else np.zeros(1)
        right = _steps(reach, float(size[k + 1]), grading.ratio) if graded[1] else np.zeros(1)
        if graded.any():
            # where both are graded they meet in the middle, which is one point; where one is, the
            # other is an end
            points = np.concatenate([a + left, (b - right)[-2::-1]])
            orders += [_orders(len(left) - 1, grading), _orders(len(right) - 1, grading)[::-1]]
        else:
            points = np.array([a, b])
            orders.append(np.array([grading.order]))
        points[0], points[-1] = a, b
        pieces.append(points[1:])
    result = np.concatenate(orders)
    for order, power in ((result, marks.powers[0]), (result[::-1], marks.powers[1])):
        if power:
            _of_corner(order, grading)
    return np.concatenate(pieces), result


def _of_corner(orders: Index, grading: Grading) -> None:
    """Set order 0 on a corner element that is a power, and the full order next to it, in place."""
    growing = (
        int(np.argmax(orders >= grading.order)) if np.any(orders >= grading.order) else len(orders)
    )
    orders[:growing] = grading.order
    orders[0] = 0


def balanced(marks: Marks, grading: Grading, share: float = 1.0) -> Marks:
    """Return the marks with sizes that fit the shorter interval next to each, or a share of it."""
    interval = marks.position[1:] - marks.position[:-1]
    shorter = np.concatenate([interval[:1], np.minimum(interval[:-1], interval[1:]), interval[-1:]])
    fitting = np.minimum(marks.size, 0.5 * grading.ratio * share * shorter)
    return Marks(marks.position, np.where(np.isfinite(marks.size), fitting, np.inf), marks.powers)


def _steps(half: float, smallest: float, ratio: float) -> Array:
    """Return distances from a mark to the ends of the elements in the half interval next to it."""
    levels = max(0, math.ceil(math.log(smallest / half) / math.log(ratio) - WRITTEN))
    result = np.zeros(levels + 2)
    result[1:] = half * ratio ** np.arange(levels, -1.0, -1.0)
    return result


@functools.lru_cache(maxsize=256)
def _orders(count: int, grading: Grading) -> Index:
    """Return orders of elements away from a mark; the longest element has the full order."""
    away: Index = np.floor(1.0 + SLOPE * np.arange(count)).astype(np.int64)
    least: Index = grading.order - np.ceil(FALL * np.arange(count)[::-1]).astype(np.int64)
    return np.clip(np.maximum(away, least), 1, grading.order)


def _split(breaks: Array, orders: Index, count: Index) -> tuple[Array, Index]:
    """Return breaks and orders after each element is cut into `count` equal ones."""
    if count.max() == 1:
        return breaks, orders
    return cut_equally(breaks, count), np.repeat(orders, count)


def _smooth(outline: Outline, breaks: list[Array], orders: list[Index]) -> None:
    """Halve elements that are too long next to their neighbours, in place."""
    first = 0
    for loop in outline.loops:
        sides = range(first, first + len(loop))
        first += len(loop)
        closed = np.array_equal(loop[-1].end, loop[0].start)
        while True:
            length = np.concatenate([np.diff(breaks[k]) * outline.sides[k].length for k in sides])
            before, after = (length[-1:], length[:1]) if closed else (length[:1], length[-1:])
            around = np.concatenate([before, length, after])
            count = np.where(
                length > NEIGHBOUR * (1.0 + WRITTEN) * np.minimum(around[:-2], around[2:]), 2, 1
            )
            if count.max() == 1:
                break
            ends = np.cumsum([0, *(len(orders[k]) for k in sides)])
            for k, a, b in zip(sides, ends[:-1], ends[1:], strict=True):
                breaks[k], orders[k] = _split(breaks[k], orders[k], count[a:b])


def _spread(before: Side, after: Side) -> float:
    """Return the distance of points of one side from the other over that from their common corner
    [-].

    It is infinite if neither side lies behind the other.
    """
    between = turn(before, after)
    return math.sin(between) if between > 0.0 and math.cos(between) < OPPOSITE else math.inf


def _distance_limits(
    outline: Outline, breaks: list[Array], near: float, most: list[float]
) -> list[Array]:
    """Return the distances (n,) of the middles of elements from sides that do not meet their own,
    where they cut an element as `_cut_near` says, else infinity [length]."""
    counts = np.array([len(fractions) - 1 for fractions in breaks])
    both = [*((b[1:] + b[:-1]) / 2.0 for b in breaks), *breaks]
    cloud = np.concatenate([s.point(b) for s, b in zip(outline.sides * 2, both, strict=True)])
    owner = np.repeat([*range(len(counts))] * 2, [len(fractions) for fractions in both])
    lengths = [np.diff(b) * side.length for b, side in zip(breaks, outline.sides, strict=True)]
    # what is farther away cuts no element
    reach = np.minimum(np.concatenate(lengths), np.repeat(most, counts)) / near
    number, other = within(cloud, cloud[: counts.sum()], reach)
    own, owns = owner[number], owner[other]
    far = (
        (own != owns) & (outline.neighbours[0][own] != owns) & (outline.neighbours[1][own] != owns)
    )
    away = np.linalg.norm(cloud[number[far]] - cloud[other[far]], axis=1)
    limits = smallest_by(number[far], away, int(counts.sum()))
    return np.split(limits, np.cumsum(counts)[:-1])
