"""Tables that choose a kernel, its compiled columns and its expansions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..given.tables.material import Material
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.ring_mesh import RingMesh, TwistedRingMesh
from ..mesh.surface_mesh import SurfaceMesh
from .column_fillers import PlainFiller
from .kelvin2d import compiled as plane
from .kelvin2d.expansions import expansion
from .kelvin2d.kernel import Kelvin2D
from .kelvin3d import compiled as space
from .kelvin3d.kernel import Kelvin3D
from .kernel import ColumnData, ColumnFiller, Kernel
from .revolution import compiled as rings
from .revolution.kernel import RingKernel, TwistedRingKernel

KERNELS: dict[type, Callable[..., Kernel]] = {
    CurveMesh: Kelvin2D,
    RingMesh: RingKernel,
    TwistedRingMesh: TwistedRingKernel,
    SurfaceMesh: Kelvin3D,
}
"""Kernels by the kind of a mesh. Each is made from a material, the unit of length of a mesh and a
`tolerance` of quadrature."""
COLUMN_FILLERS: dict[type, Callable[[object, Any, ColumnData], ColumnFiller]] = {
    Kelvin2D: plane.compiled_columns,
    Kelvin3D: space.compiled_columns,
    RingKernel: rings.compiled_columns,
    TwistedRingKernel: rings.compiled_columns,
}
"""By the very class of a kernel: one that inherits may have other integrals."""
EXPANSIONS: dict[type, Callable[..., object]] = {Kelvin2D: expansion}
"""What elements add to a field far from them, likewise by the very class of a kernel."""


def kernel_for(mesh: BoundaryMesh, material: Material, tolerance: float | None = None) -> Kernel:
    """Return the kernel of a material on a mesh."""
    wanted = {} if tolerance is None else {"tolerance": tolerance}
    return KERNELS[type(mesh)](material, mesh.unit_length, **wanted)


def column_filler(kernel: Kernel, mesh: BoundaryMesh, data: ColumnData) -> ColumnFiller:
    """Return the filler of blocks of columns on a mesh: compiled code, or the integrals of a kernel
    without compiled code."""
    return COLUMN_FILLERS.get(type(kernel), PlainFiller)(kernel, mesh, data)
