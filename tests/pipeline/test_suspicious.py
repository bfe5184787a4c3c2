"""Warnings of what a user hardly meant; each has its limit in the table of findings."""

from __future__ import annotations

import pytest
from shapes import drawn, elastic, moved, rectangle

from petcontact import solve
from petcontact.model.base import parse
from petcontact.model.problem import Problem

pytestmark = pytest.mark.usefixtures("unsampled")


def warned(boundary=None, steps=(), **more):
    """Warnings of a small block on a floor."""
    floor = {"part": "bottom", "condition": "contact", "normal": "unilateral", **(boundary or {})}
    data = {
        "material": elastic(1000.0, 0.3),
        "geometry": rectangle([0, 0], [1, 1]),
        "mesh": {"element_size": 0.25},
        "boundary": [
            floor,
            moved("top", [0, -0.01]),
            *(drawn(part, [0, 0]) for part in ("left", "right")),
        ],
        "step": list(steps),
    }
    solution = solve(parse(Problem, {**data, **more}, "block"))
    assert solution.converged
    return " ".join(solution.verdict().split())


def test_a_usual_block_has_no_warning():
    assert "warning" not in warned()


@pytest.mark.parametrize(
    ("words", "boundary", "more"),
    [
        ("a friction coefficient of 3", {"friction_coefficient": 3.0}, {}),
        ("bilateral contact closes a gap of 0.01", {"normal": "bilateral", "gap": 0.01}, {}),
        ("overlaps by 0.2, far for the theory", {"gap": -0.2}, {}),
    ],
)
def test_each_warning(words, boundary, more):
    assert words in warned(boundary, **more)


def test_strains_and_tiny_loads():
    change = {"part": "top"}
    assert "is strained by" in warned(steps=[{"boundary": [{**change, "value": [0, -0.08]}]}])
    tiny = warned(steps=[{"boundary": [{**change, "value": [0, -1e-12]}]}])
    assert "have the same unit" in tiny


def test_a_step_in_which_nothing_is_carried():
    lifted, pressed = ({"boundary": [{"part": "top", "value": [0, y]}]} for y in (0.01, -0.01))
    said = warned(steps=[{"name": "lift", **lifted}, {"name": "press", **pressed}])
    assert "step 'lift': its contact carries nothing" in said


def test_bodies_that_nothing_joins_and_loads_in_pascals():
    other = {
        "material": elastic(210e9, 0.3),
        "mesh": {"element_size": 0.5},
        "geometry": rectangle([0, 0], [1, 1]),
    }
    held = moved("bottom", [0, 0])
    pressed = {"part": "top", "condition": "traction", "pressure": 400.0}
    bodies = [{"name": name, "boundary": [held, pressed], **other} for name in "ab"]
    said = " ".join(solve(parse(Problem, {"body": bodies}, "two")).verdict().split())
    assert "body 'a': touches no other body; bodies meet where a [[contact]]" in said
    assert "check that loads and moduli have the same unit" in said
