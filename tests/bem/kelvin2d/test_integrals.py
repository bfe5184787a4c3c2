"""Kernels over straight elements and circular arcs: against graded quadrature in extended precision
at all distances, and identities."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_oracle import (
    Element,
    around,
    block_error,
    drawn,
    free,
    nearest,
    nodes_of,
    reference,
    reference_self,
)
from marks import slow

from petcontact.bem.kelvin2d.integrals import Elements, Targets, integrals
from petcontact.mesh.basis import gauss

ORDERS = range(6)
NEAR = (1e-8, 1e-6, 1e-4, 0.01, 0.1, 0.3, 0.7, 1.0)
FAR = (1.5, 2.2, 4.0, 5.4, 6.1, 9.0, 30.0, 1e3, 1e8)
ROUND = (1e-8, 1e-5, 1e-3, 0.03, 0.2, 0.5, 0.8, 1.3, 2.0, 3.0, 5.0, 9.0, 40.0, 1e4, 1e8)
"""Distances in lengths of the element: rules change between them."""
ANGLES = (1e-9, 0.05, 0.3, -0.8, 1.2, -1.55)
"""Half the angle of an arc, positive turns left."""
KINDS = [(order, 0.0) for order in ORDERS] + [
    (slow if order in (1, 3, 4) or k else pytest.param)(order, ANGLES[(order + k) % 6])
    for order in ORDERS
    for k in (0, 3)
]
RATIO, LENGTH = 0.3, 3.0


def assert_as_reference(element, size, point, tolerance=1e-12):
    g, h = integrals(free(point[None]), element.elements(), RATIO, LENGTH)
    expected_g, expected_h = reference(element, point, RATIO, LENGTH)
    # the reference's distances have an absolute error of 1e-19 of the element
    lost = 1e-18 * size / nearest(element, point)[1]
    assert block_error(g[..., 0], expected_g) < tolerance
    assert block_error(h[..., 0], expected_h) < tolerance + lost


@pytest.mark.parametrize(("order", "angle"), KINDS)
def test_entries_off_the_element(order, angle):
    """At all distances, beside either end or anywhere along the element."""
    rng = np.random.default_rng([order, round(1e9 * abs(angle))])
    for distance in ROUND if angle else NEAR + FAR:
        element, size = drawn(rng, order, angle)
        s = rng.choice([-1.0, 1.0, rng.uniform(-1, 1)])
        turn = rng.choice([-1, 1]) * rng.uniform(*((1.0, 2.1) if angle else (0.2, 2.9)))
        assert_as_reference(element, size, around(element, s, distance * size, turn))


@pytest.mark.parametrize(("order", "angle"), KINDS)
def test_self_pairs(order, angle):
    """The node's coordinate on its own element counts, not its rounded position; so it does of a
    point that is said to lie on the line of the element."""
    element, _ = drawn(np.random.default_rng(order), order, angle)
    line = -1 if angle else 4
    xi = np.append(gauss(order)[0], 0.6)
    own = np.append(np.zeros(order + 1, int), 0 if angle or order == 0 else -1)
    points = np.array([element.at(s) for s in xi]) + np.where(own < 0, 0.0, 1e-9)[:, None]
    targets = Targets(points, np.full(order + 2, line), own, np.where(own < 0, 0.0, xi))
    g, h = integrals(targets, element.elements(line=line), RATIO, LENGTH)
    for k, s in enumerate(xi):
        expected_g, expected_h = reference_self(element, s, RATIO, LENGTH)
        exact = own[k] == 0
        assert not exact or block_error(g[..., k], expected_g) < 1e-13
        assert np.max(np.abs(h[..., k] - expected_h)) < (2e-13 if exact else 1e-12)
    assert angle or (np.all(h[0, 0] == 0) and np.all(h[1, 1] == 0))


@pytest.mark.parametrize("order", ORDERS)
def test_collinear_neighbours(order):
    """A slanted line of elements of unlike size: nothing but the rotation is left of H, and that
    exactly."""
    knots, direction = np.array([0.0, 1.0, 1.5, 1.501, 9.0]), np.array([0.6, 0.8])
    start, end = knots[:-1, None] * direction, knots[1:, None] * direction
    elements = Elements(start, end, np.zeros(4), order, np.full(4, 7), np.arange(4))
    shapes = [Element(start[e], end[e], 0.0, order) for e in range(4)]
    targets = nodes_of(elements, shapes)
    g, h = integrals(targets, elements, RATIO, LENGTH)
    assert np.all(h[0, 0] == 0) and np.all(h[1, 1] == 0)
    np.testing.assert_allclose(h[0, 1], -h[1, 0], rtol=0, atol=1e-15 * np.max(np.abs(h)))
    for e, element in enumerate(shapes):
        columns = slice(e * (order + 1), (e + 1) * (order + 1))
        for k in np.flatnonzero(targets.element != e)[:: order + 1]:
            expected_g, expected_h = reference(element, targets.point[k], RATIO, LENGTH)
            assert block_error(g[:, :, columns, k], expected_g) < 1e-12
            # rounded nodes lie off the line; the reference sees that, the kernels are given the line
            assert block_error(h[:, :, columns, k], expected_h) < 1e-11


def test_centre_of_the_circle():
    """Its preimage is at infinity."""
    element = Element(np.array([2.0, 0.0]), 2 * np.array([np.cos(0.7), np.sin(0.7)]), 0.5, 3)
    assert_as_reference(element, 1.4, np.zeros(2), 1e-14)
