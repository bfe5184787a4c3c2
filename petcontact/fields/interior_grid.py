"""Points inside a body and triangles between them: a regular grid, and a row of points along the boundary."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import Delaunay

from ..arrays import Array, Index
from ..errors import InputError
from ..mesh.curve_mesh import BoundaryMesh

INSET = 1e-3
"""Distance of the outermost points from the boundary, in grid spacings."""
KEPT_OFF = 0.45
"""Grid points nearer to the boundary than this are left out, in grid spacings: they would make slivers."""


def body_polygon(mesh: BoundaryMesh, largest_turn: float = 0.02) -> shapely.Polygon:
    """The meshed body as a shapely polygon, arcs as chords that turn by `largest_turn` at most [rad]."""
    rings = [np.vstack([_arc_points(mesh, int(k), largest_turn)[:-1] for k in loop]) for loop in loops(mesh)]
    return shapely.Polygon(rings[0], rings[1:])


def loops(mesh: BoundaryMesh) -> list[Index]:
    """Numbers of the elements of each closed loop, in order, the outer loop first."""
    ends = np.flatnonzero(np.any(mesh.end[:-1] != mesh.start[1:], axis=1)) + 1
    return list(np.split(np.arange(mesh.n_elements), ends))


def triangulate(mesh: BoundaryMesh, resolution: tuple[int, int]) -> tuple[Array, Index]:
    """Points (n, 2) strictly inside the body and triangles (k, 3) that fill it up to a sliver along its boundary.

    Raises
    ------
    InputError
        If the resolution is below 2 in a direction.
    """
    if min(resolution) < 2:
        raise InputError(f"grid: at least 2 x 2 cells are needed, got {resolution[0]} x {resolution[1]}")
    low, high = mesh.start.min(axis=0), mesh.start.max(axis=0)
    low, high = np.minimum(low, mesh.x.min(axis=0)), np.maximum(high, mesh.x.max(axis=0))
    step = (high - low) / np.array(resolution, dtype=float)
    spacing = float(step.min())
    rim = [_rim(mesh, loop, spacing) for loop in loops(mesh)]
    body = shapely.Polygon(rim[0], rim[1:])
    shapely.prepare(body)
    x, y = (low[c] + step[c] * np.arange(resolution[c] + 1) for c in range(2))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[shapely.contains_xy(body, *grid.T)]
    grid = grid[shapely.distance(body.boundary, shapely.points(grid)) > KEPT_OFF * spacing]
    points = np.vstack([*rim, grid])
    cells = np.asarray(Delaunay((points - low) / spacing).simplices, dtype=np.int64)
    a, b, c = (points[cells[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    cells[area < 0.0] = cells[area < 0.0][:, ::-1]
    centre = (a + b + c) / 3.0
    kept = shapely.contains_xy(body, *centre.T) & (np.abs(area) > 1e-9 * spacing**2)
    return points, cells[kept]


def _rim(mesh: BoundaryMesh, loop: Index, spacing: float) -> Array:
    """Points just inside the boundary along a loop, about `spacing` apart, and one at each corner.

    They keep away from the ends of elements, where discontinuous elements have singular stresses.
    """
    points: list[Array] = []
    inset = INSET * spacing
    for k in loop:
        before = loop[(np.searchsorted(loop, k) - 1) % len(loop)]
        corner = _corner(mesh, int(before), int(k), inset)
        if corner is not None:
            # a corner is worth more than what came just before it
            while points and np.hypot(*(points[-1] - corner)) < KEPT_OFF * spacing:
                points.pop()
            points.append(corner)
        count = max(1, int(np.ceil(mesh.length[k] / spacing)))
        place, normal = on_element(mesh, int(k), (np.arange(count) + 0.5) / count * 2.0 - 1.0)
        for point in place - inset * normal:
            if not points or np.hypot(*(points[-1] - point)) >= KEPT_OFF * spacing:
                points.append(point)
    while len(points) > 3 and np.hypot(*(points[-1] - points[0])) < KEPT_OFF * spacing:
        points.pop()
    return np.array(points)


def _corner(mesh: BoundaryMesh, before: int, after: int, inset: float) -> Array | None:
    """The point inside a corner, None where the outline runs on smoothly."""
    n = on_element(mesh, before, np.array([1.0]))[1][0]
    m = on_element(mesh, after, np.array([-1.0]))[1][0]
    if n @ m > np.cos(np.radians(10.0)):
        return None
    inwards = -(n + m) / max(float(np.hypot(*(n + m))), 1e-12)
    return np.asarray(mesh.start[after] + inset * inwards)


def on_element(mesh: BoundaryMesh, k: int, xi: Array) -> tuple[Array, Array]:
    """Points (n, 2) of an element at ξ in [-1, 1] and outward normals."""
    chord = mesh.end[k] - mesh.start[k]
    size = float(np.hypot(*chord))
    tangent = (chord[0] + 1j * chord[1]) / size
    angle = float(np.arcsin(np.clip(0.5 * mesh.curvature[k] * size, -1.0, 1.0)))
    middle = complex(*(0.5 * (mesh.start[k] + mesh.end[k]))) - 0.5j * size * tangent * np.tan(0.5 * angle)
    turn = 0.5 * angle * xi
    place = middle + tangent * 0.5 * mesh.length[k] * xi * np.sinc(turn / np.pi) * np.exp(1j * turn)
    normal = -1j * tangent * np.exp(1j * angle * xi)
    return np.column_stack([place.real, place.imag]), np.column_stack([normal.real, normal.imag])


def _arc_points(mesh: BoundaryMesh, k: int, largest_turn: float) -> Array:
    turn = abs(float(mesh.curvature[k] * mesh.length[k]))
    count = max(1, int(np.ceil(turn / largest_turn)))
    points = on_element(mesh, k, np.linspace(-1.0, 1.0, count + 1))[0]
    points[0], points[-1] = mesh.start[k], mesh.end[k]
    return points
