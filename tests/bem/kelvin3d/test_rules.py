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
from petcontact.given.tables.material import Material
from petcontact.mesh.panels import Panels

NU = 0.3
KERNEL = Kelvin3D(Material(young_modulus=2.0, poisson_ratio=NU), 1.7)


def assert_field(panel, points, exact, allowed: float) -> None:
    """Displacement and stress of tractions alone, then of displacements alone, by integrals (m, ...)
    of the kernels."""
    data = np.random.default_rng(3).normal(size=(panel.n_nodes, 3))
    (g, h, d, s), zero = exact, np.zeros_like(data)
    for u, traction, moves, stresses in ((zero, data, g, d), (data, zero, -h, s)):
        scaled = KERNEL.unit_length * traction
        moved, stress, _ = KERNEL.field(points, panel, u[..., None], scaled[..., None])
        for ours, values in ((moved, moves), (stress / KERNEL.unit_length, stresses)):
            expected = np.einsum("mckb,bk->mc", values, data)
            size = np.einsum("mckb,bk->mc", np.abs(values), np.abs(data)).max(axis=1)
            assert np.all(np.abs(ours[..., 0] - expected).max(axis=1) <= allowed * size)


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
    exact = [
        np.einsum("bq,ijqm->mijb", weight[0], value, optimize=True)
        for value in (*kelvin(r, normal, NU), *stress_of_kelvin(r, normal, NU))
    ]
    allowed = 10.0 * TOLERANCE[Panels]
    for ours, values in zip(integrals(points, panel, NU), exact[:2], strict=True):
        error = np.abs(np.moveaxis(ours, -1, 0) - values).max(axis=(1, 2, 3))
        assert np.all(error <= allowed * np.abs(values).max(axis=(1, 2, 3)))
    assert_field(panel, points, exact, allowed)


@pytest.mark.parametrize(("corners", "order"), [(4, 2), slow(3, 0), slow(3, 2), slow(4, 0)])
def test_curved_panels_against_subdivision(corners: int, order: int) -> None:
    """Rules aim at the digits of T: of S, one order more singular, 4e-7 is left at a height of .01."""
    rng = np.random.default_rng(10 * corners + order)
    panel = a_curved_panel(corners, order, rng)
    heights = np.array([0.1, -0.5, 2.0, -30.0])
    middle = np.full((1, 1, 2), 0.3 if corners == 3 else 0.1)
    points = panel.at(middle)[0][0] + heights[:, None] * panel.normals(middle)[0]
    both = kelvin, stress_of_kelvin
    exact = [by_subdivision(panel, x, NU, both, points=10) for x in points]
    assert_field(panel, points, [np.array(part) for part in zip(*exact, strict=True)], 3e-8)
