"""Gauss points of far panels: the degree that they integrate, and the tolerance on panels that are
no rectangles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from panel_oracle import kelvin, stress_of_kelvin
from random_panels import a_panel

from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.bem.kelvin3d.kernel import Kelvin3D
from petcontact.bem.kelvin3d.rules import TOLERANCE
from petcontact.mesh.panels import Panels
from petcontact.model.problem import Material

NU = 0.3
OUTLINES = {
    "rectangle": [[-1.0, -0.4], [1.0, -0.4], [1.0, 0.4], [-1.0, 0.4]],
    "parallelogram": [[-1.2, -0.4], [0.8, -0.4], [1.2, 0.4], [-0.8, 0.4]],
    "trapezium": [[-1.0, -0.4], [1.0, -0.4], [0.7, 0.4], [-0.5, 0.4]],
    "turned trapezium": [[-1.0, -0.4], [1.0, -0.7], [1.0, 0.7], [-1.0, 0.3]],
    "crooked": [[-1.0, -0.4], [1.0, -0.6], [0.9, 0.5], [-0.7, 0.6]],
    "triangle": [[-1.0, -0.4], [1.0, -0.6], [0.9, 0.5]],
}


@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize("order", range(4))
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_kernels_and_fields_hold_their_tolerance_from_afar(
    corners: int, order: int, seed: int
) -> None:
    """At 2 to 1e4 lengths, against far more Gauss points than any rule takes: G and H, and the
    displacement and stress of tractions alone and of displacements alone."""
    rng = np.random.default_rng(seed)
    panel = a_panel(corners, order, rng)
    away = rng.normal(size=(12, 3))
    away *= np.geomspace(2.0, 1e4, 12)[:, None] / np.linalg.norm(away, axis=1, keepdims=True)
    points = panel.centre[0] + 2.0 * panel.size[0] * away
    y, weight = panel.rule((40, 40))
    r, normal = y[0][:, None] - points, panel.frame[0, 2]
    g, h, d, s = (
        np.einsum("bq,ijqm->ijbm", weight[0], value, optimize=True)
        for value in (*kelvin(r, normal, NU), *stress_of_kelvin(r, normal, NU))
    )
    allowed = 10.0 * TOLERANCE[Panels]
    for ours, exact in zip(integrals(points, panel, NU), (g, h), strict=True):
        worst = np.abs(ours - exact).max(axis=(0, 1, 2)) / np.abs(exact).max(axis=(0, 1, 2))
        assert worst.max() <= allowed
    kernel = Kelvin3D(Material(young_modulus=2.0, poisson_ratio=NU), 1.0)
    data, zero = rng.normal(size=(panel.n_nodes, 3)), np.zeros((panel.n_nodes, 3))
    for u, traction, moves, stresses in ((zero, data, g, d), (data, zero, -h, s)):
        moved, stress, _ = kernel.field(points, panel, u[..., None], traction[..., None])
        for ours, values in ((moved, moves), (stress, stresses)):
            size = np.einsum("ckbm,bk->mc", np.abs(values), np.abs(data)).max(axis=1, keepdims=True)
            expected = np.einsum("ckbm,bk->mc", values, data)
            assert np.all(np.abs(ours[..., 0] - expected) <= allowed * size)
