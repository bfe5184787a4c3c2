"""Several bodies that only contact holds: a column of discs that roll with little friction, balls
that no race loads."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapes import moved, problem, rectangle, solid, touching

from petcontact import solve

pytestmark = pytest.mark.usefixtures("unestimated")


def plate(name, lower, upper, *conditions, size=0.12):
    mesh = {"element_size": size, "order": 1}
    return solid(name, rectangle(lower, upper), *conditions, mesh=mesh)


def disc(name, centre, radius):
    """A disc in four parts: `far` and `near` above and below its middle, two sides."""

    def at(angle):
        way = math.radians(90.0 + angle)
        return [centre[0] + radius * math.cos(way), centre[1] + radius * math.sin(way)]

    parts = ("far", 0.0), ("side", 90.0), ("near", 180.0), ("side", 270.0)
    sides = [
        {"part": part, "to": at(middle + 45.0), "through": at(middle)} for part, middle in parts
    ]
    mesh = {"element_size": 0.06, "order": 1}
    return solid(name, {"shape": "outline", "loops": [sides]}, mesh=mesh)


def test_discs_in_a_column_with_little_friction_are_solved_in_few_iterations():
    """Where sets are exchanged without damping the discs roll to and fro for hundreds of
    iterations."""
    bodies = [
        plate("floor", [-2, -1], [2, 0], moved("bottom", [0.0, 0.0])),
        plate("plate", [-0.912593, 0.0], [0.912593, 0.481023], size=0.06),
        disc("lower", [-0.0077105, 1.1113619], 0.6303393),
        disc("upper", [-0.0250493, 2.4559552], 0.7142539),
        plate("lid", [-2, 3.1702091], [2, 4.1702091], moved("top", ["free", -0.06])),
    ]
    pairs = [
        ("plate.bottom", "floor.top", -1),
        ("lower.near", "plate.top", -1),
        ("upper.near", "lower.far", -1),
        ("upper.far", "lid.bottom", 1),
    ]
    contact = [
        touching(f"{k}", *parts, friction_coefficient=0.05, direction=[0, way])
        for k, (*parts, way) in enumerate(pairs)
    ]
    solution = solve(problem(body=bodies, contact=contact))
    assert solution.converged and [step.iterations < 40 for step in solution.steps] == [True]
    forces = np.array([each.force[1] for each in solution.pairs.values()])
    assert forces * [1, 1, 1, -1] == pytest.approx(forces[0] * np.ones(4), rel=1e-9)
    assert forces[0] > 0.0


def test_a_free_cylinder_between_two_plates_that_meet_it_between_nodes_only_is_not_overlooked():
    """It could yield to one plate, and no node meets the other: that was taken for no contact."""
    shape = {"shape": "cylinder", "from": [0.0, -4.0, 5.0], "to": [0.0, 4.0, 5.0], "radius": 5.0}
    roller = solid("roller", shape, mesh={"element_size": 8.0, "order": 1})
    plates = [{"name": "floor"}, {"name": "plate", "displacement": [0.0, 0.0, -0.01]}]
    contact = [
        touching("lower", "roller.side", "floor", gap="z", direction=[0.0, 0.0, -1.0]),
        touching("upper", "roller.side", "plate", gap="10 - z", direction=[0.0, 0.0, 1.0]),
    ]
    solution = solve(problem(body=[roller], obstacle=plates, contact=contact))
    assert solution.status == "not converged" and "overlap between nodes" in solution.reason
