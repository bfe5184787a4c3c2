"""Fatigue over the steps of solved problems: blocks under uniform stress, fretting, the command,
its table and figure."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from shapes import closing, drawn, elastic, problem, rectangle, rollers, solid

from petcontact import load, solve
from petcontact.commands.main import main
from petcontact.fatigue.evaluate import fatigue

CONFIG = Path(__file__).parents[2] / "configs" / "fretting.toml"


def test_uniform_stress_in_the_plane():
    """Pulled along x between rollers, by 3 and then by -1. Plane strain: σ_zz = νσ_x strains the
    plane less."""
    steps = [
        {"name": name, "boundary": [{"part": "right", "value": [value, 0.0]}]}
        for name, value in (("pull", 3.0), ("push", -1.0))
    ]
    sides = *rollers("left"), closing("bottom"), drawn("right", [0.0, 0.0])
    more = {"material": elastic(200.0, 0.3), "mesh": {"element_size": 0.5, "order": 1}}
    bar = problem(body=[solid("bar", rectangle([0, 0], [2, 1]), *sides, **more)], step=steps)
    found = fatigue(solve(bar), "smith-watson-topper", first="pull", last="push", depth=0.3)
    (one,) = found.found
    assert set(one.sites.part) == {"bottom"} and one.sites.depth.max() == pytest.approx(0.3)
    assert len(np.unique(one.sites.depth)) == 7
    assert one.value == pytest.approx(3.0 * 2.0 * (1.0 - 0.3**2) / 200.0, rel=1e-7)
    assert np.abs(one.normal[:, 0]) == pytest.approx(1.0, abs=1e-5)


@pytest.fixture(scope="module")
def fretting(tmp_path_factory):
    """A solution, and its file."""
    steps = {f"step.{k}.increments": 1 for k in (1, 2, 3)}
    solution = solve(load(CONFIG, {"body.0.mesh.element_sizes.top": 0.25, **steps}))
    path = tmp_path_factory.mktemp("fretting") / "f.h5"
    solution.save(path)
    return solution, path


def test_ruiz_is_friction_work_and_tension(fretting):
    """Between the two ends of a cycle δ is half the way; both sides of the interface have the same
    work."""
    solution, _ = fretting
    first, second = (
        fatigue(solution, name, first="pull", last="push again") for name in ("ruiz-1", "ruiz-2")
    )
    a, b = (step.pairs["interface"] for step in solution.steps[-2:])
    way, shear = 0.5 * np.abs(a.slip - b.slip)[:, 0], [np.abs(x.sigma_t)[:, 0] for x in (a, b)]
    work = way * np.maximum(*shear)
    lower, upper = first.found
    assert (lower.sites.body, upper.sites.body) == ("lower", "upper") and work.max() > 1e-4
    assert lower.value == pytest.approx(work) and upper.value == pytest.approx(work)
    nodes = solution.nodes["interface"]
    tension = [solution.stress_on_boundary("lower", step)[nodes, 0] for step in solution.steps[-2:]]
    moments = [np.maximum(s, 0.0) * q * way for s, q in zip(tension, shear, strict=True)]
    found = second.found[0]
    assert found.value == pytest.approx(np.max(moments, axis=0))
    # where slip is largest and the surface is pulled: at the edges
    assert abs(abs(found.sites.x[found.value.argmax(), 0]) - 0.7) < 0.1


def test_the_command(fretting, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cycle = ["fatigue", str(fretting[1]), "--first", "pull", "--last", "push again"]
    words = "--parameter crossland --sensitivity 0.3 --limit 0.2 --body lower --depth 0.2"
    assert main([*cycle, *f"{words} -o out.csv --figure out.svg".split()]) == 0
    said = capsys.readouterr().out
    assert "crossland: 2 increments" in said and "lower.top" in said
    assert "over the limit 0.2: 0." in said
    with open("out.csv") as file:
        rows = list(csv.DictReader(file))
    assert set(rows[0]) == {"body", "part", "x", "y", "depth", "arc_length", "crossland"}
    # on this mesh the largest stress is not resolved
    below, bound = said.split("largest ")[1].split()[:2]
    assert below == "below" and max(float(row["crossland"]) for row in rows) < float(bound)
    assert (tmp_path / "out.svg").stat().st_size > 10_000
    assert main([*cycle, "--life", "2.0,-0.1,0.5,-0.6"]) == 0
    said = capsys.readouterr().out
    assert "critical plane: normal" in said and "cycles to failure" in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--first", "pul"], "--first: no step 'pul', did you mean 'pull'?"),
        (["--first", "push again", "--last", "push"], "step 'push' comes before step 'push again'"),
        (["--first", "press", "--last", "press"], "at least two increments"),
        (["--body", "uper"], "no body 'uper', did you mean 'upper'?"),
        (["--parameter", "findly"], "no 'findly', did you mean 'findley'?"),
        (["--parameter", "findley"], "findley needs it"),
        (["--sensitivity", "0.3"], "smith-watson-topper has none"),
        (["--depth", "-1"], "depth: must be 0 or more, got -1"),
        (["--part", "w"], "no part 'w'; parts are bottom, right, top, left\n"),
        (
            ["--parameter", "ruiz-1", "--depth", "0.5"],
            "depth: ruiz-1 is of slip and shear on the surface",
        ),
        (["--life", "1,2"], "four numbers"),
        (["-o", "out.txt"], "written as .csv"),
    ],
)
def test_mistakes_are_one_line(fretting, capsys, words, message):
    assert main(["fatigue", str(fretting[1]), *words]) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1
