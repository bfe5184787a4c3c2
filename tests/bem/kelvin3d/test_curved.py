"""Kelvin's kernels over curved panels: quadrature on subdivided panels, closed forms of flat ones,
rigid motions."""

from __future__ import annotations

import numpy as np
import pytest
from curved_bodies import a_curved_panel, icosphere
from marks import slow
from panel_oracle import worst

from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.geometry.quadratic import REFERENCE
from petcontact.mesh.curved.curved_panels import CurvedPanels, make_curved_panels
from petcontact.mesh.panels import make_panels

NU = 0.3


def beside(panel: CurvedPanels, heights: tuple[float, ...], rng: np.random.Generator) -> np.ndarray:
    """Points at heights, in sizes of the panel, over and under places in and next to it."""
    share = rng.dirichlet(np.ones(panel.n_corners), len(heights)) @ REFERENCE[panel.n_corners]
    y, along = panel.at(1.2 * share[None])
    normal = np.cross(along[0, :, 0], along[0, :, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return (
        y[0]
        + rng.choice([-1.0, 1.0], len(heights))[:, None]
        * np.array(heights)[:, None]
        * panel.size[0]
        * normal
    )


@pytest.mark.parametrize("order", [2, slow(0), slow(3)])
@pytest.mark.parametrize(
    "shape", ["spherical", slow("warped triangle"), slow("warped quadrilateral")]
)
def test_both_kernels_against_subdivision(shape: str, order: int) -> None:
    """Within 1e-8 near a piece of a sphere with arcs of 32 degrees, and where points are moved at
    random by 4 %."""
    rng = np.random.default_rng(order)
    if shape == "spherical":
        panel = make_curved_panels(icosphere(2)[:1], order, np.arange(1))[0]
    else:
        panel = a_curved_panel(3 if shape.endswith("triangle") else 4, order, rng, 0.04)
    points = beside(panel, (0.003, 0.1, 0.4, 1.0, 3.0), rng)
    assert worst(points, panel, NU) <= 1e-8


@pytest.mark.parametrize(
    ("corners", "order", "seed", "warp", "heights", "row"),
    [
        # the foot is next to a side, about which 40 points left 9e-9
        (4, 0, [4, 0, 0], 0.1, (0.003,), 0),
        (3, 2, [3, 2, 10], 0.1, (0.003,), 0),
        # near a centre of curvature |y - x|² loses its ρ² term; the flat panel's zeros left 3e-10
        (3, 2, [3, 146, 15], 0.15, (0.7,) * 7, 4),
    ],
)
def test_more_digits_are_there_where_they_are_asked_for(
    corners: int, order: int, seed: list[int], warp: float, heights: tuple, row: int
) -> None:
    rng = np.random.default_rng(seed)
    panel = a_curved_panel(corners, order, rng, warp)
    x = beside(panel, heights, rng)[row : row + 1]
    assert worst(x, panel, NU, tolerance=1e-11) <= 2e-10


@pytest.mark.parametrize(("corners", "seed", "row"), [(4, 3, 0), (3, 21, 1)])
def test_points_beside_a_side_have_their_foot_there(corners: int, seed: int, row: int) -> None:
    """Newton's way to the nearest point stopped in a corner, and where its step passed the side: T
    was off by 3e-2."""
    rng = np.random.default_rng(seed)
    panel = a_curved_panel(corners, 2, rng, 1e-4)
    x = beside(panel, (0.003, 0.03), rng)[row : row + 1]
    line = np.linspace(0.0 if corners == 3 else -1.0, 1.0, 201)
    local = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    local = local[local.sum(axis=1) <= 1.0 + 1e-12] if corners == 3 else local
    brute = np.linalg.norm(panel.at(local[None])[0][0] - x, axis=1).min()
    assert panel.nearest(x)[1][0] <= brute < 1.5 * panel.nearest(x)[1][0]
    assert worst(x, panel, NU) < 1e-8


@pytest.mark.parametrize("order", range(4))
def test_a_flat_panel_has_its_closed_form(order: int) -> None:
    """Off the panel, and at the nodes of a rectangle and a triangle: the principal value."""
    rng = np.random.default_rng(order)
    a, b = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    for corners in (
        np.array([0 * a, a, 0.3 * a + 0.8 * b]),
        np.array([0 * a, a, a + 0.7 * b, 0.7 * b]),
    ):
        middle = [corners.mean(axis=0)[None]] if len(corners) == 4 else []
        points = np.concatenate([corners, 0.5 * (corners + np.roll(corners, -1, axis=0)), *middle])
        curved, x, weight, _ = make_curved_panels(points[None], order, np.arange(1))
        flat, y, other = make_panels(corners[None], order, np.arange(1))
        np.testing.assert_allclose(x, y, atol=1e-14)
        np.testing.assert_allclose(weight, other, atol=1e-14)
        points = np.vstack([x[0], beside(curved, (0.01, 0.2, 2.0), rng)])
        for ours, exact in zip(
            integrals(points, curved, NU), integrals(points, flat, NU), strict=True
        ):
            assert np.all(
                np.abs(ours - exact).max(axis=(0, 1, 2))
                <= 2e-8 * np.abs(exact).max(axis=(0, 1, 2)) + 2e-9
            )
