"""Half sections of bodies of revolution turned about their axis: cells in space for ParaView."""

from __future__ import annotations

import math
from collections.abc import Sequence

import meshio
import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import WRITTEN

CELLS = {"line": ("quad", (0, 2, 3, 1)), "triangle": ("wedge", (0, 1, 2, 3, 4, 5))}
"""What cells of a section become, and the order of their points: those of the section first."""


def check_revolved(meshes: Sequence[BoundaryMesh], degrees: float | None) -> None:
    """Refuse an angle that is none, and bodies that are not of revolution; nothing where
    none is asked for.

    Raises
    ------
    InputError
        One line that names the option.
    """
    if degrees is None:
        return
    if not 0.0 < degrees <= 360.0:
        raise InputError(f"--revolve {degrees:g}: must be an angle up to 360 degrees")
    if any("zz" not in mesh.stresses or mesh.dim == 3 for mesh in meshes):
        raise InputError('--revolve: turns bodies of revolution, symmetry = "axial", alone')


def revolved(section: meshio.Mesh, degrees: float) -> meshio.Mesh:
    """Cells of a section in (r, z), turned about the axis z from the plane y = 0.

    Point data with three components are vectors (r, z, θ), with six symmetric tensors rr, zz, θθ,
    rz, zθ, rθ as the section's file has them; they become those of x, y, z. What has one value all
    round stands side by side, in single precision: files are compressed to a quarter.
    """
    # cells of 7.5 degrees at most, whose chords leave 2e-3 of the radius
    count = math.ceil(degrees / 7.5 - WRITTEN)
    angles = np.radians(degrees / count * np.arange(count + (degrees < 360.0)))
    frames = np.array([_frame(angle) for angle in angles])
    place, blocks = np.arange(count + 1)[:, None] % len(angles), []
    for block in section.cells:
        kind, order = CELLS[block.type]
        at = len(angles) * block.data[:, None] + place
        cells = np.concatenate([at[:, :-1], at[:, 1:]], axis=2)
        blocks.append((kind, cells[:, :, order].reshape(-1, len(order))))
    return meshio.Mesh(
        _turned(section.points, frames),
        blocks,
        point_data={name: _turned(values, frames) for name, values in section.point_data.items()},
        cell_data={
            name: [np.repeat(part, count) for part in parts]
            for name, parts in section.cell_data.items()
        },
    )


def _frame(angle: float) -> Array:
    """Directions of r, z and θ, as columns."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, -s], [s, 0.0, c], [0.0, 1.0, 0.0]], dtype=np.float32)


TENSOR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
"""Places of the components of a symmetric tensor in VTK's order: xx, yy, zz, xy, yz, xz."""


def _turned(values: Array, frames: Array) -> Array:
    """Values of the section's points, each at all angles."""
    values = values.astype(np.float32)
    if values.ndim == 1:
        return np.repeat(values, len(frames))
    if values.shape[1] == 3:
        return np.asarray(np.einsum("aij,nj->nai", frames, values).reshape(-1, 3))
    whole = np.einsum("aij,njk,alk->nail", frames, values[:, TENSOR], frames, optimize=True)
    i, j = (0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)
    return np.asarray(whole[:, :, i, j].reshape(-1, 6))
