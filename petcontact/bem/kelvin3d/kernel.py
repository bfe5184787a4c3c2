"""Kelvin's solution in space as the operators see it."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...mesh.curved.panels import CurvedPanels
from ...mesh.panels import Panels
from ..kelvin import KelvinSolution
from .compiled import compiled_field
from .integrals import integrals
from .stress import near_stress, stress_integrals


class Kelvin3D(KelvinSolution):
    """Kelvin's solution of a material in space (see `bem.kernel.Kernel`); `plane` of the material
    says nothing here."""

    dim = 3

    @property
    def poisson_ratio(self) -> float:
        """ν [-]."""
        return self.material.poisson_ratio

    def potential(self, distance: Array) -> Array:
        """1/r."""
        return 1.0 / distance

    def integrals(self, targets: Array, elements: Panels | CurvedPanels) -> tuple[Array, Array]:
        """Both kernels integrated over panels at points (m, 3)."""
        kernel_g, kernel_h = integrals(
            targets, elements, self.poisson_ratio, tolerance=self.tolerance
        )
        kernel_g /= self.unit_length
        return kernel_g, kernel_h

    def stress_integrals(
        self, targets: Array, elements: Panels | CurvedPanels
    ) -> tuple[Array, Array]:
        """Stress at points (m, 3) off the boundary; xx, yy, zz, xy, xz, yz come first."""
        kernel_d, kernel_s = stress_integrals(targets, elements, self.poisson_ratio)
        return kernel_d, kernel_s * self.unit_length

    def field(
        self, targets: Array, elements: Panels | CurvedPanels, u: Array, traction: Array
    ) -> tuple[Array, Array, Array]:
        """As `bem.kernels.field_of`, of one state, by compiled code."""
        data = np.concatenate([traction / self.unit_length, u], axis=1)
        field, (element, column) = compiled_field(
            targets, elements, self.poisson_ratio, self.tolerance, data
        )
        stress = field[:, 3:9]
        if isinstance(elements, Panels):
            stress = stress + near_stress(
                targets, elements, element, column, self.poisson_ratio, data
            )
        return field[:, :3], self.unit_length * stress, field[:, 9]
