"""Sides of curved panels that hang on a longer side.

They are moved onto that side, since there would be slits between the two curves otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy

from ...arrays import Array, Index, Mask, linked, smallest_by
from ...geometry.quadratic import on_side
from ...geometry.surface import Boundary
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import WRITTEN

CLOSE = 0.1
"""Distance of a corner from a quarter of a side over half the side, up to which it hangs there
[-]."""
Place = Callable[[Index, Array, Array, Array, Mask], Array]
"""Function that returns the positions of hanging points (n, 3).

Its arguments are the panels on which the points hang, the ends of these panels' sides, the
positions on the quadratic sides, and which points lie between two parts.
"""


_Hanging = tuple[int, int, int, int, int]
"""A panel, an end, the middle and the other end of its side, and the point that hangs half-way
between the first two."""


def closed(mesh: SurfaceMesh) -> SurfaceMesh:
    """Return the mesh with hanging sides moved onto the quadratic side of the larger neighbour.

    On an exact surface they are then as far off as that side. The boundary is closed, which rigid
    motions need.
    """
    return _moved(mesh, lambda panel, first, last, middle, rim: middle)


def apart(mesh: SurfaceMesh, surface: Boundary) -> SurfaceMesh:
    """Return the mesh with hanging points on the surface, and middles of all sides half-way along
    them.

    This undoes `closed`. Two panels that are equal after one of them is cut then have the same
    side. Equidistant points of a quadratic side are not equidistant after projection onto the
    surface. A quadratic side through such points leaves the surface by the third power of its
    length. A side through equidistant points leaves it by the fourth power.
    """

    def half_way(panels: Index, first: Array, last: Array, middle: Array, rim: Mask) -> Array:
        parts, pieces = mesh.part[panels], (first[:, None], last[:, None], middle[:, None])
        result, triangle = np.empty_like(middle), np.isnan(mesh.corners[panels, 3, 0])
        result[~rim] = centred(surface, parts[~rim], *(one[~rim] for one in pieces))[:, 0]
        # at a rim the panels' sides come along, since it is found by their widths
        for corners in (3, 4):
            some = rim & (triangle == (corners == 3))
            start, middles = (x[panels[some], :corners] for x in (mesh.corners, mesh.middles))
            own = start, np.roll(start, -1, axis=1), middles
            sides = [
                np.concatenate([one[some], side], axis=1)
                for one, side in zip(pieces, own, strict=True)
            ]
            result[some] = centred(surface, parts[some], *sides)[:, 0]
        return result

    return with_half_way_middles(_moved(mesh, half_way), surface)


def with_half_way_middles(mesh: SurfaceMesh, surface: Boundary) -> SurfaceMesh:
    """Return the mesh with the middles of curved sides half-way along them.

    The centres of quadrilaterals are set between them.
    """
    middles, triangle = mesh.middles.copy(), np.isnan(mesh.corners[:, 3, 0])
    for corners in (3, 4):
        panels = np.flatnonzero((triangle == (corners == 3)) & ~np.isnan(middles[:, 0, 0]))
        if not len(panels):
            continue
        first, part = mesh.corners[panels, :corners], mesh.part[panels]
        sides = centred(surface, part, first, np.roll(first, -1, axis=1), middles[panels, :corners])
        middles[panels, :corners] = sides
        if corners == 4:
            between = 0.5 * sides.sum(axis=1) - 0.25 * first.sum(axis=1)
            middles[panels, 4] = surface.onto(
                part, np.concatenate([first, sides, between[:, None]], axis=1)
            )[:, 8]
    return replace(mesh, middles=middles)


def centred(surface: Boundary, part: Index, first: Array, last: Array, middle: Array) -> Array:
    """Return points (n, k, 3) on sides of panels, moved along them on the surface until they are
    half-way.

    `part` (n,) is the part of each panel.
    """
    chord = last - first
    for _ in range(2):
        middle = surface.onto(part, np.concatenate([first, last, middle], axis=1))[
            :, 2 * first.shape[1] :
        ]
        off = np.sum((0.5 * (first + last) - middle) * chord, axis=2) / np.sum(chord**2, axis=2)
        middle = middle + off[..., None] * chord
    return surface.onto(part, np.concatenate([first, last, middle], axis=1))[
        :, 2 * first.shape[1] :
    ]


def _moved(mesh: SurfaceMesh, moved_to: Place) -> SurfaceMesh:
    """Return the mesh with hanging points moved to the positions that `moved_to` returns."""
    curved = np.flatnonzero(~np.isnan(mesh.middles[:, 0, 0]))
    if not len(curved):
        return mesh
    panel, k, (start, stop, middle) = mesh.sides_of(curved)
    sides = _Sides((start, stop, middle), panel, mesh.part[panel], moved_to)
    corners, middles = mesh.corners.copy(), mesh.middles.copy()
    corners[panel, k], middles[panel, k] = sides.position[sides.numbers[[0, 2]]]
    return replace(mesh, corners=corners, middles=middles)


def bent(mesh: SurfaceMesh, surface: Boundary, places: Array, share: float, most: float) -> Mask:
    """Return which panels to cut, (n_elements, 2), since their sides leave the surface by too much.

    Smaller panels that hang on a side follow it instead of the surface, see `closed`. The gap is
    wrong by this distance. The error of p is about E* times the distance over the size of the small
    panels.

    Parameters
    ----------
    mesh : SurfaceMesh
    surface : Boundary
        The exact surface.
    places : (k, 3) array
        Points in contact; sides that are farther away than their length do not count [length].
    share : float
        Accepted distance of a side from the surface over the shortest side that hangs on it [-].
    most : float
        Largest accepted distance of any side [length].
    """
    result = np.zeros((mesh.n_elements, 2), dtype=bool)
    curved = np.flatnonzero(~np.isnan(mesh.middles[:, 0, 0]))
    if not len(curved) or not len(places):
        return result
    panel, k, points = mesh.sides_of(curved)
    length = np.linalg.norm(points[1] - points[0], axis=1)
    numbers = numbered(points.reshape(-1, 3)).reshape(3, -1)
    short = smallest_by(numbers[:2].ravel(), np.tile(length, 2), 1 + int(numbers.max()))
    asked = scipy.spatial.cKDTree(places).query(points[2])[0] <= length
    panel, k = panel[asked], k[asked]
    off = _off(surface, mesh, panel, *points[:, asked])
    over = off > np.minimum(share * short[numbers[2, asked]], most)
    result[panel[over], k[over] % 2] = True
    return result


def _off(
    surface: Boundary, mesh: SurfaceMesh, panel: Index, a: Array, b: Array, middle: Array
) -> Array:
    """Return the distance (n,) of quadratic sides of panels from the surface, at both quarters
    [length]."""
    quarters = np.stack([on_side(a, middle, b, share) for share in (0.25, 0.75)], axis=1)
    points = np.concatenate([mesh.corners[panel], quarters], axis=1)
    away = np.linalg.norm(surface.onto(mesh.part[panel], points)[:, 4:] - quarters, axis=2)
    return np.asarray(away.max(axis=1, initial=0.0))


def numbered(points: Array) -> Index:
    """Return numbers (n,) of points (n, 3); coinciding points have the same number."""
    pairs = scipy.spatial.cKDTree(points).query_pairs(
        WRITTEN * float(np.ptp(points, axis=0).max()), output_type="ndarray"
    )
    return linked(pairs.T, len(points))


class _Sides:
    """Sides between numbered points, moved onto each other from the longest to the shortest.

    Attributes
    ----------
    numbers : (3, n) int array
        Both ends and the middle of each side.
    position : (p, 3) array
        Position of each point [length].
    """

    def __init__(
        self, points_of: tuple[Array, Array, Array], panel: Index, part: Index, moved_to: Place
    ) -> None:
        (start, stop, _), points = points_of, np.concatenate(points_of)
        numbers = numbered(points)
        self.numbers = numbers.reshape(3, -1)
        self.position = np.empty((1 + numbers.max(), 3))
        self.position[numbers] = points
        on_part = np.zeros((len(self.position), 1 + part.max()), dtype=bool)
        on_part[self.numbers[:2], part] = True
        self._rim = on_part.sum(axis=1) > 1
        self._tree = scipy.spatial.cKDTree(self.position)
        self._middle = {frozenset((a, b)): m for a, b, m in self.numbers.T.tolist()}
        self._ends = set(self.numbers[:2].ravel().tolist())
        hanging = [
            each
            for k in np.argsort(-np.linalg.norm(stop - start, axis=1)).tolist()
            for each in self._on(int(panel[k]), *self.numbers[:, k].tolist())
        ]
        for together in _at_once(hanging):
            self._move(np.array(together), moved_to)

    def _move(self, hanging: Index, moved_to: Place) -> None:
        """Move points that hang, rows of `_Hanging`."""
        panels, first, m, second, number = hanging.T
        start, middle, stop = (self.position[point] for point in (first, m, second))
        self.position[number] = moved_to(
            panels, start, middle, on_side(start, middle, stop, 0.25), self._rim[number]
        )

    def _on(self, panel: int, a: int, b: int, m: int) -> Iterator[_Hanging]:
        """Yield what hangs on both halves of a side, or of a piece of a side, of a panel."""
        if m not in self._ends:
            return
        for first, second in ((a, b), (b, a)):
            start, middle, stop = self.position[[first, m, second]]
            hanging = self._middle.get(frozenset((first, m)))
            if hanging is None:  # several shorter sides may hang there
                apart, near = self._tree.query(on_side(start, middle, stop, 0.25))
                half = np.linalg.norm(middle - start)
                hanging = int(near) if apart < CLOSE * half and int(near) in self._ends else None
            if hanging is not None:
                yield panel, first, m, second, hanging
                yield from self._on(panel, first, m, hanging)


def _at_once(hanging: Sequence[_Hanging]) -> list[list[_Hanging]]:
    """Return the same moves in few lists: those of one list do not depend on one another."""
    result, moved, used = list[list[_Hanging]](), dict[int, int](), dict[int, int]()
    for each in hanging:
        number, from_points = each[4], each[1:4]
        level = max(
            *(moved.get(point, 0) for point in (*from_points, number)), used.get(number, 0) - 1
        )
        moved[number] = level + 1
        used |= {point: max(used.get(point, 0), level + 1) for point in from_points}
        if level == len(result):
            result.append([])
        result[level].append(each)
    return result
