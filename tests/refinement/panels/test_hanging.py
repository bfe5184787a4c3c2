"""Curved panels of different sizes side by side: the boundary stays closed."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import Cylinder, Revolved, Sphere
from petcontact import OutlineSide as Side
from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.geometry.quadratic import QuadraticCells
from petcontact.mesh.panelling import round_mesh
from petcontact.refinement.panels.axes import sides
from petcontact.refinement.panels.quartering import cut


def moved(mesh):
    """Largest tractions' part of ∑H + ½ on a translation and a rotation, over about 1."""
    most = 0.0
    for motion in (
        np.tile([1.0, -2.0, 0.5], (mesh.n_nodes, 1)),
        np.cross(mesh.x, [0.3, 1.0, -0.4]),
    ):
        defect = 0.5 * motion
        for batch in mesh.batches():
            defect = defect + np.einsum(
                "ijkm,kj->mi", integrals(mesh.x, batch.elements, 0.3)[1], motion[batch.nodes]
            )
        most = max(most, float(np.abs(defect).max()))
    return most


@pytest.mark.slow
@pytest.mark.parametrize(
    "shape",
    [Sphere((0, 0, 0), 1.0), Cylinder((0, 0, 0), (0, 0, 1.0), 0.7)],
    ids=["ball", "cylinder"],
)
def test_rigid_motions_where_sides_hang_twice_over(shape):
    """1e-8 after a panel was cut and one of its pieces once more, beside the first ones; with slits
    1e-3 to 1e-2."""
    surface = shape.outline()
    mesh = round_mesh(surface, 1.2, 2)
    for count in (1, 2):
        along = np.zeros((mesh.n_elements, 2), dtype=bool)
        along[-count:] = True
        mesh = cut(mesh, along, surface)
    assert moved(mesh) < 1e-8


SQUARE = [Side("below", (2, 0)), Side("outer", (2, 1)), Side("top", (1, 1)), Side("inner", (1, 0))]


@pytest.mark.parametrize(
    ("shape", "radius"),
    [(Cylinder((0, 0, 0), (0, 0, 1.0), 0.7), 0.7), (Revolved([SQUARE], angle=90.0), 2.0)],
    ids=["cylinder", "ring"],
)
def test_pieces_of_narrow_panels_at_a_rim_keep_their_width(shape, radius):
    """Panels beside the rim are halved across it until they are 1 / 64 as wide. What belongs on
    the rim does not depend on their length: with points within 2 % of it the last two collapse."""
    surface = shape.outline()
    mesh, widths = round_mesh(surface, 0.5 * radius, 2), []
    for _ in range(7):
        inwards = radius - np.hypot(mesh.corners[..., 0], mesh.corners[..., 1])
        beside = (np.abs(inwards) < 1e-9).any(axis=1) & (mesh.part == surface.parts.index("top"))
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
