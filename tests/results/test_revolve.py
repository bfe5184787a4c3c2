"""Half sections turned about their axis for ParaView."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

from petcontact import InputError
from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.results.vtu.revolve import check_revolved, revolved

SECTION = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
KINDS = {
    "triangle": np.array([[0, 1, 2], [0, 2, 3]]),
    "line": np.array([[0, 1], [1, 2], [2, 3]]),
}


def outer(x):
    """x xᵀ in VTK's order."""
    a, b, c = x.T
    return np.column_stack([a * a, b * b, c * c, a * b, b * c, a * c])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degrees", [90.0, 360.0])
def test_cells_vectors_and_tensors_turn(kind, degrees):
    """The field u = x and σ = x xᵀ is one of revolution."""
    data = {"u": SECTION, "stress": outer(SECTION), "height": SECTION[:, 1]}
    cells = [(kind, KINDS[kind])]
    part = {"part": [np.arange(len(KINDS[kind]))]}
    turned = revolved(meshio.Mesh(SECTION, cells, point_data=data, cell_data=part), degrees)
    assert turned.point_data["u"] == pytest.approx(turned.points, abs=1e-15)
    assert turned.point_data["stress"] == pytest.approx(outer(turned.points), abs=1e-14)
    assert np.array_equal(turned.point_data["height"], turned.points[:, 2])
    (block,), (numbers,) = turned.cells, turned.cell_data["part"]
    assert len(block.data) == len(numbers)
    corners, share = turned.points[block.data], degrees / 360.0
    if kind == "line":
        normal = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(12 * np.pi * share, rel=3e-3)
        assert np.all(np.einsum("nd,nd->n", normal, corners.mean(axis=1) - [0.0, 0.0, 0.5]) > 0.0)
    else:
        assert block.type == "wedge"
        sides = [corners[:, [0, 1, 2, 3]], corners[:, [1, 2, 3, 4]], corners[:, [2, 3, 4, 5]]]
        volumes = [np.abs(np.linalg.det(s[:, 1:] - s[:, :1])) / 6.0 for s in sides]
        assert np.sum(volumes) == pytest.approx(4 * np.pi * share, rel=3e-3)


def test_what_cannot_be_turned_is_refused():
    with pytest.raises(InputError, match="--revolve 400: must be an angle up to 360 degrees"):
        check_revolved([], 400.0)
    plane = CurveMesh.__new__(CurveMesh)
    with pytest.raises(InputError, match="--revolve: turns bodies of revolution"):
        check_revolved([plane], 90.0)
