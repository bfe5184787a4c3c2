"""Solutions that are zero, or rigid motions: they converge on every storage, and no round-off is
told as a result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shapes import cuboid, elastic, touching

from petcontact import solve
from petcontact.model.case import parse_problem

STEEL = elastic(1000.0, 0.3)
BALL = {
    "name": "ball",
    "material": STEEL,
    "mesh": {"element_size": 2.0, "order": 2},
    "geometry": {"shape": "sphere", "centre": [0, 0, 2], "radius": 2},
}
FLOOR = {
    "name": "floor",
    "material": STEEL,
    "mesh": {"element_size": 1.0, "order": 1},
    "geometry": cuboid([-2, -2, -2], [2, 2, 0]),
    "boundary": [{"part": "bottom", "condition": "displacement", "value": [0.0] * 3}],
}


def solved(**tables):
    return solve(parse_problem(tables, "nothing.toml", {}, Path()))


@pytest.mark.slow
@pytest.mark.parametrize("storage", ["dense", "hmatrix"])
def test_a_ball_that_a_bonded_socket_moves_carries_nothing(storage):
    """A rigid motion: no round-off is told as traction, resultant, tension, error or peak, and
    Newton's method ends."""
    socket = {"name": "socket", "displacement": [0.1, -0.2, 0.05], "rotation": [0.01, 0.02, -0.03]}
    pair = touching("pair", "ball.bottom", "socket", normal="bonded")
    found = solved(body=[BALL], obstacle=[socket], contact=[pair], bem={"mat_type": storage})
    assert found.converged and found.steps[0].iterations < 9
    pair = found.last.pairs["pair"]
    assert not pair.pressure.any() and not pair.force.any() and pair.tension_share == 0.0
    assert not found.last.obstacles["socket"].force.any() and found.accuracy.unknown
    assert "von Mises stress: 0\n" in found.verdict() and "PULLS" not in found.verdict()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("storage", "condition", "size"), [("dense", "displacement", 2.0), ("hmatrix", "traction", 1.5)]
)
def test_steps_of_nothing_and_back_to_nothing(storage, condition, size):
    """Round bodies that were pressed, let go, and left alone are as they were, and can be pressed
    again."""
    top = {"part": "top", "condition": condition, "value": [0.0, 0.0, -0.05]}
    bodies = [{**BALL, "mesh": {"element_size": size, "order": 2}, "boundary": [top]}, FLOOR]
    pair = touching(
        "pair", "ball.bottom", "floor.top", direction=[0, 0, -1], friction_coefficient=0.3
    )
    changes = [[0.0, 0.0, z] for z in (-0.05, 0.0, 0.0, -0.05)]
    steps = [{"boundary": [{"body": "ball", "part": "top", "value": value}]} for value in changes]
    found = solved(body=bodies, contact=[pair], step=steps, bem={"mat_type": storage})
    assert found.converged and len(found.steps) == 4
    assert all(step.iterations < 20 for step in found.steps)
    first, *nothing, last = [step.pairs["pair"].force[2] for step in found.steps]
    assert first > 0.1 and last == pytest.approx(first, rel=1e-3) and not any(nothing)
    strained = [np.ptp(step.bodies["ball"].traction, axis=0).max() for step in found.steps[1:3]]
    moved = max(np.abs(step.bodies["ball"].u).max() for step in found.steps[1:3])
    assert not any(strained) and (
        moved < 1e-15 or condition == "traction"
    )  # a ball that nothing holds may be anywhere
