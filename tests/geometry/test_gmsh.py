"""Gmsh files as outlines, and one file with two bodies. The files in tests/data were written by Gmsh
4.15.2: a plate 4 x 3 with a hole of radius 0.75."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from petcontact import Gmsh, InputError

DATA = Path(__file__).parents[1] / "data"
ALL = "plate_v22 plate_v41 plate_v41_binary plate_lines plate_v22_order2 plate_v41_order2"


def outline(name):
    return Gmsh(file=str(DATA / f"{name}.msh")).outline()


@pytest.mark.parametrize("name", ALL.split())
def test_physical_groups_are_parts_and_loops_are_closed(name):
    body = outline(name)
    assert sorted(body.parts) == ["9", "bottom", "sides", "top"]
    assert len(body.loops) == 2 and {side.part for side in body.loops[1]} == {"9"}
    length = [
        sum(side.length for side in body.sides if side.part == part)
        for part in ("bottom", "sides", "top")
    ]
    assert length == pytest.approx([4.0, 6.0, 4.0], rel=1e-14)
    corners = np.array([side.start for side in body.loops[0]])
    assert np.array_equal(corners.min(axis=0), [0.0, 0.0])
    assert np.array_equal(corners.max(axis=0), [4.0, 3.0])


@pytest.mark.parametrize("name", ["plate_v22_order2", "plate_v41_order2"])
def test_lines_of_second_order_become_arcs_on_the_circle(name):
    body = outline(name)
    assert np.allclose([side.curvature for side in body.loops[1]], -1.0 / 0.75, rtol=1e-12)
    assert all(side.curvature == 0.0 for side in body.loops[0])
    assert sum(side.length for side in body.loops[1]) == pytest.approx(1.5 * math.pi, rel=1e-12)


def edited(tmp_path, old, new):
    text = (DATA / "plate_v22.msh").read_text()
    assert old in text
    path = tmp_path / "edited.msh"
    path.write_text(text.replace(old, new))
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("\n2 4 0 0\n", "\n2 4 0 1\n", "the surface is open"),
        ("\n2 4 0 0\n", "\n2 nan 0 0\n", "not finite"),
        ("\n2 4 0 0\n", "\n2 9 9 0\n", "crosses or touches"),
        ("$Elements", "$Elephants", "no line is in a physical group"),
        ("2.2 0 8", "9.9 0 8", "not a Gmsh mesh"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message) as caught:
        Gmsh(file=str(edited(tmp_path, old, new))).outline()
    said = str(caught.value)
    assert "\n" not in said and ("edited.msh" in said or said.startswith("geometry"))


def test_truncated_missing_and_foreign_files_are_refused(tmp_path):
    text = (DATA / "plate_v41.msh").read_bytes()
    path = tmp_path / "cut.msh"
    for size in (0, 10, len(text) // 3, 2 * len(text) // 3):
        path.write_bytes(text[:size])
        with pytest.raises(
            InputError, match=r"cut\.msh: (not a Gmsh mesh|no line is in)"
        ) as caught:
            Gmsh(file=str(path)).outline()
        assert "array" not in str(caught.value)  # numpy's words are nobody's
        if size > 100:
            assert re.search(r"cut off inside \$(Nodes|Elements|Entities)", str(caught.value))
    # numbers that end half-way: as many as twice the triangles
    lines = text.splitlines()
    block = next(k for k, line in enumerate(lines) if line.split()[::2] == [b"2", b"2"])
    half = block + 1 + int(lines[block].split()[3]) // 2
    path.write_bytes(b"\n".join([*lines[:half], b"X"]))
    with pytest.raises(InputError, match=r"cut\.msh: .*(cells of type triangle have no 3|cut off)"):
        Gmsh(file=str(path)).outline()
    with pytest.raises(InputError, match="No such file"):
        Gmsh(file=str(tmp_path / "none.msh")).outline()


def test_files_that_meshio_cannot_read_are_refused_with_advice():
    """Saved with Mesh.SaveAll, so that some lines are in a group and other cells in none."""
    with pytest.raises(InputError, match=r"save it as format 2\.2 or 4\.1 without Mesh\.SaveAll"):
        outline("plate_all")


def test_cells_that_are_there_twice_are_refused(tmp_path):
    """None of their edges belongs to one cell only: there is no boundary."""
    elements = (DATA / "plate_v22.msh").read_text().partition("$Elements\n72\n")[2]
    elements = elements.partition("$EndElements")[0]
    twice = edited(tmp_path, f"72\n{elements}", f"144\n{elements}{elements}")
    with pytest.raises(InputError, match=r"edited\.msh: damaged .*no boundary"):
        Gmsh(file=str(twice)).outline()


def test_a_line_in_no_group_is_unnamed_where_cells_tell_the_boundary(tmp_path):
    """Without cells the loop is open."""
    mesh = (DATA / "plate_v22.msh").read_text().splitlines()
    first = next(k for k, line in enumerate(mesh) if line == "$Elements")
    lines = [k for k in range(first + 2, len(mesh)) if mesh[k].split()[1:2] == ["1"]]
    for keep_cells in (True, False):
        kept = [
            line
            for k, line in enumerate(mesh[first + 2 :], first + 2)
            if k != lines[0] and not line.startswith("$") and (keep_cells or line.split()[1] == "1")
        ]
        path = tmp_path / "open.msh"
        path.write_text("\n".join([*mesh[: first + 1], str(len(kept)), *kept, "$EndElements", ""]))
        if keep_cells:
            sides = Gmsh(file=str(path)).outline().sides
            assert [side.part for side in sides].count("unnamed") == 1
        else:
            with pytest.raises(InputError, match="must form closed loops"):
                Gmsh(file=str(path)).outline()


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


CUBE = np.array(list(itertools.product((0, 1), repeat=3)), dtype=float)
HEXAHEDRON = [0, 4, 6, 2, 1, 5, 7, 3]
TETRAHEDRA = [[0, 4, 6, 1], [0, 6, 2, 1], [4, 5, 6, 1], [6, 5, 7, 1], [2, 6, 3, 1], [6, 7, 3, 1]]


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize(("kind", "cells"), [("hexahedron", [HEXAHEDRON]), ("tetra", TETRAHEDRA)])
def test_sides_in_space_that_are_in_no_group_are_unnamed_where_cells_tell_the_boundary(
    tmp_path, kind, cells, second
):
    """A cube of which the bottom only is in a group."""
    points, corners = CUBE, np.array(cells)
    bottom = [[0, 4, 6, 2]] if kind == "hexahedron" else [[0, 4, 6], [0, 6, 2]]
    flat = "quad" if kind == "hexahedron" else "triangle"
    blocks, order = [(flat, bottom), (kind, corners)], ""
    if second:  # middles by meshio's order of nodes
        edges = np.array([p[0] for p in sorted(EDGES[kind].items(), key=lambda p: p[1])])
        ends = np.sort(corners[:, edges], axis=2).reshape(-1, 2)
        unique, place = np.unique(ends, axis=0, return_inverse=True)
        points = np.vstack([points, points[unique].mean(axis=1)])
        middles = 8 + place.reshape(len(corners), -1)
        kind, order = f"{kind}{corners.shape[1] + len(edges)}", "2"
        known = {tuple(e): 8 + k for k, e in enumerate(unique.tolist())}
        sides = [list(zip(b, [*b[1:], b[0]], strict=True)) for b in bottom]
        more = [[known[min(e), max(e)] for e in own] for own in sides]
        flat = "quad8" if flat == "quad" else "triangle6"
        blocks = [
            (flat, np.hstack([bottom, more])),
            (kind, np.hstack([corners, middles])),
        ]
    tags = [[1] * len(bottom), [5] * len(corners)]
    names = {"bottom": (1, 2), "cube": (5, 3)}
    file = written(tmp_path / f"cube{order}.msh", points, blocks, tags, names)
    for surface in (None, "cube"):
        found = Gmsh(file, surface=surface).outline()
        assert set(found.parts) == {"bottom", "unnamed"}
        assert len(found.facets) == (6 if flat.startswith("quad") else 12)
        own = found.part == found.parts.index("bottom")
        assert np.all(found.points[found.facets[own][found.facets[own] >= 0], 2] == 0.0)


EDGES = {
    "tetra": {(0, 1): 4, (1, 2): 5, (2, 0): 6, (0, 3): 7, (1, 3): 8, (2, 3): 9},
    "hexahedron": {
        **{(0, 1): 8, (1, 2): 9, (2, 3): 10, (3, 0): 11, (4, 5): 12, (5, 6): 13},
        **{(6, 7): 14, (7, 4): 15, (0, 4): 16, (1, 5): 17, (2, 6): 18, (3, 7): 19},
    },
}
"""Numbers of the middles of edges in a cell, as VTK has them."""


def test_a_name_that_is_not_there_is_named_with_those_that_are(squares):
    with pytest.raises(InputError, match="no physical surface 'top'; there are left, right"):
        Gmsh(squares, surface="top").outline()
    with pytest.raises(InputError, match=r"surface: is for .msh files"):
        Gmsh("part.step", surface="left")
