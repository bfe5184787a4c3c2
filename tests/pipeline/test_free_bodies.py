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


@pytest.mark.slow
def test_balls_that_no_race_loads_are_accepted_without_tractions():
    """Three balls between two races; the outer one moves down onto the two upper ones, so that the
    lower one is free."""
    size, ball, race, shaft = 0.09, 0.4, 1.2, 0.6
    outer = race + 2.0 * ball

    def ring(name, hole, rim, loops, displacement):
        arcs = [
            [
                {"part": part, "to": [way * radius, 0.0], "through": [0.0, -way * radius]}
                for way in (-1.0, 1.0)
            ]
            for part, radius in zip((rim, hole), loops, strict=True)
        ]
        moved = {"part": "held", "condition": "displacement", "value": displacement}
        return {
            "name": name,
            "material": SOFT,
            "geometry": {"shape": "outline", "loops": arcs},
            "mesh": {"element_size": size, "order": 1},
            "boundary": [moved],
        }

    bodies = [
        ring("inner", "held", "race", (race, shaft), [0.0, 0.0]),
        ring("outer", "race", "held", (2.5, outer), [0.0, -0.02]),
    ]
    contact = []
    for number, angle in enumerate((-90.0, 30.0, 150.0)):
        way = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
        bodies.append(disc(f"ball {number}", (race + ball) * way, ball, angle, size))
        contact += [
            pair(f"{side} {number}", f"ball {number}.{part}", f"{side}.race", 0.1)
            for side, part in (("outer", "far"), ("inner", "near"))
        ]
    solution = solve(parse(Problem, {"body": bodies, "contact": contact}, "bearing"))
    assert solution.converged
    pressed = [float(np.linalg.norm(each.force)) for each in solution.pairs.values()]
    assert pressed == pytest.approx([0.0, 0.0] + [pressed[2]] * 4, rel=1e-6) and pressed[2] > 1e-3


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
