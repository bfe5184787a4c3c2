"""Panels in rings about an elliptical contact on the face of a box: sides of panels follow its edge, where p is a root, and
that of its stick zone, where µp - |q| is one."""

from __future__ import annotations

import itertools

import numpy as np

from ...arrays import Array, Mask, States
from ...frozen import frozen
from ...geometry.quadratic import QuadraticCells
from ...mesh.surface_mesh import SurfaceMesh

CORE, SHRINK = 0.5, 0.4
"""Share of the zone in its core, and width of a ring over that of all from its inner side to the edge, beyond the first."""
SECTOR = np.pi / 6.0
"""About the angle of a panel."""
SMOOTH = 1
"""Rings outside of the zone of order 2: jumps of u beside narrow panels are pressures there."""
GROWTH = 2.5
"""Width of a ring outside of the zone over that of the one before it."""
INSET = 0.999
"""Of the semi-axes: a panel that ends beyond the edge of contact carries a pressure there, one before it does no harm."""
STRAY = 0.1
"""Largest share of a contact that is not in the ellipse, or lacks in it."""
NARROW = (-0.04, -0.02, 0.0, 0.02, 0.04)
"""Where rings of order 1 at the edge of a stick zone end, from there, over the radius of the contact. Between them and the
core is one ring of order 2: a second one made no estimate smaller."""
LEAST, MOST = 0.15, 0.9
"""Radius of a stick zone that has rings, and how far it reaches, over the radius of the contact."""
ELONGATED = 3.0
"""Largest ratio of the axes of an ellipse."""
PATCH, LEFT = 1.5, 0.5
"""Half the sides of the rectangle that rings fill over the reach of the zone, and what it leaves at least beside it."""
CLEAR = 1.1
"""Least distance of the rectangle from the centre over that of the edge."""
DISTORTED = 8.0
"""Largest ratio of area factors within a panel."""
POINTS = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1))
"""Of a panel on a grid with the middles of its sides, in the order of `QuadraticCells`."""


@frozen
class Zone:
    """An ellipse: x = centre + axes z, |z| <= 1.

    Attributes
    ----------
    centre : (3,) array
        [length]
    axes : (3, 2) array
        Both semi-axes, as vectors [length].
    """

    centre: Array
    axes: Array

    def local(self, x: Array) -> Array:
        """z of points (n, 3), (n, 2)."""
        return np.asarray((x - self.centre) @ np.linalg.pinv(self.axes).T)


def zone_of(x: Array, weight: Array, pressure: Array, closed: Mask) -> Zone | None:
    """The ellipse over which Hertz' pressure has the moments of a given one; None where the contact is another.

    Hertz' pressure on semi-axes a, b has ∫p x²/∫p = a²/5. Moments are exact to a few thousandths on meshes on which p is
    off by a tenth.

    Parameters
    ----------
    x : (m, 3) array
        Nodes [length].
    weight : (m,) array
        [area]
    pressure : (m,) array
        [stress]
    closed : (m,) bool array
        Which nodes are in contact, in any increment.
    """
    load = weight * pressure
    if not load.sum() > 0.0:
        return None
    centre = load @ x / load.sum()
    square, vectors = np.linalg.eigh((x - centre).T @ ((x - centre) * load[:, None]) / load.sum())
    if not 0.0 < square[2] <= ELONGATED**2 * square[1]:
        return None
    zone = Zone(centre, vectors[:, 1:] * INSET * np.sqrt(5.0 * square[1:]))
    stray = closed != (np.linalg.norm(zone.local(x), axis=1) < 1.0)
    return zone if weight[stray].sum() <= STRAY * weight[closed].sum() else None


def stick_of(x: Array, weight: Array, state: States, slip: Array, zone: Zone) -> Zone | None:
    """The ellipse, of the shape of the contact's, that parts what sticks from what slips; None where none does.

    Stick zones are such ellipses under a tangential load (Cattaneo) and under a growing normal one (Spence), shifted where
    a body is stretched besides. The edge lies between the last node that sticks and the first that slips, where |Δw|, which
    grows like the power 3/2 of the distance, is 0 by a line through its power 2/3 over the square of the radius.

    Parameters
    ----------
    x : (m, 3) array
        Nodes [length].
    weight : (m,) array
        [area]
    state : (m,) array
        0 stick, 1 slip, 2 open.
    slip : (m, 2) array
        Δw of the increment [length].
    zone : Zone
        The contact.
    """
    closed = state != 2
    z, area, sticks, slip = zone.local(x)[closed], weight[closed], state[closed] == 0, slip[closed]
    total = area[sticks].sum()
    if sticks.all() or not total > 0.0:
        return None
    middle = area[sticks] @ z[sticks] / total
    square = np.sum((z - middle) ** 2, axis=1)
    order = np.argsort(square)
    right = np.cumsum(np.where(sticks, area, -area)[order])
    last = int(right[:-1].argmax())
    power = np.linalg.norm(slip[~sticks], axis=1) ** (2.0 / 3.0)
    away, root = square[~sticks], np.sqrt(area[~sticks])
    (start, slope), *_ = np.linalg.lstsq(root[:, None] * np.vander(away, 2, True), root * power, rcond=None)
    edge = -start / slope if slope > 0.0 else 0.0
    radius = float(np.sqrt(np.clip(edge, *square[order[last : last + 2]])))
    stray = total - right[last] > STRAY * total
    return None if stray or radius < LEAST or radius + np.linalg.norm(middle) > MOST else \
        Zone(zone.centre + zone.axes @ middle, radius * zone.axes)  # fmt: skip


def ringed(mesh: SurfaceMesh, part: str, zone: Zone, rings: int, stick: Zone | None = None) -> SurfaceMesh | None:
    """The mesh with the panels of a rectangular face replaced by rings about a zone, of order 2 in it and 1 outside.

    In the zone's own coordinates, where it is a disc: a core of panels like a grid's, rings about it up to the edge, and
    rings from there to a rectangle, beside which panels are rectangles. Rays to its corners are sides of panels.

    Parameters
    ----------
    mesh : SurfaceMesh
    part : str
        A face of a box.
    zone : Zone
        It is brought onto the plane of the face along its normal.
    rings : int
        Between the core, or the stick zone, and the edge.
    stick : Zone, optional
        In the zone and of its shape; narrow rings end at its edge.

    Returns
    -------
    SurfaceMesh or None
        Nothing where the zone is too close to the rim of the face, or panels would be too distorted.
    """
    number = mesh.part_names.index(part)
    mine = mesh.part == number
    low, high = (each[mine] for each in mesh.boxes)
    low, high, normal = low.min(axis=0), high.max(axis=0), mesh.normal[mesh.first_node[:-1][mine][0]]
    axis = int(np.abs(normal).argmax())
    uv = [(axis + 1) % 3, (axis + 2) % 3][:: 1 if normal[axis] > 0.0 else -1]
    centre, axes = zone.centre[uv], zone.axes[uv]
    axes = axes if np.linalg.det(axes) > 0.0 else axes[:, ::-1]
    reach, face = np.linalg.norm(axes, axis=1), np.stack([low[uv], high[uv]])
    far = np.abs(face - centre) < (PATCH + LEFT) * reach
    patch = np.where(far, face, centre + np.outer([-1.0, 1.0], PATCH * reach))
    to_disc = np.linalg.inv(axes).T
    middle, radius = np.zeros(2), 1.0
    if stick is not None:
        middle = np.dot(stick.centre[uv] - centre, to_disc)
        radius = float(np.linalg.norm(stick.axes) / np.linalg.norm(axes))
    found = _panels((_corners(patch[None])[0] - centre) @ to_disc, rings, middle, radius)
    if found is None:
        return None
    points = centre + found[0] @ axes.T
    beside = _corners(_beside(face, patch, centre))
    flat = np.full((len(beside), 9, 2), np.nan)
    flat[:, :4] = beside
    new = np.full((len(flat) + len(points), 9, 3), low[axis])
    new[..., uv] = np.concatenate([flat, points])
    new[np.isnan(new[..., uv[0]])] = np.nan
    if not np.all(QuadraticCells(new[len(flat) :]).distortion < DISTORTED):
        return None
    order = np.concatenate([np.ones(len(flat), dtype=int), found[1]])
    return SurfaceMesh(
        np.concatenate([mesh.corners[~mine], new[:, :4]]), np.concatenate([mesh.order[~mine], order]),
        np.concatenate([mesh.part[~mine], np.full(len(new), number)]), mesh.part_names,
        np.concatenate([mesh.middles[~mine], new[:, 4:]]),
    )  # fmt: skip


def _corners(rectangles: Array) -> Array:
    """Corners (n, 4, 2), counter-clockwise, of rectangles given by their least and largest coordinates, (n, 2, 2)."""
    return np.stack([rectangles[:, [i, j], [0, 1]] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1)


def _beside(face: Array, patch: Array, centre: Array) -> Array:
    """Rectangles (n, 2, 2) of a face outside of a patch of it, none of which is longer than its distance from a centre."""
    cells = [np.array([[a, c], [b, d]]) for a, b in itertools.pairwise(np.unique([face[0, 0], *patch[:, 0], face[1, 0]]))
             for c, d in itertools.pairwise(np.unique([face[0, 1], *patch[:, 1], face[1, 1]]))]  # fmt: skip
    cells = [cell for cell in cells if not np.array_equal(cell, patch)]
    result = []
    while cells:
        cell = cells.pop()
        length, middle = cell[1] - cell[0], cell.mean(axis=0)
        k = int(length.argmax())
        if length[k] <= np.linalg.norm(middle - centre):
            result.append(cell)
            continue
        for end in (0, 1):
            half = cell.copy()
            half[end, k] = middle[k]
            cells.append(half)
    return np.array(result).reshape(-1, 2, 2)


def _panels(corners: Array, rings: int, middle: Array, radius: float) -> tuple[Array, Array] | None:
    """Points (n, 9, 2) of panels in a polygon of four corners about the unit disc, and their orders (n,).

    A stick zone is a smaller disc in it, of a middle and radius.
    """
    start = np.unwrap(np.angle(np.append(corners, corners[:1], axis=0) @ [1.0, 1.0j]))
    span = np.diff(start)
    if not np.all((span > 0.0) & (span < np.pi)) or not np.isclose(span.sum(), 2.0 * np.pi):
        return None
    count = np.maximum(1, np.round(span / SECTOR)).astype(int)
    count = np.maximum(count, np.roll(count, 2))
    outer, chord, direction = [], [], []
    for k in range(4):
        phi = start[k] + span[k] * np.arange(2 * count[k]) / (2 * count[k])
        towards, side = np.column_stack([np.cos(phi), np.sin(phi)]), corners[(k + 1) % 4] - corners[k]
        direction.append(towards)
        outer.append(np.cross(corners[k], side) / np.cross(towards, side))
        chord.append(np.cos(0.5 * span[k]) / np.cos(phi - start[k] - 0.5 * span[k]))
    reach, disc = np.concatenate(outer), np.concatenate(direction)
    if reach.min() < CLEAR:
        return None
    # the core is half way between a polygon and a disc: its corners are neither 90 nor 180 degrees
    core = middle + radius * 0.5 * CORE * (1.0 + np.concatenate(chord))[:, None] * disc
    curves, orders = [core], list[int]()
    if radius < 1.0:
        edge = middle + radius * disc
        near = [edge + width / (1.0 - radius) * (disc - edge) for width in NARROW]
        curves, orders = [core, *near], [2] + (len(near) - 1) * [1]
    curves += _graded(curves[-1], disc, rings)[1:]
    orders += (rings + SMOOTH) * [2]
    rim, narrow = reach[:, None] * disc, np.linalg.norm(disc - curves[-1], axis=1).min()
    steps = np.log1p((reach.max() - 1.0) * (GROWTH - 1.0) / (2.0 * narrow)) / np.log(GROWTH)
    number = max(1, round(float(steps)))
    share = (GROWTH ** np.arange(number + 1) - 1.0) / (GROWTH**number - 1.0)
    lines = np.array([*curves, *(disc + t * (rim - disc) for t in share)])
    both = np.repeat(lines, 2, axis=0)[:-1]
    both[1::2] = 0.5 * (lines[1:] + lines[:-1])
    around = np.append(both, both[:, :1], axis=1)
    grids = [around[2 * k : 2 * k + 3] for k in range(len(lines) - 1)]
    orders += (len(grids) - len(orders)) * [1]
    middles = _cells(_filled(lines[0], *count[:2]))
    return np.concatenate([middles, *map(_cells, grids)]), np.repeat(
        [2, *orders], [len(middles), *len(grids) * [len(disc) // 2]]
    )


def _graded(low: Array, high: Array, rings: int) -> list[Array]:
    """Curves between two, the first of which is the lower one, that bound rings which are narrower towards the upper one."""
    return [low + (1.0 - SHRINK**k) * (high - low) for k in range(rings)]


def _filled(rim: Array, *count: int) -> Array:
    """A grid (2 count + 1, 2 count + 1, 2) within points along its four sides, by Coons."""
    ends = np.cumsum([0, *(2 * n for n in (*count, *count))])
    closed = np.append(rim, rim[:1], axis=0)
    low, right, top, left = (closed[a : b + 1] for a, b in itertools.pairwise(ends))
    top, left = top[::-1], left[::-1]
    u, v = (np.linspace(0.0, 1.0, 2 * n + 1) for n in count)
    u, v = u[:, None, None], v[None, :, None]
    straight = (1 - u) * (1 - v) * low[0] + u * (1 - v) * low[-1] + (1 - u) * v * top[0] + u * v * top[-1]
    return np.asarray((1 - v) * low[:, None] + v * top[:, None] + (1 - u) * left[None] + u * right[None] - straight)


def _cells(grid: Array) -> Array:
    """Panels (n, 9, d) of a grid (2 i + 1, 2 j + 1, d)."""
    i, j = grid.shape[0] - 1, grid.shape[1] - 1
    points = np.stack([grid[a : a + i : 2, b : b + j : 2] for a, b in POINTS], axis=2)
    return np.asarray(points.reshape(-1, 9, grid.shape[2]))
