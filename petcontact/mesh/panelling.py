"""Panels on surfaces: grids on the faces of boxes, finer towards edges and corners, and the facets of other surfaces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..geometry.surface import BOX_PARTS, BoxSurface, FacetSurface
from .surface_mesh import SurfaceMesh


def graded(count: int, exponent: float) -> Array:
    """Fractions (count + 1,) from 0 to 1, their distance from the nearer end growing with a power of the number."""
    t = np.arange(count + 1) / count
    left = 0.5 * (2.0 * np.minimum(t, 1.0 - t)) ** exponent
    return np.where(t <= 0.5, left, 1.0 - left)


def box_mesh(box: BoxSurface, size_of: Callable[[str], float], order: int, exponent: float) -> SurfaceMesh:
    """A grid on each face of a box.

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
    corners, part = [], []
    for number, (name, (axis, side)) in enumerate(BOX_PARTS.items()):
        u, v = ((axis + 1) % 3, (axis + 2) % 3) if side else ((axis + 2) % 3, (axis + 1) % 3)
        extent = box.upper - box.lower
        lines = [box.lower[c] + extent[c] * graded(max(1, round(float(extent[c]) / size_of(name))), exponent)
                 for c in (u, v)]  # fmt: skip
        grid = np.empty((len(lines[0]), len(lines[1]), 3))
        grid[..., u], grid[..., v] = np.meshgrid(*lines, indexing="ij")
        grid[..., axis] = (box.lower, box.upper)[side][axis]
        cells = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)
        corners.append(cells)
        part.append(np.full(len(cells), number))
    everything = np.vstack(corners)
    return SurfaceMesh(everything, np.full(len(everything), order), np.concatenate(part), box.part_names)


def facet_mesh(surface: FacetSurface, order: int) -> SurfaceMesh:
    """A panel on each facet of a surface."""
    corners = surface.points[surface.facets]
    corners[surface.facets < 0] = np.nan
    return SurfaceMesh(corners, np.full(len(corners), order), surface.part, surface.part_names)
