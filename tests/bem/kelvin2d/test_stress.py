"""Stress inside the body: textbook kernels by graded quadrature in extended precision, and exact
states."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_oracle import around, block_error, drawn, outline, reference_stress
from marks import some

from petcontact.bem.kelvin2d.stress import stress_integrals

RATIO = 0.3


@pytest.mark.parametrize("order", some((0, 2, 5), range(6)))
@pytest.mark.parametrize("angle", [0.0, 1e-8, -0.7])
def test_kernels_of_the_stress(order, angle):
    rng = np.random.default_rng(order)
    for distance in (1e-5, 1e-3, 0.05, 0.3, 0.8, 1.4, 3.0, 6.1, 60.0, 1e4):
        element, size = drawn(rng, order, angle)
        turn = 0.5 * np.pi * rng.choice([-1, 1])
        point = around(element, rng.uniform(-1, 1), distance * size, turn)
        # rounding of the coordinates moves the point against the element
        tolerance = 1e-12 + 1e-15 * (size + np.max(np.abs(point))) / (distance * size)
        found = stress_integrals(point[None], element.elements(), RATIO)
        for part, expected in zip(found, reference_stress(element, point, RATIO), strict=True):
            assert block_error(part[..., 0], expected) < tolerance


@pytest.mark.parametrize("order", [1, 2, 5])
def test_constant_stress_up_to_the_boundary(order):
    """Rigid motions leave none."""
    elements, targets = outline([(0, 0), (6, 0), (5, 3), (0.6, 3)], np.linspace(0, 1, 6), order)
    chord, x = elements.end - elements.start, targets.point
    normal = np.stack([chord[:, 1], -chord[:, 0]], axis=1) / np.hypot(*chord.T)[:, None]
    normal = np.repeat(normal, order + 1, axis=0)
    stress = np.array([[1.0, 0.4], [0.4, -0.5]])
    twice_mu_u = x @ (stress - RATIO * np.trace(stress) * np.eye(2))
    points = np.array([[3.0, 1.5], [2.0, 0.1], [2.31, 1e-3], [4.5, 2.99], [0.65, 2.9]])
    d, s = stress_integrals(points, elements, RATIO)
    found = np.einsum("ijbm,bj->im", d, normal @ stress) + np.einsum("ijbm,bj->im", s, twice_mu_u)
    np.testing.assert_allclose(found, np.array([[1.0], [-0.5], [0.4]]) * np.ones(5), atol=1e-10)
    rigid = np.stack([1.0 - x[:, 1], 2.0 + x[:, 0]], axis=1)
    np.testing.assert_allclose(np.einsum("ijbm,bj->im", s, rigid), 0.0, atol=1e-9)


def test_mixed_elements_and_no_points():
    elements, _ = outline([(0, 0), (1, 0), (1, 1), (0, 1)], [0.0, 1.0], 2, [0, 1, 0, 0])
    points = np.array([[0.4, 0.5], [0.9, 0.05]])
    whole = stress_integrals(points, elements, RATIO)
    for e in range(4):
        single = stress_integrals(points, elements.take(np.array([e])), RATIO)
        for part, all_ in zip(single, whole, strict=True):
            expected = all_[:, :, 3 * e : 3 * e + 3]
            np.testing.assert_allclose(part, expected, rtol=1e-13, atol=1e-13)
    assert stress_integrals(np.empty((0, 2)), elements, RATIO)[0].shape == (3, 2, 12, 0)
