"""Fields inside a body in space: next to a panel and away from it against subdivision, and a state of
constant stress."""

from __future__ import annotations

import numpy as np
import pytest
from curved_bodies import a_curved_panel
from marks import slow
from panel_oracle import by_subdivision, kelvin, stress_of_kelvin
from random_panels import a_panel

from petcontact.bem.kelvin3d.kernel import Kelvin3D
from petcontact.mesh.curved.panels import CurvedPanels
from petcontact.mesh.panels import Panels
from petcontact.model.problem import Material

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
