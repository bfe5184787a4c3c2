"""Curved panels of different sizes side by side: the boundary stays closed."""

from __future__ import annotations

import numpy as np
import pytest
from curved_bodies import vector_area

from petcontact import Cylinder, Revolved, Sphere
from petcontact import OutlineSide as Side
from petcontact.geometry.quadratic import QuadraticCells
from petcontact.mesh.panelling import round_mesh
from petcontact.refinement.panels.cut_directions import sides
from petcontact.refinement.panels.quartering import cut

CYLINDER = Cylinder((0, 0, 0), (0, 0, 1.0), 0.7)


@pytest.mark.parametrize("shape", [Sphere((0, 0, 0), 1.0), CYLINDER], ids=["ball", "cylinder"])
def test_hanging_sides_lie_on_those_of_their_neighbours(shape):
    """After panels are cut at random, and their pieces again; with slits 4e-4."""
    surface, rng = shape.outline(), np.random.default_rng(4)
    mesh = round_mesh(surface, 1.2, 2)
    for _ in range(2):
        mesh = cut(mesh, rng.random((mesh.n_elements, 2)) < 0.2, surface)
    assert np.abs(vector_area(mesh)).max() < 1e-14


SQUARE = [Side("below", (2, 0)), Side("outer", (2, 1)), Side("top", (1, 1)), Side("inner", (1, 0))]


@pytest.mark.parametrize(
    ("shape", "radius", "some"),
    [
        (CYLINDER, 0.7, np.inf),
        (Revolved([SQUARE], angle=90.0), 2.0, np.inf),
        (Revolved([SQUARE], angle=90.0), 2.0, 0.8),
    ],
    ids=["cylinder", "ring", "ring beside large panels"],
)
def test_pieces_of_narrow_panels_at_a_rim_keep_their_width(shape, radius, some):
    """Panels beside the rim, or some of them, are halved across it until they are 1 / 64 as wide.
    What belongs on the rim does not depend on their length, nor on that of their neighbours: with
    points within 2 % of it the last two collapse."""
    surface = shape.outline()
    mesh, widths = round_mesh(surface, 0.5 * radius, 2), []
    for _ in range(7):
        inwards = radius - np.hypot(mesh.corners[..., 0], mesh.corners[..., 1])
        beside = (np.abs(inwards) < 1e-9).any(axis=1) & (mesh.part == surface.parts.index("top"))
        beside &= np.angle(mesh.corners @ [1.0, 1.0j, 0.0]).max(axis=1) < some
        widths.append(inwards[beside].max(axis=1))
        centre = mesh.corners[..., :2].mean(axis=1)
        along = np.abs(np.sum(sides(mesh)[..., :2] * centre[:, None], axis=2))
        across = beside[:, None] & (along == along.max(axis=1, keepdims=True))
        mesh, before = cut(mesh, across, surface), mesh
    assert all(np.ptp(width) < 1e-9 for width in widths)
    assert np.allclose(np.array(widths)[1:], 0.5 * np.array(widths)[:-1], rtol=0.05)
    cells = QuadraticCells(np.concatenate([before.corners, before.middles], axis=1)[beside])
    assert cells.distortion.max() < 2.0
    assert np.abs(mesh.weight @ mesh.normal).max() < 1e-6 * mesh.weight.sum()
