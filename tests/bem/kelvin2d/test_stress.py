"""Stress inside the body: textbook kernels by graded quadrature in extended precision, and exact
states."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kernel_oracle import Element, block_error, nearest, reference_stress
from marks import some

from petcontact.bem.kelvin2d.integrals import Elements
from petcontact.bem.kelvin2d.stress import stress_integrals
from petcontact.mesh.basis import gauss

RATIO = 0.3


def assert_as_reference(element, point, distance, size):
    d, s = stress_integrals(point[None], element.elements(), RATIO)
    expected_d, expected_s = reference_stress(element, point, RATIO)
    # Rounding of the coordinates moves the point against the element.
    tolerance = 1e-12 + 1e-15 * (size + np.max(np.abs(point))) / distance
    assert block_error(d[..., 0], expected_d) < tolerance
    assert block_error(s[..., 0], expected_s) < tolerance


@pytest.mark.parametrize("order", some((0, 2, 5), range(6)))
@pytest.mark.parametrize("angle", [0.0, 1e-8, -0.7])
def test_kernels_of_the_stress(order, angle):
    rng = np.random.default_rng(order)
    for distance in (1e-5, 1e-3, 0.05, 0.3, 0.8, 1.4, 3.0, 6.1, 60.0, 1e4):
        start = rng.normal(size=2)
        turn = rng.uniform(0, 2 * np.pi)
        size = 10.0 ** rng.uniform(-2, 1)
        end = start + size * np.array([np.cos(turn), np.sin(turn)])
        element = Element(start, end, 2 * np.sin(angle) / size, order)
        s = rng.uniform(-1, 1)
        tangent = complex(element.tangent_first * np.exp(1j * element.angle * (s + 1)))
        step = 1j * tangent * rng.choice([-1, 1]) * distance * size
        assert_as_reference(
            element, element.at(s) + np.array([step.real, step.imag]), distance * size, size
        )


@settings(max_examples=6, deadline=None)
@given(
    order=st.integers(0, 5), x=st.floats(-3, 4), y=st.floats(-3, 3), curvature=st.floats(-1.9, 1.9)
)
def test_kernels_of_the_stress_anywhere(order, x, y, curvature):
    curvature = curvature if abs(curvature) > 1e-6 else 0.0
    element = Element(np.array([0.0, 0.0]), np.array([1.0, 0.2]), curvature, order)
    distance = nearest(element, (x, y))[1]
    assume(distance > 1e-3)
    assert_as_reference(element, np.array([x, y]), distance, 1.0)


@pytest.mark.parametrize("order", [1, 2, 5])
def test_constant_stress_up_to_the_boundary(order):
    corner = np.array([(0, 0), (6, 0), (5, 3), (0.6, 3)], float)
    t = np.linspace(0, 1, 6)
    sides = [
        a + t[:, None] * (b - a) for a, b in zip(corner, np.roll(corner, -1, axis=0), strict=True)
    ]
    start, end = np.concatenate([s[:-1] for s in sides]), np.concatenate([s[1:] for s in sides])
    n = len(start)
    elements = Elements(start, end, np.zeros(n), order, np.repeat(np.arange(4), 5), np.arange(n))
    xi, _ = gauss(order)
    x = (0.5 * (start[:, None] * (1 - xi)[:, None] + end[:, None] * (1 + xi)[:, None])).reshape(
        -1, 2
    )
    chord = end - start
    normal = np.repeat(
        np.stack([chord[:, 1], -chord[:, 0]], axis=1) / np.hypot(*chord.T)[:, None],
        order + 1,
        axis=0,
    )
    stress = np.array([[1.0, 0.4], [0.4, -0.5]])
    twice_mu_u = x @ (stress - RATIO * np.trace(stress) * np.eye(2))
    points = np.array([[3.0, 1.5], [2.0, 0.1], [2.31, 1e-3], [4.5, 2.99], [0.65, 2.9]])
    d, s = stress_integrals(points, elements, RATIO)
    found = np.einsum("ijbm,bj->im", d, normal @ stress) + np.einsum("ijbm,bj->im", s, twice_mu_u)
    np.testing.assert_allclose(found, np.array([[1.0], [-0.5], [0.4]]) * np.ones(5), atol=1e-10)
    # Rigid motions leave no stress.
    rigid = np.stack([1.0 - x[:, 1], 2.0 + x[:, 0]], axis=1)
    np.testing.assert_allclose(np.einsum("ijbm,bj->im", s, rigid), 0.0, atol=1e-9)


def test_mixed_elements_and_no_points():
    start, end = np.array([[0.0, 0], [1, 0], [1, 1]]), np.array([[1.0, 0], [1, 1], [0, 1]])
    elements = Elements(start, end, np.array([0, 1.0, 0]), 2, np.array([0, -1, 1]), np.arange(3))
    points = np.array([[0.4, 0.5], [0.9, 0.05]])
    whole = stress_integrals(points, elements, RATIO)
    for e in range(3):
        for part, expected in zip(
            stress_integrals(points, elements.take(np.array([e])), RATIO), whole, strict=True
        ):
            np.testing.assert_allclose(
                part, expected[:, :, 3 * e : 3 * e + 3], rtol=1e-13, atol=1e-13
            )
    assert stress_integrals(np.empty((0, 2)), elements, RATIO)[0].shape == (3, 2, 9, 0)
