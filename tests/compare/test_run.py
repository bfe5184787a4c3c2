"""The comparison of methods: its rows, tables, figures, and the command."""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

import forked
import pytest
from examples import example

from petcontact import Contact, Displacement, InputError, MeshOptions
from petcontact.commands.options import positives
from petcontact.compare.side_by_side import CONTENDERS, compare

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def rows(comm):
    cases = [
        (f"h = {size}", example(1, mesh=MeshOptions(element_size=size))) for size in (0.4, 0.2)
    ]
    return compare(cases, rhos=(1.0, 1e3, 1e7), comm=comm)


def test_methods_for_other_problems_are_left_out_unless_they_are_asked_for(comm):
    floor = Contact("bottom", normal="unilateral", friction_coefficient=0.3)
    case = example(1, mesh=MeshOptions(element_size=1.0))
    case = case.model_copy(
        update={"boundary": [floor if isinstance(c, Contact) else c for c in case.boundary]}
    )
    rows = compare([("a", case)], rhos=(1e3,), comm=comm)
    assert {row.contender for row in rows} == set(CONTENDERS) - {"tao"}
    with pytest.raises(InputError, match="tao solves bilateral"):
        compare([("a", case)], contenders=["tao"], comm=comm)
    held = [Displacement(c.part, (0.0, 0.0)) if c.part == "bottom" else c for c in case.boundary]
    with pytest.raises(InputError, match="a: nothing is in contact"):
        compare([("a", case.model_copy(update={"boundary": held}))], comm=comm)


def test_command(tmp_path):
    def run(*words):
        words = [forked.program(), "compare", *words]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=300)

    words = ["-o", "out", "--rho", "1,1e4", "--element-size", "0.4"]
    methods = "rule (4.3),operator-robin"
    done = run(str(ROOT / "configs/example1.toml"), *words, "--methods", methods)
    assert done.returncode == 0, done.stderr
    assert "operator-robin" in done.stdout and "semismooth" not in done.stdout
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {f"compare{end}" for end in ("-iterations.png", "-residual.png", ".csv", ".md")}
    wrong = run("x.toml", "--methods", "magic")
    assert wrong.returncode == 2 and "magic" in wrong.stderr and "operator-robin" in wrong.stderr


def test_numbers():
    assert positives("1,1e3") == [1.0, 1e3]
    for text in ("a", "1,,2", "-1", "inf", "nan"):
        with pytest.raises(argparse.ArgumentTypeError, match="no positive number"):
            positives(text)
