"""Stress on the boundary of solved problems against closed forms: rings, holes, contact edges,
volume loads, corners."""

from __future__ import annotations

import numpy as np
import pytest
from marks import slow
from shapes import closing, drawn, elastic, problem, rectangle, rollers
from verification.cases.half_planes import cattaneo_field
from verification.test_exact_blocks import GIVEN, solved

from petcontact import InputError, solve
from petcontact.fields.boundary.places import best_places

pytestmark = pytest.mark.usefixtures("unestimated")


@pytest.mark.parametrize(("order", "levels", "bound"), [(4, 6, 3e-4), slow(5, 8, 1e-4)])
def test_stress_along_contact_graded_to_its_edges(order, levels, bound):
    """σ_xx under Cattaneo's tractions, on the secondary and on the primary."""
    solution = solved(order=order, levels=levels, grading=0.3, graded_points=GIVEN)
    for body, part, side in (("lower", "top", 1.0), ("upper", "bottom", -1.0)):
        own = solution.meshes[body]
        element, place = best_places(own)
        here = own.part[element] == own.part_names.index(part)
        x = own.at(element[here], place[here])[0]
        wanted = cattaneo_field(side * x)[1]
        found = solution.stress_at(x, body, part=part)[:, 0]
        assert np.abs(found - wanted).max() < bound * np.abs(wanted).max()


def test_both_sides_of_a_corner_and_what_is_refused():
    """Pulled along x between rollers in steps: at a corner each part has its own stress, here the
    same."""
    block = problem(
        material=elastic(200.0, 0.3),
        geometry=rectangle([0, 0], [2, 1]),
        mesh={"element_size": 0.5, "order": 1},
        boundary=[
            *rollers("left"),
            closing("bottom"),
            drawn("right", [3.0, 0]),
            drawn("top", [0, 0]),
        ],
        step=[{"name": "half", "increments": 2}, {"name": "whole"}],
    )
    solution = solve(block)
    for part in ("right", "top"):
        assert np.allclose(solution.stress_at([[2.0, 1.0]], part=part), [3.0, 0.0, 0.0], atol=1e-11)
    assert np.allclose(
        solution.stress_at([[2.0, 0.4], [1.0, 0.5]], step=1), [1.5, 0.0, 0.0], atol=1e-11
    )
    assert np.allclose(
        solution.at([[2.0, 1.0]]), [[6.0 * (1 - 0.3**2) / 200.0, -3.0 * 0.3 * 1.3 / 200.0]]
    )
    with pytest.raises(InputError, match="no part 'rigth', did you mean 'right'"):
        solution.stress_at([[2.0, 1.0]], part="rigth")
    with pytest.raises(InputError, match=r"part 'right': the point \(1, 0.5\) does not lie on it"):
        solution.stress_at([[2.0, 0.5], [1.0, 0.5]], part="right")
    with pytest.raises(InputError, match="does not lie inside"):
        solution.stress_at([[2.0, 1.001]])
