"""Panels on surfaces: graded grids on the faces of boxes, and the facets of other surfaces."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..arrays import Array, Index
from ..geometry.round_surfaces import RoundSurface
from ..geometry.surface import BOX_PARTS, BoxSurface, FacetSurface, face_axes
from ..round_off import whole
from .surface_mesh import SurfaceMesh


def graded(count: int, exponent: float) -> Array:
    """Return fractions (count + 1,) from 0 to 1.

    Their distance from the nearer end grows with a power of the number.
    """
    t = np.arange(count + 1) / count
    left = 0.5 * (2.0 * np.minimum(t, 1.0 - t)) ** exponent
    return np.where(t <= 0.5, left, 1.0 - left)


def box_mesh(
    box: BoxSurface, size_of: Callable[[str], float], order: int, exponent: float
) -> SurfaceMesh:
    """Return a mesh with a grid on each face of a box.

    Parameters
    ----------
    box : BoxSurface
    size_of : callable
        Element size on a part: an edge of length l has round(l/h) panels, at least one [length].
    order : int
        p, 0 to 3.
    exponent : float
        1 for equal panels; greater for panels that shrink towards the edges.
    """
    extent = box.upper - box.lower
    lines = [
        graded(max(1, whole(float(extent[c]) / size_of(name))), exponent)
        for name, face in BOX_PARTS.items()
        for c in face_axes(*face)
    ]
    return box_of_lines(box, lines, [np.full(len(line) - 1, order) for line in lines])


def box_of_lines(box: BoxSurface, lines: Sequence[Array], orders: Sequence[Index]) -> SurfaceMesh:
    """Return the mesh of a box with given grids.

    Parameters
    ----------
    box : BoxSurface
    lines : 12 arrays (n + 1,)
        Fractions from 0 to 1 along the two axes of each face, in the order of `BOX_PARTS` and
        `face_axes`.
    orders : 12 arrays (n,)
        A panel has the smaller of the orders along its two axes.
    """
    corners, part, order = [], [], []
    for number, (axis, side) in enumerate(BOX_PARTS.values()):
        u, v = face_axes(axis, side)
        extent = box.upper - box.lower
        along = [box.lower[c] + extent[c] * lines[2 * number + k] for k, c in enumerate((u, v))]
        grid = np.empty((len(along[0]), len(along[1]), 3))
        grid[..., u], grid[..., v] = np.meshgrid(*along, indexing="ij")
        grid[..., axis] = (box.lower, box.upper)[side][axis]
        cells = np.stack(
            [grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2
        ).reshape(-1, 4, 3)
        corners.append(cells)
        part.append(np.full(len(cells), number))
        order.append(np.minimum.outer(orders[2 * number], orders[2 * number + 1]).ravel())
    return SurfaceMesh(np.vstack(corners), np.concatenate(order), np.concatenate(part), box.parts)


def round_mesh(surface: RoundSurface, size: float, order: int) -> SurfaceMesh:
    """Return curved panels on a sphere, a cylinder or a revolved surface.

    Parameters
    ----------
    surface : RoundSurface
    size : float
        About the size of the panels [length].
    order : int
        p, 0 to 3.
    """
    cells, parts = [], []
    for part, x in surface.cells(size):
        cells.append(x)
        parts.append(np.full(len(x), part))
    points = np.concatenate(cells)
    return SurfaceMesh(
        points[:, :4],
        np.full(len(points), order),
        np.concatenate(parts),
        surface.parts,
        points[:, 4:],
    )


def facet_mesh(surface: FacetSurface, order: int) -> SurfaceMesh:
    """Return a mesh with a panel on each facet of a surface."""
    corners, middles = surface.points[surface.facets], surface.points[surface.middles]
    corners[surface.facets < 0], middles[surface.middles < 0] = np.nan, np.nan
    return SurfaceMesh(corners, np.full(len(corners), order), surface.part, surface.parts, middles)
