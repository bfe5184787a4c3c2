"""Where elements begin and end, and what a mesh knows about its nodes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from smooth_field import TOE as SIDES

from petcontact import Circle, InputError, MeshOptions, Polygon, Rectangle, SideBySide
from petcontact.mesh.grading import mesh_outline

BOX = Rectangle(lower_left=(0.0, 0.0), upper_right=(8.0, 4.0))
RING = SideBySide(
    loops=(
        Circle(part="rim", center=(1.0, 2.0), radius=2.0),
        Circle(part="hole", center=(1.5, 2.0), radius=0.5),
    )
)
TOE = SideBySide(loops=(SIDES,))


def mesh(body, **options):
    return mesh_outline(body.outline(), MeshOptions(**options))


@pytest.mark.parametrize(
    ("size", "counts"), [(0.05, (160, 80)), (3.0, (3, 1)), (100.0, (1, 1)), (2.0 / 3.0, (12, 6))]
)
def test_a_side_has_round_l_over_h_equal_elements(size, counts):
    m = mesh(BOX, element_size=size)
    per_part = [int(np.sum(m.part == k)) for k in range(4)]
    assert per_part == [counts[0], counts[1], counts[0], counts[1]]
    for k, length in enumerate((8.0, 4.0, 8.0, 4.0)):
        assert np.allclose(m.length[m.part == k], length / per_part[k], rtol=1e-12)
    assert m.n_nodes == m.n_elements and np.allclose(m.x, 0.5 * (m.start + m.end))


def test_element_size_of_single_parts():
    m = mesh(BOX, element_size=1.0, element_sizes={"bottom": 0.25})
    assert [int(np.sum(m.part == k)) for k in range(4)] == [32, 4, 8, 4]
    with pytest.raises(
        InputError,
        match=r"mesh\.element_sizes\.botom: no such part; parts are bottom, right, top, left",
    ):
        mesh(BOX, element_size=1.0, element_sizes={"botom": 0.25})


@pytest.mark.parametrize("body", [BOX, RING, TOE], ids=["box", "ring", "toe"])
@pytest.mark.parametrize(
    "options", [{"element_size": 0.3}, {"levels": 5}, {"element_size": 0.4, "order": 2}]
)
def test_weights_nodes_and_normals(body, options):
    """Divergence theorem: lengths, area and centroid of the body from nodes, normals and weights
    alone."""
    m = mesh(body, **options)
    sides = body.outline().sides
    assert m.weight.sum() == pytest.approx(sum(side.length for side in sides), rel=1e-12)
    assert np.allclose(np.hypot(*m.normal.T), 1.0, rtol=1e-14)
    assert np.allclose(m.weight @ m.normal, 0.0, atol=1e-5 if m.order[0] else 5e-3)
    area = body.outline().polygon(4000).area
    assert 0.5 * m.weight @ np.sum(m.x * m.normal, axis=1) == pytest.approx(area, rel=2e-3)
    assert np.array_equal(np.sort(np.unique(m.element)), np.arange(m.n_elements))


def test_graded_mesh_shrinks_by_the_ratio_towards_corners_and_points():
    m = mesh(BOX, grading=0.4, levels=6, graded_points=((3.0, 0.0),))
    bottom = np.flatnonzero(m.part == 0)
    length = m.length[bottom]
    assert len(length) == 4 * 7
    assert np.any(np.isclose(m.end[bottom, 0], 3.0, rtol=0.0, atol=1e-15))
    first, second = length[:14], length[14:]
    for piece, whole in ((first, 3.0), (second, 5.0)):
        assert piece.sum() == pytest.approx(whole) and np.allclose(piece, piece[::-1])
        assert np.allclose(piece[1:6] / piece[2:7], [0.4] * 5, rtol=1e-9)
        assert piece[0] == pytest.approx(0.5 * whole * 0.4**6, rel=1e-9)


def test_graded_point_off_the_boundary_is_refused():
    with pytest.raises(InputError, match=r"graded_points: \[3.0, 0.1\] lies 0.1 off the boundary"):
        mesh(BOX, graded_points=((3.0, 0.1),))
    inside = mesh(TOE, levels=4, graded_points=((1.0 - math.sqrt(0.5), 1.0 - math.sqrt(0.5)),))
    assert np.sum(inside.part == inside.part_names.index("toe")) == 2 * 10


@pytest.mark.parametrize("shift", [0.0, 1000.0])
def test_half_an_element_is_rounded_up_however_a_body_lies(shift):
    """l/h = 2.5 on all sides: three elements on each, turned by any angle."""
    for angle in np.linspace(0.0, 3.0, 40):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        corners = 1.5 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) @ turn.T + shift
        body = Polygon(vertices=corners.tolist(), parts=["bottom", "right", "top", "left"])
        assert len(mesh_outline(body.outline(), MeshOptions(element_size=0.6)).x) == 12
