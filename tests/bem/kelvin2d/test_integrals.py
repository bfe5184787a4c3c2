"""Kernels over straight elements: against graded quadrature in extended precision at all distances,
and identities."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_oracle import (
    Element,
    basis,
    block_error,
    free,
    kelvin,
    nearest,
    reference,
    reference_self,
)

from petcontact.bem.kelvin2d.integrals import Elements, Targets, integrals
from petcontact.mesh.basis import gauss

ORDERS = range(6)
DISTANCES = (
    1e-8,
    1e-6,
    1e-4,
    1e-2,
    0.1,
    0.3,
    0.7,
    1.0,
    1.5,
    2.2,
    4.0,
    5.4,
    6.1,
    9.0,
    30.0,
    1e3,
    1e5,
    1e8,
)
RATIO, LENGTH = 0.3, 3.0
ARBITRARY = st.floats(-1.0, 1.0)


def outline(vertices, counts, order, *, ratio=None):
    """Elements of a polygon and their nodes as targets; `ratio` grades every side towards both
    ends."""
    start, end, line = [], [], []
    for k, corner in enumerate(vertices):
        corner = np.array(corner, float)
        following = np.array(vertices[(k + 1) % len(vertices)], float)
        t = np.linspace(0, 1, counts + 1)
        if ratio is not None:
            half = np.concatenate([[0.0], ratio ** np.arange(counts, 0, -1.0) / 2])
            t = np.concatenate([half, [0.5], 1 - half[::-1]])
        points = corner + t[:, None] * (following - corner)
        points[-1] = following
        start.append(points[:-1]), end.append(points[1:]), line.append(np.full(len(t) - 1, k))
    start, end, line = np.concatenate(start), np.concatenate(end), np.concatenate(line)
    n = len(start)
    elements = Elements(start, end, np.zeros(n), order, line, np.arange(n))
    return elements, nodes_of(elements)


def nodes_of(elements):
    """The collocation nodes of straight elements as targets."""
    xi, _ = gauss(elements.order)
    n, nodes = len(elements.index), len(xi)
    point = 0.5 * (
        elements.start[:, None] * (1 - xi)[:, None] + elements.end[:, None] * (1 + xi)[:, None]
    )
    return Targets(
        point.reshape(-1, 2),
        np.repeat(elements.line, nodes),
        np.repeat(elements.index, nodes),
        np.tile(xi, n),
    )


def normals(elements):
    """Outward normals at the nodes."""
    chord = elements.end - elements.start
    normal = np.stack([chord[:, 1], -chord[:, 0]], axis=1) / np.hypot(*chord.T)[:, None]
    return np.repeat(normal, elements.order + 1, axis=0)


def matrices(elements, targets, **kwargs):
    """½I + H and G as matrices over nodes, component fastest."""
    g, h = integrals(targets, elements, RATIO, 10.0, **kwargs)
    n = len(targets.line)
    flat = [k.transpose(3, 0, 2, 1).reshape(2 * n, -1) for k in (g, h)]
    return flat[1] + 0.5 * np.eye(2 * n), flat[0]


def random_element(rng, order):
    start, angle, size = rng.normal(size=2), rng.uniform(0, 2 * np.pi), 10.0 ** rng.uniform(-2, 1)
    return Element(start, start + size * np.array([np.cos(angle), np.sin(angle)]), 0.0, order), size


def assert_as_reference(element, size, points, tolerance=1e-12):
    g, h = integrals(free(points), element.elements(), RATIO, LENGTH)
    for k, point in enumerate(points):
        expected_g, expected_h = reference(element, point, RATIO, LENGTH)
        # What the reference itself loses: its distances have an absolute error of 1e-19 of the
        # element.
        lost = 1e-18 * size / nearest(element, point)[1]
        assert block_error(g[..., k], expected_g) < tolerance
        assert block_error(h[..., k], expected_h) < tolerance + lost


# -- single integrals
# -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("order", "distance"),
    [(order, distance) for order in ORDERS for distance in DISTANCES[order % 3 :: 3]],
)
def test_entries_off_the_element(order, distance):
    """A third of the distances for each order, all of them for any three."""
    rng = np.random.default_rng([order, DISTANCES.index(distance)])
    element, size = random_element(rng, order)
    along = np.array([-1.0, 1.0, rng.uniform(-1, 1)])
    angle = rng.uniform(0.2, 2.9, 3) * rng.choice([-1, 1], 3)
    tangent = (element.end - element.start) / size
    normal = np.array([-tangent[1], tangent[0]])
    step = distance * size * (np.cos(angle)[:, None] * tangent + np.sin(angle)[:, None] * normal)
    anchor = np.array([element.start, element.end, element.at(along[2])])
    assert_as_reference(element, size, anchor + step)


@settings(max_examples=10, deadline=None)
@given(
    order=st.integers(0, 5),
    log_distance=st.floats(-3, 6),
    along=ARBITRARY,
    angle=st.floats(0.01, 3.13),
    turn=ARBITRARY,
)
def test_entries_anywhere(order, log_distance, along, angle, turn):
    direction = np.exp(1j * np.pi * turn)
    element = Element(
        np.array([0.3, -0.2]), np.array([0.3, -0.2]) + 1.7 * _pair(direction), 0.0, order
    )
    point = element.at(along) + 1.7 * 10.0**log_distance * _pair(direction * np.exp(1j * angle))
    assert_as_reference(element, 1.7, point[None])


def _pair(z):
    return np.array([z.real, z.imag])


@pytest.mark.parametrize("order", ORDERS)
def test_self_pairs(order):
    element, _ = random_element(np.random.default_rng(order), order)
    xi, _ = gauss(order)
    nodes = order + 1
    targets = Targets(
        np.array([element.at(s) for s in xi]), np.full(nodes, 4), np.zeros(nodes, int), xi
    )
    g, h = integrals(targets, element.elements(line=4), RATIO, LENGTH)
    for k, s in enumerate(xi):
        expected_g, expected_h = reference_self(element, s, RATIO, LENGTH)
        assert block_error(g[..., k], expected_g) < 1e-13
        assert np.max(np.abs(h[..., k] - expected_h)) < 1e-13
    assert np.all(h[0, 0] == 0) and np.all(h[1, 1] == 0)
    # The node's coordinate on its own element counts, not its rounded position.
    moved = Targets(targets.point + 1e-9, targets.line, targets.element, xi)
    for now, before in zip(
        integrals(moved, element.elements(line=4), RATIO, LENGTH), (g, h), strict=True
    ):
        np.testing.assert_array_equal(now, before)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("s", [-0.99, 0.45])
def test_points_told_to_lie_on_the_line(order, s):
    element, _ = random_element(np.random.default_rng(order), order)
    none = np.array([-1])
    targets = Targets(element.at(s)[None], np.array([4]), none, np.zeros(1))
    _, h = integrals(targets, element.elements(line=4), RATIO, LENGTH)
    assert np.all(h[0, 0] == 0) and np.all(h[1, 1] == 0)
    if abs(s) < 1:
        _, expected = reference_self(element, s, RATIO, LENGTH)
        assert np.max(np.abs(h[..., 0] - expected)) < 1e-12


def test_a_node_off_the_middle_of_a_constant_element():
    element, _ = random_element(np.random.default_rng(1), 0)
    targets = Targets(element.at(0.6)[None], np.array([4]), np.zeros(1, int), np.array([0.6]))
    found = integrals(targets, element.elements(line=4), RATIO, LENGTH)
    for ours, expected in zip(found, reference_self(element, 0.6, RATIO, LENGTH), strict=True):
        assert np.max(np.abs(ours[..., 0] - expected)) < 1e-13


@pytest.mark.slow
def test_oracle_agrees_with_scipy():
    element = Element(np.array([0.1, 0.2]), np.array([1.4, -0.3]), 0.0, 2)
    point = np.array([0.8, 0.05])
    expected = reference(element, point, RATIO, LENGTH)

    def integrand(s, kind, i, j, b):
        r, tangent = element.vector(complex(*point), np.array([s + 1]), np.array([s - 1]))
        return float(
            (
                kelvin(r, tangent, RATIO, LENGTH)[kind][i, j]
                * basis(2, np.array([s]))[b]
                * element.half
            )[0]
        )

    centre = float(nearest(element, point)[0])
    for kind in (0, 1):
        for i, j, b in np.ndindex(2, 2, 3):
            value, _ = scipy.integrate.quad(
                integrand,
                -1,
                1,
                args=(kind, i, j, b),
                points=[centre],
                epsabs=1e-13,
                epsrel=1e-12,
                limit=200,
            )
            assert abs(value - expected[kind][i, j, b]) < 1e-11


@pytest.mark.parametrize("order", ORDERS)
def test_collinear_neighbours(order):
    # A slanted line of elements of unlike size: nothing but the rotation is left of H, and that
    # exactly.
    knots = np.array([0.0, 1.0, 1.5, 1.501, 9.0])
    direction = np.array([0.6, 0.8])
    elements = Elements(
        knots[:-1, None] * direction,
        knots[1:, None] * direction,
        np.zeros(4),
        order,
        np.full(4, 7),
        np.arange(4),
    )
    targets = nodes_of(elements)
    g, h = integrals(targets, elements, RATIO, LENGTH)
    assert np.all(h[0, 0] == 0) and np.all(h[1, 1] == 0)
    scale = np.max(np.abs(h))
    np.testing.assert_allclose(h[0, 1], -h[1, 0], rtol=0, atol=1e-15 * scale)
    place = 0
    for e in range(4):
        element = Element(elements.start[e], elements.end[e], 0.0, order)
        columns = slice(e * (order + 1), (e + 1) * (order + 1))
        for k in np.flatnonzero(targets.element != e)[:: order + 1]:
            expected_g, expected_h = reference(element, targets.point[k], RATIO, LENGTH)
            assert block_error(g[:, :, columns, k], expected_g) < 1e-12
            # Rounded nodes lie off the line; the reference sees that, the kernels are told that
            # they are on it.
            assert block_error(h[:, :, columns, k], expected_h) < 1e-11
            place += 1
    assert place > 0


def test_entries_that_vanish_are_zero_on_axis_parallel_sides():
    elements, targets = outline([(0, 0), (3, 0), (3, 1), (0, 1)], 5, 0)
    g, h = integrals(targets, elements, RATIO, LENGTH)
    same = elements.line[:, None] == targets.line
    assert same.any()
    assert np.all(g[0, 1][same] == 0) and np.all(g[1, 0][same] == 0)
    assert np.all(h[0, 0][same] == 0) and np.all(h[1, 1][same] == 0)


# -- identities
# --------------------------------------------------------------------------------------------------

SHAPES = {
    "triangle": ([(0, 0), (2, 0.1), (0.3, 1.7)], 1),
    "quadrilateral": ([(0, 0), (6, 0), (5, 3), (0.6, 3)], 9),
    "notched": ([(0, 0), (4, 0), (4, 3), (2.02, 3), (2, 0.5), (1.98, 3), (0, 3)], 4),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("order", ORDERS)
def test_rigid_motion_and_constant_stress(shape, order):
    elements, targets = outline(*SHAPES[shape], order)
    h, g = matrices(elements, targets)
    x, normal = targets.point, normals(elements)
    n = len(x)
    for translation in ([1.0, 0.0], [0.0, 1.0]):
        assert np.max(np.abs(h @ np.tile(translation, n))) < 1e-12
    if order == 0:
        return  # constant elements hold neither rotations nor linear displacements
    assert np.max(np.abs(h @ np.stack([-x[:, 1], x[:, 0]], axis=1).ravel())) < 1e-12
    for sxx, syy, sxy in np.eye(3):
        strain = np.array(
            [[(1 - RATIO) * sxx - RATIO * syy, sxy], [sxy, (1 - RATIO) * syy - RATIO * sxx]]
        )  # 2µ ε
        traction = normal @ np.array([[sxx, sxy], [sxy, syy]])
        assert np.max(np.abs(h @ (x @ strain).ravel() - g @ traction.ravel())) < 1e-12


def test_rigid_motion_on_strongly_graded_sides():
    # The smallest elements are 1e-8 of a side: what is left is the rounding of their nodes'
    # coordinates.
    elements, targets = outline([(0, 0), (1, 0), (1, 1), (0, 1)], 18, 3, ratio=0.36)
    h, _ = matrices(elements, targets)
    at_origin = np.repeat(np.hypot(*targets.point.T) < 0.4, 2)
    error = np.abs(h @ np.tile([1.0, 0.0], len(targets.line)))
    assert np.max(error[at_origin]) < 1e-12
    assert np.max(error) < 1e-6


# -- batches
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0, 2])
def test_no_targets_and_no_elements(order):
    elements, targets = outline([(0, 0), (2, 0.1), (0.3, 1.7)], 3, order)
    g, h = integrals(targets, elements, RATIO, LENGTH)
    assert integrals(free(np.empty((0, 2))), elements, RATIO, LENGTH)[0].shape == (
        2,
        2,
        9 * (order + 1),
        0,
    )
    assert integrals(targets, elements.take(np.arange(0)), RATIO, LENGTH)[1].shape == (
        2,
        2,
        0,
        9 * (order + 1),
    )
    assert g.flags.c_contiguous and h.flags.c_contiguous


# -- quadrature
# --------------------------------------------------------------------------------------------------


def test_negative_order():
    with pytest.raises(ValueError, match="order -1"):
        gauss(-1)
