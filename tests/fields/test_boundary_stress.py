"""Stress on the boundary from exact data: orders, patch tests, places, corners, states of
contact."""

from __future__ import annotations

import numpy as np
import pytest
from facets import quartered
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import closing, cuboid, elastic, problem, solid
from smooth_field import STEEL, boundary_data, exact, meshed

from petcontact import Contact, Cylinder, Material, MeshOptions, Polygon, Problem, Sphere
from petcontact.bem.kernel import tensor_components
from petcontact.fields.boundary.places import best_places, located
from petcontact.fields.boundary.surface_stress import BoundaryField
from petcontact.fields.interior import field_at
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.mesh.surface_mesh import SurfaceMesh
from petcontact.refinement.body_meshes import mesh_of
from petcontact.results.body_fields import BodyFields
from petcontact.results.records import BodyResult

CUBE = BoxSurface(np.full(3, -1.0), np.ones(3))
BOX = cuboid([-1] * 3, [1] * 3)
SOFT = Material(2.6, 0.3)
CYLINDER = Cylinder(**{"from": (0, 0, -1), "to": (0, 0, 1), "radius": 1})


def at(mesh, element, place):
    return mesh.at(element, place)[0]


def everywhere(mesh, count, rng):
    """Places drawn on every element."""
    element = np.repeat(np.arange(mesh.n_elements), count)
    if mesh.dim == 2:
        return element, rng.uniform(0.0, 1.0, len(element))
    place = np.empty((len(element), 2))
    for batch in mesh.batches():
        quads = batch.elements.corners.shape[1] == 4
        own = rng.uniform(-1.0, 1.0, (count, 2)) if quads else rng.dirichlet(np.ones(3), count)
        place[np.isin(element, batch.elements.index)] = batch.elements.mapped(own[:, :2]).reshape(
            -1, 2
        )
    return element, place


@pytest.mark.parametrize(
    ("order", "size", "bound"),
    [(0, 0.05, 3e-4), (1, 0.1, 2e-3), (2, 0.2, 5e-4), (3, 0.2, 4e-5), (5, 0.4, 1e-6)],
)
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_exact_data_on_arcs_and_straight_sides(order, size, bound, plane):
    mesh, material = meshed(order=order, element_size=size), Material(200.0, 0.3, plane)
    field = BoundaryField(mesh, *boundary_data(mesh, material), material)
    for element, place in ((mesh.element, mesh.places), best_places(mesh)):
        x = at(mesh, element, place)
        assert np.abs(at(mesh, *located(mesh, x)) - x).max() < 1e-13
        stress = exact(x, material)[1]
        assert np.abs(field.at(element, place)[2] - stress).max() < bound * np.abs(stress).max()


def kelvin(x, force=(0.3, -0.5, 1.0), source=(0.2, 0.1, 1.9)):
    """Displacement and stress of a point force outside the cube, μ = 1, ν = 0.3."""

    def moved(y):
        r = y - np.array(source)
        size = np.sqrt(np.sum(r * r, axis=1))[:, None]
        return (1.8 * np.array(force) / size + r * (r @ np.array(force))[:, None] / size**3) / 4.0

    slope = np.stack([moved(x + 1e-30j * axis).imag / 1e-30 for axis in np.eye(3)], axis=2)
    strain = 0.5 * (slope + slope.transpose(0, 2, 1))
    return moved(x), 2.0 * strain + 1.5 * np.trace(strain, axis1=1, axis2=2)[
        :, None, None
    ] * np.eye(3)


@pytest.mark.parametrize(
    ("order", "size", "bounds"),
    [(1, 0.25, (3e-2, 3.1e-2, 6e-2)), (2, 0.25, (3e-3, 3e-3, 6e-3)), (3, 0.5, (6e-3, 4e-3, 8e-3))],
)
def test_exact_data_on_panels(order, size, bounds):
    mesh = box_mesh(CUBE, lambda part: size, order, 1.0)
    u, stress = kelvin(mesh.x)
    field = BoundaryField(mesh, u, np.einsum("nij,nj->ni", stress, mesh.normal), SOFT)
    places = (
        (mesh.element, mesh.places),
        best_places(mesh),
        everywhere(mesh, 4, np.random.default_rng(0)),
    )
    for (element, place), bound in zip(places, bounds, strict=True):
        wanted = tensor_components(kelvin(at(mesh, element, place))[1])
        assert np.abs(field.at(element, place)[2] - wanted).max() < bound * np.abs(wanted).max()


@pytest.mark.parametrize("depth", [1e-5, 0.005, 0.03])
def test_next_to_panels_stress_is_as_accurate_as_on_them(depth):
    """The field of the data as they are has jumps at the panels' edges, with stresses that grow
    towards these."""
    mesh = box_mesh(CUBE, lambda part: 0.25, 2, 1.0)
    u, stress = kelvin(mesh.x)
    found = BodyResult(u, np.einsum("nij,nj->ni", stress, mesh.normal))
    (body,) = problem(body=[solid("cube", BOX, closing("top"), material=elastic(2.6, 0.3))]).bodies
    fields = BodyFields(body, mesh, found, None, np.full(mesh.n_nodes, -1), {1: 1.0})
    element, place = everywhere(mesh, 2, np.random.default_rng(0))
    x = at(mesh, element, place)[mesh.part[element] == mesh.part_names.index("top")][::3]
    x = x[np.abs(x[:, :2]).max(axis=1) < 0.9] - [0.0, 0.0, depth]
    error = np.abs(fields.at(x).stress - tensor_components(kelvin(x)[1])).max()
    assert len(x) > 20 and error < 4.5e-3 * np.abs(stress).max()


@pytest.mark.parametrize("depth", [0.1, 0.2, 0.4])
def test_below_long_panels_stress_is_that_of_the_body(depth):
    """Panels along a load on a line are as long as the line, and as narrow as the load asks for."""
    cube, long = box_mesh(CUBE, lambda part: 0.25, 2, 1.0), np.array([1.0, 20.0, 4.0])
    mesh = SurfaceMesh(cube.corners * long, cube.order, cube.part, cube.part_names, cube.middles)
    sources = [(0.1, y, 4.3) for y in np.linspace(-40.0, 40.0, 401)]

    def line(x):
        return (sum(each) for each in zip(*(kelvin(x, source=s) for s in sources), strict=True))

    u, stress = line(mesh.x)
    found = BodyResult(u, np.einsum("nij,nj->ni", stress, mesh.normal))
    (body,) = problem(body=[solid("cube", BOX, closing("top"), material=elastic(2.6, 0.3))]).bodies
    fields = BodyFields(body, mesh, found, None, np.full(mesh.n_nodes, -1), {1: 1.0})
    x = np.array([(x, y, 4.0 - depth) for x in (-0.1, 0.0, 0.1) for y in (0.0, 2.0)])
    _, wanted = line(x)
    error = np.abs(fields.at(x).stress - tensor_components(wanted)).max()
    assert error < 0.01 * np.abs(wanted).max()


def triangles(mesh):
    """Every panel cut in two, the curved ones through the points in their middles."""
    corners = np.concatenate([mesh.corners[:, [0, 1, 2, 3]], mesh.corners[:, [0, 2, 3, 3]]])
    middles = np.concatenate([mesh.middles[:, [0, 1, 4, 4, 4]], mesh.middles[:, [4, 2, 3, 4, 4]]])
    corners[:, 3] = middles[:, 3:] = np.nan
    return SurfaceMesh(
        corners, np.tile(mesh.order, 2), np.tile(mesh.part, 2), mesh.part_names, middles
    )


def refined(mesh, point, levels, shrink):
    """A mesh with the panels about a point cut again and again, those around it as they are."""
    for level in range(levels):
        distance = np.full(mesh.n_elements, np.inf)
        np.minimum.at(distance, mesh.element, np.linalg.norm(mesh.x - point, axis=1))
        mesh = quartered(mesh, distance < 0.35 * shrink**level)
    return mesh


def posed(shape, order, size):
    """A body in contact at its top, and its mesh."""
    mesh, contact = MeshOptions(size, order=order), [Contact("top")]
    problem = Problem(material=SOFT, geometry=shape, mesh=mesh, boundary=contact)
    return problem, mesh_of(problem.bodies[0], problem.outline())


def bent(x):
    """A quadratic displacement of a beam in bending, its stress linear."""
    (x, y, z), result = x.T, np.zeros((len(x), 3, 3))
    result[:, 0, 0] = 2.6 * z
    return np.column_stack([x * z, -0.3 * y * z, -0.5 * (x**2 + 0.3 * (z**2 - y**2))]), result


def stress_error(mesh, field, *places):
    """Largest error of the stress of exact data over the largest stress."""
    u, stress = field(mesh.x)
    traction = np.einsum("nij,nj->ni", stress, mesh.normal)
    found = BoundaryField(mesh, u, traction, SOFT).at(*places)[2]
    wanted = tensor_components(field(at(mesh, *places))[1])
    return np.abs(found - wanted).max() / np.abs(wanted).max()


@pytest.mark.parametrize("order", [1, 2, 3])
def test_linear_stress_is_exact_on_hanging_nodes(order):
    mesh = refined(box_mesh(CUBE, lambda part: 0.5, order, 1.0), (0.2, 0.1, 1.0), 4, 0.5)
    assert stress_error(mesh, bent, *everywhere(mesh, 3, np.random.default_rng(0))) < 1e-12


@pytest.mark.parametrize(
    ("ball", "order", "bound"),
    [(False, 1, 0.2), (False, 2, 0.09), (True, 1, 0.2), (True, 2, 0.027)],
)
def test_large_panels_beside_crowds_of_small_ones_tell_no_peak_that_is_elsewhere(
    ball, order, bound
):
    """The stress of a load on a spot, on panels 64 times smaller than those around them: 1.17 and
    .12 off at nodes of large panels when the samples nearest to these lie on small ones only; .31
    and .03 at large ones of a ball, whose parts have few panels."""
    mesh, spot = box_mesh(CUBE, lambda part: 0.5, order, 1.0), (0.2, 0.1, 1.0)
    if ball:
        _, mesh = posed(Sphere(centre=(0.0, 0.0, 0.0), radius=1.0), order, 0.5)
        spot = (0.0, 0.0, 1.0)
    mesh, above = refined(mesh, spot, 6, 0.4), (*spot[:2], 1.05)
    load = lambda x: kelvin(x, (0.015, -0.025, 0.05), above)  # noqa: E731
    assert stress_error(mesh, load, mesh.element, mesh.places) < bound


def straight(kind, order, rng):
    """A quadrilateral of random shape, or a cube."""
    if kind == "curve":
        corners = [(0, 0), (6, 0), (rng.uniform(4, 6), 3), (rng.uniform(0, 2), 4)]
        body = Polygon(corners, ["bottom", "right", "top", "left"])
        return meshed(body, element_size=rng.uniform(0.3, 2.0), order=order)
    mesh = box_mesh(CUBE, lambda part: 0.7, order, 1.0)
    return triangles(mesh) if kind == "triangles" else mesh


def curved(kind, order, rng):
    """A curved body somewhere, of random shape."""
    if kind == "curve":
        return meshed(order=order, element_size=rng.uniform(0.3, 1.0))
    shape = Sphere(centre=(0, 0, 0), radius=1) if rng.integers(2) else CYLINDER
    _, mesh = posed(shape, order, 1.0)
    mesh = triangles(mesh) if kind == "triangles" else mesh
    stretched = np.diag(rng.uniform(0.5, 2.0, 3)) + rng.uniform(-0.2, 0.2, (3, 3))
    away = rng.uniform(-3.0, 3.0, 3)
    points = (values @ stretched + away for values in (mesh.corners, mesh.middles))
    return SurfaceMesh(next(points), mesh.order, mesh.part, mesh.part_names, next(points))


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    order=st.integers(0, 3),
    kind=st.sampled_from(["curve", "quads", "triangles"]),
    body=st.sampled_from([straight, curved]),
)
def test_uniform_stress_is_exact_and_rigid_motions_strain_nothing(seed, order, kind, body):
    """Curved elements of order 1 told von Mises stresses of a tenth of E times the angle; those of
    order 3 of a hundredth. Only straight ones of order 1 and more hold all linear data."""
    rng = np.random.default_rng(seed)
    mesh = body(kind, order, rng)
    d, material = mesh.dim, Material(1.0, rng.uniform(-0.5, 0.45))
    strain, turn = rng.normal(size=(2, d, d))
    strain = (strain + strain.T) * (body is straight and order > 0)
    mu, nu = material.shear_modulus, material.poisson_ratio
    stress = 2.0 * mu * (strain + nu / (1.0 - 2.0 * nu) * np.trace(strain) * np.eye(d))
    slope, shift = strain + turn - turn.T, rng.normal(size=d)
    u, traction = mesh.x @ slope.T + shift, mesh.normal @ stress
    field = BoundaryField(mesh, u, traction, material, rng.integers(-1, 3, mesh.n_nodes))
    places, size = everywhere(mesh, 3, rng), max(np.abs(stress).max(), np.abs(u).max())
    assert np.abs(field.at(*places)[2] - tensor_components(stress[None])).max() < 1e-11 * size
    x = at(mesh, *places)
    found, where = located(mesh, x)
    assert np.all(found >= 0) and np.abs(at(mesh, found, where) - x).max() < 1e-12
    moved = x @ slope.T + shift
    assert np.abs(field.at(*places)[1] - moved).max() < 1e-11 * size
    # beside a corner of a straight body that leans a point below a side may lie outside
    within = mesh.x.mean(axis=0) if body is straight else mesh.x[0] - 0.1 * mesh.normal[0]
    _, inside = field_at(mesh, u, traction, material, within[None])
    assert np.abs(inside - tensor_components(stress[None])).max() < 1e-10 * size


@pytest.mark.parametrize("kind", ["curve", "quads", "triangles"])
def test_linear_fields_on_constant_elements(kind):
    """The slope next to the middle of an element comes from its neighbours; in space none was
    taken, and no stress told."""
    rng = np.random.default_rng(0)
    mesh = curved(kind, 0, rng)
    slope = rng.normal(size=(3, 3))[: 2 + (kind != "curve"), : 2 + (kind != "curve")]
    strain, d = 0.5 * (slope + slope.T), len(slope)
    stress = 2.0 * SOFT.shear_modulus * (strain + 0.3 / 0.4 * np.trace(strain) * np.eye(d))
    field = BoundaryField(mesh, mesh.x @ slope.T, mesh.normal @ stress, SOFT)
    assert np.abs(field.at(*best_places(mesh))[2] - tensor_components(stress[None])).max() < 1e-11


def test_a_kink_at_the_end_of_a_state_is_not_smoothed():
    """Slopes that jump where the state of contact changes stay apart; without the states they run
    into one another."""
    mesh = meshed(order=2, element_size=0.2)
    bottom = mesh.part_names.index("bottom")
    kinked = np.where(mesh.node_part == bottom, np.maximum(mesh.x[:, 0] - 2.4, 0.0), 0.0)
    u, free = np.column_stack([1e-3 * kinked, 0.0 * kinked]), np.zeros((mesh.n_nodes, 2))
    state = np.where(mesh.node_part == bottom, np.where(mesh.x[:, 0] > 2.4, 1, 0), -1)
    here = np.flatnonzero(mesh.node_part == bottom)
    wanted = np.where(
        mesh.x[here, 0] > 2.4,
        2.0 * STEEL.shear_modulus / (1.0 - STEEL.plane_strain_ratio) * 1e-3,
        0.0,
    )
    places = mesh.element[here], mesh.places[here]
    assert (
        np.abs(BoundaryField(mesh, u, free, STEEL, state).at(*places)[2][:, 0] - wanted).max()
        < 1e-12
    )
    assert np.abs(BoundaryField(mesh, u, free, STEEL).at(*places)[2][:, 0] - wanted).max() > 1e-2
