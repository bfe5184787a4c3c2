"""Kelvin's solution in space as the operators see it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...arrays import Array, Index
from ...mesh.curved_panels import CurvedPanels
from ...mesh.panels import Panels
from ...mesh.surface_mesh import SurfaceMesh
from ...model.problem import Material
from . import point_force
from .compiled import compiled_field
from .integrals import integrals
from .stress import near_stress, stress_integrals


@dataclass(frozen=True)
class Kelvin3D:
    """Kelvin's solution of a material in space (see `bem.kernel.Kernel`).

    Attributes
    ----------
    material : Material
        Its `plane` says nothing here.
    unit_length : float
        ℓ [length].
    tolerance : float, optional
        Relative error of quadrature, by default `rules.TOLERANCE`.
    """

    material: Material
    unit_length: float
    tolerance: float | None = None
    dim: ClassVar[int] = 3

    @property
    def traction_scale(self) -> float:
        """2µ/ℓ [stress/length]."""
        return 2.0 * self.material.shear_modulus / self.unit_length

    @property
    def half_space_compliance(self) -> float:
        """(1-ν)/(πµ) [1/stress]."""
        return (1.0 - self.material.poisson_ratio) / (math.pi * self.material.shear_modulus)

    def integrals(
        self, targets: Array, elements: Panels | CurvedPanels, *, displacement: bool = True, traction: bool = True
    ) -> tuple[Array | None, Array | None]:
        """Both kernels integrated over panels at points (m, 3)."""
        kernel_g, kernel_h = integrals(
            targets, elements, self.material.poisson_ratio, displacement=displacement, traction=traction,
            tolerance=self.tolerance,
        )  # fmt: skip
        if kernel_g is not None:
            kernel_g /= self.unit_length
        return kernel_g, kernel_h

    def corner_columns(self, mesh: SurfaceMesh, rows: Index, nodes: Index) -> Iterable[tuple[int, Array, Array]]:
        """As in `Kernel`: there are none."""
        return ()

    def stress_integrals(self, targets: Array, elements: Panels | CurvedPanels) -> tuple[Array, Array]:
        """Stress at points (m, 3) off the boundary; xx, yy, zz, xy, xz, yz come first."""
        kernel_d, kernel_s = stress_integrals(targets, elements, self.material.poisson_ratio)
        return kernel_d, kernel_s * self.unit_length

    def field(
        self, targets: Array, elements: Panels | CurvedPanels, u: Array, traction: Array
    ) -> tuple[Array, Array, Array] | None:
        """As `bem.kernels.field_of`, by compiled code; None where nothing was compiled."""
        data = np.concatenate([traction / self.unit_length, u], axis=1)
        found = compiled_field(targets, elements, self.material.poisson_ratio, self.tolerance, data)
        if found is None:
            return None
        field, (element, column) = found
        stress = field[:, 3:9]
        if isinstance(elements, Panels):
            stress = stress + near_stress(targets, elements, element, column, self.material.poisson_ratio, data)
        return field[:, :3], self.unit_length * stress, field[:, 9]

    def point_displacement(self, x: Array, at: Array, force: Array) -> Array:
        """As in `Kernel`."""
        return point_force.displacement(x, at, force, self.material)

    def point_stress(self, x: Array, at: Array, force: Array) -> Array:
        """As in `Kernel`."""
        return point_force.stress(x, at, force, self.material)
