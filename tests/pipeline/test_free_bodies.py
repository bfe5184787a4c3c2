"""Several bodies that only contact holds: a column of discs that roll with little friction, balls
that no race loads."""

from __future__ import annotations

import math

import numpy as np
import pytest

from petcontact import Problem, solve
from petcontact.model.base import parse

pytestmark = pytest.mark.usefixtures("unestimated")

SOFT = {"young_modulus": 1.0, "poisson_ratio": 0.3}


def rectangle(name, lower, upper, condition, size=0.12):
    shape = {"shape": "rectangle", "lower_left": lower, "upper_right": upper}
    return {
        "name": name,
        "material": SOFT,
        "geometry": shape,
        "mesh": {"element_size": size, "order": 1},
        "boundary": [] if condition is None else [{"condition": "displacement", **condition}],
    }


def disc(name, centre, radius, outward, size=0.06):
    """A disc in four parts: `far` and `near` around a direction [degrees] and its opposite, two
    sides."""

    def at(angle):
        way = math.radians(outward + angle)
        return [centre[0] + radius * math.cos(way), centre[1] + radius * math.sin(way)]

    parts = ("far", 0.0), ("side", 90.0), ("near", 180.0), ("side", 270.0)
    sides = [
        {"part": part, "to": at(middle + 45.0), "through": at(middle)} for part, middle in parts
    ]
    return {
        "name": name,
        "material": SOFT,
        "geometry": {"shape": "outline", "loops": [sides]},
        "mesh": {"element_size": size, "order": 1},
    }


def pair(name, secondary, primary, friction, **more):
    law = {} if friction is None else {"friction_coefficient": friction}
    return {"name": name, "secondary": secondary, "primary": primary, **law, **more}


def test_discs_in_a_column_with_little_friction_are_solved_in_few_iterations():
    """Where sets are exchanged without damping the discs roll to and fro for hundreds of
    iterations."""
    clamped = {"part": "bottom", "value": [0.0, 0.0]}
    bodies = [
        rectangle("floor", [-2, -1], [2, 0], clamped),
        rectangle("plate", [-0.912593, 0.0], [0.912593, 0.481023], None, 0.06),
        disc("lower", [-0.0077105, 1.1113619], 0.6303393, 90.0),
        disc("upper", [-0.0250493, 2.4559552], 0.7142539, 90.0),
        rectangle(
            "lid", [-2, 3.1702091], [2, 4.1702091], {"part": "top", "value": ["free", -0.06]}
        ),
    ]
    contact = [
        pair("1", "plate.bottom", "floor.top", 0.05, direction=[0, -1]),
        pair("2", "lower.near", "plate.top", 0.05, direction=[0, -1]),
        pair("3", "upper.near", "lower.far", 0.05, direction=[0, -1]),
        pair("4", "upper.far", "lid.bottom", 0.05, direction=[0, 1]),
    ]
    solution = solve(parse(Problem, {"body": bodies, "contact": contact}, "column"))
    assert solution.converged and [step.iterations < 40 for step in solution.steps] == [True]
    forces = np.array([each.force[1] for each in solution.pairs.values()])
    assert forces * [1, 1, 1, -1] == pytest.approx(forces[0] * np.ones(4), rel=1e-9)
    assert forces[0] > 0.0


def test_a_free_cylinder_between_two_plates_that_meet_it_between_nodes_only_is_not_overlooked():
    """It could yield to one plate, and no node meets the other: that was taken for no contact."""
    shape = {"shape": "cylinder", "from": [0.0, -4.0, 5.0], "to": [0.0, 4.0, 5.0], "radius": 5.0}
    roller = {
        "name": "roller",
        "material": SOFT,
        "geometry": shape,
        "mesh": {"element_size": 8.0, "order": 1},
    }
    plates = [{"name": "floor"}, {"name": "plate", "displacement": [0.0, 0.0, -0.01]}]
    contact = [
        pair("lower", "roller.side", "floor", None, gap="z", direction=[0.0, 0.0, -1.0]),
        pair("upper", "roller.side", "plate", None, gap="10 - z", direction=[0.0, 0.0, 1.0]),
    ]
    solution = solve(
        parse(Problem, {"body": [roller], "obstacle": plates, "contact": contact}, "roller")
    )
    assert solution.status == "not converged" and "overlap between nodes" in solution.reason
