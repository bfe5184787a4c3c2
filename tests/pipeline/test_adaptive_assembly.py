"""Adaptive solves of assemblies: data that only their expressions show, and what no mesh resolves."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import Problem
from petcontact.model.base import parse
from petcontact.pipeline.adaptive.climb import adapt

WIDTH, PLACE = 1e-4, 0.7312345


def block(pressure, steps=()):
    """A block on a rigid floor, with friction, under a pressure."""
    return parse(Problem, {
        "body": [{"name": "block", "material": {"young_modulus": 100.0, "poisson_ratio": 0.3},
                  "geometry": {"shape": "rectangle", "lower_left": [0.0, 0.0], "upper_right": [2.0, 1.0]},
                  "boundary": [{"part": "top", "condition": "traction", "pressure": pressure}]}],
        "obstacle": [{"name": "floor"}],
        "contact": [{"name": "sole", "secondary": "block.bottom", "primary": "floor", "friction_coefficient": 0.3}],
        "step": [*steps],
    }, "block")  # fmt: skip


@pytest.mark.parametrize("later", [False, True])
def test_a_narrow_load_is_seen(later):
    """A Gaussian of width 1e-4, which no node of a coarse mesh meets: the floor carries its integral, √π·1e-4."""
    peak = f"1 + 100*exp(-((x - {PLACE})/{WIDTH})**2)"
    change = {"boundary": [{"body": "block", "part": "top", "pressure": peak}]}
    solution = adapt(block("1.0", [{}, change]) if later else block(peak), 3e-2)
    pressed = 2.0 + 100.0 * WIDTH * np.sqrt(np.pi)
    assert solution.converged, solution.reason
    assert solution.last.pairs["sole"].force[1] == pytest.approx(pressed, rel=1e-6)


def test_data_that_no_mesh_resolves_are_told():
    solution = adapt(block("1 + 0.5*sin(1e6*x)"), 1e-2)
    assert solution.status == "not converged" and "no mesh resolves the given data" in solution.reason
