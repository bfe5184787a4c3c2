"""Patches of faces to be filled by rings of panels: their rims, and the panels around them."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np

from ...arrays import Array, Index, Mask, scattered
from ...geometry.arcs import cross
from ...geometry.quadratic import QuadraticCells, on_side, samples
from ...geometry.surface import Boundary, BoxSurface
from ...mesh.surface_mesh import SurfaceMesh
from ...record import record
from ...round_off import least_pieces
from .cut_directions import sides
from .hanging import numbered
from .quartering import cut, parents
from .zone import ContactEllipse

AROUND = (1.25, 1.5, 2.0)
"""Distances from the centre over that of the edge [-]. Panels within one of them may be a patch;
the first one with a good rim is taken. The rectangle on a face of a box has half sides of the
second one, and reaches to the rim of the face where this is nearer than the third."""
MOST_PIECES = 40
"""Largest number of panels around a zone, and of sectors of a rim."""


@record
class Patch:
    """A part of a face that is filled by panels in rings.

    Attributes
    ----------
    rest : SurfaceMesh
        The body's panels outside of the patch.
    part : int
        Number of the face.
    rim : (2n, 3) array
        Ends and middles of the outer sides of n sectors, counter-clockwise seen from outside the
        body [length].
    counts : (int, int)
        Numbers of sectors on the four sides of the inner grid: on the first and third, on the
        second and fourth [-].
    onto : callable
        Function that projects points (k, 3) onto the face.
    """

    rest: SurfaceMesh
    part: int
    rim: Array
    counts: tuple[int, int]
    onto: Callable[[Array], Array]


@functools.singledispatch
def patches_of(
    surface: Boundary,
    mesh: SurfaceMesh,
    first: SurfaceMesh,
    part: str,
    zone: ContactEllipse,
    sector: float,
) -> Iterator[Patch]:
    """Yield the patches of a face around a zone, if there are any, those with fewer panels first.

    Parameters
    ----------
    surface : Boundary
        The exact surface.
    mesh, first : SurfaceMesh
        The present mesh, and the first one, whose panels the face has outside of the patch.
    part : str
        The face.
    zone : ContactEllipse
    sector : float
        About the angle of a panel [rad].
    """
    # other panels of a curved face are cut until none is longer than its distance from the centre
    number = mesh.part_names.index(part)
    panels = _joined(
        mesh.reordered(np.flatnonzero(mesh.part != number)),
        first.reordered(first.elements_of(part)),
    )
    for _ in range(16):
        on_part = np.flatnonzero(panels.part == number)
        away = scattered(_distance(zone, panels, on_part), on_part, panels.n_elements, np.inf)
        if np.count_nonzero(away < AROUND[0]) > MOST_PIECES:
            return
        for near in (away < limit for limit in AROUND):
            if _rim(zone, panels, np.flatnonzero(near), sector) is not None:
                graded, near = _graded(panels, near, number, zone.centre, surface)
                rim = _rim(zone, graded, np.flatnonzero(near), sector)
                rest = graded.reordered(np.flatnonzero(~near))
                if rim is not None:
                    yield Patch(
                        rest,
                        number,
                        *rim,
                        lambda x: surface.onto(np.full(len(x), number), x[:, None])[:, 0],
                    )
        panels = cut(panels, np.repeat((away < AROUND[0])[:, None], 2, axis=1), surface)


@patches_of.register
def _rectangle(
    surface: BoxSurface,
    mesh: SurfaceMesh,
    first: SurfaceMesh,
    part: str,
    zone: ContactEllipse,
    sector: float,
) -> Iterator[Patch]:
    """Yield a patch on the face of a box: a rectangle, with rectangles around it.

    Those that touch it have its order, 2: they jump less, and what jumps beside small panels is
    stress there.
    """
    number = mesh.part_names.index(part)
    on_face = mesh.part == number
    low, high = (corner[on_face] for corner in mesh.boxes)
    low = low.min(axis=0)
    high = high.max(axis=0)
    normal = mesh.normal[mesh.first_node[:-1][on_face][0]]
    axis = int(np.abs(normal).argmax())
    uv = [(axis + 1) % 3, (axis + 2) % 3][:: 1 if normal[axis] > 0.0 else -1]
    centre = zone.centre[uv]
    reach, face = np.linalg.norm(zone.axes[uv], axis=1), np.stack([low[uv], high[uv]])
    far = np.abs(face - centre) < AROUND[2] * reach
    patch = np.where(far, face, centre + np.outer([-1.0, 1.0], AROUND[1] * reach))

    def placed(points: Array) -> Array:
        result = np.full((*points.shape[:-1], 3), low[axis])
        result[..., uv] = points
        return result

    around = _rectangles_around(face, patch, centre)
    touching = np.all((around[:, 0] <= patch[1]) & (around[:, 1] >= patch[0]), axis=1)
    rest = SurfaceMesh(
        np.concatenate([mesh.corners[~on_face], placed(_corners(around))]),
        np.append(mesh.order[~on_face], 1 + touching),
        np.append(mesh.part[~on_face], np.full(len(around), number)),
        mesh.part_names,
        np.concatenate([mesh.middles[~on_face], np.full((len(around), 5, 3), np.nan)]),
    )
    rim, counts = _equal_angles(zone, placed(_corners(patch[None])[0]), sector)
    if rim is not None:
        yield Patch(rest, number, rim, counts, lambda x: placed(x[..., uv]))


def _equal_angles(
    zone: ContactEllipse, corners: Array, sector: float
) -> tuple[Array | None, tuple[int, int]]:
    """Return a rim between corners (4, 3) with points at equal angles along each side, or None."""
    seen = zone.facing(corners).local(corners)
    angle = np.unwrap(np.angle(np.append(seen, seen[:1], axis=0) @ [1.0, 1.0j]))
    span = np.diff(angle)
    if not _goes_round(span):
        return None, (0, 0)
    half = _half(sector)
    across = span[0] + span[2]
    first = min(max(1, round(half * across / (2.0 * np.pi))), half - 1)
    count = [first, half - first, first, half - first]
    points = []
    for k in range(4):
        phi = angle[k] + span[k] * np.arange(2 * count[k]) / (2 * count[k])
        towards, along = np.column_stack([np.cos(phi), np.sin(phi)]), seen[(k + 1) % 4] - seen[k]
        share = cross(seen[k], towards) / cross(towards, along)
        points.append(corners[k] + share[:, None] * (corners[(k + 1) % 4] - corners[k]))
    return np.concatenate(points), (count[0], count[1])


def _goes_round(span: Array) -> bool:
    """Return whether the sides of a rim, seen at these angles [rad], go round the centre once."""
    once = np.isclose(span.sum(), 2.0 * np.pi)
    return bool(once and np.all((span > 0.0) & (span < np.pi)))


def _half(sector: float) -> int:
    """Return half the number of sectors of a full turn, each of about the given angle at most."""
    return max(2, int(least_pieces(np.pi / sector)))


def _corners(rectangles: Array) -> Array:
    """Return the corners (n, 4, 2), counter-clockwise, of rectangles (n, 2, 2).

    A rectangle is given by its least and largest coordinates.
    """
    return np.stack(
        [rectangles[:, [i, j], [0, 1]] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1
    )


def _rectangles_around(face: Array, patch: Array, centre: Array) -> Array:
    """Return the rectangles (n, 2, 2) that fill a face outside a patch.

    None of them is longer than its distance from `centre`.
    """
    cells = [
        np.array([[a, c], [b, d]])
        for a, b in itertools.pairwise(np.unique([face[0, 0], *patch[:, 0], face[1, 0]]))
        for c, d in itertools.pairwise(np.unique([face[0, 1], *patch[:, 1], face[1, 1]]))
    ]
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


def _joined(first: SurfaceMesh, second: SurfaceMesh) -> SurfaceMesh:
    """Return the panels of both meshes."""
    corners, order, part, middles = (
        np.concatenate([getattr(mesh, name) for mesh in (first, second)])
        for name in ("corners", "order", "part", "middles")
    )
    return SurfaceMesh(corners, order, part, first.part_names, middles)


def _graded(
    mesh: SurfaceMesh, near: Mask, number: int, centre: Array, surface: Boundary
) -> tuple[SurfaceMesh, Mask]:
    """Return the mesh, with panels of a part cut until none is longer than its distance from a
    centre.

    Panels in `near` are not cut; their new mask is returned, too.
    """
    while True:
        length, (low, high) = np.linalg.norm(sides(mesh), axis=2).max(axis=1), mesh.boxes
        long = (
            (mesh.part == number)
            & ~near
            & (length > np.linalg.norm(0.5 * (low + high) - centre, axis=1))
        )
        if not long.any():
            return mesh, near
        along = np.repeat(long[:, None], 2, axis=1)
        near, mesh = near[parents(mesh, along)], cut(mesh, along, surface)


def _distance(zone: ContactEllipse, mesh: SurfaceMesh, panels: Index) -> Array:
    """Return the distance of panels from the centre of a zone over that of its edge, (n,) [-].

    It is the least of points on each panel.
    """
    result = np.full(len(panels), np.inf)
    for corners in (3, 4):
        members = np.flatnonzero(np.isnan(mesh.corners[panels, 3, 0]) == (corners == 3))
        six = [
            mesh.corners[panels[members], :corners],
            mesh.middles[panels[members], : 2 * corners - 3],
        ]
        cells = QuadraticCells(np.concatenate(six, axis=1))
        foot, _ = cells.nearest(np.repeat(zone.centre[None], len(members), axis=0))
        x = np.concatenate(
            [cells.at(cells.each(samples(corners)))[0], cells.at(foot[:, None])[0]], axis=1
        )
        result[members] = (
            zone.distance(x.reshape(-1, 3)).reshape(x.shape[:2]).min(axis=1, initial=np.inf)
        )
    return result


def _rim(
    zone: ContactEllipse, mesh: SurfaceMesh, panels: Index, sector: float
) -> tuple[Array, tuple[int, int]] | None:
    """Return the rim of panels around a zone, with wide sides halved, and the counts of the inner
    grid.

    The result is None unless the rim is one loop outside the zone whose points are all seen from
    the centre at good angles.
    """
    loop = _loop(mesh, panels)
    if loop is None:
        return None
    zone = zone.facing(loop[0])
    span = np.diff(_angles(zone, loop[0]))
    if not _goes_round(span):
        return None
    # halves of a piece that is wider than this are nearer to a sector
    pieces = np.ones(len(span), dtype=int)
    while pieces.sum() < 2 * _half(sector) or (span / pieces).max() > math.sqrt(2.0) * sector:
        pieces[(span / pieces).argmax()] *= 2
    if pieces.sum() % 2:  # opposite sides of the inner grid have equal counts
        pieces[np.where(pieces == 1, span, 0.0).argmax()] = 2
    if pieces.sum() > MOST_PIECES:
        return None
    t = np.concatenate([np.arange(2 * count)[:, None] / (2 * count) for count in pieces.tolist()])
    start, middle, stop = np.repeat(loop, 2 * pieces, axis=1)
    rim = on_side(start, middle, stop, t)
    if np.linalg.norm(zone.local(rim), axis=1).min() < 1.0:
        return None
    counts = len(rim) // 8, len(rim) // 4 - len(rim) // 8
    # choose the corners of the inner grid as far from one another as possible
    angle = _angles(zone, rim[::2])
    ends = np.arange(len(angle) - 1)[:, None] + np.cumsum([0, *counts, *counts])
    first = int(np.diff(np.append(angle[:-1], angle + 2.0 * np.pi)[ends]).max(axis=1).argmin())
    return np.roll(rim, -2 * first, axis=0), counts


def _angles(zone: ContactEllipse, loop: Array) -> Array:
    """Return the increasing angles at which points (n, 3) around a zone are seen, (n + 1,) [rad].

    The first point is repeated at the end.
    """
    return np.unwrap(np.angle(zone.local(np.append(loop, loop[:1], axis=0)) @ [1.0, 1.0j]))


def _loop(mesh: SurfaceMesh, panels: Index) -> Array | None:
    """Return the starts, middles and ends (3, n, 3) of the sides around panels, in order.

    The result is None if they do not form one loop.
    """
    start, stop, middle = mesh.sides_of(panels)[2]
    if not len(start) or np.isnan(middle).any():
        return None
    first, last = numbered(np.concatenate([start, stop])).reshape(2, -1).tolist()
    inner = {*zip(last, first, strict=True)}
    outer = [i for i, ends in enumerate(zip(first, last, strict=True)) if ends not in inner]
    following = {first[i]: i for i in outer}
    order = outer[:1]
    while len(order) < len(outer) and last[order[-1]] in following:
        order.append(following[last[order[-1]]])
    return (
        None if len({*order}) < len(outer) else np.stack([start[order], middle[order], stop[order]])
    )
