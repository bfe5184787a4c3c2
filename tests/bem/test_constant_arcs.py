"""Constant elements on arcs: of second order, since they know the slope of the displacement from
their neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import Circle, Material, MeshOptions, SideBySide
from petcontact.bem.kernels import kernel_for
from petcontact.mesh.grading import mesh_outline

RING = SideBySide(
    loops=[
        Circle(part=name, center=(0.3, 0.1), radius=r) for name, r in (("rim", 2.0), ("hub", 1.0))
    ]
)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_a_rigid_rotation_has_no_traction_to_second_order(nu):
    """(½ + H) u for rigid motions: 0 for translations, and 3.3e-3, 1.7e-3 for the rotation without
    the slope."""
    material, worst = Material(young_modulus=1.0, poisson_ratio=nu), []
    for size in (0.2, 0.1):
        mesh = mesh_outline(RING.outline(), MeshOptions(element_size=size))
        kernel, targets = kernel_for(mesh, material), mesh.targets(np.arange(mesh.n_nodes))
        (batch,) = mesh.batches()
        kernel_h = kernel.integrals(targets, batch.elements)[1]
        modes = mesh.motions.modes(mesh.x)
        left = 0.5 * modes + np.einsum("ijkm,kjr->mir", kernel_h, modes[batch.nodes])
        assert np.abs(left[:, :, :2]).max() < 1e-14
        worst.append(np.abs(left[:, :, 2]).max())
    assert worst[1] < 4e-4 and np.log2(worst[0] / worst[1]) > 1.9
