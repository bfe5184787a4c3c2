"""What passes between faces that do not match: force, moment and constant pressure, whatever the
meshes and orders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow

from petcontact import OutlineSide, Revolved
from petcontact.geometry.round_surfaces import SphereSurface
from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.mesh.pairs.clipping import area
from petcontact.mesh.pairs.contact_search import face
from petcontact.mesh.panelling import round_mesh
from petcontact.mesh.surface_mesh import SurfaceMesh

SEEDS = st.integers(0, 2**32 - 1)


def curve(points, curvature, order):
    count = len(points) - 1
    none = np.zeros(count, dtype=np.int64)
    return CurveMesh(
        points[:-1],
        points[1:],
        np.full(count, curvature),
        none + order,
        none,
        none - (curvature != 0.0),
        np.zeros(count),
        ("face",),
    )


def side(rng, order, y, *, up, low=0.0, high=1.0):
    """A straight side along x, its body below (up) or above."""
    x = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, int(rng.integers(3, 12))))])
    x = low + (high - low) * x / x[-1]
    return curve(np.column_stack([x[::-1] if up else x, np.full(len(x), y)]), 0.0, order)


def circle(rng, order, radius, *, hole):
    """A pin or a hole about the origin."""
    turn = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 1.0, int(rng.integers(14, 24))))])
    turn = rng.uniform(0.0, 6.0) + 2.0 * np.pi * (turn[::-1] if hole else turn) / turn[-1]
    return curve(
        radius * np.column_stack([np.cos(turn), np.sin(turn)]),
        (-1.0 if hole else 1.0) / radius,
        order,
    )


def panels(corners, order, *, up):
    """A part in a plane z = const of triangles or quadrilaterals (n, 3 or 4, 3)."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    corners = np.where(((across > 0.0) == up)[:, None, None], corners, corners[:, ::-1])
    if corners.shape[1] == 3:
        corners = np.concatenate([corners, np.full((len(corners), 1, 3), np.nan)], axis=1)
    return SurfaceMesh(
        corners, np.full(len(corners), order), np.zeros(len(corners), dtype=np.int64), ("face",)
    )


def square(rng, order, z, *, up, low=0.0, high=1.0):
    """A square of random triangles, or of uneven rectangles."""
    if rng.integers(2):
        edge = np.linspace(0.0, 1.0, int(rng.integers(2, 5)))
        rim = [
            np.column_stack(sides)
            for a in (0.0, 1.0)
            for sides in ((edge, 0 * edge + a), (0 * edge + a, edge))
        ]
        points = np.unique(
            np.vstack([*rim, rng.uniform(0.1, 0.9, (int(rng.integers(3, 20)), 2))]), axis=0
        )
        corners = points[scipy.spatial.Delaunay(points).simplices]
        corners = corners[np.abs(area(corners)) > 1e-9]
    else:
        u, v = (np.cumsum(rng.uniform(0.2, 1.0, int(rng.integers(3, 6)))) for _ in range(2))
        u, v = (np.concatenate([[0.0], c / c[-1]]) for c in (u, v))
        a, b = (c.ravel() for c in np.meshgrid(np.arange(len(u) - 1), np.arange(len(v) - 1)))
        corners = np.stack(
            [np.column_stack([u[a + i], v[b + j]]) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))],
            axis=1,
        )
    corners = low + (high - low) * corners
    return panels(
        np.concatenate([corners, np.full((*corners.shape[:2], 1), z)], axis=2), order, up=up
    )


def moment(x, force):
    x, force = (np.pad(each, ((0, 0), (0, 3 - each.shape[1]))) for each in (x, force))
    return np.cross(x, force).sum(axis=0)


def passes(one, other, rng, direction=None):
    """Force and moment of random normal tractions are the same on both sides; what the primary gets
    from an even one."""
    facing = face(one, "face", other, "face", direction)
    traction = (rng.normal(size=len(facing.secondary)) * facing.met)[:, None] * facing.normal
    mine = one.weight[facing.secondary, None] * traction
    theirs = -other.weight[facing.primary, None] * (facing.loads @ traction)
    size = np.abs(mine).sum()
    assert np.abs(mine.sum(axis=0) + theirs.sum(axis=0)).max() <= 1e-12 * size
    turning = moment(one.x[facing.secondary], mine) + moment(other.x[facing.primary], theirs)
    assert np.abs(turning).max() <= 1e-11 * size
    # what moves as one rigid body opens nowhere
    turned, here = (
        np.column_stack([-x[:, 1], x[:, 0], 0.0 * x[:, 0]])[:, : one.dim]
        for x in (other.x[facing.primary], one.x[facing.secondary])
    )
    opening = np.sum((facing.values @ turned - here) * facing.normal, axis=1)
    assert np.abs(opening[facing.met]).max(initial=0.0) < 1e-11
    return facing, facing.loads @ np.ones(len(facing.secondary))


@settings(max_examples=5, deadline=None)
@given(SEEDS, st.integers(0, 5), st.integers(0, 5), st.sampled_from([side, square]))
def test_plane_faces_pass_force_moment_and_constants(seed, order, opposite, shape):
    """Straight sides and plane faces of triangles or rectangles: whole ones, and such that meet
    partly, along normals or a direction."""
    rng = np.random.default_rng(seed)
    if shape is square:
        order, opposite = order // 2, opposite // 2
    one, other = shape(rng, order, 0.0, up=True), shape(rng, opposite, 0.1, up=False)
    facing, even = passes(one, other, rng)
    assert facing.met.all() and np.allclose(even, 1.0, atol=1e-11)
    low = rng.uniform(-0.5, 0.4)
    other = shape(rng, opposite, 0.05, up=False, low=low, high=low + rng.uniform(0.5, 1.2))
    direction = np.array([0.2, 1.0] if shape is side else [0.1, 0.2, 1.0])
    facing, _ = passes(one, other, rng, [None, direction][int(rng.integers(2))])
    assert np.all(np.diff(facing.values.indptr)[~facing.met] == 0)


@settings(max_examples=5, deadline=None)
@given(SEEDS, st.integers(0, 5), st.integers(0, 5), st.booleans())
def test_arcs_pass_force_and_moment(seed, order, opposite, swapped):
    rng = np.random.default_rng(seed)
    pin, hole = circle(rng, order, 0.99, hole=False), circle(rng, opposite, 1.0, hole=True)
    facing, even = passes(*((hole, pin) if swapped else (pin, hole)), rng)
    assert facing.met.all()
    assert np.allclose(
        even, 1.0 / 0.99 if swapped else 0.99, atol=0.03 if order and opposite else 0.15
    )


@pytest.mark.parametrize("order", range(4))
def test_faces_that_match_pass_values_on_as_they_are(order):
    rng = np.random.default_rng(order)
    ends = np.sort(rng.uniform(size=(5, 1)), axis=0) * [1.0, 0.0]
    pairs = [(curve(ends[::-1], 0.0, order), curve(ends + np.array([0.0, 0.1]), 0.0, order))]
    corners = rng.uniform(size=(1, 4, 3)) * [0.3, 0.3, 0.0] + [
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    ]
    for count in (3, 4):
        pairs.append(
            (
                panels(corners[:, :count], order, up=True),
                panels(corners[:, :count] + [0, 0, 0.1], order, up=False),
            )
        )
    for one, other in pairs:
        facing = face(one, "face", other, "face", None)
        assert facing.matched and np.all(facing.values.data == 1.0)
        assert np.all(np.diff(facing.values.indptr) == 1)
        assert np.allclose(facing.loads.data, 1.0, atol=1e-14)


def test_what_lies_behind_is_not_faced():
    """A primary in two floors: all goes to the nearer one."""
    rng = np.random.default_rng(5)
    floors = [square(rng, 1, z, up=False) for z in (0.1, 0.5)]
    corners = np.concatenate([mesh.corners for mesh in floors])
    none = np.zeros(len(corners), dtype=np.int64)
    both = SurfaceMesh(corners, none + 1, none, ("face",))
    facing, even = passes(square(rng, 1, 0.0, up=True), both, rng)
    assert np.allclose(facing.distance, 0.1)
    assert np.allclose(even[both.x[:, 2] < 0.3], 1.0, atol=1e-12)
    assert not even[both.x[:, 2] > 0.3].any()


@pytest.mark.parametrize(("order", "size"), [(1, 0.25), (2, 0.4), slow(3, 0.4)])
def test_pressure_passes_evenly_between_curved_panels(order, size):
    """A ball in a hollow sphere: panels of one go over the curved sides of those of the other, or
    match.

    Polygons in straight pieces passed on 31 % more or less here and there with order 3, 5 % in L2;
    15 % on matching ones."""

    def half(*corners):
        sides = [OutlineSide(part, to, radius=radius) for part, to, radius in corners]
        return Revolved([sides], angle=90.0)

    ball = half(("fit", (1, 0), 1.0), ("fit", (0, 1), 1.0), ("axis", (0, -1), None))
    outer = ("outer", (2, 0), 2.0), ("outer", (0, 2), 2.0), ("axis", (0, 1), None)
    hollow = half(*outer, ("fit", (1, 0), -1.0), ("fit", (0, -1), -1.0), ("axis", (0, -2), None))
    one, two = round_mesh(ball.outline(), 0.25, order), round_mesh(hollow.outline(), size, order)
    met = face(one, "fit", two, "fit", None)
    passed, weight = met.loads @ np.ones(len(met.secondary)), two.weight[met.primary]
    assert met.matched == (size == 0.25)
    assert np.abs(passed - 1.0).max() < (1e-12 if met.matched else 0.03)
    assert np.sqrt(weight @ (passed - 1.0) ** 2 / weight.sum()) < 4e-3


def test_pressure_passes_evenly_between_narrow_rings():
    """Flat rings of panels whose sides bend by .8 of their width, of order 2; lines of one lie a
    hundredth of that beside those of the other. Off by a third before."""
    share = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5]])
    share = np.vstack([share, [0.5, 0.5]])
    first = np.stack(np.meshgrid(np.arange(4), np.arange(3)), axis=-1).reshape(-1, 1, 2) + share

    def rings(off, z, up):
        r, turn = 25.0 + 0.07 * (first[..., 1] + off), np.radians(7.5 * first[..., 0])
        points = np.stack([r * np.cos(turn), r * np.sin(turn), np.full(r.shape, z)], axis=-1)
        points = points if up else points[:, [0, 3, 2, 1, 7, 6, 5, 4, 8]]
        none = np.zeros(12, dtype=np.int64)
        return SurfaceMesh(points[:, :4], none + 2, none, ("face",), points[:, 4:])

    one, two = rings(0.0, 0.0, False), rings(0.01, 0.1, True)
    met = face(one, "face", two, "face", np.array([0.0, 0.0, 1.0]))
    passed = met.loads @ np.ones(len(met.secondary))
    radius = np.hypot(*two.x[met.primary, :2].T)
    middle = np.abs(radius - 25.105) < 0.035
    assert np.abs(passed[middle] - 1.0).max() < 5e-3


def test_how_far_facets_miss_their_circle_is_known_node_by_node():
    """h²/8 of a pin of radius 1 whose lower half has sides a third as long, in a hole of more
    sides."""
    turn = np.pi * np.concatenate([np.linspace(0.0, 1.0, 13), np.linspace(1.0, 2.0, 37)[1:]])
    around = np.linspace(2.0 * np.pi, 0.0, 121)
    pin, hole = (
        curve(r * np.column_stack([np.cos(t), np.sin(t)]), 0.0, 2)
        for r, t in ((1.0, turn), (1.1, around))
    )
    facing = face(pin, "face", hole, "face", None)
    for chosen, angle in ((pin.x[:, 1] > 0.3, np.pi / 12.0), (pin.x[:, 1] < -0.3, np.pi / 36.0)):
        assert np.allclose(facing.sag[chosen], angle**2 / 8.0, rtol=0.02)


@pytest.mark.parametrize("seed", [53, 2239, 218412])
def test_triangles_cover_one_another_whole(seed):
    """Shadows of triangles have a side between two places that are one to round-off, which is no
    side."""
    rng = np.random.default_rng(seed)
    one, other = square(rng, 0, 0.0, up=True), square(rng, 0, 0.1, up=False)
    (elements, own), (others, opposite) = one.faces("face"), other.faces("face")
    found = own.segments(opposite, one.order[elements], other.order[others], None)
    np.testing.assert_allclose(np.bincount(found.face, found.weight), one.weight, rtol=1e-10)
    np.testing.assert_allclose(np.bincount(found.other, found.weight), other.weight, rtol=1e-10)


@pytest.mark.parametrize("height", [2.1, 1.9])
def test_the_far_side_of_a_body_is_not_met(height):
    """Two discs, one above the other, by all of their rims; and one pushed into the other, where
    they do overlap."""
    below = circle(np.random.default_rng(1), 1, 1.0, hole=False)
    above = curve(np.vstack([below.start, below.end[-1:]]) + np.array([0.0, height]), 1.0, 1)
    facing = face(above, "face", below, "face", None)
    gap = facing.distance[facing.met]
    assert above.x[facing.secondary][facing.met, 1].max() < height
    assert gap.min() == pytest.approx(height - 2.0, abs=0.05) and gap.max() < height


def test_the_far_side_of_a_ball_is_not_met():
    balls = [round_mesh(SphereSurface(np.array([0.0, 0.0, z]), 1.0), 0.5, 1) for z in (2.1, 0.0)]
    above, below = (replace(ball, part=0 * ball.part, part_names=("face",)) for ball in balls)
    facing = face(above, "face", below, "face", None)
    assert np.all(facing.met == (facing.distance < 10.0)) and facing.met.any()
    assert np.all(above.x[facing.secondary][facing.met, 2] < 2.1)
    assert facing.distance.min() == pytest.approx(0.1, abs=0.1)
    own, opposite = above.faces("face")[1], below.faces("face")[1]
    segments = own.segments(opposite, above.order, below.order, None)
    assert own.at(segments.face, segments.place)[0][:, 2].max() < 2.1
