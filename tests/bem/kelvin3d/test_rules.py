"""Far panels hold their tolerance, and fields inside a body do next to a panel and away from it."""

from __future__ import annotations

import numpy as np
import pytest
from curved_bodies import a_curved_panel
from hypothesis import given, settings
from hypothesis import strategies as st
from kelvin_oracle import kelvin, stress_of_kelvin
from marks import slow
from panel_oracle import a_panel, by_subdivision

from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.bem.kelvin3d.kernel import Kelvin3D
from petcontact.bem.kelvin3d.rules import TOLERANCE
from petcontact.mesh.curved.panels import CurvedPanels
from petcontact.mesh.panels import Panels
from petcontact.model.problem import Material

NU = 0.3


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


NU = 0.3
KERNEL = Kelvin3D(Material(young_modulus=2.0, poisson_ratio=NU), 1.7)


def assert_field(panel: Panels | CurvedPanels, points: np.ndarray, allowed: float) -> None:
    """Displacement and stress of tractions alone, then of displacements alone."""
    data = np.random.default_rng(3).normal(size=(panel.n_nodes, 3))
    exact = [by_subdivision(panel, x, NU, (kelvin, stress_of_kelvin), points=10) for x in points]
    g, h, d, s = (np.array(part) for part in zip(*exact, strict=True))
    zero = np.zeros_like(data)
    for u, traction, moves, stresses in ((zero, data, g, d), (data, zero, -h, s)):
        scaled = KERNEL.unit_length * traction
        moved, stress, _ = KERNEL.field(points, panel, u[..., None], scaled[..., None])
        for ours, values in ((moved, moves), (stress / KERNEL.unit_length, stresses)):
            expected = np.einsum("mckb,bk->mc", values, data)
            size = np.einsum("mckb,bk->mc", np.abs(values), np.abs(data)).max(axis=1)
            assert np.all(np.abs(ours[..., 0] - expected).max(axis=1) <= allowed * size)


@pytest.mark.parametrize(("corners", "order"), [(3, 0), (4, 3), slow(3, 3), slow(4, 0)])
def test_flat_panels_against_subdivision(corners: int, order: int) -> None:
    """Over the panel, beside it and in its plane, and afar."""
    rng = np.random.default_rng(7 + order)
    panel = a_panel(corners, order, rng)
    places = np.column_stack([rng.uniform(-1.3, 1.3, (4, 2)), [1e-4, -0.02, 0.15, 3.0]])
    places = np.vstack([places, [[1.5, 0.2, 0.0], [-1.6, 0.3, 1e-4], [0.1, 1.2, -0.02]]])
    assert_field(panel, panel.centre[0] + places @ panel.frame[0], 1e-9)


@pytest.mark.parametrize(("corners", "order"), [(4, 2), slow(3, 0), slow(3, 2), slow(4, 0)])
def test_curved_panels_against_subdivision(corners: int, order: int) -> None:
    """Rules aim at the digits of T: of S, one order more singular, 4e-7 is left at a height of .01."""
    rng = np.random.default_rng(10 * corners + order)
    panel = a_curved_panel(corners, order, rng)
    heights = np.array([0.1, -0.5, 2.0, -30.0])
    middle = np.full((1, 1, 2), 0.3 if corners == 3 else 0.1)
    points = panel.at(middle)[0][0] + heights[:, None] * panel.normals(middle)[0]
    assert_field(panel, points, 3e-8)
