"""Configs that are proposed for the bodies of CAD files and meshes: their pairs are known."""

from __future__ import annotations

import importlib.util
import tomllib
from pathlib import Path

import meshio
import numpy as np
import pytest
from inp_decks import grid

from petcontact import Box, load, solve
from petcontact.commands.main import main
from petcontact.convert.touching_parts import touching
from petcontact.mesh.panelling import box_mesh, round_mesh
from petcontact.model.shapes.solids import Sphere

needs_gmsh = pytest.mark.skipif(
    importlib.util.find_spec("gmsh") is None, reason="Gmsh is not installed (scripts/setup --cad)"
)


def squares(path: Path, apart: float = 0.0) -> str:
    """Two squares above each other, with a free strip in the middle if apart."""
    points = [(x, y, 0.0) for y in (0.0, 1.0, 1.0 + apart, 2.0 + apart) for x in (0.0, 1.0)]
    lines = [[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4]]
    cells = [("line", lines), ("triangle", [[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6]])]
    words = ["floor", "right", "joint", "left", "seat", "east", "roof", "west"]
    names = {word: np.array([k, 1]) for k, word in enumerate(words, 1)}
    names |= {"low": np.array([11, 2]), "high": np.array([12, 2])}
    tags = [np.arange(1, 9), np.array([11, 11, 12, 12])]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(np.array(points), cells, cell_data=data, field_data=names).write(
        path, file_format="gmsh22", binary=False
    )
    return str(path)


def config(path: Path) -> dict:
    return tomllib.loads(path.read_text())


def test_two_bodies_of_a_mesh_are_solved_after_one_edit(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["init", "pair", "--from", squares(tmp_path / "two.msh")]) == 0
    found = config(tmp_path / "pair.toml")
    assert [body["name"] for body in found["body"]] == ["low", "high"]
    (pair,) = found["contact"]
    assert {pair["secondary"], pair["primary"]} == {"low.joint", "high.seat"}
    assert "boundary" not in found["body"][0]
    text = (tmp_path / "pair.toml").read_text()
    (tmp_path / "pair.toml").write_text(text.replace("#>", ""))
    solution = solve(load("pair.toml"))
    assert solution.converged
    assert solution.pairs["contact1"].force[1] != 0.0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("kind", "apart", "count"), [("CPE4", 0, 1), ("C3D8", 0, 1), ("CPE4", 1, 0)]
)
def test_a_deck_without_contact_gets_proposals(kind, apart, count, tmp_path, monkeypatch, capsys):
    d = 3 if kind == "C3D8" else 2
    text = []
    for first, low in ((1, 0.0), (101, 1.0 + apart)):
        lower = [0.0] * (d - 1) + [low]
        text += grid(lower, [x + 1.0 for x in lower], (2,) * d, first, first, kind, "ALL")[0]
    text += ["*MATERIAL, NAME=M", "*ELASTIC", "1., 0.", "*SOLID SECTION, ELSET=ALL, MATERIAL=M"]
    monkeypatch.chdir(tmp_path)
    Path("deck.inp").write_text("\n".join(text))
    assert main(["init", "deck", "--from", "deck.inp"]) == 0
    assert "no *CONTACT PAIR" in capsys.readouterr().err or not count
    Path("deck.toml").write_text(Path("deck.toml").read_text().replace("#>", ""))
    assert len(load("deck.toml").interfaces) == count


def test_bodies_that_are_far_apart_are_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["init", "pair", "--from", squares(tmp_path / "two.msh", 0.5)]) == 0
    assert "contact" not in config(tmp_path / "pair.toml")
    assert "low touches no other body" in capsys.readouterr().err


def test_a_ball_touches_the_face_that_it_lies_on_only():
    sphere = Sphere(centre=(0.0, 0.0, 1.0), radius=1.0).outline()
    block = Box(lower=(-2.0, -2.0, -1.0), upper=(2.0, 2.0, 0.0)).outline()
    meshes = {
        "ball": round_mesh(sphere, 0.5, 1),
        "block": box_mesh(block, lambda part: 0.5, 1, 1.0),
    }
    assert touching(meshes) == [(["ball.bottom"], ["block.top"])]


@needs_gmsh
@pytest.mark.parametrize("suffix", ["step", "iges"])
def test_a_pin_in_a_lug_is_a_pair_of_cylinders(tmp_path, monkeypatch, suffix):
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    bore = occ.addCylinder(0, -5, 0, 0, 10, 0, 5.05)
    occ.cut([(3, occ.addBox(-20, -5, -10, 60, 10, 20))], [(3, bore)])
    occ.addCylinder(0, -10, 0, 0, 20, 0, 5.0)
    occ.synchronize()
    gmsh.write(str(tmp_path / f"lug.{suffix}"))
    gmsh.finalize()
    monkeypatch.chdir(tmp_path)
    assert main(["init", "lug", "--from", f"lug.{suffix}"]) == 0
    found = config(tmp_path / "lug.toml")
    (pair,) = found["contact"]
    assert (pair["secondary"], pair["primary"]) == ("body1.7", "body2.8")
    assert [body["geometry"]["solid"] for body in found["body"]] == [1, 2]
    assert len(load("lug.toml").interfaces) == 1
    # the proposed motion closes the clearance of 0.05
    assert "0.06" in Path("lug.toml").read_text().partition("#>value")[2]


@needs_gmsh
def test_a_bolted_joint_has_a_thread_and_a_preload(tmp_path, monkeypatch):
    """Two plates, a bolt with a head, a nut: shank and holes are apart, nut and bolt are one."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ

    def round_bar(low, high, radius):
        return [(3, occ.addCylinder(0, 0, low, 0, 0, high - low, radius))]

    for low in (0, 10):
        occ.cut([(3, occ.addBox(-20, -20, low, 40, 40, 10))], round_bar(low - 1, low + 11, 5.5))
    occ.fuse(round_bar(-8, 20, 5), round_bar(20, 26, 8))
    occ.cut(round_bar(-8, 0, 8), round_bar(-9, 1, 5))
    occ.synchronize()
    gmsh.write(str(tmp_path / "joint.step"))
    gmsh.finalize()
    monkeypatch.chdir(tmp_path)
    assert main(["init", "joint", "--from", "joint.step"]) == 0
    text = (tmp_path / "joint.toml").read_text().replace("#>", "")
    (tmp_path / "joint.toml").write_text(text)
    found = tomllib.loads(text)
    (thread,) = [pair for pair in found["contact"] if pair.get("normal") == "bonded"]
    assert {thread["secondary"][:5], thread["primary"][:5]} == {"body3", "body4"}
    (pulled,) = [pair for pair in found["contact"] if "preload" in pair]
    assert {pulled["secondary"][:5], pulled["primary"][:5]} == {"body1", "body4"}
    assert [pair["gap"] for pair in found["contact"] if "gap" in pair] == [0.5, 0.5]
    values = {body["name"]: body["boundary"][0]["value"] for body in found["body"][:2]}
    assert values == {"body1": [0.0, 0.0, 0.0], "body2": [-0.01, 0.0, 0.0]}
    assert len(load("joint.toml").interfaces) == 6


@needs_gmsh
def test_a_ball_without_a_free_face_is_pushed(tmp_path, monkeypatch):
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addBox(-20, -20, -10, 40, 40, 10)
    gmsh.model.occ.addSphere(0, 0, 10, 10)
    gmsh.model.occ.synchronize()
    gmsh.write(str(tmp_path / "ball.step"))
    gmsh.finalize()
    monkeypatch.chdir(tmp_path)
    assert main(["init", "ball", "--from", "ball.step"]) == 0
    found = tomllib.loads((tmp_path / "ball.toml").read_text().replace("#>", ""))
    assert [body["boundary"][0]["part"] for body in found["body"] if "boundary" in body] == ["5"]
    volume = 4.0 / 3.0 * np.pi * 10.0**3
    assert found["body"][1]["loads"]["force"] == pytest.approx(
        [0.0, 0.0, -1000.0 / volume], rel=0.01
    )
    assert "friction_coefficient" not in found["contact"][0]


def test_other_files_are_refused_with_what_is_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("part.stl").write_text("solid")
    assert main(["init", "part", "--from", "part.stl"]) == 2
    assert main(["init", "part", "--from", "none.msh"]) == 2
