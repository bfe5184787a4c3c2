"""Kelvin's solution in the plane as a `Kernel`: here ν, plane strain or stress, and the length of
the logarithm end."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Index
from ...mesh.curve_mesh import CurveMesh
from ...mesh.elements import Elements, Targets
from ..kernel import Kernel
from .corner_elements import corner_columns
from .inside import field_inside
from .integrals import integrals


class Kelvin2D(Kernel):
    """Kelvin's solution of plane strain, or of plane stress by the usual change of constants."""

    dim = 2

    @property
    def poisson_ratio(self) -> float:
        """ν of plane strain, ν/(1+ν) of plane stress [-]."""
        return self.material.plane_strain_ratio

    def potential(self, distance: Array) -> Array:
        """-ln(r/ℓ)."""
        return np.asarray(-np.log(distance / self.unit_length))

    def integrals(self, targets: Targets, elements: Elements) -> tuple[Array, Array]:
        """As in `Kernel`."""
        kernel_g, kernel_h = integrals(targets, elements, self.poisson_ratio, self.unit_length)
        kernel_g /= self.unit_length
        return kernel_g, kernel_h

    def corner_columns(
        self, mesh: CurveMesh, rows: Index, nodes: Index
    ) -> Iterator[tuple[int, Array, Array]]:
        """As in `Kernel`."""
        return corner_columns(self, mesh, rows, nodes)

    def field(
        self, targets: Targets, elements: Elements, u: Array, traction: Array
    ) -> tuple[Array, Array, Array]:
        """As in `Kernel`."""
        return field_inside(targets, elements, u, traction, self.poisson_ratio, self.unit_length)
