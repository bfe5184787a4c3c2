"""A body that only friction holds: solved as long as the bound can carry the loads, else
reported."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from shapes import drawn

from petcontact import load, solve

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

EXAMPLE = Path(__file__).parents[2] / "configs" / "example1.toml"


def pushed(pressure, method="semismooth-newton"):
    """A block of 8 x 4 on a sole with g = 50, pushed by a pressure on its left side."""
    changes = {
        "boundary.0.friction_bound": 50.0,
        "boundary.1": drawn("top", [0.0, 0.0]),
        "boundary.2": {"part": "left", "condition": "traction", "pressure": pressure},
        "mesh": {"element_size": 0.4},
        "method": {"name": method},
    }
    return solve(load(EXAMPLE, changes))


@pytest.mark.parametrize(
    ("method", "pressure"),
    # where nearly all of it slips the projection method needs more than its 1000 iterations
    [("semismooth-newton", 97.0), ("operator-robin", 97.0), ("projection", 30.0)],
)
def test_friction_that_can_carry_the_load_does(method, pressure):
    """Capacity 8·50 = 400, load 4·pressure."""
    solution = pushed(pressure, method)
    assert solution.converged and "3 motions held by contact only" in solution.verdict(verbose=True)
    force = solution.pairs["bottom"].force
    assert force == pytest.approx([-4.0 * pressure, 0.0], rel=1e-9, abs=1e-9)


def test_friction_that_cannot_is_told_with_the_load_that_it_could():
    solution = pushed(110.0)
    reached = float(re.search(r"no equilibrium at load factor (\d\.\d+)", solution.reason)[1])
    assert not solution.converged and reached == pytest.approx(400.0 / 440.0, abs=0.01)
