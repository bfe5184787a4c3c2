"""Sides of curved panels that hang on a longer one, brought onto it: else slits stay between the
two curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...geometry.surface import Boundary
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import WRITTEN

CLOSE = 0.1
"""Distance from a quarter of a side, over half the side, up to which a corner hangs there."""
Place = Callable[[int, Array, Array, Array], Array]
"""Where a hanging point belongs, of the panel that it hangs on, the ends of its side and its place
on the quadratic side."""
QUARTER = np.array([0.375, -0.125, 0.75])
"""Quadratic shape functions of both ends and the middle of a side, a quarter of it from the first
end."""


def closed(mesh: SurfaceMesh) -> SurfaceMesh:
    """The mesh with the points of hanging sides on the quadratic side of the larger neighbour, as
    pieces of it.

    On an exact surface they lie off it by as much as that side does, and the boundary is closed, as
    rigid motions need it.
    """
    return _moved(mesh, lambda panel, first, last, place: place)


def apart(mesh: SurfaceMesh, surface: Boundary) -> SurfaceMesh:
    """The mesh with the points of hanging sides on the surface, and the middles of all sides half
    way along these.

    What was `closed` is as it was before, so that panels which are equal after one of them is cut
    have the same side. Points that are equally far apart on a quadratic side are not so when they
    are brought onto the surface; a quadratic side through others leaves the surface by the third
    power of its length, through these by the fourth.
    """

    def half_way(panel: int, first: Array, last: Array, place: Array) -> Array:
        part = mesh.part[panel : panel + 1]
        return np.asarray(
            centred(surface, part, first[None, None], last[None, None], place[None, None])[0, 0]
        )

    return with_half_way_middles(_moved(mesh, half_way), surface)


def with_half_way_middles(mesh: SurfaceMesh, surface: Boundary) -> SurfaceMesh:
    """The mesh with the middles of curved panels' sides half way along these, and those of
    quadrilaterals between."""
    middles, triangle = mesh.middles.copy(), np.isnan(mesh.corners[:, 3, 0])
    for corners in (3, 4):
        mine = np.flatnonzero((triangle == (corners == 3)) & ~np.isnan(middles[:, 0, 0]))
        if not len(mine):
            continue
        first, part = mesh.corners[mine, :corners], mesh.part[mine]
        sides = centred(surface, part, first, np.roll(first, -1, axis=1), middles[mine, :corners])
        middles[mine, :corners] = sides
        if corners == 4:
            between = 0.5 * sides.sum(axis=1) - 0.25 * first.sum(axis=1)
            middles[mine, 4] = surface.onto(
                part, np.concatenate([first, sides, between[:, None]], axis=1)
            )[:, 8]
    return replace(mesh, middles=middles)


def centred(surface: Boundary, part: Index, first: Array, last: Array, middle: Array) -> Array:
    """Points (n, k, 3) on sides of panels of parts (n,), moved along these on the surface until
    they are half way."""
    way = last - first
    for _ in range(2):
        middle = surface.onto(part, np.concatenate([first, last, middle], axis=1))[
            :, 2 * first.shape[1] :
        ]
        off = np.sum((0.5 * (first + last) - middle) * way, axis=2) / np.sum(way**2, axis=2)
        middle = middle + off[..., None] * way
    return surface.onto(part, np.concatenate([first, last, middle], axis=1))[
        :, 2 * first.shape[1] :
    ]


def _moved(mesh: SurfaceMesh, place: Place) -> SurfaceMesh:
    """The mesh with hanging points where they belong."""
    curved = np.flatnonzero(~np.isnan(mesh.middles[:, 0, 0]))
    if not len(curved):
        return mesh
    count = np.where(np.isnan(mesh.corners[curved, 3, 0]), 3, 4)
    panel, k = np.repeat(curved, count), np.concatenate([np.arange(n) for n in count.tolist()])
    after = np.where(k + 1 == np.repeat(count, count), 0, k + 1)
    start, middle = mesh.corners[panel, k], mesh.middles[panel, k]
    sides = _Sides(start, mesh.corners[panel, after], middle, panel, place)
    corners, middles = mesh.corners.copy(), mesh.middles.copy()
    corners[panel, k], middles[panel, k] = sides.position[sides.numbers[[0, 2]]]
    return replace(mesh, corners=corners, middles=middles)


def bent(mesh: SurfaceMesh, surface: Boundary, places: Array, share: float, most: float) -> Mask:
    """Panels to cut, along both coordinates, (n_elements, 2): their sides leave the surface.

    Smaller panels that hang on them follow the side instead of the surface, see `closed`. What the
    gap is off by for it, over their size, is about p over E* too much.

    Parameters
    ----------
    mesh : SurfaceMesh
    surface : Boundary
        The exact one.
    places : (k, 3) array
        Where contact is closed; sides further away than they are long do not count [length].
    share : float
        How far a side may be off the surface, over the shortest side that hangs on it [-].
    most : float
        How far any side may be off it [length].
    """
    result = np.zeros((mesh.n_elements, 2), dtype=bool)
    curved = np.flatnonzero(~np.isnan(mesh.middles[:, 0, 0]))
    if not len(curved) or not len(places):
        return result
    count = np.where(np.isnan(mesh.corners[curved, 3, 0]), 3, 4)
    panel, k = np.repeat(curved, count), np.concatenate([np.arange(n) for n in count.tolist()])
    after = np.where(k + 1 == np.repeat(count, count), 0, k + 1)
    start, middle, stop = mesh.corners[panel, k], mesh.middles[panel, k], mesh.corners[panel, after]
    length = np.linalg.norm(stop - start, axis=1)
    first, last, at = numbered(np.concatenate([start, stop, middle])).reshape(3, -1)
    short = np.full(1 + max(first.max(), last.max(), at.max()), np.inf)
    for ends in (first, last):
        np.minimum.at(short, ends, length)
    asked = scipy.spatial.cKDTree(places).query(middle)[0] <= length
    a, m, b, number = start[asked], middle[asked], stop[asked], panel[asked]
    quarters = np.stack(
        [np.einsum("i,inc->nc", QUARTER, np.stack(ends)) for ends in ((a, b, m), (b, a, m))], axis=1
    )
    off = np.linalg.norm(surface.onto(mesh.part[number], quarters) - quarters, axis=2).max(
        axis=1, initial=0.0
    )
    over = off > np.minimum(share * short[at[asked]], most)
    result[number[over], k[asked][over] % 2] = True
    return result


def numbered(points: Array) -> Index:
    """Numbers (n,) of points (n, 3), equal ones of the same place."""
    pairs = scipy.spatial.cKDTree(points).query_pairs(
        WRITTEN * float(np.ptp(points, axis=0).max()), output_type="ndarray"
    )
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    return np.asarray(scipy.sparse.csgraph.connected_components(graph, directed=False)[1])


class _Sides:
    """Sides between numbered points, brought onto each other from the longest on.

    Attributes
    ----------
    numbers : (3, n) int array
        Both ends and the middle of each side.
    position : (p, 3) array
        Of each point [length].
    """

    def __init__(
        self, start: Array, stop: Array, middle: Array, panel: Index, place: Place
    ) -> None:
        self._place = place
        points = np.concatenate([start, stop, middle])
        found = numbered(points)
        self.numbers = found.reshape(3, -1)
        self.position = np.empty((1 + found.max(), 3))
        self.position[found] = points
        self._tree = scipy.spatial.cKDTree(self.position.copy())
        self._middle = {frozenset((a, b)): m for a, b, m in self.numbers.T.tolist()}
        self._ends = set(self.numbers[:2].ravel().tolist())
        for k in np.argsort(-np.linalg.norm(stop - start, axis=1)).tolist():
            a, b, m = self.numbers[:, k].tolist()
            self._halve(a, b, m, int(panel[k]))

    def _halve(self, a: int, b: int, m: int, panel: int) -> None:
        """Bring what hangs on both halves of a side, or of a piece of one, onto it."""
        if m not in self._ends:
            return
        for first, second in ((a, b), (b, a)):
            place = QUARTER @ self.position[[first, second, m]]
            hanging = self._middle.get(frozenset((first, m)))
            if hanging is None:  # no side is as long: two or more shorter ones may hang there
                apart, near = self._tree.query(place)
                half = np.linalg.norm(self.position[m] - self.position[first])
                hanging = int(near) if apart < CLOSE * half and int(near) in self._ends else None
            if hanging is not None:
                self.position[hanging] = self._place(
                    panel, self.position[first], self.position[m], place
                )
                self._halve(first, m, hanging, panel)
