"""The choice of the kernel: one line for each."""

from __future__ import annotations

from collections.abc import Callable

from ..mesh.boundary_mesh import BoundaryMesh
from ..model.problem import Material
from .kelvin2d.kernel import Kelvin2D
from .kernel import Kernel

KERNELS: dict[int, Callable[[Material, float], Kernel]] = {2: Kelvin2D}
"""By dimension, from a material and the unit of length of a mesh."""


def kernel_for(mesh: BoundaryMesh, material: Material) -> Kernel:
    """The kernel of a material on a mesh."""
    return KERNELS[mesh.dim](material, mesh.unit_length)
