"""Cuts through bodies in space along a coordinate plane: outlines, and points and triangles between
them."""

from __future__ import annotations

import re

import numpy as np
import shapely
from scipy.spatial import Delaunay

from ...arrays import Array, Index
from ...errors import InputError
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import HALF

INSET = 1e-3
"""How far inside of the outline the outermost points lie, in spacings."""


def plane_of(text: str) -> tuple[int, float]:
    """The number of the axis across a plane, and where it is: of y=2.5 these are 1 and 2.5.

    Raises
    ------
    InputError
        If the text is no such plane.
    """
    match = re.fullmatch(r"\s*([xyz])\s*=\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*", text)
    try:
        return "xyz".index(match[1]), float(match[2])  # type: ignore[index]
    except (TypeError, ValueError):
        raise InputError(
            f"--section {text}: expected a plane across an axis, such as y=0"
        ) from None


def outline_of(mesh: SurfaceMesh, axis: int, value: float) -> shapely.Geometry:
    """What a plane across an axis cuts out of a body, in its other two coordinates; empty where it
    does not meet the body."""
    corners = mesh.triangles()
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    # aside of corners that lie in the plane, by half of the digits
    side = corners[..., axis] - (value + HALF * size)
    crossed = (side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)
    ends = np.delete(_crossings(corners[crossed], side[crossed]), axis, axis=2)
    # neighbours compute the point of an edge that they share apart
    step = 4.0 * HALF * size
    lines = shapely.linestrings(np.round(ends / step) * step)
    return shapely.build_area(shapely.union_all(lines))


def _crossings(corners: Array, side: Array) -> Array:
    """The two points (m, 2, 3) at which edges of triangles (m, 3, 3) change their side (m, 3)."""
    points = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        meets = (side[:, a] < 0.0) != (side[:, b] < 0.0)
        share = side[:, a] / np.where(meets, side[:, a] - side[:, b], np.nan)
        points.append(corners[:, a] + share[:, None] * (corners[:, b] - corners[:, a]))
    every = np.stack(points, axis=1)
    met = np.isfinite(every).all(axis=2)
    return np.asarray(every[met].reshape(-1, 2, 3))


def grid_of(cut: shapely.Geometry, axis: int, value: float, cells: int) -> tuple[Array, Index]:
    """Points (n, 3) in a cut, about so many along its longer side, and triangles (k, 3)."""
    low, high = np.array(cut.bounds).reshape(2, 2)
    spacing = float((high - low).max()) / cells
    inner = shapely.segmentize(cut.buffer(-INSET * spacing), spacing)
    shapely.prepare(cut)
    lines = (np.arange(low[c], high[c] + spacing, spacing) for c in range(2))
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    away = shapely.contains_xy(cut.buffer(-0.45 * spacing), *grid.T)
    flat = np.vstack([shapely.get_coordinates(inner), grid[away]])
    flat = np.unique(np.round(flat / (1e-6 * spacing)), axis=0) * 1e-6 * spacing
    triangles = np.asarray(Delaunay((flat - low) / spacing).simplices, dtype=np.int64)
    kept = shapely.contains_xy(cut, *flat[triangles].mean(axis=1).T)
    return np.insert(flat, axis, value, axis=1), triangles[kept]
