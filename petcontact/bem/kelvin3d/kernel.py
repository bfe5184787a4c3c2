"""Kelvin's solution in space as the operators see it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ...arrays import Array
from ...mesh.panels import Panels
from ...model.problem import Material
from . import point_force
from .integrals import TOLERANCE, integrals
from .stress import stress_integrals


@dataclass(frozen=True)
class Kelvin3D:
    """Kelvin's solution of a material in space (see `bem.kernel.Kernel`).

    Attributes
    ----------
    material : Material
        Its `plane` says nothing here.
    unit_length : float
        ℓ [length].
    tolerance : float
        Relative error of the quadrature of far panels.
    """

    material: Material
    unit_length: float
    tolerance: float = TOLERANCE
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
        self, targets: Array, elements: Panels, *, displacement: bool = True, traction: bool = True
    ) -> tuple[Array | None, Array | None]:
        """Both kernels integrated over panels at points (m, 3)."""
        kernel_g, kernel_h = integrals(
            targets, elements, self.material.poisson_ratio, displacement=displacement, traction=traction,
            tolerance=self.tolerance,
        )  # fmt: skip
        if kernel_g is not None:
            kernel_g /= self.unit_length
        return kernel_g, kernel_h

    def stress_integrals(self, targets: Array, elements: Panels) -> tuple[Array, Array]:
        """Stress at points (m, 3) off the boundary; xx, yy, zz, xy, xz, yz come first."""
        kernel_d, kernel_s = stress_integrals(targets, elements, self.material.poisson_ratio)
        return kernel_d, kernel_s * self.unit_length

    def point_displacement(self, x: Array, at: Array, force: Array) -> Array:
        """As in `Kernel`."""
        return point_force.displacement(x, at, force, self.material)

    def point_stress(self, x: Array, at: Array, force: Array) -> Array:
        """As in `Kernel`."""
        return point_force.stress(x, at, force, self.material)
