"""Kelvin's solution of a point force in the plane and in space: what both kernels share."""

from __future__ import annotations

import abc
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, Index
from ..model.problem import Material

COMPONENTS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))}
"""Order of the components of symmetric tensors in 2 and 3 dimensions: xx, yy, xy and xx, yy, zz,
xy, xz, yz."""


@dataclass(frozen=True)
class KelvinSolution(abc.ABC):
    """Kelvin's solution of a material in d dimensions.

    Attributes
    ----------
    material : Material
    unit_length : float
        ℓ, which the argument of the plane's logarithm is measured in [length].
    tolerance : float, optional
        Relative error of quadrature, by default `kelvin3d.rules.TOLERANCE`; the plane's integrals
        are closed forms [-].
    """

    material: Material
    unit_length: float
    tolerance: float | None = None
    dim: ClassVar[int]

    @property
    @abc.abstractmethod
    def poisson_ratio(self) -> float:
        """ν of the solution [-]."""

    @property
    def traction_scale(self) -> float:
        """Return 2µ/ℓ [stress/length]."""
        return 2.0 * self.material.shear_modulus / self.unit_length

    @property
    def half_space_compliance(self) -> float:
        """Return (1-ν)/(πµ) [1/stress]. This is 2(1-ν²)/(πE) in space and in plane strain, and
        2/(πE) in plane stress."""
        return (1.0 - self.poisson_ratio) / (math.pi * self.material.shear_modulus)

    @abc.abstractmethod
    def potential(self, distance: Array) -> Array:
        """Return φ(r), -ln(r/ℓ) in the plane and 1/r in space."""

    def measure(self, points: Array) -> Array:
        """As in `Kernel`: 1."""
        return np.ones(len(points))

    def corner_columns(
        self, mesh: Any, rows: Index, nodes: Index
    ) -> Iterable[tuple[int, Array, Array]]:
        """As in `Kernel`: there are none."""
        return ()

    def point_displacement(self, x: Array, points: Array, force: Array) -> Array:
        """As in `Kernel`, in the plane by forces per length: ((3-4ν) φ F + r
        (r·F)/r^d)/(8π(d-1)µ(1-ν))."""
        result, nu, d = np.zeros((len(x), self.dim)), self.poisson_ratio, self.dim
        for source, load in zip(points, force, strict=True):
            r, distance = _from(x, source)
            result += (3.0 - 4.0 * nu) * self.potential(distance)[:, None] * load + (
                r @ load / distance**d
            )[:, None] * r
        return result / (8.0 * np.pi * (d - 1) * self.material.shear_modulus * (1.0 - nu))

    def point_stress(self, x: Array, points: Array, force: Array) -> Array:
        """As in `Kernel`."""
        result, nu, d = np.zeros((len(x), len(COMPONENTS[self.dim]))), self.poisson_ratio, self.dim
        for source, load in zip(points, force, strict=True):
            r, distance = _from(x, source)
            along = r @ load
            for c, (i, j) in enumerate(COMPONENTS[d]):
                result[:, c] -= (
                    (1.0 - 2.0 * nu)
                    * (r[:, j] * load[i] + r[:, i] * load[j] - (i == j) * along)
                    / distance**d
                )
                result[:, c] -= d * r[:, i] * r[:, j] * along / distance ** (d + 2)
        return result / (4.0 * np.pi * (d - 1) * (1.0 - nu))


def weighted(
    by_traction: Array, by_displacement: Array, traction: Array, displacement: Array
) -> Array:
    """Multiply integrals (c, d, k, m) by data (k, d, s) at the nodes of elements and add. The
    result is (m, c, s)."""
    pushed = np.tensordot(traction, by_traction, ((0, 1), (2, 1)))
    return np.asarray(pushed + np.tensordot(displacement, by_displacement, ((0, 1), (2, 1)))).T


def _from(x: Array, source: Array) -> tuple[Array, Array]:
    """Return the vector r and its length. The length is never zero: at the force itself the vector
    0 cancels the infinite factors."""
    r = x - source
    distance = np.linalg.norm(r, axis=1)
    return r, np.maximum(distance, 1e-12 * distance.max(initial=1e-150))
