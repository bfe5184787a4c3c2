"""Panels in rings around an elliptical contact.

Sides of panels follow the edge of contact, where p is a square root, and the edge of the stick
zone, where µp - |q| is one.
"""

from __future__ import annotations

import itertools

import numpy as np

from ...arrays import Array
from ...geometry.quadratic import QuadraticCells
from ...geometry.round_surfaces import GRID
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import SOLVED
from .face_patches import Patch
from .hanging import closed
from .zone import STRIP, ContactEllipse

CORE, SHRINK = 0.5, 0.4
"""`CORE` is the radius of the core over that of the zone [-]. `SHRINK` is the distance of a ring's
outer side from the edge over that of its inner side."""
FRAMES = 4.0
"""Width of a ring or a frame outside over that of the next inner one [-]. With 2.5 and with 4 the
error of p of a rigid roller, 1000 half-widths long, was 1.45 and 1.44 %."""
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


def ringed(
    patch: Patch, zone: ContactEllipse, rings: int, stick: ContactEllipse | None = None
) -> SurfaceMesh | None:
    """Return the mesh with a patch filled by rings around a zone, of order 2 but beside sticking.

    In the zone's coordinates it is the unit disc. Its core has panels in a grid. Rings lead from
    the core to the edge, and from the edge to the rim of the patch.

    Parameters
    ----------
    patch : Patch
    zone : ContactEllipse
        It is projected onto the face along its normal.
    rings : int
        Number of rings between the core, or the stick zone, and the edge.
    stick : ContactEllipse, optional
        A zone of the same shape inside; narrow rings end at its edge.

    Returns
    -------
    SurfaceMesh or None
        None if panels would be too distorted.
    """
    zone = zone.facing(patch.rim)
    middle, radius = np.zeros(2), 1.0
    if stick is not None:
        middle = zone.local(stick.centre[None])[0]
        radius = float(np.linalg.norm(stick.axes) / np.linalg.norm(zone.axes))
    lines, orders = _inside(zone.local(patch.rim), patch.counts, rings, middle, radius)
    core = _filled(lines[0], *patch.counts)
    both = twice_as_fine(lines)
    points = _lifted(patch, zone, np.concatenate([core.reshape(-1, 2), both.reshape(-1, 2)]))
    if points is None:
        return None
    filled, inside = (
        part.reshape(*grid.shape[:2], 3)
        for part, grid in zip(np.split(points, [core[..., 0].size]), (core, both), strict=True)
    )
    outside = _outside(
        patch, inside[-1], _widths(lines, np.linalg.norm(zone.local(patch.rim), axis=1))
    )
    around = np.concatenate([inside, outside])
    around = np.append(around, around[:, :1], axis=1)
    grids = [cells_of(filled), *(cells_of(around[k : k + 3]) for k in range(0, len(around) - 1, 2))]
    # linear panels of 30 degrees leave jumps of u next to narrow ones, and stress of .05 p there
    orders = [2, *orders, *(len(grids) - len(orders) - 1) * [2]]
    new = np.concatenate(grids)
    if not np.all(QuadraticCells(new).distortion < DISTORTED):
        return None
    rest = patch.rest
    return closed(
        SurfaceMesh(
            np.concatenate([rest.corners, new[:, :4]]),
            np.append(rest.order, np.repeat(orders, [*map(len, grids)])),
            np.append(rest.part, np.full(len(new), patch.part)),
            rest.part_names,
            np.concatenate([rest.middles, new[:, 4:]]),
        )
    )


def sector(
    rings: int, zone: ContactEllipse | None = None, stick: ContactEllipse | None = None
) -> float:
    """Return about the angle of panels in rings [rad].

    It depends on the width of the rings, between the core or stick zone and the edge.
    """
    inner = CORE
    if zone is not None and stick is not None:
        inner = float(np.linalg.norm(stick.axes) / np.linalg.norm(zone.axes)) + NARROW[-1]
    return min(SECTOR, LONG * (1.0 - inner) * SHRINK ** (rings - 1))


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


def _widths(lines: Array, reach: Array) -> Array:
    """Return the ends (n,) of rings between the edge and a rim, over their distance [-]."""
    narrow = np.linalg.norm(lines[-1] - lines[-2], axis=1).min()
    steps = np.log1p((reach.max() - 1.0) * (FRAMES - 1.0) / narrow) / np.log(FRAMES)
    number = max(1, int(steps))
    return (FRAMES ** np.arange(number + 1) - 1.0) / (FRAMES**number - 1.0)


def _outside(patch: Patch, edge: Array, share: Array) -> Array:
    """Return lines (2n, 2s, 3) from the edge (2s, 3) to the rim, with lines half-way between."""
    shares = twice_as_fine(share)[1:-1]
    between = edge + shares[:, None, None] * (patch.rim - edge)
    return np.append(
        patch.onto(between.reshape(-1, 3)).reshape(between.shape), patch.rim[None], axis=0
    )


def _lifted(patch: Patch, zone: ContactEllipse, z: Array) -> Array | None:
    """Return the points (n, 3) of the face above points of the zone with coordinates (n, 2), or
    None."""
    x = patch.onto(zone.centre + z @ zone.axes.T)
    for _ in range(60):
        off = z - zone.local(x)
        if np.abs(off).max() < SOLVED:
            return x
        x = patch.onto(x + off @ zone.axes.T)
    return None


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
