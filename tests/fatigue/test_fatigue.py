"""Fatigue over the steps of solved problems: blocks under uniform stress, fretting, the command,
its table and figure."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from petcontact import (
    Body,
    Contact,
    InputError,
    Material,
    MeshOptions,
    Problem,
    Rectangle,
    Step,
    Symmetry,
    Traction,
    load,
    solve,
)
from petcontact.commands.main import main
from petcontact.fatigue.evaluate import fatigue, table
from petcontact.model.load_steps import BoundaryChange

STEEL = Material(200.0, 0.3)
CONFIG = Path(__file__).parents[2] / "configs" / "fretting.toml"


def pulled(geometry, sides, plane=True):
    """Along x between rollers: 3, then -1."""
    free = (0.0,) * (2 if plane else 3)
    forces = [BoundaryChange(part="right", value=(value, *free[1:])) for value in (3.0, -1.0)]
    return Problem(
        body=[
            Body(
                name="bar",
                material=STEEL,
                geometry=geometry,
                mesh=MeshOptions(element_size=0.5, order=1),
                boundary=[
                    Symmetry("left"),
                    Contact("bottom"),
                    *([] if plane else [Symmetry("front")]),
                    Traction("right", free),
                    *(Traction(part, free) for part in sides),
                ],
            )
        ],
        step=[Step("pull", boundary=forces[:1]), Step("push", boundary=forces[1:])],
    )


def uniform(solution):
    found = fatigue(solution, "smith-watson-topper", first="pull", last="push", depth=0.3)
    (one,) = found.found
    assert set(one.sites.part) == {"bottom"} and one.sites.depth.max() == pytest.approx(0.3)
    assert len(np.unique(one.sites.depth)) == 7
    return one


def test_uniform_stress_in_the_plane():
    """Plane strain: σ_zz = νσ_x strains the plane less."""
    one = uniform(solve(pulled(Rectangle((0, 0), (2, 1)), ["top"])))
    assert one.value == pytest.approx(3.0 * 2.0 * (1.0 - 0.3**2) / 200.0, rel=1e-7)
    assert np.abs(one.normal[:, 0]) == pytest.approx(1.0, abs=1e-5)


def solved(size):
    steps = {f"step.{k}.increments": 1 for k in (1, 2, 3)}
    return solve(load(CONFIG, {"body.0.mesh.element_sizes.top": size, **steps}))


@pytest.fixture(scope="module")
def fretting():
    return solved(0.1)


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    path = tmp_path_factory.mktemp("fretting") / "f.h5"
    solved(0.25).save(path)
    return path


@pytest.mark.slow
def test_ruiz_is_friction_work_and_tension(fretting):
    """Between the two ends of a cycle δ is half the way; both sides of the interface have the same
    work."""
    first = fatigue(fretting, "ruiz-1", first="pull", last="push again")
    a, b = (step.pairs["interface"] for step in fretting.steps[-2:])
    work = (
        0.5 * np.abs(a.slip - b.slip)[:, 0] * np.maximum(np.abs(a.sigma_t), np.abs(b.sigma_t))[:, 0]
    )
    lower, upper = first.found
    assert (lower.sites.body, upper.sites.body) == ("lower", "upper")
    assert lower.value == pytest.approx(work) and upper.value == pytest.approx(work)
    assert work.max() > 1e-4
    second = fatigue(fretting, "ruiz-2", first="pull", last="push again")
    nodes = fretting.nodes["interface"]
    tension = [fretting.stress_on_boundary("lower", step)[nodes, 0] for step in fretting.steps[-2:]]
    moments = [
        np.maximum(s, 0.0) * np.abs(pair.sigma_t[:, 0]) * 0.5 * np.abs(a.slip - b.slip)[:, 0]
        for s, pair in zip(tension, (a, b), strict=True)
    ]
    assert second.found[0].value == pytest.approx(np.max(moments, axis=0))
    # where slip is largest and the surface is pulled: at the edges
    assert abs(abs(second.found[0].sites.x[second.found[0].value.argmax(), 0]) - 0.7) < 0.1


@pytest.mark.slow
def test_fretting_is_worst_at_the_edge_on_the_surface(fretting):
    result = fatigue(fretting, "smith-watson-topper", first="pull", last="push again", depth=0.5)
    found, k = result.largest
    assert found.sites.depth[k] == 0.0 and abs(abs(found.sites.x[k, 0]) - 0.74) < 0.06
    rows = table(result)
    assert len(rows["body"]) == sum(len(one.value) for one in result.found)
    below = [
        rows["smith_watson_topper"][rows["depth"] == depth].max()
        for depth in np.unique(rows["depth"])
    ]
    assert np.all(np.diff(below) < 0.0)
    # equal bodies, pushed to and fro alike: the same from left and right, above and below
    lower, upper = (one.value.max() for one in result.found)
    assert lower == pytest.approx(upper, rel=0.03)


def test_the_command(coarse, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cycle = ["fatigue", str(coarse), "--first", "pull", "--last", "push again"]
    words = "--parameter crossland --sensitivity 0.3 --limit 0.2 --body lower --depth 0.2"
    assert main([*cycle, *f"{words} -o out.csv --figure out.svg".split()]) == 0
    said = capsys.readouterr().out
    assert "crossland: 2 increments" in said and "lower.top" in said
    assert "over the limit 0.2: 0." in said
    with open("out.csv") as file:
        rows = list(csv.DictReader(file))
    assert set(rows[0]) == {"body", "part", "x", "y", "depth", "arc_length", "crossland"}
    largest, sign, error = said.split("largest ")[1].split()[:3]
    assert sign == "+-"
    assert max(float(row["crossland"]) for row in rows) == pytest.approx(
        float(largest), abs=float(error)
    )
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
        (["--parameter", "findly"], "no 'findly', did you mean 'findley'?"),
        (["--parameter", "findley"], "findley needs it"),
        (["--sensitivity", "0.3"], "smith-watson-topper has none"),
        (["--depth", "-1"], "--depth -1: must be a number, 0 or more"),
        (["--body", "uper"], "no body 'uper', did you mean 'upper'?"),
        (["--part", "tip"], "no part 'tip'"),
        (["--part", "w"], "no part 'w'; parts are bottom, right, top, left\n"),
        (
            ["--parameter", "ruiz-1", "--depth", "0.5"],
            "depth: ruiz-1 is of slip and shear on the surface",
        ),
        (["--life", "1,2"], "four numbers"),
        (["-o", "out.txt"], "written as .csv"),
    ],
)
def test_mistakes_are_one_line(coarse, capsys, words, message):
    assert main(["fatigue", str(coarse), *words]) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1


def test_nothing_in_contact_is_refused():
    block = pulled(Rectangle((0, 0), (2, 1)), ["top"])
    solution = solve(block)
    with pytest.raises(InputError, match="no part 'side'"):
        fatigue(solution, "smith-watson-topper", parts=["side"])
