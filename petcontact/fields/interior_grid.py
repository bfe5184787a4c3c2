"""Points inside a body and triangles between them: a regular grid and one row of points along the
boundary."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import Delaunay

from ..arrays import Array, Index
from ..errors import InputError
from ..mesh.curve_mesh import CurveMesh
from ..round_off import WRITTEN

KEPT_OFF = 0.45
"""Distance from the boundary below which grid points are left out, in grid spacings. Nearer points
would make slivers."""


def triangulate(
    mesh: CurveMesh, resolution: tuple[int, int], window: tuple[Array, Array] | None = None
) -> tuple[Array, Index]:
    """Return points (n, 2) strictly inside the body [length] and triangles (k, 3) between them.

    The triangles fill the body except for a thin strip along its boundary.

    Parameters
    ----------
    mesh : CurveMesh
    resolution : (int, int)
        Numbers of grid cells along x and y over the bounding box.
    window : two (2,) arrays, optional
        Lower and upper corner of a box. Only the part of the body inside it is filled [length].

    Raises
    ------
    InputError
        If the resolution is below 2 in a direction, or no part of the body is in the window.
    """
    if min(resolution) < 2:
        raise InputError(
            f"grid: at least 2 x 2 cells are needed, got {resolution[0]} x {resolution[1]}"
        )
    low, high = mesh.start.min(axis=0), mesh.start.max(axis=0)
    low, high = np.minimum(low, mesh.x.min(axis=0)), np.maximum(high, mesh.x.max(axis=0))
    if window is not None:
        low, high = np.maximum(low, window[0]), np.minimum(high, window[1])
        if np.any(low >= high):
            raise InputError("--window: nothing of the body lies in it")
    step = (high - low) / np.array(resolution, dtype=float)
    spacing = float(step.min())
    rim = [_rim(mesh, loop, spacing) for loop in mesh.loops()]
    # a hole may share a stretch of the axis with the outer loop
    body = shapely.Polygon(rim[0]).difference(shapely.union_all([*map(shapely.Polygon, rim[1:])]))
    shapely.prepare(body)
    x, y = (low[c] + step[c] * np.arange(resolution[c] + 1) for c in range(2))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[shapely.contains_xy(body, *grid.T)]
    grid = grid[shapely.distance(body.boundary, shapely.points(grid)) > KEPT_OFF * spacing]
    points = np.vstack([*rim, grid])
    if window is not None:
        points = points[np.all((points >= low) & (points <= high), axis=1)]
        body = body.intersection(shapely.box(*low, *high))
        shapely.prepare(body)
        if len(points) < 3:
            raise InputError("--window: nothing of the body lies in it")
    cells = np.asarray(Delaunay((points - low) / spacing).simplices, dtype=np.int64)
    a, b, c = (points[cells[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    cells[area < 0.0] = cells[area < 0.0][:, ::-1]
    centre = (a + b + c) / 3.0
    kept = shapely.contains_xy(body, *centre.T) & (np.abs(area) > WRITTEN * spacing**2)
    return points, cells[kept]


def _rim(mesh: CurveMesh, loop: Index, spacing: float) -> Array:
    """Return points just inside the boundary along a loop, and one inside each corner.

    Their distance is about `spacing`. They avoid the ends of elements, where discontinuous elements
    have singular stresses.
    """
    points: list[Array] = []
    # the outermost points lie a thousandth of a spacing inside the boundary
    inset = 1e-3 * spacing
    for before, k in zip(mesh.neighbours()[0][loop].tolist(), loop.tolist(), strict=True):
        corner = _corner(mesh, before, k, inset)
        if corner is not None:
            # a corner matters more than the points just before it
            while points and np.hypot(*(points[-1] - corner)) < KEPT_OFF * spacing:
                points.pop()
            points.append(corner)
        count = max(1, int(np.ceil(mesh.length[k] / spacing)))
        place, normal = mesh.at(np.full(count, k), (np.arange(count) + 0.5) / count)
        for point in place - inset * normal:
            if not points or np.hypot(*(points[-1] - point)) >= KEPT_OFF * spacing:
                points.append(point)
    if mesh.neighbours()[1][loop[-1]] == loop[-1]:
        # the axis, which carries no elements, closes the outline
        end = _beside(mesh, int(loop[-1]), 1.0, inset)
        count = max(1, int(np.hypot(*(end - points[0])) / spacing))
        points += [*np.linspace(end, points[0], count, endpoint=False)]
    while len(points) > 3 and np.hypot(*(points[-1] - points[0])) < KEPT_OFF * spacing:
        points.pop()
    return np.array(points)


def _corner(mesh: CurveMesh, before: int, after: int, inset: float) -> Array | None:
    """Return the point just inside the corner between two elements.

    It is None if the outline is smooth there. If the outline begins on the axis, the point lies on
    the axis.
    """
    if before == after:
        return _beside(mesh, after, 0.0, inset)
    n, m = mesh.at(np.array([before, after]), np.array([1.0, 0.0]))[1]
    if n @ m > np.cos(np.radians(10.0)):
        return None
    inwards = -(n + m) / max(float(np.hypot(*(n + m))), 1e-12)
    return np.asarray(mesh.start[after] + inset * inwards)


def _beside(mesh: CurveMesh, number: int, fraction: float, inset: float) -> Array:
    """Return the point on the axis just inside the element's end there, at the fraction 0 or 1."""
    place, normal = mesh.at(np.array([number]), np.array([fraction]))
    return np.asarray((place - inset * normal)[0] * [0.0, 1.0])
