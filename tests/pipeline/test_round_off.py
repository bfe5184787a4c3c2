"""What is strained and not displaced, what is displaced and not strained: round-off decides
nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from petcontact import load, solve

pytestmark = pytest.mark.usefixtures("unsampled", "unestimated")

LIMIT_TORQUE = Path(__file__).parents[2] / "configs" / "recipes" / "limit_torque.toml"


def test_a_bore_that_is_pressed_and_held_keeps_its_tractions():
    """The plug is bonded into a shaft that a ring presses on: its face has tractions and does not
    move, before it is turned and after."""
    solution = solve(load(LIMIT_TORQUE, {"method.name": "semismooth-newton"}))
    assert solution.converged, solution.reason
    for step in solution.steps:
        assert step.pairs["grip"].pressure == pytest.approx(2.598, rel=1e-3)
    assert solution.pairs["grip"].moment == pytest.approx(2.491, rel=1e-3)
