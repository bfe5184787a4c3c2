"""One problem, two spellings: a body at the top of the file, or [[body]]; what is said of either,
and what is refused."""

from __future__ import annotations

import copy
import os
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import petcontact
from petcontact import (
    Body,
    Contact,
    Displacement,
    InputError,
    Material,
    MeshOptions,
    Method,
    Obstacle,
    Pair,
    Problem,
    Rectangle,
    Step,
    load,
)
from petcontact.given.tables.base import parse, regular_file
from petcontact.model.case import parse_problem
from petcontact.model.toml_text import parse_toml

CONFIGS = Path(__file__).parents[2] / "configs"
FILES = [
    path
    for path in sorted(CONFIGS.glob("*.toml"))
    if "problems" not in tomllib.loads(path.read_text())
]
BODY = ("material", "geometry", "mesh", "boundary", "point_force")
FLAT = {
    "title": "block",
    "units": {"length": "mm"},
    "material": {"young_modulus": 10.0, "poisson_ratio": 0.3},
    "geometry": {"shape": "rectangle", "lower_left": [0.0, 0.0], "upper_right": [2.0, 1.0]},
    "mesh": {"element_size": 0.5, "order": 1, "graded_points": [[0.5, 0.0]]},
    "boundary": [
        {"part": "bottom", "condition": "contact", "friction_bound": 1.0},
        {"part": "top", "condition": "displacement", "value": ["free", -0.1]},
    ],
    "point_force": [{"name": "pin", "at": [0.5, 0.5], "force": [1.0, 0.0]}],
    "obstacle": [{"name": "punch", "displacement": [0.0, -0.1]}],
    "contact": [{"name": "side", "secondary": "left", "primary": "punch"}],
    "step": [{"name": "press", "boundary": [{"part": "top", "value": ["free", -0.2]}]}],
    "method": {"tolerance": 1e-8},
    "bem": {"mat_type": "dense"},
    "petsc": {"ksp_type": "gmres"},
}


def with_body(data):
    """The other spelling."""
    data = copy.deepcopy(data)
    return {
        **{key: value for key, value in data.items() if key not in BODY},
        "body": [{"name": "body", **{key: data[key] for key in BODY if key in data}}],
    }


def block(**more) -> Problem:
    given = {
        "material": Material(1e4, 0.3),
        "geometry": Rectangle((0, 0), (8, 4)),
        "boundary": [Contact("bottom", friction_bound=150), Displacement("top", (0, 0))],
    }
    return Problem(**{**given, **more})


def two(size=None, **more) -> Problem:
    bodies = [
        Body(name, Material(1.0, 0.3), Rectangle((0, y), (1, y + 1)), mesh=MeshOptions(size))
        for name, y in (("lower", 0), ("upper", 1))
    ]
    return Problem(
        body=bodies,
        contact=[Pair("middle", "upper.bottom", "lower.top", friction_coefficient=0.4)],
        **more,
    )


def message(data) -> str:
    with pytest.raises(InputError) as caught:
        parse(Problem, data, "c")
    return str(caught.value)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_config_survives_its_own_toml(path):
    problem = load(path)
    again = parse_problem(tomllib.loads(problem.toml()), "again", {}, Path())
    assert again == problem and again.toml() == problem.toml()
    assert ("body" in tomllib.loads(problem.toml())) == ("body" in tomllib.loads(path.read_text()))


def leaves(tree, head=()):
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        yield (*head, key)
        if isinstance(value, (dict, list)):
            yield from leaves(value, (*head, key))


@given(
    st.sampled_from(list(leaves({key: FLAT[key] for key in BODY}))),
    st.one_of(
        st.none(), st.integers(-3, 3), st.text(max_size=3), st.just({"no_such": 1}), st.just([[]])
    ),
)
def test_a_mistake_is_named_as_it_was_spelled(path, value):
    """Whatever is said of a wrong entry in [[body]] is said of the flat file without `body[0].` and
    `body.`; so is nothing."""
    data = copy.deepcopy(FLAT)
    here = data
    for step in path[:-1]:
        here = here[step]
    here[path[-1]] = value
    said = []
    for spelled in (data, with_body(data)):
        try:
            said.append(parse(Problem, spelled, "c").toml())
        except InputError as error:
            said.append(str(error))
    assert said[0] == re.sub(r"body(\[0\])?\.", "", said[1]) and "body[" not in said[0]


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        ({"materal": {}}, "c: materal: unknown key, did you mean 'material'?"),
        ({"obstacles": []}, "c: obstacles: unknown key, did you mean 'obstacle'?"),
        ({"name": "block"}, "c: name: unknown key"),
        ({"step": [{"name": "a\0b"}]}, "c: step[0].name: has a character below 32, got '"),
        ({"body": []}, "c: material: belongs to a body; where there is [[body]] it stands in each"),
    ],
)
def test_unknown_keys_of_the_flat_spelling(change, wanted):
    assert message({**FLAT, **change}).startswith(wanted)


def test_several_bodies_by_another_word_are_no_flat_spelling():
    assert message({"bodies": []}).startswith("c: bodies: unknown key, did you mean 'body'?")


@pytest.mark.parametrize("key", BODY)
def test_of_several_bodies_each_has_its_own(key):
    with pytest.raises(
        AttributeError, match=f"{key}: the problem has the bodies 'lower', 'upper'; take .body"
    ):
        getattr(two(), key)
    with pytest.raises(AttributeError, match=key):
        two().model_copy(update={key: ()})
    assert not hasattr(two(), key) and two().model_copy(update={"title": "b"}).title == "b"


FULL = Method(formulation="full", start="frictionless")
PROJECTION = Method("projection", omega=1.0, start="r.h5")
POINT = {"graded_points": [(1, 0)]}


@pytest.mark.parametrize(
    ("problem", "adaptive", "wanted"),
    [
        (block(), False, ""),
        (block(method=Method(rho=2.0, tau=1.0)), False, "method.rho method.tau"),
        (block(method=FULL), False, ""),
        (two(method=FULL), False, ""),
        (two(size=1.0), True, "body[0].mesh.element_size body[1].mesh.element_size"),
        (block(method=PROJECTION, mesh=MeshOptions(0.1)), True, "mesh.element_size"),
        (block(mesh=MeshOptions(**POINT)), True, ""),
        (block(mesh=MeshOptions(levels=3, accuracy=0.1)), True, "mesh.levels"),
        (
            block(mesh=MeshOptions(0.1, levels=3, accuracy=0.1, **POINT)),
            False,
            "mesh.levels mesh.graded_points mesh.accuracy",
        ),
        # adaptive solves in space begin with the mesh that is asked for
        (load(CONFIGS / "space_b.toml", {"mesh.order": 1, "mesh.accuracy": 0.1}), True, ""),
    ],
)
def test_keys_that_a_solve_does_not_read(problem, adaptive, wanted):
    assert problem.ignored(adaptive=adaptive) == wanted.split()


def test_files_that_a_config_names_are_regular_and_bounded(tmp_path):
    (tmp_path / "file").write_bytes(b"12345")
    os.mkfifo(tmp_path / "fifo")
    assert regular_file(tmp_path / "file", 5) == tmp_path / "file"
    for name, most, wanted in (
        ("fifo", 5, "not a regular file"),
        ("none", 5, "No such file"),
        ("file", 4, "5 bytes, larger than the 4 that are read"),
    ):
        with pytest.raises(InputError, match=wanted):
            regular_file(tmp_path / name, most)


def test_a_problem_shows_itself_in_a_few_lines():
    steps, walls = [Step("press", 4)], [Obstacle("wall", (0, "free"))]
    problem = two(title="Stack <2>", step=steps, obstacle=walls)
    assert repr(problem).splitlines() == [
        "<Problem 'Stack <2>'",
        "  body lower: rectangle, E = 1, ν = 0.3",
        "  body upper: rectangle, E = 1, ν = 0.3",
        "  obstacle wall: displacement [0, free]",
        "  contact middle: upper.bottom on lower.top, unilateral, friction coefficient 0.4",
        "  step press: 4 increments; changes nothing",
        "  method: semismooth-newton>",
    ]
    table = problem._repr_html_()
    assert "Stack &lt;2&gt;" in table and table.count("<tr>") == 6
    bound = block(boundary=[Contact("bottom", friction_bound=lambda x: 1.0 + 0.0 * x)])
    assert "  body: " in repr(bound)  # the only one has no name
    assert "contact on bottom, bilateral, friction bound by a function" in repr(bound)


NEWCOMERS = {
    "material.thickness = '10 mm'": "with mm, N and MPa 10 mm are 10",
    "material.yield_strength = 355.0": "compare the largest von Mises stress",
    "geometry = { type = 'rectangle' }": 'write shape = "rectangle", not type',
    "geometry.width = 8.0": "a rectangle has lower_left and upper_right",
    "geometry.upper_right = ['L', 4.0]": r"\[variables\] has no L",
    "variables.L = '8 mm'": "with mm, N and MPa 8 mm are 8",
    "mesh.order = 'quadratic'": "0 is constant, 1 linear, 2 quadratic",
    "dimension = 2": "the shape says it",
    "contact = [{ name = 'a', secondary = 'left', primary = 'punch', normal = 'frictional' }]": (
        "friction_coefficient or friction_bound"
    ),
    "contact = [{ name = 'a', secondary = 'left', primary = 'punch', gap = 'scan.csv' }]": (
        r"\{ points = \"scan.csv\" \}"
    ),
    "obstacle = [{ name = 'p', shape = 'circle', diameter = 2.0 }]": "give the radius, half of it",
    "obstacle = [{ name = 'p', velocity = [1.0, 0.0] }]": "nothing depends on time",
    "method.name = 'augmented lagrangian'": "contact is exact here",
}


@pytest.mark.parametrize("line", NEWCOMERS)
def test_what_newcomers_write_is_answered_with_what_to_write(line):
    data, given = copy.deepcopy(FLAT), tomllib.loads(line)
    for key, value in given.items():
        merged = isinstance(value, dict) and "type" not in value
        data[key] = {**data.get(key, {}), **value} if merged else value
    with pytest.raises(InputError, match=NEWCOMERS[line]):
        parse_problem(data, "own.toml", {}, Path())


@pytest.mark.parametrize(("text", "word"), [("title: Block", "YAML"), ('{"title": 1}', "JSON")])
def test_files_of_other_kinds_are_named(text, word):
    with pytest.raises(InputError, match=f"this is {word}"):
        parse_toml(text, "own.toml")


@pytest.mark.parametrize(
    ("thing", "name", "where"),
    [
        (block(), "solve", "petcontact.solve"),
        (block().body[0].material, "E", "did you mean 'young_modulus'"),
        (block(), "bodys", "did you mean 'body'"),
    ],
)
def test_an_attribute_that_a_model_has_not_is_answered_with_what_is_meant(thing, name, where):
    with pytest.raises(AttributeError, match=f"has no '{name}'.*{where}"):
        getattr(thing, name)


@pytest.mark.parametrize(
    ("name", "hint"),
    [("Displacment", "did you mean 'Displacement'"), ("Force", 'condition = "traction"')],
)
def test_names_that_the_package_has_not_are_answered_with_what_is_meant(name, hint):
    with pytest.raises(AttributeError, match=f"petcontact has no {name!r}.*{hint}"):
        getattr(petcontact, name)
