"""Errors of printed numbers, by solutions and numbers that are made up for it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapes import drawn, elastic, moved, rectangle

from petcontact import Problem, load, solve
from petcontact.contact.law_protocol import SLIP
from petcontact.model.base import parse
from petcontact.results.evaluated import displacement_scale
from petcontact.results.numbers import ENERGY


@pytest.fixture(scope="module")
def slipping():
    """A block of which a fifth of the bottom slips, far less than the block is displaced."""
    data = {
        "material": elastic(1.0, 0.3),
        "geometry": rectangle([0.0, 0.0], [2.0, 1.0]),
        "mesh": {"element_size": 0.125},
        "boundary": [
            {"part": "bottom", "condition": "contact", "friction_bound": "0.002 + 2*(x > 0.4)"},
            moved("top", [0.01, -0.01]),
            drawn("left", [0.0, 0.0]),
            drawn("right", [0.0, 0.0]),
        ],
    }
    return solve(parse(Problem, data, "slipping"))


def test_an_energy_is_off_by_the_worst_slip_that_the_error_allows(slipping):
    """An error of u_t in L2 changes ∫ g |u_t| most where it is proportional to g."""
    (pair,), (energy,) = (
        slipping.pairs.values(),
        [each for each in slipping.numbers if each.name == ENERGY],
    )
    slips = pair.state == SLIP
    assert 0 < np.count_nonzero(slips) < 8
    g, weight = pair.bound[slips], pair.weight[slips]
    norm = slipping.accuracy.error * displacement_scale(slipping)
    worst = norm * g / math.sqrt(weight @ g**2)
    assert energy.error >= (1.0 - 1e-9) * float(weight @ (g * worst))


def test_maxima_by_the_edge_of_contact_are_off_by_the_root_of_the_error():
    """A ball on a block, of which the whole contact is by the edge. The energy is no moment: it is
    off by no more than the force takes along the slip."""
    changes = {"mesh": {"element_size": 0.75}, "boundary.0.friction_coefficient": 0.3}
    solution = solve(load("configs/kinds/space_adaptive.toml", changes))
    numbers = {each.name: each for each in solution.numbers}
    slip, force, energy = (numbers[name] for name in ("largest slip", "force", ENERGY))
    assert slip.error == pytest.approx(math.sqrt(solution.accuracy.error) * slip.size)
    assert 0.0 < energy.error < force.size * slip.size


def test_the_largest_q_may_reach_the_bound_at_an_end_that_sticks(slipping):
    """Stress has no bound beside the right side."""
    (largest,) = [each for each in slipping.numbers if each.name == "largest q"]
    assert np.isinf(largest.error) or largest.error >= 2.002 - largest.size
