"""Corners that are known before anything is solved, and data that no mesh resolves."""

from __future__ import annotations

import pytest
from shapes import closing, drawn, elastic, moved, problem, rectangle

from petcontact import adapt
from petcontact.refinement.singular_points import corner_exponents

FREE = [0.0, 0.0]
HELD = moved("top", FREE)
L_SHAPED = {
    "shape": "polygon",
    "vertices": [[0, 0], [8, 0], [8, 2], [4, 2], [4, 4], [0, 4]],
    "parts": ["bottom", "right", "shelf", "inner", "top", "left"],
}
"""A reentrant corner between shelf and inner, at (4, 2)."""
FLAT = {
    "shape": "polygon",
    "vertices": [[0, 0], [4, 0], [8, 0], [8, 4], [0, 4]],
    "parts": ["a", "b", "right", "top", "left"],
}
SKEW = {
    "shape": "polygon",
    "vertices": [[0, 0], [40, 0], [55, 12], [40, 25], [0, 25]],
    "parts": ["base", "lower", "upper", "top", "left"],
}


def exponents(geometry, *boundary, **more):
    """Of all corners; sides of which nothing is said are free."""
    given = problem(material=elastic(1.0, 0.3), geometry=geometry, boundary=boundary, **more)
    return corner_exponents(given.bodies[0], given.boundaries[0])


def test_corners_are_as_strong_as_their_angles_and_sides():
    """Free sides meet at (4, 2); the right angles are clamped and free, or free. Held and free sides
    in one line: r^(1/2), whether they stick or slip."""
    contact = closing("bottom", friction_bound=80.0)
    found = exponents(L_SHAPED, contact, HELD)
    assert found[2][1] == found[3][0] == pytest.approx(0.5445, abs=1e-3)
    assert found[0] == pytest.approx((0.711, 0.711), abs=2e-3) and found[1] == (found[0][1], 1.0)
    level = exponents(FLAT, closing("a", friction_bound=1.0), HELD)
    assert level[0] == pytest.approx((0.711, 0.5), abs=2e-3)
    held = exponents(L_SHAPED, contact, HELD, moved("shelf", FREE))
    assert held[2][1] == pytest.approx(0.3417, abs=1e-3)


def test_a_skew_roller_is_held_in_its_own_direction():
    """Contact may slide at (40, 0); the side from (55, 12) leans and is held in x: neither sliding
    nor clamped."""
    others = closing("base", friction_bound=60.0), moved("left", ["0.004*y/25", "free"])
    found = exponents(SKEW, *others, moved("upper", [-0.03, "free"]))
    assert found[0][1] == pytest.approx(0.528, abs=2e-3)
    clamped = exponents(SKEW, *others, moved("upper", [-0.03, 0.0]))
    assert found[2][0] == found[1][1] != clamped[2][0]


def test_torsion_has_the_exponents_of_laplace_s_equation():
    """A disc is turned on the top of a shaft, and no other direction is held there: r^(1/2) where it
    ends."""
    ends = {"bottom": [2, 0], "side": [2, 2], "top": [1, 2], "disc": [0, 2], "axis": [0, 0]}
    loop = [{"part": part, "to": to} for part, to in ends.items()]
    turned, held = moved("disc", ["free", "free", "x"]), moved("bottom", [0.0, 0.0, 0.0])
    shaft = {"shape": "outline", "loops": [loop]}
    found = exponents(shaft, held, turned, symmetry="axial")
    assert [round(a, 3) for a, _ in found] == [1.0, 0.711, 1.0, 0.5]


def test_data_that_no_mesh_resolves_are_refused(comm):
    sides = closing("bottom", friction_bound=6.0), moved("right", FREE)
    slab = problem(
        material=elastic(8000.0, 0.3),
        geometry=rectangle([0, 0], [7, 1.2]),
        boundary=[*sides, drawn("left", [15.0, 0.0]), drawn("top", [0.0, "-10*sin(1e5*x)"])],
    )
    solution = adapt(slab, 1e-2, comm=comm)
    assert solution.status == "not converged" and "resolve" in solution.reason
