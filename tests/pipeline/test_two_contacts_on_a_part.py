"""One part of a body that is the secondary of two contacts, on meshes that adapt themselves."""

from __future__ import annotations

import pytest

from petcontact import Problem, solve

BLOCK = {
    "material": {"young_modulus": 1.0, "poisson_ratio": 0.3},
    "geometry": {"shape": "rectangle", "lower_left": [0.0, 0.0], "upper_right": [1.0, 1.0]},
    "boundary": [
        {"part": "top", "condition": "displacement", "value": [0.0, -0.1]},
        {"part": "left", "condition": "traction", "value": [0.0, 0.0]},
        {"part": "right", "condition": "traction", "value": [0.0, 0.0]},
    ],
}


def test_the_halves_of_a_side_carry_what_the_side_carries():
    halves = [
        {"name": "one", "secondary": "bottom", "primary": "a", "gap": "where(x < 0.5, 0, 1)"},
        {"name": "two", "secondary": "bottom", "primary": "b", "gap": "where(x > 0.5, 0, 1)"},
    ]
    whole = [{"name": "whole", "secondary": "bottom", "primary": "a"}]
    two, one = (
        solve(
            Problem.model_validate(
                {**BLOCK, "contact": contacts, "obstacle": [{"name": name} for name in names]}
            )
        )
        for contacts, names in ((halves, "ab"), (whole, "a"))
    )
    assert two.converged and one.converged
    forces = [pair.force[1] for pair in two.pairs.values()]
    assert forces == pytest.approx([0.5 * one.pairs["whole"].force[1]] * 2, rel=1e-4)
    for pair in two.pairs.values():
        assert pair.pressure.max() == pytest.approx(one.pairs["whole"].pressure.max(), rel=1e-2)
