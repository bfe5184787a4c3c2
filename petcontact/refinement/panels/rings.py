"""Panels in rings about an elliptical contact: sides of panels follow its edge, where p is a root,
and that of its stick zone, where µp - |q| is one."""

from __future__ import annotations

import itertools

import numpy as np

from ...arrays import Array
from ...geometry.quadratic import QuadraticCells
from ...geometry.round_surfaces import GRID
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import SOLVED
from .hanging import closed
from .patches import Patch
from .zone import Zone

CORE, SHRINK = 0.5, 0.4
"""Share of the zone in its core, and width of a ring over that of all from its inner side to the
edge, beyond the first."""
SECTOR, LONG = np.pi / 6.0, 5.0
"""About the angle of a panel, and largest length of one at the edge over its width: on longer ones
of order 2 single nodes beside the edge were in contact, and others open (three rings of 12: p 8 %
off; of 16: .1 %)."""
SMOOTH = 1
"""Rings outside of the zone of order 2: jumps of u beside narrow panels are pressures there."""
GROWTH = 2.5
"""Width of a ring outside of the zone over that of the one before it."""
NARROW = (-0.04, -0.02, 0.0, 0.02, 0.04)
"""Where rings of order 1 at the edge of a stick zone end, from there, over the radius of the
contact. Between them and the core is one ring of order 2: a second one made no estimate smaller."""
DISTORTED = 8.0
"""Largest ratio of area factors within a panel."""
STEPS = 60
"""Of the search for the points of a face above those of a zone."""


def ringed(patch: Patch, zone: Zone, rings: int, stick: Zone | None = None) -> SurfaceMesh | None:
    """The mesh with a patch filled by rings about a zone, of order 2 in it and 1 outside.

    In the zone's own coordinates, where it is a disc: a core of panels like a grid's, rings about
    it up to the edge, and rings from there to the rim of the patch.

    Parameters
    ----------
    patch : Patch
    zone : Zone
        It is brought onto the face along its normal.
    rings : int
        Between the core, or the stick zone, and the edge.
    stick : Zone, optional
        In the zone and of its shape; narrow rings end at its edge.

    Returns
    -------
    SurfaceMesh or None
        Nothing where panels would be too distorted.
    """
    zone = zone.facing(patch.rim)
    middle, radius = np.zeros(2), 1.0
    if stick is not None:
        middle = zone.local(stick.centre[None])[0]
        radius = float(np.linalg.norm(stick.axes) / np.linalg.norm(zone.axes))
    lines, orders = _inside(zone.local(patch.rim), patch.counts, rings, middle, radius)
    core = _filled(lines[0], *patch.counts)
    both = np.repeat(lines, 2, axis=0)[:-1]
    both[1::2] = 0.5 * (lines[1:] + lines[:-1])
    found = _lifted(patch, zone, np.concatenate([core.reshape(-1, 2), both.reshape(-1, 2)]))
    if found is None:
        return None
    filled, inside = (
        part.reshape(*grid.shape[:2], 3)
        for part, grid in zip(np.split(found, [core[..., 0].size]), (core, both), strict=True)
    )
    outside = _outside(
        patch, inside[-1], _widths(lines, np.linalg.norm(zone.local(patch.rim), axis=1))
    )
    around = np.concatenate([inside, outside])
    around = np.append(around, around[:, :1], axis=1)
    grids = [_cells(filled), *(_cells(around[k : k + 3]) for k in range(0, len(around) - 1, 2))]
    orders = [2, *orders, *(len(grids) - len(orders) - 1) * [1]]
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


def sector(rings: int, zone: Zone | None = None, stick: Zone | None = None) -> float:
    """About the angle of panels in rings from the core, or the edge of the stick zone, to that of
    the zone [rad]."""
    inner = CORE
    if zone is not None and stick is not None:
        inner = float(np.linalg.norm(stick.axes) / np.linalg.norm(zone.axes)) + NARROW[-1]
    return min(SECTOR, LONG * (1.0 - inner) * SHRINK ** (rings - 1))


def _inside(
    rim: Array, counts: tuple[int, int], rings: int, middle: Array, radius: float
) -> tuple[Array, list[int]]:
    """Lines (n, 2s, 2) around the core, in rings to the edge of the unit disc; orders of panels
    between and next beyond.

    A stick zone is a smaller disc in it, of a middle and radius.
    """
    # equal sectors: quadratic arcs whose middle is not half way are no circles
    angle = 2.0 * np.pi * np.arange(len(rim)) / len(rim)
    angle += np.mean(np.unwrap(np.angle(rim @ [1.0, 1.0j])) - angle)
    disc = np.column_stack([np.cos(angle), np.sin(angle)])
    ends = 2 * np.cumsum([0, *counts, *counts])
    side, full = (
        np.repeat(np.arange(4), np.diff(ends)),
        np.append(angle, angle[0] + 2.0 * np.pi)[ends],
    )
    half = 0.5 * np.diff(full)[side]
    chord = np.cos(half) / np.cos(angle - full[side] - half)
    # the core is half way between a polygon and a disc: its corners are neither 90 nor 180 degrees
    core = middle + radius * 0.5 * CORE * (1.0 + chord)[:, None] * disc
    curves, orders = [core], list[int]()
    if radius < 1.0:
        edge = middle + radius * disc
        near = [edge + width / (1.0 - radius) * (disc - edge) for width in NARROW]
        curves, orders = [core, *near], [2] + (len(near) - 1) * [1]
    curves += _graded(curves[-1], disc, rings)[1:]
    return np.array([*curves, disc]), [*orders, *(rings + SMOOTH) * [2]]


def _widths(lines: Array, reach: Array) -> Array:
    """Where rings from the edge to a rim begin and end, over the distance between them, (n,)."""
    narrow = np.linalg.norm(lines[-1] - lines[-2], axis=1).min()
    steps = np.log1p((reach.max() - 1.0) * (GROWTH - 1.0) / (2.0 * narrow)) / np.log(GROWTH)
    number = max(1, int(steps))
    return (GROWTH ** np.arange(number + 1) - 1.0) / (GROWTH**number - 1.0)


def _outside(patch: Patch, edge: Array, share: Array) -> Array:
    """Lines beyond the edge (2s, 3) to the rim, and half way between them, (2n, 2s, 3)."""
    every = np.repeat(share, 2)[1:-2]
    every[::2] = 0.5 * (share[1:] + share[:-1])
    between = edge + every[:, None, None] * (patch.rim - edge)
    return np.append(
        patch.onto(between.reshape(-1, 3)).reshape(between.shape), patch.rim[None], axis=0
    )


def _lifted(patch: Patch, zone: Zone, z: Array) -> Array | None:
    """The points (n, 3) of the face that are above those of the zone, of coordinates (n, 2)."""
    x = patch.onto(zone.centre + z @ zone.axes.T)
    for _ in range(STEPS):
        off = z - zone.local(x)
        if np.abs(off).max() < SOLVED:
            return x
        x = patch.onto(x + off @ zone.axes.T)
    return None


def _graded(low: Array, high: Array, rings: int) -> list[Array]:
    """Curves between two, the first of which is the lower one, that bound rings which are narrower
    towards the upper one."""
    return [low + (1.0 - SHRINK**k) * (high - low) for k in range(rings)]


def _filled(rim: Array, *count: int) -> Array:
    """A grid (2 count + 1, 2 count + 1, 2) within points along its four sides, by Coons."""
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


def _cells(grid: Array) -> Array:
    """Panels (n, 9, d) of a grid (2 i + 1, 2 j + 1, d)."""
    i, j = grid.shape[0] - 1, grid.shape[1] - 1
    points = np.stack([grid[a : a + i : 2, b : b + j : 2] for a, b in GRID], axis=2)
    return np.asarray(points.reshape(-1, 9, grid.shape[2]))
