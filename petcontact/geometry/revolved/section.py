"""The plane faces of a body that is turned by less than a full circle: its section in curved
triangles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...arrays import Array
from ..quadratic import QuadraticCells
from .stations import Stations

if TYPE_CHECKING:
    import shapely


def section_triangles(stations: Stations, size: float) -> Array | None:
    """Six points (n, 6, 2) of triangles that fill a section, counter-clockwise, with all of its
    pieces as their edges.

    Delaunay's triangulation of the ends of the pieces and of a regular grid inside. None where a
    piece is no edge of it, or a triangle is too much warped by its curved side: shorter pieces will
    do.
    """
    import shapely

    start, middle = stations.at[:, 0], stations.at[:, 1]
    body = _polygon(stations)
    inner = _grid(body, size)
    low, high = start.min(axis=0), start.max(axis=0)
    around = 0.5 * (low + high) + 5.0 * np.max(high - low) * np.array(
        [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    )
    points = np.concatenate([start, inner, around])  # nothing of the section is on the hull
    corners = scipy.spatial.Delaunay(points).simplices
    corners = corners[shapely.contains_xy(body, *points[corners].mean(axis=1).T)]
    a, b, c = points[corners].transpose(1, 0, 2)
    turned = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0.0
    corners[turned] = corners[turned][:, ::-1]
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)
    between = 0.5 * points[ends].sum(axis=2)
    pieces = np.arange(len(start)) * len(points) + stations.following
    keys = ends[..., 0] * len(points) + ends[..., 1]
    own = np.isin(keys, pieces)
    if np.count_nonzero(own) < len(start):
        return None
    between[own] = middle[keys[own] // len(points)]
    six = np.concatenate([points[corners], between], axis=1)
    distortion = QuadraticCells(np.pad(six, ((0, 0), (0, 0), (0, 1)))).distortion
    # ratio of the area factors of a triangle
    return None if np.any(distortion > 2.0) else six


def _polygon(stations: Stations) -> shapely.Polygon:
    """The section with chords for arcs."""
    import shapely

    start = stations.at[:, 0]
    last = np.flatnonzero(stations.following <= np.arange(len(start)))  # piece of each loop
    rings = np.split(start, last[:-1] + 1)
    return shapely.Polygon(rings[0], rings[1:])


def _grid(body: shapely.Polygon, size: float) -> Array:
    """Points of a triangular grid inside, away from the outline."""
    import shapely

    low, high = np.reshape(body.bounds, (2, 2))
    x, z = np.meshgrid(np.arange(low[0], high[0], size), np.arange(low[1], high[1], 0.866 * size))
    x[1::2] += 0.5 * size
    points = np.column_stack([x.ravel(), z.ravel()])
    inside = shapely.contains_xy(body, *points.T)
    # inner points keep 0.6 of the size of the triangles from the outline
    away = shapely.distance(body.boundary, shapely.points(points)) > 0.6 * size
    return np.asarray(points[inside & away])
