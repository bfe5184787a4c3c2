"""Constant elements on arcs: of second order, since they know the slope of the displacement from
their neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import moved

from petcontact import Circle, Material, MeshOptions, Method, Problem, SideBySide, solve
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


@pytest.mark.slow
def test_a_sliding_ring_converges_monotonically_with_second_order():
    """A ring in a rough socket, turned and pushed at its hub; the reference has elements of order 3
    (error 1e-8)."""

    def slip(**mesh):
        problem = Problem(
            material=Material(young_modulus=1000.0, poisson_ratio=0.3),
            geometry=RING,
            mesh=MeshOptions(**mesh),
            boundary=[
                {"part": "rim", "condition": "contact", "friction_bound": "1 + 0.5*x"},
                moved("hub", ["-0.01*y + 0.002", "0.01*x + 0.003"]),
            ],
        )
        contact = solve(problem, method=Method(tolerance=1e-10)).contact
        return contact.arc_length, contact.weight, contact.u_t[:, 0]

    s, _, u = slip(element_size=0.1, order=3)
    errors = []
    for size in (0.2, 0.14, 0.1, 0.07):
        at, weight, found = slip(element_size=size)
        wanted = np.interp(at, s, u, period=4.0 * np.pi)
        errors.append(np.sqrt(weight @ (found - wanted) ** 2 / (weight @ wanted**2)))
    # 2.3e-2, 1.7e-2, 1.2e-2, 8e-3 without the slope
    assert errors[0] < 4e-3 and np.all(np.diff(errors) < 0.0)
    assert np.log(errors[0] / errors[-1]) / np.log(0.2 / 0.07) > 1.7
