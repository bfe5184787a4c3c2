"""Kelvin's solution of rings as a `Kernel`: bodies of revolution on their generating curves.

What holds for `RingKernel` (two components) and `TwistedRingKernel` (three):

- A point of the half plane is (r, z), r >= 0, z the axis. The curve has the body on its left and
  carries no elements on the axis; its normal n = (n_r, n_z) points outward, as in the plane.
  Targets and elements are those of a `CurveMesh`.
- Components come in the order r, z, θ. θ follows the right-hand rule about +z. In elasticity
  θ knows nothing of r and z: G and H have zeros there.
- u [length] and t [stress] are values at a point of the ring. The factor R and the integral over
  the angle are in the kernels, so the equation is that of the plane:
  ½ u_i + Σ H_ij u_j = Σ G_ij t_j/s, s = `traction_scale` = 2µ/ℓ, all entries pure numbers.
- Forces are whole forces of rings: 2πR times the force per length of the ring, for each component
  (the torque of the third is R times it). On the axis only the force along z acts.
- Integrals of stress have the components of `STRESS`, in the order rr, zz, rz, θθ and, with
  torsion, rθ, zθ. Fields have those of `in_fields`: rr, zz, rz, where θθ follows from u_r/r, and
  with torsion rr, zz, θθ, rz, rθ, zθ, as space has them along r, z and θ.
- Targets may lie on the axis: u_r = u_θ = 0, σ_θθ = σ_rr and σ_rz = σ_rθ = σ_zθ = 0 there.
- Rigid motions: u = (0, 1) along z, and u_θ = r with torsion. For each, ½ u + Σ H u = 0 on a
  closed curve, and Σ H u = -u inside.
- Entries are good to `tolerance`, by default `compiled.TOLERANCE`, at any distance and order.
- The solution decays far away: no constant is free, and loads need not be in equilibrium.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ...arrays import Array
from ...mesh.elements import Elements, Targets
from ..kelvin2d.kernel import Kelvin2D
from .compiled import LOADS, STRESSES, ring_forces, ring_integrals

STRESS = ((0, 0), (1, 1), (0, 1), (2, 2), (0, 2), (1, 2))
"""Components of stress: rr, zz, rz, θθ, and with torsion rθ, zθ."""
APART = 1e-12
"""Distance, over the largest one, at which a force is evaluated instead of 0, where its field is
infinite."""


def _weighted(
    by_traction: Array, by_displacement: Array, traction: Array, displacement: Array
) -> Array:
    """Multiply integrals (c, d, k, m) by data (k, d, s) at the nodes of elements and add. The
    result is (m, c, s)."""
    pushed = np.tensordot(traction, by_traction, ((0, 1), (2, 1)))
    return np.asarray(pushed + np.tensordot(displacement, by_displacement, ((0, 1), (2, 1)))).T


class RingKernel(Kelvin2D):
    """Kelvin's solution of rings, loaded along r and z; from near it is that of plane strain."""

    dim = 2
    stress_components: ClassVar[tuple[tuple[int, int], ...]] = STRESS[:4]
    in_fields: ClassVar[tuple[int, ...]] = (0, 1, 2)

    def measure(self, points: Array) -> Array:
        """As in `Kernel`: 2πr."""
        return np.asarray(2.0 * np.pi * points[:, 0])

    def integrals(self, targets: Targets, elements: Elements) -> tuple[Array, Array]:
        """As in `Kernel`."""
        return ring_integrals(self, targets, elements, self.dim, self.dim)

    def stress_integrals(self, targets: Targets, elements: Elements) -> tuple[Array, Array]:
        """D and S, (components, d, k, m) as of `Kelvin2D`, the components those of
        `stress_components`."""
        integrals = ring_integrals(self, targets, elements, len(STRESSES), of_stress=True)
        shape = len(self.stress_components), self.dim, *integrals[0].shape[1:]
        kernel_d, kernel_s = np.zeros(shape), np.zeros(shape)
        for whole, rows in zip((kernel_d, kernel_s), integrals, strict=True):
            for (component, load), row in zip(STRESSES, rows, strict=True):
                if load < self.dim:
                    whole[component, load] = row
        return kernel_d, kernel_s

    def field(
        self, targets: Targets, elements: Elements, u: Array, traction: Array
    ) -> tuple[Array, Array, Array]:
        """As in `Kernel`; `wound` is that of a rigid translation along z, around none at r < 0."""
        kernel_g, kernel_h = self.integrals(targets, elements)
        kernel_d, kernel_s = self.stress_integrals(targets, elements)
        rows = list(self.in_fields)
        moved = _weighted(kernel_g, -kernel_h, traction, u)
        stress = _weighted(kernel_d[rows], kernel_s[rows], traction, u)
        wound = np.where(targets.point[:, 0] < 0.0, 0.0, -kernel_h[1, 1].sum(axis=0))
        return moved, stress, wound

    def point_displacement(self, x: Array, points: Array, force: Array) -> Array:
        """u (n, d) [length] at points (n, 2) for whole forces (f, d) of rings through (f, 2)."""
        return self._of_forces(x, points, force)[0]

    def point_stress(self, x: Array, points: Array, force: Array) -> Array:
        """Stress (n, d(d+1)/2) of the same forces [stress]."""
        return self._of_forces(x, points, force)[1][:, list(self.in_fields)]

    def _of_forces(self, x: Array, sources: Array, force: Array) -> tuple[Array, Array]:
        u, stress = np.zeros((len(x), self.dim)), np.zeros((len(x), len(self.stress_components)))
        for source, load in zip(sources, force, strict=True):
            distance = np.hypot(*(x - source).T)
            nearest = max(APART * float(distance.max(initial=0.0)), 1e-150)
            moved = np.where((distance < nearest)[:, None], source + np.array([0.0, nearest]), x)
            for whole, rows, kinds in zip(
                (u, stress),
                ring_forces(moved, source, self.poisson_ratio),
                (LOADS, STRESSES),
                strict=True,
            ):
                for (component, along), row in zip(kinds, rows, strict=True):
                    if along < self.dim:
                        whole[:, component] += row * load[along]
        return u / (2.0 * self.material.shear_modulus), stress


class TwistedRingKernel(RingKernel):
    """Kelvin's solution of rings, loaded along r, z and θ."""

    dim = 3
    stress_components = STRESS
    in_fields = (0, 1, 3, 2, 4, 5)
