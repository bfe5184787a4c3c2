"""Small files that ask for much: meshing grows with the sides, limits are reported before the
work."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from shapes import closing, cuboid, drawn, elastic, moved, problem

from petcontact import Bem, InputError, load
from petcontact.commands.progress import announcer
from petcontact.model.case import set_key
from petcontact.model.toml_text import DEEPEST
from petcontact.pipeline import choice
from petcontact.pipeline.eliminate import FINISHED
from petcontact.pipeline.run import prepare
from petcontact.refinement.body_meshes import mesh_of


def many_sided(sides, **mesh):
    """A polygon with that many vertices on a circle."""
    angle = 2.0 * math.pi * np.arange(sides) / sides
    parts = ["c" if 0.5 < a < 1.5 else "d" if a > 4.0 else "f" for a in angle]
    corners = [[10.0 * math.cos(a), 10.0 * math.sin(a)] for a in angle]
    return problem(
        material=elastic(1.0, 0.3),
        geometry={"shape": "polygon", "vertices": corners, "parts": parts},
        mesh=mesh,
        boundary=[closing("c", friction_bound=1.0), moved("d", (0, 0)), drawn("f", (0, 0))],
    )


def test_a_polygon_of_a_thousand_sides_is_meshed_soon():
    """0.3 s; 12 s when every side was compared with every other."""
    case = many_sided(1000)
    assert 10_000 < mesh_of(case.bodies[0], case.outline()).n_nodes < 20_000


@pytest.mark.slow
def test_too_many_graded_sides_are_refused_before_the_work():
    case, line = many_sided(100_000), r"^mesh: 100000 graded sides give more than 1e\+06 nodes"
    with pytest.raises(InputError, match=line):
        mesh_of(case.bodies[0], case.outline())


def test_dense_operators_that_do_not_fit_the_machine_are_refused(monkeypatch, comm):
    monkeypatch.setattr(choice, "physical_memory", lambda: 1e6)
    case = many_sided(300, element_size=1.0)
    for bem in (Bem(mat_type="dense"), Bem()):
        with pytest.raises(
            InputError,
            match=r"^mesh: dense operators of 600 unknowns, 48 of contact, take 0\.0\d+ GB",
        ):
            prepare(case.model_copy(update={"bem": bem}), comm)


def test_what_takes_a_while_is_announced(comm, capsys):
    """Its size and seconds before the work, and the share of a matrix while it is built."""
    announced, lines = [], []

    class Status:
        show = staticmethod(lines.append)

    def announce(*words):
        announced.append(words)
        return announcer(Status, False, quiet=False)(*words)

    small = many_sided(100, element_size=1.0)
    prepare(small, comm, announce=announce).close()
    mesh = mesh_of(small.bodies[0], small.outline())
    nodes = len(mesh.nodes_of("c"))
    seconds = FINISHED * choice.solve_seconds(Bem(), [mesh], [nodes], nodes, 1)
    assert [words[:3] for words in announced] == [(100, 200, seconds)]
    assert announced[0][3] > 8 * 200**2
    for adaptive in (False, True):
        announcer(Status, adaptive, quiet=False)(1000, 2000, 28.4, 0.35e9)
    size = "petcontact: 1000 nodes, 2000 unknowns, about 0.35 GB: about 28 s"
    whole, one = capsys.readouterr().err.splitlines()
    assert whole == f"{size} of processor time"
    assert one == f"{size} of processor time, if no finer mesh is needed"
    sides = [drawn(part, [0, 0, 1]) for part in ("left", "right", "front", "back")]
    block = problem(
        material=elastic(1.0, 0.3),
        geometry=cuboid([0, 0, 0], [1, 1, 1]),
        boundary=[moved("top", [0, 0, 0]), closing("bottom", friction_bound=1.0), *sides],
        mesh={"element_size": 0.34},
        bem={"mat_type": "hmatrix"},
    )
    prepare(block, comm, announce=announce).close()
    assert re.fullmatch(r"matrix: \d+%, about \d+ s left", lines[0])
    assert lines[-1].startswith("matrix: 100%, about 0 s")


DEEP = {
    "dots": ".".join("a" * 100_000) + " = 1",
    "quoted": ".".join(['"a"'] * 50_000) + " = 1",
    "header": "[" + ".".join("a" * 20_000) + "]",
    "spaced": " . ".join("a" * 50_000) + " = 1",
    "arrays": "a = " + "[" * 20_000 + "]" * 20_000,
    "open": "a = " + "[" * 20_000,
    "tables": "a = " + "{a = " * 8_000 + "1" + "}" * 8_000,
    "just too deep": "a = " + "[" * 17 + "]" * 17,
}


@pytest.mark.parametrize("kind", DEEP)
def test_deep_toml_is_refused_at_once(tmp_path, kind):
    """A key of 100 000 parts took a minute and 6 GB."""
    (tmp_path / "c.toml").write_text(DEEP[kind])
    with pytest.raises(InputError, match=rf"c\.toml: nested deeper than {DEEPEST} levels"):
        load(tmp_path / "c.toml")


BRACKETS = "[" * 20
TEXTS = [
    f'title = "a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s {BRACKETS}"',
    f"# {BRACKETS}",
    f"title = '''\n{BRACKETS}\n'''",
]


@pytest.mark.parametrize("text", TEXTS)
def test_brackets_and_dots_in_text_are_no_depth(tmp_path, text):
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(InputError, match="this key is required"):
        load(tmp_path / "c.toml")


def test_a_key_of_many_parts_is_refused_too():
    with pytest.raises(InputError, match="a key of 20 parts"):
        set_key({}, ".".join("a" * 20), 1, "--set")
