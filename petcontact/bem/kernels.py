"""The choice of the kernel: one line for each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Array
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh, RingMesh
from ..mesh.surface_mesh import SurfaceMesh
from ..model.problem import Material
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
    SurfaceMesh: Kelvin3D,
}
"""By the kind of a mesh, from a material and the unit of length of a mesh, and a `tolerance` of
quadrature where one is wanted."""
COLUMN_FILLERS: dict[type, Callable[[Any, Any, ColumnData], ColumnFiller]] = {
    Kelvin2D: plane.compiled_columns,
    Kelvin3D: space.compiled_columns,
    RingKernel: rings.compiled_columns,
    TwistedRingKernel: rings.compiled_columns,
}
"""By the very class of a kernel: one that inherits may have other integrals."""
EXPANSIONS: dict[type, Callable[..., Any]] = {Kelvin2D: expansion}
"""What elements add to a field far from them, likewise by the very class of a kernel."""

FIELDS: dict[type, Callable[..., tuple[Array, Array, Array]]] = {
    Kelvin3D: Kelvin3D.field,
    RingKernel: RingKernel.field,
    TwistedRingKernel: TwistedRingKernel.field,
}
"""What elements add to a field near them by compiled code, where it does better than integrals; by
the very class."""


def kernel_for(mesh: BoundaryMesh, material: Material, tolerance: float | None = None) -> Kernel:
    """The kernel of a material on a mesh."""
    wanted = {} if tolerance is None else {"tolerance": tolerance}
    return KERNELS[type(mesh)](material, mesh.unit_length, **wanted)


def column_filler(kernel: Kernel, mesh: BoundaryMesh, data: ColumnData) -> ColumnFiller:
    """What fills blocks of columns on a mesh: compiled code, or the integrals of a kernel that has
    none."""
    return COLUMN_FILLERS.get(type(kernel), PlainFiller)(kernel, mesh, data)


def field_of(
    kernel: Kernel, targets: Any, elements: Any, u: Array, traction: Array
) -> tuple[Array, Array, Array]:
    """What some elements add to the field inside a body.

    Parameters
    ----------
    kernel : Kernel
    targets, elements
        m points off the boundary and elements with k nodes, as the mesh gives them.
    u, traction : (k, d, s) arrays
        Displacement [length] at the nodes, and traction over the kernel's `traction_scale`
        [length], in s states.

    Returns
    -------
    u : (m, d, s) array
        [length]
    stress : (m, d(d+1)/2, s) array
        Over `traction_scale`.
    wound : (m,) array
        The part of the full angle, in space of the full solid angle, under which the elements are
        seen: a rigid translation, whose sum over a closed boundary is 1 inside and 0 outside.
    """
    compiled = FIELDS.get(type(kernel))
    if compiled is not None:
        each = [
            compiled(kernel, targets, elements, u[..., s], traction[..., s])
            for s in range(u.shape[2])
        ]
        moved, stressed, (wound, *_) = zip(*each, strict=True)
        return np.stack(moved, axis=2), _in_plane(np.stack(stressed, axis=2), kernel.dim), wound
    kernel_g, kernel_h = kernel.integrals(targets, elements)
    kernel_d, kernel_s = kernel.stress_integrals(targets, elements)
    axes = range(kernel.dim)
    displacement, stress = (
        np.stack(
            [
                sum(traction[:, j].T @ a[j] + sign * (u[:, j].T @ b[j]) for j in axes)
                for a, b in zip(*pair, strict=True)
            ]
        ).transpose(2, 0, 1)
        for sign, pair in ((-1.0, (kernel_g, kernel_h)), (1.0, (kernel_d, kernel_s)))
    )
    wound = -sum(kernel_h[i, i].sum(axis=0) for i in axes) / kernel.dim
    return displacement, stress, wound


def _in_plane(stress: Array, d: int) -> Array:
    """Stress without the hoop stress that kernels of rings add: it follows from u_r/r."""
    return stress[:, : d * (d + 1) // 2]
