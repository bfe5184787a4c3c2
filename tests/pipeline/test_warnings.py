"""Motions that are not small."""

from __future__ import annotations

import pytest
from shapes import closing, drawn, elastic, moved, problem, rectangle, solid, touching

from petcontact import (
    solve,
)

pytestmark = pytest.mark.usefixtures("unsampled")


def test_a_body_that_turns_is_warned_of(comm):
    """A block whose top is turned by 3 rad, above a floor that it does not reach."""
    block = problem(
        material=elastic(1.0, 0.3),
        geometry=rectangle([0.0, 0.0], [1.0, 1.0]),
        mesh={"element_size": 0.25},
        boundary=[
            closing("bottom", normal="unilateral", gap=10.0),
            moved("top", ["-3*y", "3*x"]),
            *(drawn(part, [0.0, 0.0]) for part in ("left", "right")),
        ],
    )
    assert "turns by 3 rad" in solve(block, comm=comm).verdict()


@pytest.mark.parametrize(("slope", "held"), [(1e-4, True), (0.1, False)])
def test_a_disc_that_rolls_down_a_slope_is_not_held_by_the_arm_of_its_undeformed_contact(
    slope, held
):
    """Its contact would have to lie `slope` radii behind its middle, and is .06 wide."""
    foot = [
        {"part": "foot", "to": [0.2, 0.0202041], "through": [0.0, 0.0]},
        {"part": "rest", "to": [-0.2, 0.0202041], "through": [0.0, 2.0]},
    ]
    disc = solid(
        "disc",
        {"shape": "outline", "loops": [foot]},
        material={**elastic(4e4, 0.3), "density": 1.0},
        loads={"acceleration": [10.0 * slope, -10.0]},
        mesh={"element_size": 0.02, "order": 1},
    )
    law = {"direction": [0.0, -1.0], "gap": "y", "friction_coefficient": 0.5}
    pair = touching("pair", "disc.foot", "floor", **law)
    solution = solve(problem(body=[disc], obstacle=[{"name": "floor"}], contact=[pair]))
    assert solution.converged == held, solution.reason
    assert ("widths of its contact" in solution.reason) != held
