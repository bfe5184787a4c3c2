"""Panels in rings around an elliptical contact.

Sides of panels follow the edge of contact, where p is a square root, and the edge of the stick
zone, where µp - |q| is one.
"""

from __future__ import annotations

import itertools

import numpy as np

from ...arrays import Array
from ...geometry.chart import Chart
from ...geometry.quadratic import QuadraticCells
from ...geometry.round_surfaces import GRID
from ...record import record, replace
from ...round_off import SINGLE, least_pieces
from .zone import STRIP, ContactEllipse

CORE, SHRINK = 0.5, 0.4
"""`CORE` is the radius of the core over that of the zone [-]. `SHRINK` is the distance of a ring's
outer side from the edge over that of its inner side."""
FRAMES = 4.0
"""Width of a ring or a frame outside over that of the next inner one [-]. With 2.5 and with 4 the
error of p of a rigid roller, 1000 half-widths long, was 1.45 and 1.44 %."""
AROUND = (1.5, 2.0)
"""Half sides of the rectangle around a zone over those of the narrowest one [-]. It reaches to the
rim of the face where this is nearer than the second one."""
SECTOR, LONG = np.pi / 6.0, 5.0
"""`SECTOR` is about the angle of a panel [rad], `LONG` the largest ratio of length to width at the
edge. On longer panels of order 2 single nodes at the edge were closed, and others open. p was wrong
by 8 % with three rings of 12 panels, and by 0.1 % with rings of 16."""
NARROW = np.linspace(-STRIP, STRIP, 5)
"""Distances of the ends of rings of order 1 from the edge of a stick zone, over the radius of the
contact [-]. One ring of order 2 lies between them and the core; a second one made no estimate
smaller."""
DISTORTED = 8.0
"""Largest accepted ratio of area factors within a panel [-]."""


@record
class Inner:
    """The panels in and next to a zone, inside a rectangle.

    Attributes
    ----------
    cells, outer : (n, 9, 2), (m, 9, 2) arrays
        Points of panels on the chart, and of those of order 2 beside the zone, which may be cut
        [length].
    order : (n,) array
        Orders of panels.
    rim : list of (k, 2) arrays
        Ends of panels along the sides of the rectangle, counter-clockwise [length]; none if panels
        reach to the rim of the face.
    origin, axes : (2,), (2, 2) arrays
        A point, and unit vectors along the sides of the rectangle as rows.
    width : float
        Of the outermost panels across the rim [length].
    """

    cells: Array
    outer: Array
    order: Array
    rim: list[Array]
    origin: Array
    axes: Array
    width: float


def ringed(chart: Chart, zone: ContactEllipse, rings: int) -> Inner | None:
    """Return the panels of a rectangle around a zone, or of a disc, in rings, of order 2 but beside
    sticking; None if the zone is too near to the rim of the face, or panels would be too distorted.

    In the zone's coordinates it is the unit disc. Its core has panels in a grid. Rings lead from
    the core to the edge, and from the edge to the rectangle, or to the rim of the disc.

    Parameters
    ----------
    chart : Chart
        Of the face.
    zone : ContactEllipse
    rings : int
        Number of rings between the core, or the stick zone, and the edge.
    """
    points_of = _on_circle if chart.round else _on_rectangle
    for more in range(4):  # finer ones in both directions where panels are distorted
        rim, counts = points_of(chart, zone, _half_turn(zone, rings) + 2 * more)
        if not np.linalg.norm(rim, axis=1).min(initial=np.inf) >= 1.0:
            continue
        lines, orders = _inside(rim, counts, rings, zone.middle, zone.stick)
        core, edge = cells_of(zone.at(_filled(lines[0], *counts))), 2 * len(lines) - 2
        around = zone.at(_around(lines, rim, more))
        made = [core, *(cells_of(around[k : k + 3]) for k in range(0, edge, 2))]
        # linear panels of 30 degrees leave jumps of u next to narrow ones, and stress of .05 p
        outer = cells_of(around[edge:])
        if not _is_distorted(chart, np.concatenate([*made, outer])):
            break
    else:
        return None
    width = float(np.linalg.norm(around[-1] - around[-3], axis=1).min())
    order = np.repeat([2, *orders], [*map(len, made)])
    sides = [] if chart.round else _sides(zone.at(rim), counts)
    return Inner(np.concatenate(made), outer, order, sides, np.zeros(2), np.eye(2), width)


def _half_turn(zone: ContactEllipse, rings: int) -> int:
    """Return the number of sectors of half a turn."""
    inner = CORE if zone.stick == 1.0 else zone.stick + NARROW[-1]
    sector = min(SECTOR, LONG * (1.0 - inner) * SHRINK ** (rings - 1))
    return max(2, int(least_pieces(np.pi / sector)))


def _is_distorted(chart: Chart, cells: Array) -> bool:
    points = chart.at(cells.reshape(-1, 2)).reshape(-1, 9, 3)
    return not np.all(QuadraticCells(points).distortion < DISTORTED)


def _on_circle(chart: Chart, zone: ContactEllipse, half: int) -> tuple[Array, tuple[int, int]]:
    """Return points of the rim of a disc at equal angles about a zone, in its coordinates; and the
    numbers of sectors of the first two of four sides. Panels end at corners of the rim."""
    angle = np.sort(np.append(np.angle(zone.local(chart.corners) @ [1.0, 1.0j]), -np.pi))
    angle = angle[1:][np.diff(angle) > SINGLE] if len(angle) > 1 else angle
    ends = np.append(2.0 * np.round((angle - angle[0]) * half / np.pi), 4 * half)
    if np.diff(ends).min() == 0.0:
        return np.zeros((1, 2)), (0, 0)  # in the zone: this does not lie inside
    angle = np.append(angle, angle[0] + 2.0 * np.pi)
    return _seen_from(chart, zone, ends, angle), (half // 2, half - half // 2)


def _seen_from(chart: Chart, zone: ContactEllipse, ends: Array, angle: Array) -> Array:
    """Return points of a rim in a zone's coordinates, at equal angles between corners with given
    numbers and angles."""
    angle = np.interp(np.arange(ends[-1]), ends, angle)
    towards = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(chart.rays(zone.centre, towards @ zone.axes.T)[:, None] * towards)


def _on_rectangle(chart: Chart, zone: ContactEllipse, half: int) -> tuple[Array, tuple[int, int]]:
    """Return points of a rectangle around a zone, in its coordinates, counter-clockwise, at equal
    angles along each side; and the numbers of sectors of its first two sides."""
    face, reach = np.stack([chart.low, chart.high]), np.linalg.norm(zone.axes, axis=1)
    near = np.abs(face - zone.centre) < AROUND[1] * reach
    low, high = np.where(near, face, zone.centre + np.outer([-1.0, 1.0], AROUND[0] * reach))
    corners = zone.local(np.array([low, [high[0], low[1]], high, [low[0], high[1]]]))
    angle = np.unwrap(np.angle(np.append(corners, corners[:1], axis=0) @ [1.0, 1.0j]))
    span = np.diff(angle)
    once = np.isclose(span.sum(), 2.0 * np.pi)
    if not (once and np.all((span > 0.0) & (span < np.pi))):
        return np.zeros((1, 2)), (0, 0)  # in the zone: this does not lie inside
    first = min(max(1, round(half * (span[0] + span[2]) / (2.0 * np.pi))), half - 1)
    cuts = np.column_stack([np.vstack([-np.eye(2), np.eye(2)]), np.append(-low, high)])
    box = replace(chart, high=np.full(2, np.inf), cuts=cuts)
    ends = np.cumsum([0, *2 * [2 * first, 2 * (half - first)]])
    return _seen_from(box, zone, ends, angle), (first, half - first)


def _around(lines: Array, rim: Array, more: int) -> Array:
    """Return closed lines around a zone, those given and others up to a rim, each second one in the
    middle of panels; as many more rings lie outside as are asked for."""
    shares = twice_as_fine(_widths(lines, np.linalg.norm(rim, axis=1), more))[1:]
    outside = lines[-1] + shares[:, None, None] * (rim - lines[-1])
    around = np.concatenate([twice_as_fine(lines), outside])
    return np.append(around, around[:, :1], axis=1)


def _sides(rim: Array, counts: tuple[int, int]) -> list[Array]:
    """Return the ends of panels along each side of a rim."""
    along = np.append(rim, rim[:1], axis=0)[::2]
    ends = np.cumsum([0, *counts, *counts])
    return [along[a : b + 1] for a, b in itertools.pairwise(ends)]


def _inside(
    rim: Array, counts: tuple[int, int], rings: int, middle: Array, radius: float
) -> tuple[Array, list[int]]:
    """Return the lines (n, 2s, 2) from the core to the edge of the unit disc, and the orders of
    panels.

    The lines bound rings. A stick zone is a smaller disc with a centre `middle` and a radius.
    """
    # sectors are equal: a quadratic arc is nearest to a circle if its middle is half-way
    angle = 2.0 * np.pi * np.arange(len(rim)) / len(rim)
    angle += np.mean(np.unwrap(np.angle(rim @ [1.0, 1.0j])) - angle)
    disc = np.column_stack([np.cos(angle), np.sin(angle)])
    ends = 2 * np.cumsum([0, *counts, *counts])
    side = np.repeat(np.arange(4), np.diff(ends))
    full = np.append(angle, angle[0] + 2.0 * np.pi)[ends]
    half = 0.5 * np.diff(full)[side]
    chord = np.cos(half) / np.cos(angle - full[side] - half)
    # the core is half-way between a polygon and a disc, for corners between 90 and 180 degrees
    core = middle + radius * 0.5 * CORE * (1.0 + chord)[:, None] * disc
    curves, orders = [core], list[int]()
    if radius < 1.0:
        edge = middle + radius * disc
        near = [edge + width / (1.0 - radius) * (disc - edge) for width in NARROW]
        curves, orders = [core, *near], [2] + (len(near) - 1) * [1]
    curves += _graded(curves[-1], disc, rings)[1:]
    return np.array([*curves, disc]), [*orders, *rings * [2]]


def _widths(lines: Array, reach: Array, more: int) -> Array:
    """Return the ends (n,) of rings between the edge and a rim, over their distance [-]."""
    narrow = np.linalg.norm(lines[-1] - lines[-2], axis=1).min()
    steps = np.log1p((reach.max() - 1.0) * (FRAMES - 1.0) / narrow) / np.log(FRAMES)
    number = max(1, int(np.ceil(steps)))
    widths = FRAMES ** (number * np.linspace(0.0, 1.0, number + more + 1))
    return np.asarray((widths - 1.0) / (widths[-1] - 1.0))


def _graded(low: Array, high: Array, rings: int) -> list[Array]:
    """Return curves that bound rings between two curves, without the upper one.

    The rings are narrower towards the upper curve.
    """
    return [low + (1.0 - SHRINK**k) * (high - low) for k in range(rings)]


def _filled(rim: Array, *count: int) -> Array:
    """Return a Coons grid (2 count + 1, 2 count + 1, 2) inside points along its four sides."""
    ends = np.cumsum([0, *(2 * n for n in (*count, *count))])
    closed = np.append(rim, rim[:1], axis=0)
    low, right, top, left = (closed[a : b + 1] for a, b in itertools.pairwise(ends))
    top, left = top[::-1], left[::-1]
    u, v = (np.linspace(0.0, 1.0, 2 * n + 1) for n in count)
    u, v = u[:, None, None], v[None, :, None]
    straight = (
        (1 - u) * (1 - v) * low[0] + u * (1 - v) * low[-1] + (1 - u) * v * top[0] + u * v * top[-1]
    )
    return np.asarray(
        (1 - v) * low[:, None]
        + v * top[:, None]
        + (1 - u) * left[None]
        + u * right[None]
        - straight
    )


def twice_as_fine(values: Array) -> Array:
    """Return values (n, ...) with the means of neighbours between them, (2n - 1, ...)."""
    result = np.repeat(values, 2, axis=0)[:-1]
    result[1::2] = 0.5 * (values[1:] + values[:-1])
    return result


def cells_of(grid: Array) -> Array:
    """Return the panels (n, 9, d) of a grid (2 i + 1, 2 j + 1, d)."""
    i, j = grid.shape[0] - 1, grid.shape[1] - 1
    points = np.stack([grid[a : a + i : 2, b : b + j : 2] for a, b in GRID], axis=2)
    return np.asarray(points.reshape(-1, 9, grid.shape[2]))
