"""Load steps: reference numbers, closed forms, and where they go on from a file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from shapes import closing, cuboid, drawn, elastic, moved, problem, rectangle, solid, touching

from petcontact import (
    InputError,
    load,
    solve,
    write_solution,
)
from petcontact.model.description import condition_text

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

STACK = Path(__file__).parents[2] / "configs" / "stack.toml"
COARSE = {f"body.{k}.mesh": {"element_size": 0.5} for k in range(3)}


def test_a_free_block_on_a_rough_floor():
    """Prototype and scikit-fem P2 with 20 610 unknowns agree to 2e-6; the block is held by contact
    only."""
    block = problem(
        material=elastic(100.0, 0.3),
        geometry=rectangle([0, 0], [2, 1]),
        mesh={"levels": 9, "order": 3},
        boundary=[
            drawn("top", [0.0, -1.0]),
            closing("bottom", normal="unilateral", friction_coefficient=0.3),
            *(drawn(part, [0.0, 0.0]) for part in ("left", "right")),
        ],
        step=[
            {"name": "press"},
            {"name": "push", "boundary": [{"part": "top", "value": [0.25, -1.0]}]},
            {"name": "release", "boundary": [{"part": "top", "pressure": 1.0}]},
        ],
    )
    solution = solve(block)
    assert solution.converged and max(step.residuals["balance"] for step in solution.steps) < 1e-12
    wanted = [(0.0, -0.008675694), (0.009916782, -0.008677332), (0.000023606, -0.008677357)]
    top = solution.mesh.nodes_of("top")
    for step, value in zip(solution.steps, wanted, strict=True):
        mean = np.average(step.bodies["body"].u[top], axis=0, weights=solution.mesh.weight[top])
        assert mean == pytest.approx(value, abs=3e-6)
    assert solution.steps[1].pairs["bottom"].force == pytest.approx([-0.5, 2.0], rel=1e-12)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The file of all steps."""
    path = tmp_path_factory.mktemp("stack") / "r.h5"
    write_solution(path, solve(load(STACK, COARSE)))
    return str(path)


@pytest.mark.parametrize(
    ("key", "value", "difference"),
    [
        ("body.0.mesh", {"element_size": 1.0}, "holds other bodies, pairs or meshes"),
        ("step", [{"name": "press"}], "step[1], which is missing here"),
        ("step.1.boundary", [], "step[1].boundary[0], which is missing here"),
        ("body.0.material.young_modulus", 7.0, "young_modulus = 200.0, here it is 7.0"),
        ("contact.0.friction_coefficient", 0.1, "friction_coefficient = 0.3, here it is 0.1"),
    ],
)
def test_what_is_done_is_not_posed_anew(written, key, value, difference):
    """The increments of a file are those of the problem's own first steps; only what follows may
    differ."""
    with pytest.raises(InputError, match=re.escape(difference)):
        solve(load(STACK, COARSE | {"method.start": written, key: value}))


@pytest.mark.parametrize(("dimension", "increments"), [(2, 2), (3, 1)])
def test_a_body_that_only_contact_holds_is_unloaded_to_nothing(dimension, increments):
    """p = 0 and no word of overlaps; beyond, the body and the way it goes are named."""
    zero, corner = [0.0] * (dimension - 1), [1.0] * dimension
    shape = (rectangle, cuboid)[dimension - 2]([0.0] * dimension, corner)
    top = drawn("top", [*zero, -0.01])
    body = solid("block", shape, top, material=elastic(10.0, 0.3), mesh={"element_size": 0.5})
    pair = touching("pair", "block.bottom", "floor", friction_coefficient=0.3)
    steps = [{"name": "press"}] + [
        {
            "name": name,
            "increments": increments,
            "boundary": [{"body": "block", "part": "top", "value": [*zero, load]}],
        }
        for name, load in (("let go", 0.0), ("press again", -0.02), ("pull", 0.02))
    ]
    floor = [{"name": "floor"}]
    solution = solve(problem(body=[body], obstacle=floor, contact=[pair], step=steps))
    ends = {step.name: step for step in solution.steps if step.load_factor == 1.0}
    assert not ends["let go"].pairs["pair"].pressure.any()
    assert not ends["let go"].pairs["pair"].sigma_t.any()
    assert max(ends["let go"].residuals[key] for key in ("normal", "tangential", "overlap")) < 1e-10
    again, first = (ends[name].pairs["pair"].pressure for name in ("press again", "press"))
    assert np.allclose(again, 2.0 * first, rtol=1e-6)
    assert not solution.converged
    assert "body 'block' cannot be held: the load pushes it along +" in solution.reason


def held_and_freed(first, second, normal="bonded", **method):
    """A block on the ground whose top is held in one way, then in another."""
    change = {"part": "top", "value": second}
    block = solid(
        "block",
        rectangle([0.0, 0.0], [2.0, 1.0]),
        moved("top", first),
        material=elastic(100.0, 0.3),
        mesh={"element_size": 0.2, "order": 2},
    )
    law = {} if normal == "bonded" else {"friction_coefficient": 0.3}
    return problem(
        body=[block],
        obstacle=[{"name": "ground"}],
        contact=[touching("sole", "block.bottom", "ground", normal=normal, **law)],
        step=[{"name": "one"}, {"name": "two", "increments": 2, "boundary": [change]}],
        method=method,
    )


@pytest.mark.parametrize(
    "values", [([0.01, -0.02], ["free", -0.02]), (["free", -0.02], [0.01, "free"])]
)
def test_components_are_held_and_freed_by_steps(values):
    """Bonded, so that the way does not matter: the end is that of its own condition alone, the
    start that of the step before (to the discretisation error of equilibrium where only contact
    holds a component)."""
    solution = solve(held_and_freed(*values))
    alone = solve(held_and_freed(values[1], values[1])).last
    assert solution.converged, solution.reason
    for key in ("u", "traction"):
        found = getattr(solution.last.bodies["block"], key)
        wanted = getattr(alone.bodies["block"], key)
        assert np.allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())
    first, half, last = (step.bodies["block"].u for step in solution.steps)
    assert np.allclose(half, 0.5 * (first + last), atol=1e-12 if values[1][1] != "free" else 1e-5)


def test_a_face_that_is_held_sideways_is_pressed():
    """One-dimensional strain: σ_y = -p, and u_y = -p h/M; a step that names one of the two keeps
    the other."""
    young, ratio = 1000.0, 0.25
    stiff = young * (1.0 - ratio) / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
    steps = [
        {"name": "pull"},
        {"name": "press", "boundary": [{"part": "top", "traction": [0, -5]}]},
        {"name": "held", "boundary": [{"part": "top", "value": [0, "free"]}]},
    ]
    face = problem(
        material=elastic(young, ratio),
        geometry=rectangle([0.5, 0], [1.5, 1]),
        mesh={"element_size": 0.5, "order": 1},
        boundary=[
            moved("bottom", [0, 0]),
            {**moved("top", [0, "free"]), "traction": [0, "2*ny*x/x"]},
            *(moved(part, [0, "free"]) for part in ("left", "right")),
        ],
        step=steps,
    )
    pressed = face.bodies[0].conditions[0]["top"]
    assert condition_text(pressed) == "u = [0, free], t = [0, 2*ny*x/x]"
    solution = solve(face)
    assert solution.converged, solution.reason
    for step, pull in zip(solution.steps, (2.0, -5.0, -5.0), strict=True):
        top = step.bodies["body"].u[solution.mesh.nodes_of("top")]
        assert np.allclose(top, [0.0, pull / stiff], atol=1e-10)
        assert solution.reactions(step)["top"][1] == pytest.approx(pull)


def test_going_on_behind_a_step_that_holds_what_was_free(tmp_path):
    assembly = held_and_freed(["free", -0.02], [0.01, -0.02], "unilateral")
    whole = solve(assembly)
    assert whole.converged and whole.last.pairs["sole"].force[0] < 0.0
    write_solution(tmp_path / "whole.h5", whole)
    for count in (1, 2):
        start = f"{tmp_path}/whole.h5:{count}"
        rest = solve(held_and_freed(["free", -0.02], [0.01, -0.02], "unilateral", start=start))
        assert rest.converged and len(rest.steps) == 3
        assert np.allclose(rest.last.bodies["block"].u, whole.last.bodies["block"].u, atol=1e-11)
