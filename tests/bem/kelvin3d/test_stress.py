"""Stress inside a body in space: closed form against Gauss points, and a state of constant
stress."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.bem.kelvin3d import stress as module
from petcontact.bem.kelvin3d.stress import COMPONENTS, stress_integrals
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.mesh.panels import Panels, make_panels

NU = 0.3


@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize("order", [0, 2])
def test_closed_form_against_gauss_points(
    corners: int, order: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(7)
    outline = np.array([[[0, 0, 0], [2, 0, 0.5], [2.1, 1.0, 0.6], [0.1, 1, 0.1]]])[:, :corners]
    panel = make_panels(outline, order, np.arange(1))[0]
    # over the panel, beside it, and in its plane
    places = np.vstack(
        [
            np.column_stack([rng.uniform(-1.5, 1.5, (12, 2)), rng.choice([-0.2, 0.15, 0.6], 12)]),
            [[1.5, 0.2, 0.0], [-1.6, 0.3, 1e-4], [0.1, 1.2, -0.02]],
        ]
    )
    points = panel.centre[0] + places @ panel.frame[0]
    monkeypatch.setattr(module, "MOST_POINTS", {Panels: (-1,) * 4})
    near = stress_integrals(points, panel, NU)
    x, weight = panel.rule((150, 150))
    normal = panel.frame[0, 2]
    for ours, integrand in zip(
        near, module._tensors(module._at_points(x[0][:, None] - points), normal, NU), strict=True
    ):
        exact = np.einsum("bq,ckqm->ckbm", weight[0], integrand)
        error = np.abs(ours - exact).max(axis=(0, 1, 2)) / np.abs(exact).max(axis=(0, 1, 2))
        assert error.max() < 1e-9


def test_constant_stress() -> None:
    mesh = box_mesh(BoxSurface(np.zeros(3), np.array([3.0, 2.0, 1.0])), lambda part: 1.0, 1, 1.4)
    rng = np.random.default_rng(3)
    gradient = rng.normal(size=(3, 3))
    strain = gradient + gradient.T
    stress = strain + NU / (1.0 - 2.0 * NU) * np.trace(strain) * np.eye(3)
    points = rng.uniform(0.01, 0.99, (20, 3)) * [3.0, 2.0, 1.0]
    found = np.zeros((6, 20))
    for batch in mesh.batches():
        kernel_d, kernel_s = stress_integrals(points, batch.elements, NU)
        found += np.einsum("ckbm,bk->cm", kernel_d, (mesh.normal @ stress)[batch.nodes])
        found += np.einsum("ckbm,bk->cm", kernel_s, (mesh.x @ strain)[batch.nodes])
    np.testing.assert_allclose(
        found, np.array([[stress[i, j]] * 20 for i, j in COMPONENTS[3]]), atol=1e-9
    )
