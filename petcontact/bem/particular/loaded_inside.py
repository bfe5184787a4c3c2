"""Displacement and stress inside a body that loads in its volume cause: point forces and volume
loads of an increment."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...geometry.rotation import lifted
from ...given.body_data import Body
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record
from ..kernel import Kernel, tensor_components
from ..kernels import kernel_for
from .volume import VolumeSolution


@record
class InsideLoads:
    """Loads inside a body in a load state."""

    mesh: BoundaryMesh
    kernel: Kernel
    point: Array
    force: Array
    volume: VolumeSolution | None
    shares: dict[int, float]

    @classmethod
    def from_body(
        cls,
        body: Body,
        mesh: BoundaryMesh,
        volume: VolumeSolution | None,
        shares: dict[int, float],
    ) -> InsideLoads:
        """Return the loads of a body with the solution for its volume loads. State 0
        is unloaded, state k the end of step k; each has its share."""
        point = np.array(body.points).reshape(-1, mesh.dim)
        force = np.zeros((len(point), mesh.components))
        for state, share in shares.items():
            if state > 0:
                force += share * np.array([f.force for f in body.forces[state - 1]]).reshape(
                    force.shape
                )
        kernel = kernel_for(mesh, body.material)
        return cls(mesh, kernel, point, force / mesh.depth, volume, shares)

    def without(self, u: Array, traction: Array) -> tuple[Array, Array]:
        """Displacement and traction (n, d) on the boundary without what volume loads add there,
        `at` to be added inside."""
        if self.volume is None:
            return u, traction
        u_p, stress, _ = self.volume.values_at(self.mesh.x, self.shares)
        t_p = np.einsum("nij,nj->ni", stress, self.mesh.normal)
        count = self.mesh.components
        return u - lifted(u_p, count), traction - lifted(t_p, count)

    def values_at(self, x: Array) -> tuple[Array, Array, Array]:
        """At points (m, d) inside: u (m, d) [length], σ as of `field_at`, and in plane strain what
        temperature adds to ν(σ_xx + σ_yy) in σ_zz, (m,) [stress]."""
        (u, stress, normal), (pushed, stressed) = self.volume_at(x), self.points_at(x)
        return u + pushed, stress + stressed, normal

    def points_at(self, x: Array) -> tuple[Array, Array]:
        """u and σ of point forces alone, which `without` leaves in: the boundary stress has them,
        the integrals have not."""
        given = x, self.point, self.force
        return self.kernel.point_displacement(*given), self.kernel.point_stress(*given)

    def volume_at(self, x: Array) -> tuple[Array, Array, Array]:
        """Displacement and stress of the volume loads alone, which `without` leaves out on the
        boundary."""
        m, d = len(x), self.mesh.components
        u, stress, normal = np.zeros((m, d)), np.zeros((m, d * (d + 1) // 2)), np.zeros(m)
        if self.volume is not None:
            u, whole, heat = self.volume.values_at(x, self.shares)
            u, whole = lifted(u, d), lifted(lifted(whole, d).swapaxes(1, 2), d)
            stress = tensor_components(whole)
            material = self.kernel.material
            if material.plane == "strain":
                normal = -(1.0 - 2.0 * material.poisson_ratio) * heat
        return u, stress, normal
