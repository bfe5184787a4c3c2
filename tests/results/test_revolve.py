"""Half sections turned about their axis, for ParaView and in figures."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from shapes import elastic, moved, rectangle

from petcontact import InputError, Problem, solve
from petcontact.commands.main import main
from petcontact.given.tables.base import parse
from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.results.figures.turned import turned
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
    whole = revolved(meshio.Mesh(SECTION, cells, point_data=data, cell_data=part), degrees)
    assert whole.point_data["u"] == pytest.approx(whole.points, abs=1e-6)
    assert whole.point_data["stress"] == pytest.approx(outer(whole.points), abs=1e-6)
    assert np.array_equal(whole.point_data["height"], whole.points[:, 2])
    (block,), (numbers,) = whole.cells, whole.cell_data["part"]
    assert len(block.data) == len(numbers)
    corners, share = whole.points[block.data], degrees / 360.0
    if kind == "line":
        normal = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(12 * np.pi * share, rel=3e-3)
        assert np.all(np.einsum("nd,nd->n", normal, corners.mean(axis=1) - [0.0, 0.0, 0.5]) > 0.0)
    else:
        assert block.type == "wedge"
        sides = [corners[:, [0, 1, 2, 3]], corners[:, [1, 2, 3, 4]], corners[:, [2, 3, 4, 5]]]
        volumes = [np.abs(np.linalg.det(s[:, 1:] - s[:, :1])) / 6.0 for s in sides]
        assert np.sum(volumes) == pytest.approx(4 * np.pi * share, rel=3e-3)


def test_a_figure_has_the_bodies_cut_open_in_space(tmp_path):
    """A cylinder of radius and height 1 that is stretched: its sides and two half sections."""
    body = {"name": "rod", "material": elastic(1.0, 0.0), "mesh": {"element_size": 0.5, "order": 2}}
    body |= {"geometry": rectangle([0.0, 0.0], [1.0, 1.0])}
    body |= {"boundary": [moved("bottom", [0.0, 0.0]), moved("top", [0.0, 0.01])]}
    rod = solve(parse(Problem, {"symmetry": "axial", "body": [body]}, "rod"))
    for degrees, sections in ((270.0, 2), (360.0, 0)):
        surface = turned(rod, "rod", degrees)
        corners = surface.x[surface.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = 0.5 * np.linalg.norm(normal, axis=1).sum()
        assert area == pytest.approx(4.0 * np.pi * degrees / 360.0 + sections, rel=3e-3)
        assert surface.u[:, 2] == pytest.approx(0.01 * surface.x[:, 2], abs=1e-4)
        assert surface.values == pytest.approx(0.01, rel=1e-3)
    rod.save(tmp_path / "rod.h5")
    assert main(["plot", str(tmp_path / "rod.h5"), "--revolve"]) == 0
    assert (tmp_path / "rod-revolved.png").exists()


def test_what_cannot_be_turned_is_refused():
    with pytest.raises(InputError, match="--revolve 400: must be an angle up to 360 degrees"):
        check_revolved([], 400.0)
    plane = CurveMesh.__new__(CurveMesh)
    with pytest.raises(InputError, match="--revolve: turns bodies of revolution"):
        check_revolved([plane], 90.0)
