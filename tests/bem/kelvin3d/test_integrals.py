"""Kelvin's kernels over flat panels: quadrature on subdivided panels, rigid motion, the linear
patch, exact fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from panel_oracle import by_subdivision, kelvin
from random_panels import a_panel

from petcontact.bem.kelvin3d import integrals as module
from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.geometry.gmsh import read_msh
from petcontact.geometry.gmsh_surface import gmsh_surface
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh, facet_mesh
from petcontact.mesh.panels import Panels, make_panels

NU = 0.3


@pytest.mark.parametrize("corners", [3, slow(4)])
@pytest.mark.parametrize("order", range(4))
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_closed_form_and_gauss_points_against_subdivision(
    corners: int, order: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    panel = a_panel(corners, order, rng)
    places = [[*rng.uniform(-1.3, 1.3, 2), rng.choice([-h, h])] for h in (1e-6, 0.02, 0.5, 2.0)]
    for place in (*places, [1.2, 0.1, 0.0]):
        x = panel.centre[0] + np.array(place) @ panel.frame[0]
        for ours, exact in zip(
            integrals(x[None], panel, NU), by_subdivision(panel, x, NU, points=10), strict=True
        ):
            assert np.abs(ours[..., 0] - exact).max() <= 1e-9 * np.abs(exact).max()


def test_gauss_points_hold_their_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thin and square panels against the closed form, for targets at which that keeps its
    digits."""
    rng = np.random.default_rng(5)
    for height in (1.0, 0.2):
        corners = np.array([[[0, 0, 0], [1, 0, 0], [1, height, 0], [0, height, 0]]], dtype=float)
        panel = make_panels(corners, 1, np.arange(1))[0]
        x = panel.centre[0] + rng.normal(size=(300, 3))
        monkeypatch.setattr(module, "MOST_POINTS", {Panels: (-1,) * 4})
        exact = integrals(x, panel, NU)
        monkeypatch.setattr(module, "MOST_POINTS", {Panels: (256,) * 4})
        for tolerance in (1e-4, 1e-8):
            for ours, true in zip(integrals(x, panel, NU, tolerance=tolerance), exact, strict=True):
                error = np.abs(ours - true).max(axis=(0, 1, 2)) / np.abs(true).max(axis=(0, 1, 2))
                assert 0.0 < error.max() < 10.0 * tolerance


def test_own_panel_has_the_principal_value() -> None:
    """At a node ∫T is the mean of its values on both sides; for a constant on the panel they differ
    by 1."""
    panel, x, _ = make_panels(
        np.array([[[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]], dtype=float), 2, np.arange(1)
    )
    at = integrals(x[0], panel, NU)[1]
    beside = [
        integrals(x[0] + sign * 1e-7 * panel.frame[0, 2], panel, NU)[1] for sign in (1.0, -1.0)
    ]
    np.testing.assert_allclose(0.5 * (beside[0] + beside[1]), at, atol=1e-5)
    np.testing.assert_allclose((beside[0] - beside[1]).sum(axis=2)[0, 0], 1.0, atol=1e-6)


def boundary_operators(order: int, size: float, exponent: float) -> tuple:
    """Mesh of a 3×2×1 box, G (2µ) and ½ + H as matrices."""
    mesh = box_mesh(
        BoxSurface(np.zeros(3), np.array([3.0, 2.0, 1.0])), lambda part: size, order, exponent
    )
    kernel_g, kernel_h = np.empty((2, 3, 3, mesh.n_nodes, mesh.n_nodes))
    for batch in mesh.batches():
        g, h = integrals(mesh.targets(slice(None)), batch.elements, NU)
        kernel_g[:, :, batch.nodes], kernel_h[:, :, batch.nodes] = g, h
    n = 3 * mesh.n_nodes
    return (
        mesh,
        kernel_g.transpose(3, 0, 2, 1).reshape(n, n),
        kernel_h.transpose(3, 0, 2, 1).reshape(n, n) + 0.5 * np.eye(n),
    )


@pytest.mark.parametrize("order", [1, 2])
def test_linear_patch_on_quadrilaterals_and_triangles_from_a_file(order: int) -> None:
    """Nodes lie on the lines of other panels' edges here."""
    file = str(Path(__file__).parents[3] / "configs" / "space_bracket.msh")
    mesh = facet_mesh(gmsh_surface(read_msh(file), file), order)
    rng = np.random.default_rng(order)
    nodes = np.sort(rng.choice(mesh.n_nodes, 60, replace=False))
    strain = rng.normal(size=(3, 3))
    strain = strain + strain.T
    u = mesh.x @ strain
    t = mesh.normal @ (strain + NU / (1.0 - 2.0 * NU) * np.trace(strain) * np.eye(3))
    defect, moved = 0.5 * u[nodes], 0.5 * np.ones(len(nodes))
    for batch in mesh.batches():
        g, h = integrals(mesh.x[nodes], batch.elements, NU)
        defect += np.einsum("ijkm,kj->mi", h, u[batch.nodes]) - np.einsum(
            "ijkm,kj->mi", g, t[batch.nodes]
        )
        moved += h[0, 0].sum(axis=0)
    assert np.abs(defect).max() < 1e-10 * np.abs(u).max() and np.abs(moved).max() < 1e-10


@pytest.mark.parametrize("order", [1, 2, 3])
def test_rigid_motion_and_linear_patch(order: int) -> None:
    mesh, g, h = boundary_operators(order, 1.0, 1.4)
    rng = np.random.default_rng(order)
    assert np.abs(h @ np.tile(np.eye(3), (mesh.n_nodes, 1))).max() < 1e-10
    gradient = rng.normal(size=(3, 3))
    spin, strain = 0.5 * (gradient - gradient.T), 0.5 * (gradient + gradient.T)
    assert np.abs(h @ (mesh.x @ spin.T).ravel()).max() < 1e-10
    # over 2µ
    stress = strain + NU / (1.0 - 2.0 * NU) * np.trace(strain) * np.eye(3)
    assert (
        np.abs(h @ (mesh.x @ strain.T).ravel() - g @ (mesh.normal @ stress).ravel()).max() < 1e-10
    )


@pytest.mark.slow
def test_orders_of_convergence() -> None:
    """Displacement and traction of a point force outside of a box; prototype: 1.3/0.75, 2.2/1.0,
    2.9/2.1 for p = 0, 1, 2."""
    source, force = np.array([1.2, 0.7, 1.9]), np.array([0.3, -1.0, 0.8])
    least = {0: (1.0, 0.5), 1: (1.9, 0.8), 2: (2.5, 1.6)}

    def moved(x):
        return np.einsum("ijn,j->ni", kelvin(x - source, np.zeros(3), NU)[0], force)

    for order, sizes in {0: (0.5, 0.25), 1: (1.0, 0.5), 2: (1.0, 0.5)}.items():
        errors = []
        for size in sizes:
            mesh, g, h = boundary_operators(order, size, 1.0)
            u, step = moved(mesh.x), 1e-5
            slopes = [
                (moved(mesh.x + step * e) - moved(mesh.x - step * e)) / (2.0 * step)
                for e in np.eye(3)
            ]
            gradient = np.stack(slopes, axis=2)
            strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
            stress = strain + NU / (1.0 - 2.0 * NU) * np.trace(strain, axis1=1, axis2=2)[
                :, None, None
            ] * np.eye(3)
            t = np.einsum("nij,nj->ni", stress, mesh.normal)
            clamped = np.repeat(np.isin(mesh.node_part, [0, 4]), 3)
            rhs = g @ np.where(clamped, 0.0, t.ravel()) - h @ np.where(clamped, u.ravel(), 0.0)
            x = np.linalg.solve(np.where(clamped, -g, h), rhs)
            weight = np.repeat(mesh.weight, 3)
            errors.append(
                [
                    np.sqrt(weight[c] @ (x - e)[c] ** 2 / (weight[c] @ e[c] ** 2))
                    for c, e in ((~clamped, u.ravel()), (clamped, t.ravel()))
                ]
            )
        orders = np.log2(np.array(errors[0]) / errors[1])
        assert np.all(orders > least[order]), (order, orders, errors)
