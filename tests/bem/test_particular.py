"""Particular solutions: Navier's equations by differences of what they give, linear heat, fits and their error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from petcontact import Box, Material, MeshOptions, Problem, Rectangle, SideBySide, Traction
from petcontact.bem.particular.fit import fitted, points_in
from petcontact.bem.particular.polynomials import degrees, inverse_laplacian, laplacian, padded, values
from petcontact.bem.particular.solution import particular_solution
from petcontact.refinement.meshes import mesh_of

PLANES = [(2, "strain"), (2, "stress"), (3, "strain")]


def random(rng, d, degree):
    p = rng.normal(size=(degree + 1,) * d)
    return np.where(degrees(p) <= degree, p, 0.0)


def steel(plane):
    return Material(200.0, 0.3, plane, thermal_expansion=1e-2)


@settings(max_examples=25, deadline=None)
@given(d=st.integers(2, 3), degree=st.integers(0, 9), seed=st.integers(0, 10**6))
def test_the_laplacian_of_the_inverse_is_what_it_was(d, degree, seed):
    p = padded(random(np.random.default_rng(seed), d, degree), degree + 3)
    assert np.abs(laplacian(inverse_laplacian(p)) - p).max() < 1e-13 * np.abs(p).max()


@pytest.mark.parametrize(("d", "plane"), PLANES)
@pytest.mark.parametrize("degree", [0, 1, 5])
def test_stress_is_hookes_of_u_and_balances_the_force(d, plane, degree):
    rng, material, centre, length = np.random.default_rng(degree), steel(plane), np.full(d, 0.3), 2.0
    force, heat = [random(rng, d, degree) for _ in range(d)], random(rng, d, degree)
    found = particular_solution(force, heat, material, centre, length)
    x, step = centre + 0.5 * rng.uniform(-1.0, 1.0, (20, d)), 1e-3

    def slope(function, j):
        # fourth order
        at = [function(x + k * step * np.eye(d)[j]) for k in (-2, -1, 1, 2)]
        return (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * step)

    gradient = np.stack([slope(found.displacement, j) for j in range(d)], axis=2)
    mu, nu = material.shear_modulus, material.plane_strain_ratio
    xi = (x - centre) / length
    even = 2.0 * mu * nu / (1.0 - 2.0 * nu) * np.trace(gradient, axis1=1, axis2=2) - found.thermal_stress(x)
    stress = mu * (gradient + gradient.transpose(0, 2, 1)) + even[:, None, None] * np.eye(d)
    size = np.abs(found.stress(x)).max()
    assert np.abs(found.stress(x) - stress).max() < 1e-8 * size
    b = np.stack([values(component, xi) for component in force], axis=1)
    assert np.abs(sum(slope(found.stress, j)[:, :, j] for j in range(d)) + b).max() < 1e-8 * (np.abs(b).max() + size)


def test_what_a_heated_bar_without_room_feels_is_e_alpha_over_its_constants():
    assert steel("strain").thermal_stress == pytest.approx(200.0 * 1e-2 / 0.4)
    assert steel("stress").thermal_stress == pytest.approx(200.0 * 1e-2 / 0.7)


@pytest.mark.parametrize(("d", "plane"), PLANES)
def test_temperatures_that_leave_a_free_body_without_stress_give_none(d, plane):
    rng, material = np.random.default_rng(1), steel(plane)
    heats = [random(rng, d, 1)]
    if d == 2:
        p = padded(random(rng, 2, 7), 10)
        heats.append((p - inverse_laplacian(laplacian(p)))[:8, :8])
    x = rng.uniform(-1.0, 1.0, (50, d))
    for heat in heats:
        found = particular_solution([np.zeros((1,) * d)] * d, heat, material, np.zeros(d), 1.0)
        assert np.abs(found.stress(x)).max() < 1e-13 * np.abs(found.thermal_stress(x)).max()
        assert np.abs(found.displacement(x)).max() > 1e-3 * np.abs(values(heat, x)).max() * material.thermal_expansion


RING = SideBySide(loops=[{"part": "o", "center": (0, 0), "radius": 2.0}, {"part": "i", "center": (0, 0), "radius": 1.0}])


def meshed(geometry, size):
    boundary = geometry.outline()
    free = [Traction(part, (0.0,) * boundary.dim) for part in boundary.parts]
    mesh = MeshOptions(element_size=size, order=2)
    return mesh_of(Problem(material=steel("strain"), geometry=geometry, mesh=mesh, boundary=free), boundary)


@pytest.mark.parametrize(
    ("geometry", "function", "largest"),
    [
        (Rectangle((0, 0), (2, 1)), lambda x: 3.0 - x[:, 0] + x[:, 1] ** 3, 1e-13),
        (Rectangle((0, 0), (2, 1)), lambda x: np.exp(5.0 * x[:, 0]), 1e-12),
        (Rectangle((1e4, 0), (1e4 + 20, 1)), lambda x: np.exp((x[:, 0] - 1e4) / 20) * np.cos(x[:, 1]), 1e-12),
        (RING, lambda x: np.log(np.hypot(*x.T)), 3e-2),
        (Box((0, 0, 0), (1, 1, 1)), lambda x: np.exp(x[:, 0]) * x[:, 2], 1e-12),
    ],
)
def test_a_fit_misses_as_much_as_it_says(geometry, function, largest):
    mesh = meshed(geometry, 0.25)
    low, high = mesh.x.min(axis=0), mesh.x.max(axis=0)
    centre, length = 0.5 * (low + high), 0.5 * (high - low).max()
    p, missed = fitted(function, points_in(mesh), centre, length)
    assert missed < largest
    x = np.random.default_rng(0).uniform(low, high, (4000, mesh.dim))
    x = x[np.hypot(*x.T) > 1.0] if geometry is RING else x
    x = x[np.hypot(*x.T) < 2.0] if geometry is RING else x
    defect = np.abs(values(p, (x - centre) / length) - function(x)).max() / np.abs(function(mesh.x)).max()
    assert defect < 3.0 * missed + 1e-13


def test_what_only_huge_terms_follow_is_missed():
    """A steep step of temperature: terms of degree 24 that cancel one another gave 1e5 times the stress."""
    mesh = meshed(Rectangle((0, 0), (2, 1)), 0.25)
    p, missed = fitted(lambda x: np.tanh(5.0 * (x[:, 0] - 1.0)), points_in(mesh), np.array([1.0, 0.5]), 1.0)
    assert np.abs(p).sum() < 1e3 and 0.05 < missed < 0.5


def test_a_jump_is_missed_and_points_lie_in_the_body():
    mesh = meshed(RING, 0.25)
    points = points_in(mesh)
    r = np.hypot(*points.T)
    assert r.min() > 0.9 and r.max() < 2.1 and len(points) > 800
    assert 0.1 < fitted(lambda x: 1.0 * (x[:, 0] > 0.1), points, np.zeros(2), 2.0)[1] < 1.0
