"""Results of bodies in space for ParaView: the surface, and fields inside on a grid, as .vtu through meshio."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import meshio
import numpy as np

from ..arrays import Array, Index
from ..errors import InputError
from ..fields.interior import field_at
from ..geometry.surface import winding
from ..mesh.surface_mesh import SurfaceMesh
from ..runtime.atomic_write import temporary_name
from .solution import Solution
from .surface_figures import as_surface, corner_values

if TYPE_CHECKING:
    from .steps.vtu import BodyBoundary

INSET = 1e-3
"""Distance of the outermost grid points from the bounding box, as a fraction of its size."""


def write_surface_vtu(path: str | Path, solution: Solution | BodyBoundary) -> None:
    """Write the boundary data of a body in space: panels with corners of their own, since tractions jump between them.

    Point data: displacement, traction; cell data: the number of the part, and contact (-1 elsewhere, else the largest state
    of the panel's nodes: 0 stick, 1 slip, 2 open).

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    mesh, contact = as_surface(solution.mesh), solution.contact
    corners, u = corner_values(mesh, solution.u)
    traction = corner_values(mesh, solution.traction)[1]
    triangle = np.isnan(mesh.corners[:, 3, 0])
    numbers = np.arange(4 * mesh.n_elements).reshape(-1, 4)
    state = np.full(mesh.n_elements, -1)
    np.maximum.at(state, mesh.element[contact.nodes], contact.state.astype(np.int64))
    kinds = [(name, mine) for name, mine in (("quad", ~triangle), ("triangle", triangle)) if mine.any()]
    cells = [(name, numbers[mine, : 3 if name == "triangle" else 4]) for name, mine in kinds]
    _write(path, meshio.Mesh(
        corners.reshape(-1, 3), cells, point_data={"displacement": u.reshape(-1, 3), "traction": traction.reshape(-1, 3)},
        cell_data={"part": [mesh.part[mine] for _, mine in kinds], "contact": [state[mine] for _, mine in kinds]},
    ))  # fmt: skip


def write_volume_vtu(path: str | Path, solution: Solution, resolution: tuple[int, ...]) -> float:
    """Write displacement, stress and von Mises stress on those cells of a grid over the bounding box that lie in the body.

    Parameters
    ----------
    path : str or Path
    solution : Solution
    resolution : three numbers of cells

    Returns
    -------
    float
        The largest von Mises stress of the grid [stress].

    Raises
    ------
    InputError
        If no cell of the grid lies inside.
    OutputError
        If the file cannot be written.
    """
    points, cells = cells_inside(as_surface(solution.mesh), resolution)
    u, stress = field_at(solution.mesh, solution.u, solution.traction, solution.case.material, points)
    return write_cells(path, points, cells, u, stress)


def write_cells(path: str | Path, points: Array, cells: Index, u: Array, stress: Array) -> float:
    """Write values (n, 3) and (n, 6) at grid points; the largest von Mises stress."""
    x, y, z, xy, xz, yz = stress.T
    mises = np.sqrt(0.5 * ((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) + 3.0 * (xy**2 + xz**2 + yz**2))
    # VTK's order of a symmetric tensor is xx, yy, zz, xy, yz, xz
    tensor = np.column_stack([x, y, z, xy, yz, xz])
    _write(path, meshio.Mesh(points, [("hexahedron", cells)],
                             point_data={"displacement": u, "stress": tensor, "von_mises": mises}))  # fmt: skip
    return float(mises.max())


def cells_inside(mesh: SurfaceMesh, resolution: tuple[int, ...]) -> tuple[Array, Index]:
    """Grid points (n, 3) inside the body and the hexahedra (k, 8) between them."""
    low, high = np.nanmin(mesh.corners, axis=(0, 1)), np.nanmax(mesh.corners, axis=(0, 1))
    inset = INSET * (high - low)
    lines = [np.linspace(a, b, n + 1) for a, b, n in zip(low + inset, high - inset, resolution, strict=True)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    flat = grid.reshape(-1, 3)
    corners = np.where(np.isnan(mesh.corners), mesh.corners[:, 2:3], mesh.corners)
    triangles = np.concatenate([corners[:, :3], corners[:, [0, 2, 3]]])
    inside = np.array([winding(triangles - x) for x in flat]) > 0.5
    number = np.arange(len(flat)).reshape(grid.shape[:3])
    i, j, k = (slice(None, -1),) * 3
    up = slice(1, None)
    square = ((i, j), (up, j), (up, up), (i, up))
    cells = np.stack([number[a, b, c] for c in (k, up) for a, b in square], axis=-1).reshape(-1, 8)
    cells = cells[inside[cells].all(axis=1)]
    if not len(cells):
        raise InputError("--grid: no cell lies inside the body; choose a finer grid")
    used, renumbered = np.unique(cells, return_inverse=True)
    return flat[used], renumbered.reshape(-1, 8)


def _write(path: str | Path, mesh: meshio.Mesh) -> None:
    with temporary_name(path) as temporary:
        meshio.write(temporary, mesh, file_format="vtu")
