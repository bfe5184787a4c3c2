"""Kernels over circular arcs: against graded quadrature in extended precision, identities on
circles, flat arcs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kernel_oracle import Element, block_error, free, nearest, reference, reference_self
from marks import slow

from petcontact.bem.kelvin2d.integrals import Elements, Targets, integrals
from petcontact.mesh.basis import gauss

ORDERS = range(6)
ANGLES = (1e-9, 0.05, 0.3, -0.8, 1.2, -1.55)  # half the angle of the arc, positive turns left
DISTANCES = (1e-8, 1e-5, 1e-3, 0.03, 0.2, 0.5, 0.8, 1.3, 2.0, 3.0, 5.0, 9.0, 40.0, 1e4, 1e8)
SOME = [
    (slow if order in (1, 3, 4) or k else pytest.param)(order, ANGLES[(order + k) % 6])
    for order in ORDERS
    for k in (0, 3)
]
RATIO, LENGTH = 0.3, 3.0


def arc(rng, order, angle):
    start, turn, size = rng.normal(size=2), rng.uniform(0, 2 * np.pi), 10.0 ** rng.uniform(-2, 1)
    return Element(
        start,
        start + size * np.array([np.cos(turn), np.sin(turn)]),
        2 * np.sin(angle) / size,
        order,
    ), size


def around(element, s, distance, turn):
    """The point at a distance from the point s of the arc, at an angle to the tangent there."""
    direction = complex(element.tangent_first * np.exp(1j * element.angle * (s + 1))) * np.exp(
        1j * turn
    )
    return element.at(s) + distance * np.array([direction.real, direction.imag])


def assert_as_reference(element, size, point, tolerance=1e-12):
    g, h = integrals(free(point[None]), element.elements(), RATIO, LENGTH)
    expected_g, expected_h = reference(element, point, RATIO, LENGTH)
    # The reference's distances have an absolute error of 1e-19 of the element.
    assert block_error(g[..., 0], expected_g) < tolerance
    assert (
        block_error(h[..., 0], expected_h) < tolerance + 1e-18 * size / nearest(element, point)[1]
    )


def circle(n, order, radius, *, hole=False, centre=(0.3, -0.2)):
    """A full circle of n arcs with its nodes and normals; as a hole it runs clockwise."""
    sign = -1.0 if hole else 1.0
    corner = sign * np.linspace(0, 2 * np.pi, n + 1)
    xi, _ = gauss(order)
    angle = (corner[:-1, None] + sign * np.pi / n * (1 + xi)).ravel()
    vertex = np.array(centre) + radius * np.stack([np.cos(corner), np.sin(corner)], axis=1)
    vertex[-1] = vertex[0]
    elements = Elements(
        vertex[:-1], vertex[1:], np.full(n, sign / radius), order, np.full(n, -1), np.arange(n)
    )
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    point = np.array(centre) + radius * direction
    targets = Targets(
        point, np.full(len(point), -1), np.repeat(np.arange(n), order + 1), np.tile(xi, n)
    )
    return elements, targets, sign * direction


# -- single integrals
# -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("order", "angle"), SOME)
def test_entries_off_the_arc(order, angle):
    rng = np.random.default_rng([order, ANGLES.index(angle)])
    for distance in DISTANCES:
        element, size = arc(rng, order, angle)
        s = rng.choice([-1.0, 1.0, rng.uniform(-1, 1)])
        point = around(element, s, distance * size, rng.choice([-1, 1]) * rng.uniform(1.0, 2.1))
        assert_as_reference(element, size, point)


@settings(max_examples=10, deadline=None)
@given(
    order=st.integers(0, 5),
    angle=st.floats(-1.5, 1.5),
    log_distance=st.floats(-3, 5),
    s=st.floats(-1, 1),
    turn=st.floats(-np.pi, np.pi),
)
def test_entries_anywhere(order, angle, log_distance, s, turn):
    angle = angle if abs(angle) > 1e-7 else 1e-7
    element = Element(np.array([0.3, -0.2]), np.array([1.1, 0.4]), 2 * np.sin(angle), order)
    point = around(element, s, 10.0**log_distance, turn)
    assume(nearest(element, point)[1] > 1e-7)
    assert_as_reference(element, 1.0, point)


@pytest.mark.parametrize(("order", "angle"), SOME)
def test_self_pairs(order, angle):
    element, _ = arc(np.random.default_rng(order), order, angle)
    xi, _ = gauss(order)
    nodes = order + 1
    points = np.array([element.at(s) for s in xi])
    targets = Targets(points, np.full(nodes, -1), np.zeros(nodes, int), xi)
    g, h = integrals(targets, element.elements(), RATIO, LENGTH)
    for k, s in enumerate(xi):
        expected_g, expected_h = reference_self(element, s, RATIO, LENGTH)
        assert block_error(g[..., k], expected_g) < 1e-13
        assert np.max(np.abs(h[..., k] - expected_h)) < 2e-13


@pytest.mark.parametrize("order", ORDERS)
def test_neighbours_on_one_circle(order):
    elements, targets, _ = circle(9, order, 2.0)
    g, h = integrals(targets, elements, RATIO, LENGTH)
    element = Element(elements.start[4], elements.end[4], 0.5, order)
    columns = slice(4 * (order + 1), 5 * (order + 1))
    for k in np.flatnonzero(np.isin(targets.element, [2, 3, 5, 8]))[::2]:
        expected_g, expected_h = reference(element, targets.point[k], RATIO, LENGTH)
        assert block_error(g[:, :, columns, k], expected_g) < 1e-13
        assert block_error(h[:, :, columns, k], expected_h) < 1e-12


def test_centre_of_the_circle():
    # Its preimage is at infinity.
    element = Element(np.array([2.0, 0.0]), 2 * np.array([np.cos(0.7), np.sin(0.7)]), 0.5, 3)
    assert_as_reference(element, 1.4, np.zeros(2), 1e-14)


# -- flat arcs
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ORDERS)
def test_arcs_become_straight(order):
    start, end = np.array([0.2, 0.1]), np.array([1.3, -0.7])
    points = np.array([[0.5, 0.5], [0.75, -0.28], [1.3, -0.69], [2.0, 3.0], [-40.0, 7.0]])

    def entries(curvature):
        element = Element(start, end, curvature, order)
        return integrals(free(points), element.elements(), RATIO, LENGTH)

    for name, left, right, straight in zip(
        "GH", entries(1e-7), entries(-1e-7), entries(0.0), strict=True
    ):
        scale = np.max(np.abs(straight))
        change = np.max(np.abs(left - straight))
        assert change < 1e-6 * scale  # first order in the curvature
        # H of a constant is the same along every way from start to end.
        assert change > 1e-9 * scale if name == "G" or order > 0 else change < 1e-14 * scale
        np.testing.assert_allclose(
            0.5 * (left + right), straight, rtol=0, atol=1e-13 * scale
        )  # second order


# -- identities
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0, 3])
def test_straight_and_curved_in_one_batch(order):
    # A stadium: half circles as two arcs each, straight sides between them.
    corner = [(-2, -1), (2, -1), (3, 0), (2, 1), (-2, 1), (-3, 0)]
    start, end = np.array(corner, float), np.roll(np.array(corner, float), -1, axis=0)
    curvature, line = np.array([0, 1, 1, 0, 1, 1.0]), np.array([0, -1, -1, 1, -1, -1])
    elements = Elements(start, end, curvature, order, line, np.arange(6))
    xi, _ = gauss(order)
    nodes = order + 1
    shapes = [Element(start[e], end[e], curvature[e], order) for e in range(6)]
    point = np.array([shape.at(s) for shape in shapes for s in xi])
    targets = Targets(point, np.repeat(line, nodes), np.repeat(np.arange(6), nodes), np.tile(xi, 6))
    whole = integrals(targets, elements, RATIO, LENGTH)
    for e in range(6):
        single = integrals(targets, elements.take(np.array([e])), RATIO, LENGTH)
        for part, expected in zip(single, whole, strict=True):
            np.testing.assert_allclose(
                part, expected[:, :, e * nodes : (e + 1) * nodes], rtol=0, atol=1e-14
            )
    n = len(point)
    h = whole[1].transpose(3, 0, 2, 1).reshape(2 * n, 2 * n) + 0.5 * np.eye(2 * n)
    assert np.max(np.abs(h @ np.tile([1.0, 0.0], n))) < 1e-13
