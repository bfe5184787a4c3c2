"""Edges of bodies in space, and the angles there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapes import cuboid, elastic, moved

from petcontact import Problem
from petcontact.given.tables.base import parse
from petcontact.refinement.body_meshes import mesh_of
from petcontact.refinement.panels.edges import edges
from petcontact.refinement.panels.quartering import cut

HELD = moved("top", [0.0] * 3)
BOX = cuboid([0.0] * 3, [1.0] * 3)


def body_of(geometry, *boundary, ratio=0.3, **mesh):
    """A body and its mesh."""
    one = {
        "material": elastic(1.0, ratio),
        "geometry": geometry,
        "boundary": boundary,
        "mesh": {"order": 1, **mesh},
    }
    posed = parse(Problem, one, "a body")
    return posed.bodies[0], mesh_of(posed.bodies[0], posed.outline())


def turned(top):
    """A cone frustum of height 1 and radius 1 below."""
    loop = [("bottom", (1.0, 0.0)), ("side", (top, 1.0)), ("top", (0.0, 1.0)), ("axis", (0.0, 0.0))]
    return {"shape": "revolved", "loops": [[{"part": part, "to": to} for part, to in loop]]}


@pytest.mark.parametrize(("sizes", "missing"), [({}, 1e-6), ({"bottom": 0.2}, 0.2)])
def test_sides_that_end_at_the_middle_of_a_larger_panels_side_do_not_meet_it(sizes, missing):
    """Of a box whose panels are cut at random all twelve edges are there, and no others. A few
    pieces are missing where panels of neighbours do not match."""
    _, mesh = body_of(BOX, HELD, element_size=0.5, element_sizes=sizes)
    rng = np.random.default_rng(5)
    for _ in range(4):
        mesh = cut(mesh, rng.random((mesh.n_elements, 2)) < 0.2)
    one, other, angle, ends = edges(mesh)
    apart = mesh.part[one] != mesh.part[other]
    assert np.allclose(angle, np.where(apart, 0.5 * math.pi, math.pi), atol=1e-6)
    pairs = np.sort(np.column_stack([one, other])[apart], axis=1)
    first = np.unique(pairs, axis=0, return_index=True)[1]
    length = np.linalg.norm(np.diff(ends[apart][first], axis=1), axis=2).sum()
    assert length == pytest.approx(12.0, abs=missing)


def test_narrow_panels_meet_at_their_common_side_only():
    """Of panels 60 times as long as wide both outer sides lay within the tolerance."""
    _, mesh = body_of(BOX, HELD, element_size=0.1, exponent=4.0)
    angle = edges(mesh)[2]
    assert np.all(np.isclose(angle, 0.5 * math.pi) | np.isclose(angle, math.pi, atol=1e-6))


@pytest.mark.parametrize("top", [0.6, 1.2])
def test_a_cone_has_the_angle_of_its_held_edge(top):
    _, mesh = body_of(turned(top), HELD, element_size=0.7)
    angle = math.pi / 2.0 + math.atan(1.0 - top)
    names = np.array(mesh.part_names)
    one, other, at_edge, _ = edges(mesh)
    held = (names[mesh.part[one]] == "top") & (names[mesh.part[other]] == "side")
    assert held.any() and np.allclose(at_edge[held], angle, atol=math.radians(1.0))
