"""Round-off decides nothing: problems that are the same have the same status, increments and
numbers. More of them, and other processors: scripts/verify_processors."""

from __future__ import annotations

from pathlib import Path

import pytest
from variants import KINDS, SAMPLE, VARIANTS, Variant, differences, drawn, observed

from petcontact import load, solve

pytestmark = pytest.mark.usefixtures("unestimated")

AS_DRAWN = Variant()
CASES = [(number, False) for number in range(36)] + [(number, True) for number in (0, 3, 4, 5)]
QUICK = [*CASES[:8], (0, True)]
"""One of each kind, and one in space; the others are slow."""


@pytest.mark.parametrize(
    ("number", "space"),
    [
        pytest.param(
            *each,
            marks=() if each in QUICK else pytest.mark.slow,
            id=f"{KINDS[each[0] % 8]}-{each[0]}{'-space' * each[1]}",
        )
        for each in CASES
    ],
)
def test_the_same_problem_posed_in_other_ways(number, space):
    base = observed(solve(drawn(1, number, AS_DRAWN, space)), AS_DRAWN)
    assert base["status"] == "converged"
    told = {}
    for name in SAMPLE:
        # a box has no sides that are not along the axes
        variant = VARIANTS["turned by 90 degrees" if space and "37" in name else name]
        told[name] = differences(base, observed(solve(drawn(1, number, variant, space)), variant))
    assert not any(told.values()), told


def test_a_bore_that_is_pressed_and_held_keeps_its_tractions():
    """The plug is bonded into a shaft that a ring presses on: its face has tractions and does not
    move, before it is turned and after."""
    config = Path(__file__).parents[2] / "configs" / "recipes" / "limit_torque.toml"
    solution = solve(load(config, {"method.name": "semismooth-newton"}))
    assert solution.converged, solution.reason
    for step in solution.steps:
        assert step.pairs["grip"].pressure == pytest.approx(2.598, rel=1e-3)
    assert solution.pairs["grip"].moment == pytest.approx(2.491, rel=1e-3)
