"""TOML to a problem: what is read, and every mistake in one line that names file, key, what was
given, what is allowed."""

from __future__ import annotations

import copy
import os
import tomllib
from pathlib import Path

import pytest

from petcontact import Contact, InputError, Material, Polygon, Traction, load
from petcontact.commands.main import main
from petcontact.model.case import parse_problem, whole_key

EXAMPLE = Path(__file__).parents[2] / "configs" / "example1.toml"


def data(key=None, value=None):
    """Example 1 as plain data, one dotted key set (or removed, if the value is ...)."""
    result = copy.deepcopy(tomllib.loads(EXAMPLE.read_text()))
    if key is not None:
        *tables, last = [int(step) if step.isdigit() else step for step in key.split(".")]
        here = result
        for step in tables:
            here = here[step]
        if value is ...:
            del here[last]
        else:
            here[last] = value
    return result


def message(content) -> str:
    with pytest.raises(InputError) as caught:
        parse_problem(content, "c.toml", {}, Path())
    text = str(caught.value)
    assert text.startswith("c.toml: ") and "\n" not in text and len(text) < 400
    return text.removeprefix("c.toml: ")


def test_a_case_is_read_changed_by_dotted_keys_and_survives_its_own_toml():
    case = load(EXAMPLE)
    assert case.material == Material(young_modulus=10_000.0, poisson_ratio=0.3)
    kinds = ["contact", "displacement", "traction", "traction"]
    assert [condition.condition for condition in case.boundary] == kinds
    assert case.boundary[0].friction_bound == 150.0 and case.method.rule == "modified"
    changes = {"petsc.ksp_type": "gmres", "mesh.order": 2, "title": 'quotes " and \\ and ρ'}
    changes |= {"bem.mat_type": "dense", "boundary.0.friction_bound": "100 + x"}
    case = load(EXAMPLE, changes)
    assert (case.bem.mat_type, case.boundary[0].friction_bound) == ("dense", "100 + x")
    assert parse_problem(tomllib.loads(case.toml()), "again", {}, Path()) == case


FINITE = "must be a finite number"
ARC_AND_CENTER = {
    "shape": "outline",
    "loops": [[{"part": "a", "to": [1, 0]}, {"part": "b", "to": [0, 0], "center": [0, 1]}]],
}
TWO_NAMES = {"shape": "polygon", "vertices": [[0, 0], [1, 0], [1, 1]], "parts": ["a", "b"]}


@pytest.mark.parametrize(
    ("key", "value", "wanted"),
    [
        ("boundary.0.friction_bound", ["x", 1], f"{FINITE} or an expression"),
        ("boundary.0.friction_bound", 10**400, f"boundary[0].friction_bound: {FINITE}"),
        ("boundary.0.part", ..., "boundary[0].part: this key is required"),
        ("boundary", ..., "boundary: this key is required"),
        ("boundary.0.friction_bund", 1, "unknown key, did you mean 'friction_bound'?"),
        (
            "geometry",
            ARC_AND_CENTER,
            "[0][1].center: unknown key; valid keys: columns, part, points",
        ),
        ("boundary.0.condition", "contakt", "got 'contakt', did you mean 'contact'?"),
        (
            "geometry.shape",
            "disc",
            "geometry.shape: got 'disc'; a disc is shape = \"outline\", loops",
        ),
        ("boundary.1.value", [0.0], "boundary[1].value: array must have at least 2 items"),
        ("boundary.1.value", 4.0, "[0.0, 4.0] along y"),
        ("boundary.2.pressure", 3.0, "either value = [tx, ty] or pressure = p, got both"),
        ("boundary.0.gap", 0.1, "boundary[0]: normal: this key is required beside a gap"),
        ("boundary", [1], "boundary[0]: must be a table, got 1"),
        ("geometry", TWO_NAMES, "geometry: 3 vertices need as many part names in parts, got 2"),
        (
            "material.young_modulus",
            "1 MPa",
            "a number has no unit here; with mm, N and MPa 1 MPa are 1",
        ),
        ("geometry.upper_right", [0.0, 0.0], "upper_right [0.0, 0.0]"),
        ("material.young_modulus", 1e300, "must be at most 1e+150, got 1e+300"),
        ("material.poisson_ratio", 0.5, "poisson_ratio must lie in (-1, 1/2), got 0.5"),
        ("parts", [], "parts: unknown key; it is a key of [geometry]"),
        ("material.nu", 0.3, "material.nu: unknown key, did you mean 'poisson_ratio'?"),
        ("plane", "stress", "plane: unknown key, did you mean material.plane?"),
        ("step", 3, "step: must be an array, got 3; in double brackets, [[step]], each time"),
        ("loads", {"angular_velocity": "30 rpm"}, "30 rpm are 3.141592654"),
        ("units", {"length": "MPa", "stress": "mm"}, "units: length and stress are exchanged"),
        (
            "geometry",
            {"shape": "box", "lower": [0, 0, 0], "upper": [1, 1]},
            "upper: needs 3 numbers",
        ),
        (
            "step",
            [{"boundary": [{"part": "bottom", "value": [1, 0]}]}],
            "condition on 'bottom'; it is in contact, which [[step.contact]] changes",
        ),
        ("material", 5, "material: must be a table, got 5"),
        ("method.omega", 2.0, "method.omega: must be less than 2, got 2.0"),
        ("method.max_iterations", 10**30, "method.max_iterations: must be less than"),
        ("mesh.graded_points", [[1.0]], "mesh.graded_points[0]: needs 2 numbers, got [1.0]"),
        ("petsc", {"ksp_type": ["lu"]}, "must be text, a number or true/false, got ['lu']"),
        ("petsc", {"-ksp_type": "lu"}, "must be the name of a PETSc option without its dash"),
        ("method", {"omega": 5.0, "tau": -1.0, "rho": -1.0, "max_iterations": -1}, "; and 1 more"),
        ("title", [*range(100)], "..."),
        ("méthode\n", 5, r"'méthode\n': unknown key, did you mean 'method'?"),
    ],
)
def test_each_mistake_names_its_key(key, value, wanted):
    assert wanted in message(data(key, value))


@pytest.mark.parametrize(
    ("build", "wanted"),
    [
        (lambda: Material(-1.0, 0.3), "young_modulus: must be greater than 0, got -1.0"),
        (lambda: Material(1.0, 0.51, "stress"), "poisson_ratio must lie in (-1, 1/2] in plane"),
        (lambda: Traction("top"), "needs either value"),
        (lambda: Contact("bottom", part="top"), "Contact: part is given twice"),
        (lambda: Material(1.0, 0.3, "strain", 4), "takes young_modulus, poisson_ratio, plane in"),
        (lambda: Contact(3), "part: must be a string, got 3"),
        (lambda: Polygon([(0, 0), (1, 0)], ["a", "b"]), "vertices: array must have at least 3"),
    ],
)
def test_the_same_lines_from_python(build, wanted):
    with pytest.raises(InputError) as caught:
        build()
    assert wanted in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "wanted"),
    [
        (b"", "material: this key is required"),
        (b"\x00\x01\x89HDF\xff", "not a text file"),
        (b"title = ", "not valid TOML"),
        (b"a = 1\na = 2", "not valid TOML"),
        ("µ = 0.3".encode(), 'letters beyond a to z stand in quotes: "µ" ='),
        (b"a = [1, box]", 'a text needs quotes: "box"'),
        (b"[a]\nb = 1\n[a]\nb = 2", r"is \[\[a\]\] each time"),
        (b"a = 210 GPa", "with mm, N and MPa 210 GPa are 210000"),
        (b"a = 20 K", "a number has no unit here: 20"),
        (b"a = { b = 1 c = 2 }", "a comma is missing before c"),
        (b"a = [\n  { b = 1 }\n  { b = 2 }\n]", "a comma is missing before {"),
        (b"a = [0.0, none]", "there is no none in TOML"),
        (b"a = (1.0, 2.0)", r"an array stands in brackets: \[1.0, 2.0\]"),
        (b"a = .5", "a digit stands before a decimal point: 0.5"),
        (b"a = 5.", "a digit stands after a decimal point: 5.0"),
        (b"a = True", "write true or false, not True"),
        (b"a = 10*x # N", r'an expression needs quotes: "10\*x"'),
        ("a = “top”".encode(), "straight quotes"),
        (b"a = 1\nb = [1, 2\n", r"\(line 2\)\): 'b = \[1, 2'; a bracket in this line"),
        (b"b = 'top\na = 1\n", r"\(line 1\)\): \"b = 'top\""),
        (b"a = [1, 2\n[b]", "a bracket before this line is not closed"),
        (b"[boundary]", r"in double brackets, \[\[boundary\]\], each time"),
        (b"[[material]]", r"in single brackets, \[material\]"),
        (b"problems = []", "a sweep; solve its cases"),
        (b"[material]\nyoung_modulus = 0,3 # N", "'young_modulus = 0,3 # N'; .* comma: 0.3"),
        (
            b'[[boundary]]\npart = "a"\ncondition = "traction"\nvalue = [4,5, 0,0]',
            "at most 3 items, not 4, .* a decimal point, not a comma",
        ),
        (b"x = " + b"[" * 5000, "nested deeper than 16 levels"),
        (b"#" * 4_000_001, "larger than"),
    ],
    ids=range(28),
)
def test_files_that_are_no_config(content, wanted, tmp_path):
    path = tmp_path / "c.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=wanted) as caught:
        load(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("part.step", r"a CAD file; name it in a config: .* file = 'part.step'"),
        ("body.msh", "a Gmsh file; name it in a config"),
        ("r.h5", r"a result file; .petcontact show .*r.h5. prints it"),
    ],
)
def test_other_files_are_named_with_what_is_done_with_them(name, wanted, tmp_path):
    (tmp_path / name).write_bytes(b"\x89")
    with pytest.raises(InputError, match=wanted):
        load(tmp_path / name)


@pytest.mark.parametrize(
    "name", ["missing.toml", ".", "/dev/zero", "/dev/null", "\0", "x" * 5000, "/dev/null/c.toml"]
)
def test_names_that_are_no_config(name):
    with pytest.raises(InputError) as caught:
        load(name)
    assert "\n" not in str(caught.value)


def test_a_config_may_come_through_a_pipe():
    """As in `petcontact solve <(sed ... block.toml)`."""
    end, start = os.pipe()
    os.write(start, EXAMPLE.read_bytes())
    os.close(start)
    try:
        assert load(f"/dev/fd/{end}") == load(EXAMPLE)
    finally:
        os.close(end)


@pytest.mark.parametrize(
    ("key", "wanted"),
    [
        ("title.x", "'title' is not a table"),
        ("boundary.9.part", "'9' is no entry, entries are 0 .bottom., 1 "),
        ("boundary.part", "'part' is no entry"),
        ("..", "unknown key"),
        ("methd.rho", "unknown key"),
    ],
)
def test_dotted_keys_that_lead_nowhere(key, wanted):
    with pytest.raises(InputError, match=wanted):
        load(EXAMPLE, {key: 1})


def test_a_byte_order_mark_is_no_key(tmp_path):
    file = tmp_path / "case.toml"
    file.write_bytes(b"\xef\xbb\xbf" + EXAMPLE.read_bytes())
    assert load(file) == load(EXAMPLE)


@pytest.mark.parametrize(
    ("setting", "hint"),
    [
        ("boundary.0.friction_bound='x^2'", "a power is written with **"),
        ("boundary.0.friction_bound='10x'", "as in 10*x"),
        ("boundary.0.friction_bound='10 MPa'", "a number has no unit here"),
        ("boundary.0.friction_bound='2(x+1)'", "as in 10*x"),
        ("boundary.0.g=3.0", "did you mean 'friction_bound'?"),
        ("boundary.1.condition='clamped'", 'a support is condition = "displacement"'),
        ("boundary.1.condition='roller'", 'with value = ["free", 0.0]'),
        ("boundary.1.value=[0.0, 'fixed']", "a support is condition"),
        ("boundary.1.ux=0.0", "a displacement is value = [ux, uy]"),
        ("boundary.1.nodeset='top'", "did you mean 'part'?"),
        ("material.yield_stress=250", "materials are linear elastic"),
        ("material='steel'", "a material is its numbers"),
        ("material.name='steel'", "valid keys: density, plane, poisson_ratio"),
        ("method='projection'", 'write method.name = "projection"'),
        (
            "contact=[{name='a', secondary='top', primary='b', preload='locked'}]",
            "[[step.contact]]",
        ),
        ("boundary.0.gap={points='no.csv'}", "(No such file or directory), got"),
        ("units='mm, N'", "as { length = ..., stress = ... }"),
        ("boundary.1.value=[[0.0, 0.0]]", "in single brackets: [0.0, 0.0]"),
        ("boundary.1.part=['top', 'left']", "one text, with a table for each"),
        ("boundary.top.value=[0, 0]", "entries are 0 (bottom), 1 (top)"),
        ("E=3.0", "did you mean material.young_modulus?"),
        ("boundary.1.value=['Free', 0]", "did you mean 'free'?"),
        ("geometry.shape='cube'", "did you mean 'box'?"),
        ("gravity=9.81", "weight is [loads] acceleration"),
        ("boundary.2.value=['free', 0.0]", "a free component of a traction is 0.0"),
        ("material.E=3.0", "did you mean 'young_modulus'?"),
        ("element_size=20.0", "it is held at 2 nodes only; use smaller elements"),
    ],
)
def test_hints(setting, hint, tmp_path, monkeypatch, capsys):
    """What newcomers write first is answered with the spelling of this package."""
    monkeypatch.chdir(tmp_path)
    assert main(["solve", str(EXAMPLE), "--no-figures", "--set", setting]) == 2
    said = capsys.readouterr().err
    assert hint in said and str(EXAMPLE) in said and said.count("\n") == 1


def test_files_are_relative_to_the_config_and_those_of_overrides_to_here(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(EXAMPLE.read_text().replace("[method]", '[method]\nstart = "a.h5:3"'))
    assert load(path).method.start == f"{tmp_path}/a.h5:3"
    assert load(path, {"method.start": "b.h5"}).method.start == "b.h5"
    assert load(path, {"method.start": "zero"}).method.start == "zero"


def test_a_bare_key_is_one_of_the_solver_tables():
    assert whole_key("element_size") == "mesh.element_size" and whole_key("rho") == "method.rho"
    assert whole_key("title") == "title" and whole_key("no_such") == "no_such"
    assert load(EXAMPLE, {"element_size": 0.5}).mesh.element_size == 0.5
    with pytest.raises(InputError, match="no_such: unknown key"):
        load(EXAMPLE, {"no_such": 1})
