"""Panels in rings about elliptical contacts: they cover the face, their sides follow the edge,
moments give the ellipse."""

import numpy as np
import pytest
from curved_bodies import vector_area
from hypothesis import given, settings
from hypothesis import strategies as st

from petcontact import OutlineSide, Revolved
from petcontact.geometry.round_surfaces import CylinderSurface
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh, round_mesh
from petcontact.refinement.panels.face_patches import patches_of
from petcontact.refinement.panels.rings import ringed, sector
from petcontact.refinement.panels.zone import ELONGATED, ContactEllipse, stick_of, zone_of

BOX = BoxSurface(np.array([-1.5, -1.0, -2.0]), np.array([1.5, 2.0, 0.0]))
CYLINDER = CylinderSurface(np.array([0.0, 0.0, -2.0]), np.array([0.0, 0.0, 2.0]), 1.0)
CAP = [("bottom", (1.0, 0.0), 1.0), ("top", (0.0, 0.0), None), ("axis", (0.0, -1.0), None)]
HALF = Revolved([[OutlineSide(part, to, radius=radius) for part, to, radius in CAP]]).outline()


def axes(a, b, angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)], [0.0, 0.0]])
    return turn * [a, b]


def zone_at(point, a, b):
    """An ellipse on a sphere about the origin."""
    normal = point / np.linalg.norm(point)
    first = np.cross(normal, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first)
    return ContactEllipse(point, np.column_stack([a * first, b * np.cross(normal, first)]))


def with_rings(surface, part, zone, rings, size, *stick):
    """The mesh before, and with rings where there is a patch for them."""
    first = (
        box_mesh(surface, lambda part: size, 1, 1.0)
        if surface is BOX
        else round_mesh(surface, size, 1)
    )
    patches = patches_of(surface, first, first, part, zone, sector(rings))
    made = (ringed(patch, zone, rings, *stick) for patch in patches)
    return first, next((mesh for mesh in made if mesh is not None), None)


def check(surface, part, zone, rings, size, *stick):
    """The mesh with rings: a closed surface of the same area, whose inner panels cover the zone, or
    the stick zone, and none of them has nodes on both sides of its edge."""
    first, mesh = with_rings(surface, part, zone, rings, size, *stick)
    assert mesh is not None
    rough = surface is not BOX
    total = vector_area(mesh) if rough else mesh.weight @ mesh.normal
    assert np.abs(total).max() < 1e-12 * mesh.weight.sum()
    area, before = (np.bincount(m.part[m.element], m.weight) for m in (mesh, first))
    assert area == pytest.approx(before, rel=3e-3 if rough else 1e-12)
    nodes, edge = mesh.nodes_of(part), (*stick, zone)[0]
    inner = edge.distance(mesh.x[nodes]) < 1.0
    a, b = np.linalg.norm(edge.axes, axis=0)
    covered = mesh.weight[nodes][inner].sum()
    assert covered == pytest.approx(np.pi * a * b, rel=0.03 if rough else 1e-3)
    count, some = (np.bincount(mesh.element[nodes], which) for which in (None, inner))
    assert np.all((some == 0) | (some == count))
    return mesh


@settings(max_examples=5, deadline=None)
@given(
    st.floats(0.05, 0.7),
    st.floats(0.6, 1.0),
    st.floats(0.0, 3.0),
    st.sampled_from([("top", 0.0), ("bottom", -2.0)]),
    st.integers(1, 3),
    st.floats(-0.4, 0.4),
)
def test_rings_cover_the_face_of_a_box_and_their_inner_ones_the_zone(a, ratio, angle, on, rings, x):
    part, level = on
    zone = ContactEllipse(np.array([x, 0.3, level]), axes(a, ratio * a, angle))
    mesh = check(BOX, part, zone, rings, 0.75)
    assert np.abs(mesh.x[mesh.nodes_of(part), 2] - level).max() < 1e-12


@pytest.mark.parametrize(("a", "off"), [(0.05, 0.0), (0.2, 0.0), (0.1, 0.02), (0.02, 0.3)])
def test_rings_lie_about_the_pole_of_a_body_of_revolution_and_beside_it(a, off):
    point = np.array([off, 0.0, -np.sqrt(1.0 - off**2)])
    check(HALF, "bottom", zone_at(point, a, a), 2, 0.4)


@pytest.mark.parametrize("off", [0.0, 0.02, -0.02])
def test_rings_lie_on_a_cylinder_wherever_the_zone_is(off):
    """On its side, and on its disc: a zone is that of the other side of the contact, which may be
    curved, so that the middle of its pressure is off the disc."""
    around = np.array([[0.1, 0.0], [0.0, 0.0], [0.0, 0.2]])
    check(CYLINDER, "side", ContactEllipse(np.array([0.0, 1.0, 0.1]), around), 2, 0.5)
    zone = ContactEllipse(np.array([0.2, -0.1, 2.0 + off]), axes(0.15, 0.15, 0.0))
    mesh = check(CYLINDER, "top", zone, 2, 0.5)
    assert np.abs(mesh.x[mesh.nodes_of("top")][:, 2] - 2.0).max() < 1e-12


@pytest.mark.parametrize("x", [1.2, 2.0])
def test_a_zone_at_the_rim_of_a_face_or_beyond_it_has_no_rings(x):
    zone = ContactEllipse(np.array([x, 0.0, 0.0]), axes(0.3, 0.3, 0.0))
    assert with_rings(BOX, "top", zone, 2, 0.75)[1] is None


@pytest.mark.parametrize(("a", "b", "angle"), [(0.8, 0.8, 0.0), (0.9, 0.4, 0.5)])
def test_moments_of_a_pressure_give_its_ellipse(a, b, angle):
    true, size = ContactEllipse(np.array([0.1, -0.2, 0.5]), axes(a, b, angle)), 0.05
    line = size * (np.arange(-20, 20) + 0.5)
    x = np.stack([*np.meshgrid(line, line), np.full((40, 40), 0.5)], axis=-1).reshape(-1, 3)
    weight, rest = np.full(len(x), size**2), 1.0 - np.sum(true.local(x) ** 2, axis=1)
    pressure = np.sqrt(np.maximum(rest, 0.0))
    zone = zone_of(x, weight, pressure, pressure > 0.0)
    np.testing.assert_allclose(zone.centre, true.centre, atol=2e-3)
    np.testing.assert_allclose(zone.axes @ zone.axes.T, true.axes @ true.axes.T, atol=5e-3)
    earlier = (pressure > 0.0) | (np.abs(x - [-0.8, 0.6, 0.5]).max(axis=1) < 0.3)
    assert zone_of(x, weight, pressure, earlier) is None, "contact that was elsewhere"


def test_contacts_of_other_shapes_have_no_zone():
    line = 0.05 * (np.arange(-20, 20) + 0.5)
    x = np.stack([*np.meshgrid(line, line), np.zeros((40, 40))], axis=-1).reshape(-1, 3)
    weight = np.full(len(x), 0.0025)
    for closed in (
        np.abs(x).max(axis=1) < 0.5,
        (np.abs(x[:, 0]) < 0.9) & (np.abs(x[:, 1]) < 0.9 / ELONGATED / 1.2),
        np.abs(np.linalg.norm(x, axis=1) - 0.5) < 0.2,
        x[:, 0] > 5.0,
    ):
        assert zone_of(x, weight, closed.astype(float), closed) is None


@pytest.mark.parametrize(
    ("radius", "shift", "rings"), [(0.6, 0.0, 1), (0.3, 0.1, 2), (0.85, 0.04, 3)]
)
def test_panels_end_at_the_edge_of_a_stick_zone_and_lie_close_there(radius, shift, rings):
    zone = ContactEllipse(np.array([0.0, 0.3, 0.0]), axes(0.6, 0.4, 0.7))
    stick = ContactEllipse(zone.centre + zone.axes @ [shift, 0.0], radius * zone.axes)
    mesh = check(BOX, "top", zone, rings, 0.75, stick)
    distance = stick.distance(mesh.x[mesh.nodes_of("top")])
    # of the radius of the contact
    around = np.sort(radius * (distance - 1.0))
    assert np.diff(around[np.abs(around) < 0.03]).max() < 0.02


def test_slip_shows_where_a_stick_zone_ends():
    """Cattaneo's slip on panels in which no node is within .05 of the edge, and states of which no
    ellipse comes."""
    zone, line = ContactEllipse(np.zeros(3), axes(0.9, 0.6, 0.3)), 0.1 * (np.arange(-10, 10) + 0.5)
    x = np.stack([*np.meshgrid(line, line), np.zeros((20, 20))], axis=-1).reshape(-1, 3)
    middle, c = np.array([0.05, 0.0]), 0.6
    away = np.linalg.norm(zone.local(x) - middle, axis=1)
    slip = np.column_stack([np.maximum(away**2 - c**2, 0.0) ** 1.5, np.zeros(len(x))])
    state = np.where(np.linalg.norm(zone.local(x), axis=1) > 1.0, 2, np.where(away < c, 0, 1))
    weight = np.full(len(x), 0.01)
    stick = stick_of(x, weight, state, slip, zone)
    np.testing.assert_allclose(zone.local(stick.centre[None])[0], middle, atol=0.03)
    np.testing.assert_allclose(stick.axes, c * zone.axes, atol=0.03)
    left = np.where(state == 2, 2, x[:, 0] > 0.0)
    for others in (
        np.where(state == 1, 0, state),
        np.where(state == 0, 1, state),
        np.full(len(x), 2),
        left,
    ):
        assert stick_of(x, weight, others, slip, zone) is None
