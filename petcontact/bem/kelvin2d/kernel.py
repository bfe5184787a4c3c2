"""Kelvin's solution in the plane as a `Kernel`: here ν, plane strain or stress, and the length of the logarithm end."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from ...arrays import Array, Index
from ...mesh.curve_mesh import CurveMesh
from ...mesh.elements import Elements, Targets
from ...model.problem import Material
from . import point_force
from .corner_elements import corner_columns
from .integrals import integrals
from .stress import stress_integrals


@dataclass(frozen=True)
class Kelvin2D:
    """Kelvin's solution of plane strain, or of plane stress by the usual change of constants.

    Attributes
    ----------
    material : Material
    unit_length : float
        ℓ, which the argument of the logarithm is measured in [length].
    """

    material: Material
    unit_length: float
    dim: ClassVar[int] = 2

    @property
    def traction_scale(self) -> float:
        """2µ/ℓ [stress/length]."""
        return 2.0 * self.material.shear_modulus / self.unit_length

    @property
    def half_space_compliance(self) -> float:
        """(1-ν)/(πµ), that is 2(1-ν²)/(πE) of plane strain and 2/(πE) of plane stress [1/stress]."""
        return (1.0 - self.material.plane_strain_ratio) / (math.pi * self.material.shear_modulus)

    def integrals(
        self, targets: Targets, elements: Elements, *, displacement: bool = True, traction: bool = True
    ) -> tuple[Array | None, Array | None]:
        """As in `Kernel`."""
        kernel_g, kernel_h = integrals(
            targets, elements, self.material.plane_strain_ratio, self.unit_length,
            displacement=displacement, traction=traction,
        )  # fmt: skip
        if kernel_g is not None and self.unit_length != 1.0:
            kernel_g /= self.unit_length
        return kernel_g, kernel_h

    def corner_columns(self, mesh: CurveMesh, rows: Index, nodes: Index) -> Iterator[tuple[int, Array, Array]]:
        """As in `Kernel`."""
        return corner_columns(self, mesh, rows, nodes)

    def stress_integrals(self, targets: Targets, elements: Elements) -> tuple[Array, Array]:
        """As in `Kernel`."""
        kernel_d, kernel_s = stress_integrals(targets.point, elements, self.material.plane_strain_ratio)
        kernel_s *= self.unit_length
        return kernel_d, kernel_s

    def point_displacement(self, x: Array, at: Array, force: Array) -> Array:
        """As in `Kernel`, the forces per length of thickness."""
        return point_force.displacement(x, at, force, self.material, self.unit_length)

    def point_stress(self, x: Array, at: Array, force: Array) -> Array:
        """As in `Kernel`."""
        return point_force.stress(x, at, force, self.material)
