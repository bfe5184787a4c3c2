"""Points spread over the panels of a surface: as nodes of VTK's cells, and as small triangles for
pictures."""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Index
from ...geometry.quadratic import REFERENCE
from ...mesh.surface_mesh import CURVED, TRIANGLE, SurfaceMesh
from ...record import record

CELLS = {(3, False): "triangle", (4, False): "quad", (3, True): "triangle6", (4, True): "quad9"}
"""By the number of corners, and whether they are of the second order; VTK's 5, 9, 22 and 28."""


@record
class Places:
    """Points on the panels of a surface.

    Attributes
    ----------
    element : (q,) array
    place : (q, 2) array
        As `Hits` has them.
    """

    element: Index
    place: Array

    @staticmethod
    def joined(pieces: list[tuple[Index, Array]]) -> Places:
        """Return the places of pieces: panels (n,) and local coordinates (n, k, 2) on them."""
        elements = np.concatenate([np.repeat(index, local.shape[1]) for index, local in pieces])
        return Places(elements, np.concatenate([local.reshape(-1, 2) for _, local in pieces]))


def vtk_cells(mesh: SurfaceMesh) -> tuple[Places, list[tuple[str, Index, Index]]]:
    """Nodes of cells, and of each kind of cell its name, the numbers of its nodes (n, k) and the
    panels (n,)."""
    pieces, cells, first = [], [], 0
    for batch in mesh.batches():
        panels, kind = batch.elements, int(mesh.kind[batch.elements.index[0]])
        # from order 2 on flat panels are cells of the second order, too
        corners = 3 if kind & TRIANGLE else 4
        quadratic = bool(kind & CURVED or kind % TRIANGLE >= 2)
        local = np.asarray(panels.mapped(_nodes(corners, quadratic)))
        numbers = first + np.arange(local.shape[0] * local.shape[1]).reshape(local.shape[:2])
        first += numbers.size
        pieces.append((panels.index, local))
        cells.append((CELLS[corners, quadratic], numbers, panels.index))
    return Places.joined(pieces), cells


def _nodes(corners: int, quadratic: bool) -> Array:
    """Corners, then middles of the sides, and of quadrilaterals the middle."""
    corner = REFERENCE[corners]
    middle = [0.5 * (corner + np.roll(corner, -1, axis=0)), np.zeros((corners - 3, 2))]
    return np.concatenate([corner, *middle]) if quadratic else corner


def small_triangles(
    mesh: SurfaceMesh, most: int, elements: Index | None = None
) -> tuple[Places, Index, Index]:
    """Points, triangles (t, 3) of them that tile panels, at most about so many, and the rims of the
    panels (e, 2)."""
    chosen = np.arange(mesh.n_elements) if elements is None else elements
    # four pieces along a side at most
    count = int(np.clip(np.sqrt(most / (2.0 * len(chosen))), 1, 4))
    pieces, triangles, rims, first = [], [], [], 0
    for _, panels in mesh.by_kind(chosen):
        reference, tiles, rim = _tiling(
            3 if int(mesh.kind[panels.index[0]]) & TRIANGLE else 4, count
        )
        local = np.asarray(panels.mapped(reference))
        start = first + len(reference) * np.arange(len(local))[:, None, None]
        first += local.shape[0] * local.shape[1]
        pieces.append((panels.index, local))
        triangles.append((start + tiles).reshape(-1, 3))
        rims.append((start + rim).reshape(-1, 2))
    return Places.joined(pieces), np.concatenate(triangles), np.concatenate(rims)


@functools.cache
def _tiling(corners: int, count: int) -> tuple[Array, Index, Index]:
    """Points, triangles and rim of a reference element whose sides are cut into so many pieces."""
    i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
    inside = (i + j <= count) | (corners == 4)
    number = np.where(inside, np.cumsum(inside.ravel()).reshape(inside.shape) - 1, -1)
    points = np.column_stack([i[inside], j[inside]]) / count
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    tiles = np.concatenate(
        [np.stack([a, b, d], axis=-1).reshape(-1, 3), np.stack([b, c, d], axis=-1).reshape(-1, 3)]
    )
    ends = [number[:, 0], number[0, :]]
    ends += (
        [number[np.arange(count, -1, -1), np.arange(count + 1)]]
        if corners == 3
        else [number[:, -1], number[-1, :]]
    )
    rim = np.concatenate([np.column_stack([line[:-1], line[1:]]) for line in ends])
    return (2.0 * points - 1.0 if corners == 4 else points), tiles[np.all(tiles >= 0, axis=1)], rim
