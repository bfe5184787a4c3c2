"""Persson's pin in the hole of an infinite plate: the pressure and the angle of contact in closed
form."""

from __future__ import annotations

import numpy as np
import pytest
from verification.cases.case import FOLDER

from petcontact import load, solve
from petcontact.reference import persson


@pytest.mark.slow
def test_elements_of_a_ten_millionth_add_no_rotation():
    """Rounded chords turn the normals of tiny arcs: the pin's free rotation is not to press it into
    the hole.

    The normals were those of the chords: the pin turned 13 times round, and p was off by 1e-3 (and
    13 at some nodes).
    """
    angle = np.radians(84.0)
    edges = [[-np.sin(angle), -np.cos(angle)], [np.sin(angle), -np.cos(angle)]]
    mesh = {"levels": 12, "order": 5, "grading": 0.3, "graded_points": edges}
    gap = f"{persson.play(angle, 100.0, 0.3)!r}*(1 + sin(atan2(y, x)))"
    case = FOLDER / "closed_forms" / "c11_persson.toml"
    solution = solve(load(case, {"contact.0.gap": gap, "body.0.mesh": mesh}))
    pair = solution.last.pairs["fit"]
    exact = persson.pressure(np.arctan2(pair.x[:, 0], -pair.x[:, 1]), angle)
    square = pair.weight @ (pair.pressure - exact) ** 2 / (pair.weight @ exact**2)
    assert solution.converged and np.sqrt(square) < 5e-6
    assert np.abs(solution.last.alpha[2]) < 1e-12
    assert pair.pressure.max() < 0.65
