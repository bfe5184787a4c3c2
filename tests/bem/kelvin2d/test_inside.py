"""Stress inside the body: textbook kernels by graded quadrature in extended precision, and exact
states."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_oracle import around, block_error, drawn, free, reference_stress
from marks import some

from petcontact.bem.kelvin2d.inside import field_inside

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
        ones = np.eye(2 * order + 2).reshape(order + 1, 2, -1)
        given = (0.0 * ones, ones), (ones, 0.0 * ones)
        for data, expected in zip(given, reference_stress(element, point, RATIO), strict=True):
            found = field_inside(free([point]), element.elements(), *data, RATIO, 1.0)[1]
            found = found.reshape(3, order + 1, 2).swapaxes(1, 2)
            assert block_error(found, expected) < tolerance
