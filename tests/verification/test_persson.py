"""Persson's pin in the hole of an infinite plate: the pressure and the angle of contact in closed
form."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import elastic, problem, solid, touching

from petcontact import solve
from petcontact.reference import persson

E, NU = 100.0, 0.3


def pin(angle, **mesh):
    """A pin of radius 1 that a force 1 at its centre presses down, frictionless."""
    circle = {"center": [0.0, 0.0], "radius": 1.0}
    rim = {"shape": "outline", "loops": [{"part": "rim", **circle}]}
    hole = {"shape": "outline", "exterior": True, "loops": [{"part": "hole", **circle}]}
    force, material = {"at": [0.0, 0.0], "force": [0.0, -1.0]}, elastic(E, NU)
    gap = f"{persson.play(angle, E, NU)!r}*(1 + sin(atan2(y, x)))"
    return problem(
        body=[
            solid("pin", rim, material=material, mesh=mesh, point_force=[force]),
            solid("plate", hole, material=material),
        ],
        contact=[touching("fit", "pin.rim", "plate.hole", gap=gap)],
    )


def error(solution, angle):
    """Relative L2 error of the pressure."""
    pair = solution.last.pairs["fit"]
    exact = persson.pressure(np.arctan2(pair.x[:, 0], -pair.x[:, 1]), angle)
    return float(np.sqrt(pair.weight @ (pair.pressure - exact) ** 2 / (pair.weight @ exact**2)))


@pytest.mark.slow
def test_elements_of_a_ten_millionth_add_no_rotation():
    """Rounded chords turn the normals of tiny arcs: the pin's free rotation is not to press it into
    the hole.

    The normals were those of the chords: the pin turned 13 times round, and p was off by 1e-3 (and
    13 at some nodes).
    """
    angle = np.radians(84.0)
    edges = [[-np.sin(angle), -np.cos(angle)], [np.sin(angle), -np.cos(angle)]]
    solution = solve(pin(angle, levels=12, order=5, grading=0.3, graded_points=edges))
    assert solution.converged and error(solution, angle) < 5e-6
    assert np.abs(solution.last.alpha[2]) < 1e-12
    assert solution.last.pairs["fit"].pressure.max() < 0.65
