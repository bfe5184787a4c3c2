"""What loads inside a body add to its field: point forces and volume loads of an increment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...mesh.boundary_mesh import BoundaryMesh
from ...model.problem import PointForce, Problem
from ..kernel import Kernel
from ..kernels import kernel_for
from .volume import VolumeSolution


@dataclass(frozen=True)
class InsideLoads:
    """Loads inside a body at a load factor of a step (from 1)."""

    mesh: BoundaryMesh
    kernel: Kernel
    forces: list[PointForce]
    volume: VolumeSolution | None
    step: int
    factor: float

    @classmethod
    def of(
        cls, problem: Problem, number: int, mesh: BoundaryMesh, volume: VolumeSolution | None, step: int, factor: float
    ) -> InsideLoads:
        """Of the body of a number, with the solution for its volume loads."""
        forces = problem.point_forces(number, step, factor)
        return cls(mesh, kernel_for(mesh, problem.body[number].material), forces, volume, step, factor)

    def without(self, u: Array, traction: Array) -> tuple[Array, Array]:
        """Displacement and traction (n, d) on the boundary without what volume loads add there, `at` to be added inside."""
        if self.volume is None:
            return u, traction
        u_p, stress, _ = self.volume.at(self.mesh.x, self.step, self.factor)
        return u - u_p, traction - np.einsum("nij,nj->ni", stress, self.mesh.normal)

    def at(self, x: Array) -> tuple[Array, Array, Array]:
        """At points (m, d) inside: u (m, d) [length], σ as of `field_at`, and in plane strain what temperature adds to
        ν(σ_xx + σ_yy) in σ_zz, (m,) [stress]."""
        u, stress, normal = self.volume_at(x)
        if self.forces:
            at, force = np.array([f.at for f in self.forces]), np.array([f.force for f in self.forces])
            u, stress = u + self.kernel.point_displacement(x, at, force), stress + self.kernel.point_stress(x, at, force)
        return u, stress, normal

    def volume_at(self, x: Array) -> tuple[Array, Array, Array]:
        """The same of volume loads alone, which is what `without` leaves out on the boundary."""
        m, d = x.shape
        u, stress, normal = np.zeros((m, d)), np.zeros((m, d * (d + 1) // 2)), np.zeros(m)
        if self.volume is not None:
            u, whole, heat = self.volume.at(x, self.step, self.factor)
            i, j = np.triu_indices(d, 1)
            stress = np.hstack([np.einsum("mii->mi", whole), whole[:, i, j]])
            material = self.kernel.material
            if d == 2 and material.plane == "strain":
                normal = -(1.0 - 2.0 * material.poisson_ratio) * heat
        return u, stress, normal
