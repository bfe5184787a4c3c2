"""Kelvin's solution in space as the operators see it."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...mesh.curved.curved_panels import CurvedPanels
from ...mesh.panels import Panels
from ..kernel import Kernel
from .compiled import compiled_field
from .integrals import integrals
from .stress import near_stress


class Kelvin3D(Kernel):
    """Kelvin's solution of a material in space ; `plane` of the material says nothing
    here."""

    dim = 3

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

    def field(
        self, targets: Array, elements: Panels | CurvedPanels, u: Array, traction: Array
    ) -> tuple[Array, Array, Array]:
        """As in `Kernel`, by compiled code."""
        states = [
            self._field(targets, elements, u[..., s], traction[..., s]) for s in range(u.shape[2])
        ]
        moved, stress = (np.stack([state[k] for state in states], axis=2) for k in range(2))
        return moved, stress, states[0][2]

    def _field(
        self, targets: Array, elements: Panels | CurvedPanels, u: Array, traction: Array
    ) -> tuple[Array, Array, Array]:
        """Return displacement (m, 3), stress (m, 6) and solid angle (m,) of one state."""
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
