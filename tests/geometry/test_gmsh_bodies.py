"""One file of Gmsh with two bodies: each takes its surface, in space its volume, and meets the other
at the sides that both have."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

from petcontact import Gmsh, InputError


def written(path, points, cells, tags, names):
    """A file of format 2.2; names are (tag, dimension)."""
    data = {key: [np.array(tag) for tag in tags] for key in ("gmsh:physical", "gmsh:geometrical")}
    groups = {name: np.array(group) for name, group in names.items()}
    meshio.Mesh(np.array(points, float), cells, cell_data=data, field_data=groups).write(
        path, file_format="gmsh22", binary=False
    )
    return str(path)


@pytest.fixture
def squares(tmp_path):
    """Two unit squares beside each other."""
    points = [(x, y, 0.0) for y in (0, 1) for x in (0, 1, 2)]
    lines = [[0, 1], [1, 2], [2, 5], [5, 4], [4, 3], [3, 0], [1, 4]]
    cells = [("line", lines), ("triangle", [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])]
    names = {"rim": (1, 1), "joint": (2, 1), "left": (5, 2), "right": (6, 2)}
    tags = [[1, 1, 1, 1, 1, 1, 2], [5, 5, 6, 6]]
    return written(tmp_path / "two.msh", points, cells, tags, names)


def test_each_plane_body_has_its_own_sides_and_the_joint(squares):
    for name, low in (("left", 0.0), ("right", 1.0)):
        outline = Gmsh(squares, surface=name).outline()
        x = np.array([side.start[0] for loop in outline.loops for side in loop])
        assert set(outline.parts) == {"rim", "joint"} and len(x) == 4
        assert (x.min(), x.max()) == (low, low + 1.0)


def test_each_body_in_space_is_what_lies_around_its_volume(tmp_path):
    """Two tetrahedra on one triangle."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]]
    sides = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 4], [1, 2, 4], [2, 0, 4], [0, 1, 2]]
    cells = [("triangle", sides), ("tetra", [[0, 1, 2, 3], [0, 2, 1, 4]])]
    names = {"rim": (1, 2), "joint": (2, 2), "up": (5, 3), "down": (6, 3)}
    file = written(tmp_path / "two.msh", points, cells, [[1] * 6 + [2], [5, 6]], names)
    for name, tip in (("up", 1.0), ("down", -1.0)):
        surface = Gmsh(file, surface=name).outline()
        used = surface.points[np.unique(surface.facets[surface.facets >= 0])]
        assert len(surface.facets) == 4 and set(surface.parts) == {"rim", "joint"}
        assert {0.0, tip} == set(used[:, 2].tolist())


def test_a_name_that_is_not_there_is_named_with_those_that_are(squares):
    with pytest.raises(InputError, match="no physical surface 'top'; there are left, right"):
        Gmsh(squares, surface="top").outline()
    with pytest.raises(InputError, match=r"surface: is for .msh files"):
        Gmsh("part.step", surface="left")
