"""Adaptive meshes for pressure and shear: where corners press, where increments leave kinks, what
the estimate says."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from random_bodies import random_contact
from shapes import elastic, rectangle, touching

from petcontact import adapt, solve
from petcontact.model.base import parse
from petcontact.model.problem import Problem
from petcontact.pipeline.adapt.difference import difference, fading_places
from petcontact.pipeline.adapt.part_ends import pressed_sides
from petcontact.pipeline.adapt.traction_ladder import edges_of_steps
from petcontact.refinement.contact_edges import Edge, edges, merged
from petcontact.refinement.levels import CONTACT_LADDER, believed, growing
from petcontact.results.verdict.summary import verdict


def blocks(low: float, high: float, **changes) -> Problem:
    """A block [-1, 1] x [-1, 0] under one that reaches from `low` to `high`."""
    made = {
        "upper": (10.0, [low, 0.0], [high, 1.0], {"part": "top", "value": [0.01, -0.02]}),
        "lower": (1.0, [-1.0, -1.0], [1.0, 0.0], {"part": "bottom", "value": [0.0, 0.0]}),
    }
    bodies = [
        {
            "name": name,
            "material": elastic(modulus, 0.3),
            "geometry": rectangle(start, end),
            "boundary": [{"condition": "displacement", **held}],
        }
        for name, (modulus, start, end, held) in made.items()
    ]
    contact = touching("pair", "upper.bottom", "lower.top", friction_coefficient=0.3)
    return parse(Problem, {"body": bodies, "contact": [contact], **changes}, "blocks")


@pytest.mark.parametrize(
    ("low", "high", "on_upper", "on_lower"),
    [
        (-2.0, 2.0, [1.0, 3.0], []),
        (-0.5, 0.5, [], [0.5, 1.5]),
        (-2.0, 0.5, [1.0], [0.5]),
        (-1.0, 1.0, [], []),
    ],
)
def test_corners_press_where_they_meet_a_side(low, high, on_upper, on_lower):
    problem = blocks(low, high)
    outlines = [body.geometry.outline() for body in problem.body]
    upper, lower = pressed_sides(outlines, problem.interfaces)
    assert [s for found in upper.inner.values() for s in sorted(found)] == pytest.approx(on_upper)
    assert [s for found in lower.inner.values() for s in sorted(found)] == pytest.approx(on_lower)
    assert (len(upper.pressing), len(lower.pressing)) == (len(on_lower), len(on_upper))
    # along the secondary: its own ends, and the corners that press on it
    assert fading_places(problem)["pair"].arc_lengths == pytest.approx(
        np.unique([0.0, *on_upper, high - low])
    )


@pytest.mark.slow
def test_a_corner_that_presses_inside_of_the_secondary_is_no_error_that_stays(comm):
    # body 63 of seed 1 stagnated at 1e-1: p is infinite where the ends of the lower body press on
    # the upper one
    solution, best = (
        adapt(random_contact(1, 63), accuracy, comm=comm) for accuracy in (1e-2, 1e-3)
    )
    assert solution.converged and best.converged, best.reason
    assert difference(solution, best).inside <= 1e-2
    # with the ends the error is much larger, and the verdict says where
    assert solution.accuracy.with_ends > 0.05
    assert solution.accuracy.singular["pair"] == pytest.approx([0.28995, 2.33204], abs=1e-5)
    assert "with the ends of parts" in verdict(solution)
    assert "tractions are singular: pair at s = 0.28995, 2.332" in " ".join(
        verdict(solution).split()
    )


def test_where_slip_turns_there_is_an_edge():
    s = np.linspace(0.0, 1.0, 1001)
    moved, ones = s - 0.3004, np.ones(1001)

    def places(state, smallest=1.0):
        return [
            edge.s
            for edge in edges(s, ones, -np.sign(moved), ones, 0.0 * s, moved, state, smallest)
        ]

    none = np.zeros(0)
    assert edges(none, none, none, none, none, none, none.astype(np.int64)) == []
    slip, turning, speck = (np.ones(1001, dtype=np.int64) for _ in range(3))
    turning[300], speck[600] = 0, 0
    assert places(slip) == pytest.approx([0.3004])
    # a node that sticks where slip turns is a zone, elsewhere a speck on coarse meshes
    assert len(places(turning)) == 2
    assert places(speck) == pytest.approx([0.3004])
    assert len(places(speck, 1e-5)) == 3


def test_edges_of_earlier_increments_count(comm):
    loads = {"boundary": [{"body": "upper", "part": "top", "value": [0.02, -0.02]}]}
    problem = blocks(
        -0.5,
        0.5,
        step=[
            {"boundary": [{"body": "upper", "part": "top", "value": [0.0, -0.02]}]},
            {"increments": 4, **loads},
        ],
    )
    solution = solve(problem, comm=comm)
    every = edges_of_steps(solution, 1e-3, {"pair": 0.0})["pair"]
    alone = edges_of_steps(
        dataclasses.replace(solution, steps=[solution.steps[0], solution.steps[-1]]),
        1e-3,
        {"pair": 0.0},
    )["pair"]
    assert len(every) > len(alone)
    assert {edge.s for edge in alone} <= {edge.s for edge in every}


def test_close_edges_are_one_and_the_kept_ones_stay():
    kept = [Edge(0.5, 1.0)]
    found = merged([Edge(0.501, 1.0), Edge(0.7, 1.0), Edge(0.702, 1.0)], 1e-3, kept)
    assert [edge.s for edge in found] == [0.5, 0.7]
    assert [edge.s for edge in merged(found, 1e-3, (), 0.1)] == [0.5]


def test_differences_that_grow_are_not_believed_to_fall():
    assert believed([1e-2, 5e-3], 40.0) == 5e-3
    assert believed([1e-2, 1e-5], CONTACT_LADDER.most_gain) == pytest.approx(1e-2 / 30.0)
    assert believed([5e-3, 1e-2], 40.0) == pytest.approx(2e-2)
    assert growing([1e-2, 5e-3, 6e-3]) and growing([1e-3, 5e-3, 1e-3])
    assert not growing([1e-2, 5e-3, 1e-3]) and not growing([1.0, 2.0, 1.0, 0.5])
