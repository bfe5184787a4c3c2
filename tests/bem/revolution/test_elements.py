"""Kernels of rings over single elements: against brute force round the ring and along the element, at
all distances."""

from __future__ import annotations

import numpy as np
import pytest
from marks import some
from ring_oracle import Arc

from petcontact.bem.revolution.kernel import TwistedRingKernel
from petcontact.mesh.basis import gauss
from petcontact.mesh.elements import Elements, Targets
from petcontact.model.problem import Material

NU, UNIT = 0.3, 1.7
MATERIAL = Material(young_modulus=2.0 * (1.0 + NU), poisson_ratio=NU)
ELEMENTS = {
    "slope": Arc((0.7, -0.2), 0.6, 0.8, 0.0),
    "hollow": Arc((0.4, 0.0), 1.2, 0.7, -2.0),
    "from the axis": Arc((0.0, 0.3), 0.0, 1.1, 0.0),
    "cap": Arc((0.0, -1.0), 0.0, 0.9, 1.0),
    "shaft": Arc((0.05, 0.0), 0.5 * np.pi, 1.0, 0.0),
}
PLACES = [(0.3, 1e-6), (-0.6, -1e-6), (0.9, 1e-3), (-1.2, 0.03), (0.1, 0.1), (1.5, 0.3), (0.0, 2.0)]


def kernel(tolerance=None):
    return TwistedRingKernel(MATERIAL, UNIT, tolerance)


def elements_of(arc, order):
    bent = np.array([arc.curvature])
    line = np.where(bent == 0.0, 0, -1)
    return Elements(arc.start[None], arc.end[None], bent, order, line, np.array([3]))


def targets_at(points):
    nowhere = np.full(len(points), -1)
    return Targets(np.array(points), nowhere, nowhere, np.zeros(len(points)))


def places(arc):
    """Places beside an element whose points are not behind the axis."""
    return [(s, h * arc.half) for s, h in PLACES if arc.beside(s, h * arc.half)[0] >= 0.0]


def in_units(expected):
    """U and T as G and H, D and S as `stress_integrals`."""
    return [part * unit for part, unit in zip(expected, (1.0 / UNIT, 1.0, 1.0, UNIT), strict=False)]


def error(found, expected, least=1.0):
    """The largest, relative to the largest entry, or to `least`."""
    return np.abs(found - expected).max() / max(least, np.abs(expected).max())


@pytest.mark.parametrize("name", some(("slope", "cap"), ELEMENTS))
def test_elements_of_all_orders_at_all_distances(name):
    arc = ELEMENTS[name]
    where = places(arc)
    assert len(where) > 4
    expected = [arc.integrals(s, h, NU, range(6)) for s, h in where]
    targets = targets_at([arc.beside(s, h) for s, h in where])
    for order in range(6):
        for tolerance, allowed in ((None, 3e-9), (1e-12, 3e-12)):
            found = kernel(tolerance).integrals(targets, elements_of(arc, order))
            for k in range(len(where)):
                for whole, part in zip(found, in_units(expected[k][order]), strict=True):
                    assert error(whole[..., k], part) < allowed, (order, where[k])


@pytest.mark.parametrize(("name", "order"), [*zip(ELEMENTS, (0, 2, 5, 2, 0), strict=True)])
def test_nodes_of_the_element_itself(name, order):
    arc, node = ELEMENTS[name], order // 3
    xi, own = gauss(order)[0][node : node + 1], np.array([3])
    expected = in_units(arc.integrals(xi[0], 0.0, NU, [order])[order])
    elements = elements_of(arc, order)
    targets = Targets(arc.beside(xi[0], 0.0)[None], elements.line, own, xi)
    for tolerance, allowed in ((None, 2e-9), (1e-12, 2e-12)):
        found = kernel(tolerance).integrals(targets, elements)
        for whole, part in zip(found, expected, strict=True):
            assert error(whole[..., 0], part) < allowed


def test_panels_that_end_a_rounding_short_of_the_axis():
    """Half way to the image is the end of the element, where the radius of a ring may round to 0."""
    xi, own = gauss(2)[0], np.full(3, 3)
    for length in np.random.default_rng(0).uniform(1e-3, 1.0, 50):
        elements = elements_of(Arc((length, 0.0), np.pi, length, 0.0), 2)
        elements.end[0] = 0.0
        points = np.stack([0.5 * length * (1.0 - xi), 0.0 * xi], axis=1)
        kernels = kernel().integrals(Targets(points, np.zeros(3, int), own, xi), elements)
        assert all(np.isfinite(part).all() for part in kernels)


def test_points_on_the_axis_move_along_it_alone():
    arc = ELEMENTS["cap"]
    targets = targets_at([(0.0, 0.2), (0.0, -0.9), (0.0, -0.999)])
    elements = elements_of(arc, 3)
    for kernels in kernel().integrals(targets, elements):
        assert np.abs(kernels[[0, 2]]).max() < 1e-11
        assert np.abs(kernels[1, :2]).min() > 0.0
    for kernels in kernel().stress_integrals(targets, elements):
        np.testing.assert_allclose(kernels[3], kernels[0], rtol=1e-12, atol=1e-12)
        assert np.abs(kernels[[2, 4, 5]]).max() < 1e-12 * np.abs(kernels).max()
