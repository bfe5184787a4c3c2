"""Panels in rings about elliptical contacts: they cover the face, their sides follow the edge,
moments give the ellipse."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.refinement.panels import rings as module
from petcontact.refinement.panels.patches import patches_of
from petcontact.refinement.panels.zone import ELONGATED, ContactEllipse, stick_of, zone_of

SHAPE = BoxSurface(np.array([-1.5, -1.0, -2.0]), np.array([1.5, 2.0, 0.0]))
BOX = box_mesh(SHAPE, lambda part: 0.75, 1, 1.0)


def ringed(mesh, part, zone, rings, *stick):
    patch = next(patches_of(SHAPE, mesh, mesh, part, zone, module.sector(rings)), None)
    return None if patch is None else module.ringed(patch, zone, rings, *stick)


def axes(a, b, angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)], [0.0, 0.0]])
    return turn * [a, b]


@settings(max_examples=5, deadline=None)
@given(
    st.floats(0.05, 0.7),
    st.floats(0.6, 1.0),
    st.floats(0.0, 3.0),
    st.sampled_from(["top", "bottom"]),
    st.integers(1, 3),
    st.floats(-0.4, 0.4),
)
def test_rings_cover_the_face_and_their_inner_ones_the_zone(a, ratio, angle, part, rings, x):
    mesh = ringed(
        BOX, part, ContactEllipse(np.array([x, 0.3, 0.0]), axes(a, ratio * a, angle)), rings
    )
    assert mesh is not None
    area = np.bincount(mesh.part, np.bincount(mesh.element, mesh.weight))
    np.testing.assert_allclose(
        area, np.bincount(BOX.part, np.bincount(BOX.element, BOX.weight)), rtol=1e-12
    )
    nodes = mesh.nodes_of(part)
    level = {"top": 0.0, "bottom": -2.0}[part]
    np.testing.assert_allclose(
        mesh.normal[nodes],
        np.tile([0.0, 0.0, 1.0 if part == "top" else -1.0], (len(nodes), 1)),
        atol=1e-12,
    )
    zone = ContactEllipse(np.array([x, 0.3, level]), axes(a, ratio * a, angle))
    inner = np.linalg.norm(zone.local(mesh.x[nodes]), axis=1) < 1.0
    assert mesh.weight[nodes][inner].sum() == pytest.approx(np.pi * a * ratio * a, rel=1e-3)
    # no panel has nodes on both sides of the edge
    count, some = (np.bincount(mesh.element[nodes], which) for which in (None, inner))
    assert np.all((some == 0) | (some == count))


def test_a_zone_at_the_rim_of_a_face_or_too_long_has_no_rings():
    assert (
        ringed(BOX, "top", ContactEllipse(np.array([1.2, 0.0, 0.0]), axes(0.3, 0.3, 0.0)), 2)
        is None
    )
    assert (
        ringed(BOX, "top", ContactEllipse(np.array([2.0, 0.0, 0.0]), axes(0.3, 0.3, 0.0)), 2)
        is None
    )


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
    mesh = ringed(BOX, "top", zone, rings, stick)
    nodes = mesh.nodes_of("top")
    assert mesh.weight[nodes].sum() == pytest.approx(9.0, rel=1e-12)
    distance = np.linalg.norm(stick.local(mesh.x[nodes]), axis=1)
    inner = distance < 1.0
    assert mesh.weight[nodes][inner].sum() == pytest.approx(np.pi * 0.24 * radius**2, rel=1e-3)
    count, some = (np.bincount(mesh.element[nodes], which) for which in (None, inner))
    assert np.all((some == 0) | (some == count))
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
