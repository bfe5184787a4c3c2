"""The choice of the kernel: one line for each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..mesh.boundary_mesh import BoundaryMesh
from ..model.problem import Material
from .kelvin2d import compiled as plane
from .kelvin2d.expansions import expansion
from .kelvin2d.kernel import Kelvin2D
from .kelvin3d import compiled as space
from .kelvin3d.kernel import Kelvin3D
from .kernel import ColumnData, ColumnFiller, Kernel

KERNELS: dict[int, Callable[[Material, float], Kernel]] = {2: Kelvin2D, 3: Kelvin3D}
"""By dimension, from a material and the unit of length of a mesh."""
COLUMN_FILLERS: dict[type, Callable[[Any, Any, ColumnData], ColumnFiller | None]] = {
    Kelvin2D: plane.compiled_columns, Kelvin3D: space.compiled_columns
}  # fmt: skip
"""By the very class of a kernel: one that inherits may have other integrals."""
EXPANSIONS: dict[type, Callable[..., Any]] = {Kelvin2D: expansion}
"""What elements add to a field far from them, likewise by the very class of a kernel."""


def kernel_for(mesh: BoundaryMesh, material: Material) -> Kernel:
    """The kernel of a material on a mesh."""
    return KERNELS[mesh.dim](material, mesh.unit_length)


def column_filler(kernel: Kernel, mesh: BoundaryMesh, data: ColumnData) -> ColumnFiller | None:
    """Compiled code for whole blocks of columns on a mesh; None where the kernel's integrals have to do."""
    maker = COLUMN_FILLERS.get(type(kernel))
    return None if maker is None else maker(kernel, mesh, data)
