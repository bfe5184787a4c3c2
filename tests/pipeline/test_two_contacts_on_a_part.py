"""One part of a body that is the secondary of two contacts, on meshes that adapt themselves."""

from __future__ import annotations

import pytest
from shapes import drawn, elastic, moved, rectangle, touching

from petcontact import Problem, solve

BLOCK = {
    "material": elastic(1.0, 0.3),
    "geometry": rectangle([0.0, 0.0], [1.0, 1.0]),
    "boundary": [moved("top", [0.0, -0.1]), drawn("left", [0.0, 0.0]), drawn("right", [0.0, 0.0])],
}


def test_the_halves_of_a_side_carry_what_the_side_carries():
    halves = [
        touching("one", "bottom", "a", gap="where(x < 0.5, 0, 1)"),
        touching("two", "bottom", "b", gap="where(x > 0.5, 0, 1)"),
    ]
    whole = [touching("whole", "bottom", "a")]
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
