"""A rigid motion converges on every storage, and no round-off is told as a result."""

from __future__ import annotations

import pytest
from shapes import elastic, problem, solid, touching

from petcontact import solve


@pytest.mark.slow
@pytest.mark.parametrize("storage", ["dense", "hmatrix"])
def test_a_ball_that_a_bonded_socket_moves_carries_nothing(storage):
    """A rigid motion: no round-off is told as traction, resultant, tension, error or peak, and
    Newton's method ends."""
    socket = {"name": "socket", "displacement": [0.1, -0.2, 0.05], "rotation": [0.01, 0.02, -0.03]}
    ball = solid(
        "ball",
        {"shape": "sphere", "centre": [0, 0, 2], "radius": 2},
        material=elastic(1000.0, 0.3),
        mesh={"element_size": 2.0, "order": 2},
    )
    pair = touching("pair", "ball.bottom", "socket", normal="bonded")
    bem = {"mat_type": storage}
    found = solve(problem(body=[ball], obstacle=[socket], contact=[pair], bem=bem))
    assert found.converged and found.steps[0].iterations < 9
    pair = found.last.pairs["pair"]
    assert not pair.pressure.any() and not pair.force.any() and pair.tension_share == 0.0
    assert not found.last.obstacles["socket"].force.any() and found.accuracy.unknown
    assert "von Mises stress: 0\n" in found.verdict() and "PULLS" not in found.verdict()
