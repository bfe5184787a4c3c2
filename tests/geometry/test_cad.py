"""CAD files: what Gmsh makes of real ones, where its package is installed, and what is said where
it is not."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from petcontact import Gmsh, InputError, load
from petcontact.commands.main import main
from petcontact.errors import OutputError
from petcontact.geometry.cad import part as cad_part
from petcontact.geometry.cad.step_names import face_names
from petcontact.mesh.panelling import facet_mesh
from petcontact.refinement.panels.cut_directions import at_edges
from petcontact.refinement.panels.quartering import cut

FOOT = Path(__file__).parents[2] / "configs" / "cad" / "foot.step"
needs_gmsh = pytest.mark.skipif(
    importlib.util.find_spec("gmsh") is None, reason="Gmsh is not installed (scripts/setup --cad)"
)


def written(path, build):
    """A CAD file of what `build` makes with Gmsh's OpenCASCADE."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        build(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return str(path)


def bored_block(occ):
    occ.cut([(3, occ.addBox(0, 0, 0, 4, 3, 2))], [(3, occ.addCylinder(2, 1.5, -1, 0, 0, 4, 0.5))])


def measures(surface, size):
    """Area and volume of the mesh, and the integral of its normals."""
    mesh = facet_mesh(surface.facets(size), 2)
    volume = float(np.sum(mesh.x * mesh.normal * mesh.weight[:, None]) / 3.0)
    return float(mesh.weight.sum()), volume, mesh.weight @ mesh.normal


@needs_gmsh
def test_surfaces_of_an_iges_file_are_sewn(tmp_path):
    """Such a file has surfaces, but no solids."""

    def two(occ):
        bored_block(occ)
        occ.addSphere(10.0, 0.0, 0.0, 1.0)

    file = written(tmp_path / "part.iges", two)
    for solid, volume in ((1, 24 - np.pi / 2), (2, 4.0 / 3.0 * np.pi)):
        assert measures(Gmsh(file, solid=solid).outline(), 0.5)[1] == pytest.approx(
            volume, rel=3e-3
        )


@needs_gmsh
def test_cells_end_where_other_solids_of_a_file_end(tmp_path):
    """A pin stands on a block: the circle of its foot, where p is infinite, consists of sides of
    cells, and the block keeps its area. Beside a hole that is hardly narrower cells are as short as
    the strip between both asks for."""

    def joint(occ):
        bored_block(occ)
        occ.addCylinder(2, 1.5, 2, 0, 0, 1, 0.8)

    surface = cad_part.cad_surface(written(tmp_path / "joint.step", joint), solid=1)
    facets = surface.facets(1.0)
    mesh = facet_mesh(facets, 2)
    top = max(surface.faces, key=lambda face: face.centre[2])
    middles = mesh.middles[mesh.elements_of(top.part), :4].reshape(-1, 3)
    away = np.hypot(*(middles[:, :2] - [2.0, 1.5]).T)
    foot = np.abs(away - 0.8) < 1e-6
    # each side belongs to a cell inside and to one outside
    assert np.count_nonzero(foot) >= 2 * np.ceil(2.0 * np.pi * 0.8 / (3.0 * 0.3))
    inside = mesh.x[mesh.nodes_of(top.part)][:, :2] - [2.0, 1.5]
    weight = mesh.weight[mesh.nodes_of(top.part)]
    ring = weight[np.hypot(*inside.T) < 0.8].sum()
    np.testing.assert_allclose(ring, np.pi * (0.64 - 0.25), rtol=2e-3)
    np.testing.assert_allclose(weight.sum(), top.area, rtol=2e-3)


@needs_gmsh
def test_panels_of_a_block_are_cut_across_its_rims_only(tmp_path):
    """As those of a box: cells are quadrilaterals, and those that end at the edge of a face are
    cut to a strip there. Triangles had to be cut along it, too."""
    file = written(tmp_path / "block.step", lambda occ: occ.addBox(0, 0, 0, 6, 6, 3))
    surface = Gmsh(file).outline()
    assert surface.known
    mesh = facet_mesh(surface.facets(1.5), 1)
    assert not np.any(np.isnan(mesh.corners))
    (top,) = (face.part for face in surface.faces if face.centre[2] == pytest.approx(3.0))
    once = cut(mesh, at_edges(mesh, top, []), surface)
    twice = cut(once, at_edges(once, top, []), surface)
    low, high = (box[twice.elements_of(top)] for box in twice.boxes)
    rim = np.any((low[:, :2] < 1e-6) | (high[:, :2] > 6.0 - 1e-6), axis=1)
    width = (high - low)[:, :2]
    away = np.any((low[:, :2] > 1.0) & (high[:, :2] < 5.0), axis=1)
    corner = rim & (width.max(axis=1) < 0.7)
    np.testing.assert_allclose(width[rim].min(axis=1), 0.375, rtol=0.3)
    assert np.count_nonzero(corner) <= 4 * 4 and away.any()


@needs_gmsh
def test_the_tip_of_a_cone_is_meshed(tmp_path):
    """Its curvature has no bound."""
    file = written(tmp_path / "cone.step", lambda occ: occ.addCone(0, 0, 0, 0, 0, 10, 5, 0))
    volume = 25.0 * np.pi * 10.0 / 3.0
    assert measures(Gmsh(file).outline(), 1.0)[1] == pytest.approx(volume, rel=5e-3)


@needs_gmsh
def test_a_file_that_takes_too_long_is_refused_with_a_remedy(monkeypatch):
    monkeypatch.setattr(cad_part, "LIMIT", 0.01)
    with pytest.raises(InputError, match=r"not read in 0.01 s; give a larger mesh.element_size"):
        cad_part.ask(str(FOOT))


@needs_gmsh
def test_a_size_that_works_is_named_where_one_does_not(tmp_path, monkeypatch):
    surface = Gmsh(written(tmp_path / "block.step", bored_block)).outline()
    meshed = cad_part._facets

    def only_fine(surface, size):
        if size > 0.6:
            raise InputError(f"{surface.file}: {surface.solid}: no")
        return meshed(surface, size)

    monkeypatch.setattr(cad_part, "_facets", only_fine)
    with pytest.raises(InputError, match=r"solid .*: no; mesh.element_size = 0.5 works"):
        surface.facets(1.0)
    with pytest.raises(InputError, match="mend the solid in the CAD program"):
        surface.facets(8.0)


@needs_gmsh
@pytest.mark.parametrize("suffix", ["step", "brep"])
def test_surfaces_are_listed_and_meshed_by_curved_cells(tmp_path, suffix):
    file = written(tmp_path / f"block.{suffix}", bored_block)
    surface = Gmsh(file, parts={"bore": [7]}).outline()
    assert surface.parts == ("1", "2", "3", "4", "5", "6", "bore")
    assert [face.kind for face in surface.faces] == ["Plane"] * 6 + ["Cylinder"]
    exact = 2 * (12 + 8 + 6) - 2 * np.pi / 4 + 2 * np.pi, 24 - np.pi / 2
    assert surface.area == pytest.approx(exact[0], rel=1e-9)
    coarse, fine = measures(surface, 2.0), measures(surface, 0.25)
    assert 0.7 < surface.area / 0.25**2 / len(surface.facets(0.25).facets) < 1.5
    assert fine[:2] == pytest.approx(exact, rel=1e-5) and np.abs(fine[2]).max() < 1e-6
    assert abs(fine[1] - exact[1]) < 0.25 * abs(coarse[1] - exact[1]) < 1e-2
    facets = surface.facets(0.25)
    bore = facets.points[facets.middles[facets.part == facets.parts.index("bore"), :3]]
    assert np.hypot(bore[..., 0] - 2.0, bore[..., 1] - 1.5) == pytest.approx(0.5, rel=1e-4)


@needs_gmsh
def test_names_of_the_file_are_parts_and_the_mesh_is_the_same_each_time(tmp_path):
    surface = Gmsh(str(FOOT), parts={"flange": [3]}).outline()
    assert surface.parts == ("1", "2", "flange", "4", "5", "6", "7", "sole")
    files = [tmp_path / "one.msh", tmp_path / "two.msh"]
    for file in files:
        surface.write_msh(file, 3.0)
    assert files[0].read_bytes() == files[1].read_bytes()
    mesh = Gmsh(str(files[0])).outline()
    assert set(mesh.parts) == set(surface.parts) and np.any(mesh.middles >= 0)
    sole = mesh.points[mesh.facets[mesh.part == mesh.parts.index("sole"), :3]]
    assert np.linalg.norm(sole - [0, 0, 60], axis=2) == pytest.approx(60.0)


@needs_gmsh
def test_the_command_lists_surfaces_and_writes_a_mesh(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", str(FOOT), "--size", "4", "--part", "flange=3", "-o", "foot.msh"]) == 0
    lines = capsys.readouterr().out.splitlines()
    found = [word.strip() for word in lines[4].split("|")[1:6]]
    assert found == ["3", "flange", "Plane", "144", "0 0 6"]
    assert lines[-1] == "foot.msh" and [path.name for path in tmp_path.iterdir()] == ["foot.msh"]
    assert main(["mesh", str(FOOT), "--size", "1e-4", "-o", "foot.msh"]) == 2
    assert "5e+06 at most are made; a size of 0.0" in capsys.readouterr().err


@needs_gmsh
def test_a_body_of_a_cad_file_is_solved_and_its_result_read_without_gmsh(tmp_path, monkeypatch):
    """A bar pulled along x: uniform stress, exact on every mesh."""
    written(tmp_path / "bar.step", lambda occ: occ.addBox(0, 0, 0, 2, 1, 1))
    (tmp_path / "bar.toml").write_text("""
        material = { young_modulus = 100.0, poisson_ratio = 0.3 }
        geometry = { shape = "gmsh", file = "bar.step", parts = { left = [1], right = [2], bottom = [5], rest = [3, 4, 6] } }
        mesh = { element_size = 1.0, order = 1 }
        boundary = [
            { part = "left", condition = "symmetry" }, { part = "right", condition = "traction", value = [1.0, 0.0, 0.0] },
            { part = "bottom", condition = "contact", friction_bound = 0.0 },
            { part = "rest", condition = "displacement", value = ["free", "-0.003*y", "free"] },
        ]
    """)
    monkeypatch.chdir(tmp_path)
    assert main(["solve", "bar.toml", "-o", "bar.h5", "--no-figures"]) == 0
    from petcontact import read_result

    monkeypatch.setattr(cad_part, "ask", lambda *_, **__: pytest.fail("reads the CAD file"))
    solution = read_result("bar.h5")
    at = solution.mesh.x
    assert solution.u == pytest.approx(
        np.column_stack([0.01 * at[:, 0], -0.003 * at[:, 1], -0.003 * at[:, 2]]), abs=1e-9
    )


def boxes(occ):
    return [occ.addBox(0, 0, 0, 1, 1, 1), occ.addBox(3, 0, 0, 1, 1, 1)]


@needs_gmsh
@pytest.mark.parametrize(
    ("build", "given", "line"),
    [
        (boxes, {}, "holds 2 solids"),
        (boxes, {"solid": 3}, "no solid 3; there are 1 "),
        (
            lambda occ: occ.addRectangle(0, 0, 0, 1, 1),
            {},
            "holds 1 surface, which do not close, but no solid",
        ),
        (lambda occ: boxes(occ)[0], {"solid": 1, "parts": {"top": [9]}}, "there are 1 to 6"),
    ],
)
def test_what_is_no_body_is_refused(tmp_path, build, given, line):
    file = written(tmp_path / "part.step", build)
    with pytest.raises(InputError, match=line):
        Gmsh(file, **given).outline()


@needs_gmsh
@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[:6000],
        lambda text: "no STEP at all",
        lambda text: text.replace("CARTESIAN_POINT", "CARTESIAN_PINT"),
        lambda text: text.replace("PLANE(", "PLAIN("),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path, damage, capsys):
    (tmp_path / "part.step").write_text(damage(FOOT.read_text()))
    config = tmp_path / "part.toml"
    config.write_text((FOOT.parent / "foot.toml").read_text().replace("foot.step", "part.step"))
    assert main(["solve", str(config), "-o", str(tmp_path / "part.h5")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_without_the_extra_one_line_says_how_to_get_it(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert main(["solve", str(FOOT.parent / "foot.toml"), "-o", str(tmp_path / "foot.h5")]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "setup --cad" in line


@pytest.mark.parametrize(
    ("program", "line"),
    [
        ("import os; os.abort()", "Gmsh ended while it read or meshed it"),
        ("""print('{"missing": "libGLU.so.1: no such file"}')""", "apt install libglu1-mesa"),
        ("""print('{"error": "Unknown surface"}')""", r"cannot be read \(Unknown surface\)"),
    ],
)
def test_a_worker_that_fails_is_one_line(tmp_path, monkeypatch, program, line):
    (tmp_path / "worker.py").write_text(program)
    monkeypatch.setattr(cad_part.worker, "__file__", str(tmp_path / "worker.py"))
    monkeypatch.setitem(sys.modules, "gmsh", sys)  # there, and never imported
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: sys)
    with pytest.raises(InputError, match=line):
        cad_part.ask("part.step")


@pytest.mark.parametrize("text", ["", "$Nodes\n1 2"])
def test_a_mesh_that_is_cut_off_replaces_nothing(tmp_path, monkeypatch, text):
    """Gmsh says nothing of a disk that is full."""
    face = cad_part.CadFace(1, "a", "Plane", 1.0, (0.0, 0.0, 0.0))
    surface = cad_part.CadSurface(
        "part.step", "solid 1", 0, (face,), ("a",), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    )
    monkeypatch.setattr(cad_part, "ask", lambda *_, target, **__: Path(target).write_text(text))
    with pytest.raises(
        OutputError, match=r"part.step: its mesh cannot be written whole to .*; is there room\?"
    ):
        surface.write_msh(tmp_path / "part.msh", 1.0)


@pytest.mark.parametrize(
    ("geometry", "line"),
    [
        ('file = "part.msh", parts = { a = [1] }', "geometry: parts: is for CAD files"),
        ('file = "a.step", parts = { a = [1, 2], b = [2] }', "parts: surface 2 is named twice"),
        ('file = "part.step", parts = { a = ["x"] }', "geometry.parts.a"),
        ('file = "none.step"', "none.step: cannot be read"),
    ],
)
def test_keys_of_cad_files_are_checked(tmp_path, geometry, line):
    text = (FOOT.parent / "foot.toml").read_text()
    start, end = text.index("[geometry]"), text.index("[mesh]")
    config = tmp_path / "part.toml"
    config.write_text(f'geometry = {{ shape = "gmsh", {geometry} }}\n' + text[:start] + text[end:])
    with pytest.raises(InputError, match=line):
        load(config).geometry.outline()


TETRAHEDRON = """DATA;
#1=CARTESIAN_POINT('',(0.,0.,0.)); #2=CARTESIAN_POINT('',(1.E1,0.,0.)); #3=CARTESIAN_POINT('',(0.,20.,0.));
#4=CARTESIAN_POINT('',(0.,0.,30.));
#11=VERTEX_POINT('',#1); #12=VERTEX_POINT('',#2); #13=VERTEX_POINT('',#3); #14=VERTEX_POINT('a; b',#4);
#21=EDGE_CURVE('',#11,#12,#99,.T.); #22=EDGE_CURVE('',#12,#13,#99,.T.); #23=EDGE_CURVE('',#13,#11,#99,.T.);
#24=EDGE_CURVE('',#11,#14,#99,.T.); #25=EDGE_CURVE('',#12,#14,#99,.T.); #26=EDGE_CURVE('',#13,#14,#99,.T.);
#31=EDGE_LOOP('',(#21,#22,#23)); #32=EDGE_LOOP('',(#21,#25,#24)); #33=EDGE_LOOP('',(#22,#26,#25));
#34=EDGE_LOOP('',(#23,#24,#26));
#41=FACE_BOUND('',#31,.T.); #42=FACE_BOUND('',#32,.T.); #43=FACE_BOUND('',#33,.T.); #44=FACE_BOUND('',#34,.T.);
#51=ADVANCED_FACE('foot; ''left''',(#41),#98,.T.); #52=ADVANCED_FACE('NONE',(#42),#98,.T.);
#53=ADVANCED_FACE('R\\X2\\00FC\\X0\\cken',(#43),#98,.T.); #54=ADVANCED_FACE('',(#44),#98,.T.);
#60=CLOSED_SHELL('',(#51,#52,
  #53,#54)); ENDSEC;"""


def test_names_of_faces_in_a_step_file(tmp_path):
    """In another unit, moved and turned; not for a solid of another shape, nor in another order."""
    path = tmp_path / "part.step"
    path.write_text(TETRAHEDRON)
    corners = np.array([[0, 0, 0], [10, 0, 0], [0, 20, 0], [0, 0, 30]]) / 25.4
    turn = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]
    moved = np.array([3.0, 1.0, 2.0]) + corners @ turn
    faces = [moved[[*face]].tolist() for face in ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3))]
    names = ["foot; 'left'", "", "Rücken", ""]
    assert face_names(path, [faces, faces[::-1]]) == [names, [""] * 4]
    assert face_names(path, [faces[:3]]) == [[""] * 3]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("'NONE'", "'" + "'" * 61),
        ("'NONE'", "'" + "''" * 30 + "/* it''s */"),
        ("'NONE'", "'\\X2\\0000\\X0\\'"),
        ("#51=", "#60=A(" * 20000 + "#" + "9" * 5000 + "=A('x'); #51="),
        (
            "ENDSEC;",
            "#70=CLOSED_SHELL('',(#71,#71,#71,#71)); #71=ADVANCED_FACE('x',(#72),#98,.T.);"
            "#72=EDGE_LOOP('',(#72,#72));",
        ),
        ("ENDSEC;", "/*" * 100_000),
    ],
)
def test_names_in_a_damaged_step_file(tmp_path, old, new):
    """What cannot be read has no name; nothing hangs, and no name is one that cannot be printed."""
    path = tmp_path / "part.step"
    path.write_text(TETRAHEDRON.replace(old, new, 1))
    solid = [[[float(k), 0.0, 0.0]] * 3 for k in range(4)]
    assert face_names(path, [solid]) == [[""] * 4]


def rounded_pin(occ):
    """A cylinder whose edges are rounded: a plane disc, a torus, a cylinder."""
    pin = occ.addCylinder(0, 0, 0, 0, 0, 6, 3)
    occ.synchronize()
    discs = [edge for edge in (1, 2, 3) if np.ptp(occ.getBoundingBox(1, edge)[2::3]) < 1e-3]
    occ.fillet([pin], discs, [1.0])


@needs_gmsh
@pytest.mark.parametrize("build", [bored_block, rounded_pin])
def test_panels_that_are_cut_stay_on_the_surfaces_of_the_file(tmp_path, build):
    """Cut twice at random places the boundary is closed, and its area comes nearer to that of the
    file; pieces of the first panels leave it as it is."""
    surface = Gmsh(written(tmp_path / "part.step", build)).outline()
    first = mesh = facet_mesh(surface.facets(4.0), 2)
    rng = np.random.default_rng(3)
    for _ in range(2):
        along = np.repeat(rng.random(mesh.n_elements) < 0.15, 2).reshape(-1, 2)
        mesh = cut(mesh, along, surface)
    assert np.abs(mesh.weight @ mesh.normal).max() < 1e-6 * surface.area  # with slits 5e-6 and more
    everywhere = cut(first, np.ones((first.n_elements, 2), dtype=bool), surface)
    kept = cut(first, np.ones((first.n_elements, 2), dtype=bool))
    missed = [abs(float(m.weight.sum()) - surface.area) for m in (everywhere, kept)]
    assert missed[0] < 0.2 * missed[1]
    assert np.allclose(
        surface.onto(everywhere.part, everywhere.corners),
        everywhere.corners,
        atol=1e-7,
        equal_nan=True,
    )
