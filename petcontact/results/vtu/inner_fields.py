"""Displacement and stress inside a body for ParaView: triangles in the plane, cells of a grid in
space."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import meshio
import numpy as np

from ...arrays import Array, Index
from ...errors import InputError
from ...fields.interior import Progress
from ...fields.interior_grid import triangulate
from ...fields.stress_state import Field, StressState
from ...geometry.crossings import winding
from ...geometry.rotation import lifted
from ...given.tables.units import Units
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import as_curve
from ...mesh.surface_mesh import SurfaceMesh
from ..data import SolutionData
from ..records import StepResult
from .writing import unit_notes, write_mesh


def write_vtu(
    path: str | Path, field: Field, units: Units | None = None, degrees: float | None = None
) -> None:
    """Write displacement, stress, von Mises stress, and in the plane principal stresses inside the
    body as a .vtu file.

    Parameters
    ----------
    path : str or Path
        Appears when it is whole.
    field : Field
        From `field_on_grid`; ParaView's "Warp By Vector" with `displacement` shows the deformed
        body.
    units : Units, optional
        Named in the file's field data.
    degrees : float, optional
        Angle by which a half section is turned about its axis, up to 360.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_mesh(path, inside_cells(field), unit_notes(units), degrees)


def inside_cells(field: Field) -> meshio.Mesh:
    """Triangles or cells of a grid with the point data of `write_vtu`."""
    data = {"displacement": field.u, "von_mises": field.von_mises}
    # VTK's order of a symmetric tensor is xx, yy, zz, xy, yz, xz
    if field.x.shape[1] == 3:
        kind, points, data["stress"] = "hexahedron", field.x, field.stress[:, [0, 1, 2, 3, 5, 4]]
    else:
        kind, points = "triangle", lifted(field.x, 3)
        data |= {
            "displacement": lifted(field.u, 3),
            "stress": field.components[:, [0, 1, 2, 3, 5, 4]],
            "principal_1": field.principal_in_plane[:, 0],
            "principal_2": field.principal_in_plane[:, 1],
        }
    return meshio.Mesh(points, [(kind, field.cells)], point_data=data)


NO_CELL = "--grid: no cell lies inside the body; choose a finer grid"
RESOLUTION = {2: (100, 100), 3: (16, 16, 16)}
"""Grid cells along each axis where none are asked for, by the number of dimensions."""
Grid = tuple[Array, Index]
"""Points (n, d) and the numbers of those of each cell."""
Window = tuple[Array, Array]
"""Lower and upper corner (d,) of a box [length]."""


def grid_inside(
    mesh: BoundaryMesh, resolution: tuple[int, ...] | None, window: Window | None = None
) -> Grid:
    """Points inside a body, in a box where one is given, and the cells between them.

    Raises
    ------
    InputError
        If resolution or window have not as many numbers as the body has dimensions, or there is no
        cell.
    """
    resolution = resolution or RESOLUTION[mesh.dim]
    if len(resolution) != mesh.dim:
        raise InputError(
            f"--grid {'x'.join(map(str, resolution))}: the body has {mesh.dim} dimensions"
        )
    check_window(mesh, window)
    return _grid(mesh, resolution, window)


def check_window(mesh: BoundaryMesh, window: Window | None) -> None:
    """Refuse a box of other dimensions than a body's."""
    if window is not None and len(window[0]) != mesh.dim:
        raise InputError(
            f"--window: the body has {mesh.dim} dimensions: {2 * mesh.dim} numbers are needed"
        )


Made = TypeVar("Made")


def within(
    window: Window | None, bodies: Iterable[str], make: Callable[[str], Made]
) -> dict[str, Made]:
    """What is made for each body; those of which nothing lies in the window are left out.

    Raises
    ------
    InputError
        If none is left.
    """
    made, refusal = dict[str, Made](), None
    for name in bodies:
        try:
            made[name] = make(name)
        except InputError as error:
            if window is None:
                raise
            refusal = error
    if refusal is not None and not made:
        raise refusal
    return made


def filled_bodies(solution: SolutionData) -> list[str]:
    """The bodies whose inside is finite and known: no infinite plates, no superelements."""
    return [
        body.name
        for body in solution.problem.body
        if body.geometry.has_inside and not getattr(body.geometry, "exterior", False)
    ]


def field_inside(
    solution: SolutionData,
    grid: Grid,
    body: str,
    step: StepResult | None = None,
    progress: Progress | None = None,
) -> Field:
    """Displacement and stress of a body after an increment, the last one by default, on a grid."""
    return next(fields_inside(solution, grid, body, [step], progress))


def fields_inside(
    solution: SolutionData,
    grid: Grid,
    body: str,
    steps: Sequence[StepResult | None],
    progress: Progress | None = None,
) -> Iterator[Field]:
    """Yield the field of a body after each of some increments, as many at once as memory allows.

    `progress` is called with the share of all of them that is there.
    """
    # points times increments whose fields are computed together
    count = max(1, 400_000 // max(len(grid[0]), 1))
    for first in range(0, len(steps), count):
        some = steps[first : first + count]

        def told(share: float, first: int = first, size: int = len(some)) -> None:
            if progress is not None:
                progress((first + share * size) / len(steps))

        for state in solution.states_at(grid[0], some, body, progress=told, outside=np.nan):
            yield _inside(state, grid[1])


def _inside(state: StressState, cells: Index) -> Field:
    """A field on the cells whose points all lie inside the body. A grid is made by what stands for
    the boundary, straight or flat pieces; the integrals over it know what lies inside."""
    inside = np.isfinite(state.u).all(axis=1)
    used, numbers = np.unique(cells[inside[cells].all(axis=1)], return_inverse=True)
    if not len(used):
        raise InputError(NO_CELL)
    x, u, stress, across = (
        values[used] for values in (state.x, state.u, state.stress, state.sigma_zz)
    )
    return Field(x, u, stress, across, numbers.reshape(-1, cells.shape[1]))


def fields_of_bodies(
    solution: SolutionData,
    grids: Mapping[str, Grid],
    steps: Sequence[StepResult],
    progress: Progress | None = None,
) -> dict[str, Iterator[Field]]:
    """Return the fields of some bodies, increment after increment; `progress` is that of all."""
    shares = dict.fromkeys(grids, 0.0)

    def told(name: str, share: float) -> None:
        shares[name] = share
        if progress is not None:
            progress(sum(shares.values()) / len(shares))

    return {
        name: fields_inside(solution, grid, name, steps, functools.partial(told, name))
        for name, grid in grids.items()
    }


@functools.singledispatch
def _grid(mesh: BoundaryMesh, resolution: tuple[int, ...], window: Window | None) -> Grid:
    return triangulate(as_curve(mesh), (resolution[0], resolution[1]), window)


@_grid.register
def _(mesh: SurfaceMesh, resolution: tuple[int, ...], window: Window | None) -> Grid:
    """Grid points (n, 3) inside the body and the hexahedra (k, 8) between them."""
    low, high = (
        end(values, axis=0) for end, values in zip((np.min, np.max), mesh.boxes, strict=True)
    )
    # the outermost points lie a thousandth of the box inside of it
    inset = 1e-3 * (high - low)
    if window is not None:
        low, high = np.maximum(low, window[0] - inset), np.minimum(high, window[1] + inset)
        if np.any(high - low <= 2.0 * inset):
            raise InputError("--window: nothing of the body lies in it")
    lines = map(np.linspace, low + inset, high - inset, np.add(resolution, 1))
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    flat = grid.reshape(-1, 3)
    cells = _hexahedra(np.arange(len(flat)).reshape(grid.shape[:3]))
    inside = winding(mesh.triangles(), flat) > 0.5
    cells = cells[inside[cells].all(axis=1)]
    if not len(cells):
        raise InputError(NO_CELL)
    used, renumbered = np.unique(cells, return_inverse=True)
    return flat[used], renumbered.reshape(-1, 8)


def _hexahedra(number: Index) -> Index:
    """Cells (k, 8) between points that have these numbers in a grid, in VTK's order."""
    low, up = slice(None, -1), slice(1, None)
    square = (low, low), (up, low), (up, up), (low, up)
    corners = [number[a, b, c] for c in (low, up) for a, b in square]
    return np.asarray(np.stack(corners, axis=-1).reshape(-1, 8))
