"""Kernels of rings: exact fields of bodies of revolution, which their equations keep; over single
elements against brute force round the ring and along the element; and columns by compiled code."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_oracle import free
from marks import some
from ring_oracle import Arc
from shapes import drawn, elastic, outline, problem, rectangle, rollers

from petcontact import MeshOptions, SideBySide, operators
from petcontact.bem.column_fillers import PlainFiller
from petcontact.bem.kernel import ColumnData
from petcontact.bem.revolution.compiled import compiled_columns
from petcontact.bem.revolution.kernel import RingKernel, TwistedRingKernel
from petcontact.given.tables.material import Material
from petcontact.mesh.basis import gauss
from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.mesh.elements import Elements, Targets
from petcontact.mesh.grading import mesh_outline
from petcontact.reference.lame import Cylinder, Sphere

NU = 0.3


def kernel():
    return TwistedRingKernel(Material(young_modulus=1.0, poisson_ratio=NU), 1.0)


MU = 0.5 / (1.0 + NU)
TUBE = rectangle([1, 0], [2, 1])
SHELL = outline(middle=[2, 0], right=[0, 2, 2.0], axis=[0, 1], left=[1, 0, -1.0])


@pytest.mark.parametrize(
    ("shape", "planes", "form"),
    [(TUBE, ("bottom", "top"), Cylinder), (SHELL, ("middle",), Sphere)],
)
def test_lame_s_tube_and_ball(shape, planes, form):
    """Displacement of the boundary and stress inside, under pressure between planes of symmetry."""
    pressed = {"part": "left", "condition": "traction", "pressure": 1.0}
    body = operators(
        problem(
            symmetry="axial",
            material=elastic(1.0, NU),
            geometry=shape,
            mesh={"element_size": 0.25, "order": 4},
            boundary=[pressed, drawn("right", [0, 0]), *rollers(*planes)],
        )
    ).body
    exact, flat = form(1.0, 2.0, 1.0, NU, pressure_inside=1.0), [1.0, float(form is Sphere)]
    u, t = body.solve()
    r = np.hypot(*(body.mesh.x * flat).T)
    wanted = (exact.displacement(r) / r)[:, None] * body.mesh.x * flat
    assert np.abs(u - wanted).max() < 4e-6 * np.abs(wanted).max()
    inside = np.array([[1.2, 0.3], [1.4, 0.6]])
    r = np.hypot(*(inside * flat).T)
    (radial, hoop), (n_r, n_z) = exact.stress(r), (inside * flat).T / r
    axial = hoop if form is Sphere else NU * (radial + hoop)
    stress = body.state_at(inside, u, t).stress
    np.testing.assert_allclose(stress[:, 0], hoop + (radial - hoop) * n_r**2, atol=1e-5)
    np.testing.assert_allclose(stress[:, 1], axial + (radial - axial) * n_z**2, atol=1e-5)
    np.testing.assert_allclose(stress[:, 2], hoop, atol=1e-5)
    np.testing.assert_allclose(stress[:, 3], (radial - axial) * n_r * n_z, atol=1e-5)


def test_forces_of_rings():
    """Whole forces: a small ring is Kelvin's point force; far forces spread evenly on a ring do what
    elements of rings do."""
    solution = kernel()
    x = np.array([[0.4, 0.3], [0.0, 0.5], [2.0, -1.0]])
    axial = np.array([[0.0, 3.0, 0.0]])
    on_axis = solution.point_displacement(x, np.array([[0.0, 0.0]]), axial)
    rho = np.hypot(*x.T)
    factor = 3.0 / (16.0 * np.pi * MU * (1.0 - NU) * rho)
    np.testing.assert_allclose(on_axis[:, 0], factor * x[:, 0] * x[:, 1] / rho**2, atol=1e-15)
    kelvin = factor * (3.0 - 4.0 * NU + x[:, 1] ** 2 / rho**2)
    np.testing.assert_allclose(on_axis[:, 1], kelvin, rtol=1e-13)
    assert np.abs(on_axis[:, 2]).max() == 0.0
    # a short element of constant traction, and the ring in its middle
    elements = elements_of(Arc((1.0, 0.0), 0.5 * np.pi, 1e-4, 0.0), 0)
    targets = free(x)
    g, _ = solution.integrals(targets, elements)
    by_t, _ = solution.stress_integrals(targets, elements)
    at, force = np.array([[1.0, 5e-5]]), 2.0 * np.pi * 1e-4
    for j, unit in enumerate(np.eye(3)):
        u = solution.point_displacement(x, at, force * unit[None])
        np.testing.assert_allclose(2.0 * MU * u.T, g[:, j, 0], rtol=0.0, atol=1e-12)
        stress = solution.point_stress(x, at, force * unit[None])
        rows = list(solution.in_fields)
        np.testing.assert_allclose(stress.T, by_t[rows, j, 0], rtol=0.0, atol=1e-12)


UNIT = 1.7
MATERIAL = Material(young_modulus=2.0 * (1.0 + NU), poisson_ratio=NU)
ELEMENTS = {
    "slope": Arc((0.7, -0.2), 0.6, 0.8, 0.0),
    "hollow": Arc((0.4, 0.0), 1.2, 0.7, -2.0),
    "from the axis": Arc((0.0, 0.3), 0.0, 1.1, 0.0),
    "cap": Arc((0.0, -1.0), 0.0, 0.9, 1.0),
    "shaft": Arc((0.05, 0.0), 0.5 * np.pi, 1.0, 0.0),
}
PLACES = [(0.3, 1e-6), (-0.6, -1e-6), (0.9, 1e-3), (-1.2, 0.03), (0.1, 0.1), (1.5, 0.3), (0.0, 2.0)]


def adaptive(tolerance=None):
    return TwistedRingKernel(MATERIAL, UNIT, tolerance)


def elements_of(arc, order):
    bent = np.array([arc.curvature])
    line = np.where(bent == 0.0, 0, -1)
    return Elements(arc.start[None], arc.end[None], bent, order, line, np.array([3]))


def places(arc):
    """Places beside an element whose points are not behind the axis."""
    return [(s, h * arc.half) for s, h in PLACES if arc.beside(s, h * arc.half)[0] >= 0.0]


def in_units(expected):
    """U and T as G and H."""
    return [part * unit for part, unit in zip(expected, (1.0 / UNIT, 1.0), strict=True)]


def error(found, expected, least=1.0):
    """The largest, relative to the largest entry, or to `least`."""
    return np.abs(found - expected).max() / max(least, np.abs(expected).max())


@pytest.mark.parametrize("name", some(("slope", "cap"), ELEMENTS))
def test_elements_of_all_orders_at_all_distances(name):
    arc = ELEMENTS[name]
    where = places(arc)
    assert len(where) > 4
    expected = [arc.integrals(s, h, NU, range(6)) for s, h in where]
    targets = free([arc.beside(s, h) for s, h in where])
    for order in range(6):
        for tolerance, allowed in ((None, 3e-9), (1e-12, 3e-12)):
            found = adaptive(tolerance).integrals(targets, elements_of(arc, order))
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
        found = adaptive(tolerance).integrals(targets, elements)
        for whole, part in zip(found, expected, strict=True):
            assert error(whole[..., 0], part) < allowed


def test_panels_that_end_a_rounding_short_of_the_axis():
    """Half way to the image is the end of the element, where the radius of a ring may round to 0."""
    xi, own = gauss(2)[0], np.full(3, 3)
    for length in np.random.default_rng(0).uniform(1e-3, 1.0, 50):
        elements = elements_of(Arc((length, 0.0), np.pi, length, 0.0), 2)
        elements.end[0] = 0.0
        points = np.stack([0.5 * length * (1.0 - xi), 0.0 * xi], axis=1)
        kernels = adaptive().integrals(Targets(points, np.zeros(3, int), own, xi), elements)
        assert all(np.isfinite(part).all() for part in kernels)


def half_ring():
    """A half ring with a hole of half its radius, without the axis: orders 0 to 5."""
    whole = mesh_outline(SideBySide(**SHELL).outline(), MeshOptions(element_size=0.25))
    off = whole.part != whole.part_names.index("axis")
    start, end, bent, part, line = (
        values[off] for values in (whole.start, whole.end, whole.curvature, whole.part, whole.line)
    )
    order = np.arange(len(part)) % 6
    return CurveMesh(start, end, bent, order, part, line, 0.0 * bent, whole.part_names, 1.5)


@pytest.mark.parametrize("kind", [RingKernel, TwistedRingKernel])
def test_columns_are_those_of_the_integrals(kind):
    mesh, rng = half_ring(), np.random.default_rng(1)
    kernel = kind(Material(young_modulus=2.0, poisson_ratio=0.25), mesh.unit_length)
    n, d, count = mesh.n_nodes, kernel.dim, rng.integers(0, 3, mesh.n_nodes)
    first = np.concatenate([[0], np.cumsum(count)])
    frame = np.linalg.qr(rng.normal(size=(n, d, d)))[0]
    sides = rng.normal(size=(2, first[-1], d)) * rng.integers(0, 2, (2, first[-1], 1))
    data = ColumnData(rng.integers(0, 2, (n, d)).astype(bool), frame, first, *sides)
    rows, columns = (np.sort(rng.permutation(n)[:70]) for _ in range(2))
    found = []
    for filler in (compiled_columns(kernel, mesh, data), PlainFiller(kernel, mesh, data)):
        system = np.full((len(columns), d, len(rows), d), np.nan)
        beside = np.full((count[columns].sum(), len(rows), d), np.nan)
        filler.fill(rows, columns, system, beside)
        found.append((system, beside))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-14)
