"""Corners that are known before anything is solved, and adaptive solves that need them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from petcontact import (
    Contact,
    Displacement,
    Material,
    Polygon,
    Problem,
    Rectangle,
    Traction,
    adapt,
)
from petcontact.refinement.singular_points import corner_exponents


def l_shaped(friction_bound: float | str) -> Problem:
    """A reentrant corner between two free sides, at (4, 2)."""
    free = [Traction(part=name, value=(0.0, 0.0)) for name in ("right", "shelf", "inner")]
    return Problem(
        material=Material(young_modulus=10_000.0, poisson_ratio=0.3),
        geometry=Polygon(
            vertices=((0, 0), (8, 0), (8, 2), (4, 2), (4, 4), (0, 4)),
            parts=("bottom", "right", "shelf", "inner", "top", "left"),
        ),
        boundary=(
            Contact(part="bottom", friction_bound=friction_bound),
            Displacement(part="top", value=(0.0, 0.0)),
            Traction(part="left", value=(300.0, 0.0)),
            *free,
        ),
    )


def exponents(problem):
    return corner_exponents(problem.body[0], problem.boundaries[0])


def with_condition(problem, condition):
    """A problem with another condition for a part."""
    boundary = [condition if c.part == condition.part else c for c in problem.boundary]
    return problem.model_copy(update={"boundary": tuple(boundary)})


def test_corners_are_as_strong_as_their_angles_and_sides():
    """Free sides meet at (4, 2); the right angles are clamped and free, or free. Held and free sides
    in one line: r^(1/2), whether they stick or slip."""
    problem = l_shaped(80.0)
    found = exponents(problem)
    assert found[2][1] == found[3][0] == pytest.approx(0.5445, abs=1e-3)
    assert found[0] == pytest.approx((0.711, 0.711), abs=2e-3) and found[1] == (found[0][1], 1.0)
    flat = Polygon(
        vertices=((0, 0), (4, 0), (8, 0), (8, 4), (0, 4)), parts=("a", "b", "right", "top", "left")
    )
    boundary = (
        Contact(part="a", friction_bound=1.0),
        *(Traction(part=p, value=(0.0, 0.0)) for p in ("b", "right", "left")),
        Displacement(part="top", value=(0.0, 0.0)),
    )
    level = problem.model_copy(update={"geometry": flat, "boundary": boundary})
    assert exponents(level)[0] == pytest.approx((0.711, 0.5), abs=2e-3)
    held = with_condition(problem, Displacement(part="shelf", value=(0.0, 0.0)))
    assert exponents(held)[2][1] == pytest.approx(0.3417, abs=1e-3)


def test_a_skew_roller_is_held_in_its_own_direction():
    """Contact may slide at (40, 0); the side from (55, 12) leans and is held in x: neither sliding
    nor clamped."""
    found = exponents(skew())
    assert found[0][1] == pytest.approx(0.528, abs=2e-3)
    clamped = with_condition(skew(), Displacement(part="upper", value=(-0.03, 0.0)))
    assert found[2][0] == found[1][1] != exponents(clamped)[2][0]


def skew() -> Problem:
    """A body on whose base friction ends next to a skew side; estimates were 20 times too small
    there."""
    return Problem(
        material=Material(young_modulus=2.1e5, poisson_ratio=0.3),
        geometry=Polygon(
            vertices=((0, 0), (40, 0), (55, 12), (40, 25), (0, 25)),
            parts=("base", "lower", "upper", "top", "left"),
        ),
        boundary=(
            Contact(part="base", friction_bound=60.0),
            Traction(part="lower", value=(0.0, 0.0)),
            Displacement(part="upper", value=(-0.03, "free")),
            Traction(part="top", value=(0.0, 0.0)),
            Displacement(part="left", value=("0.004*y/25", "free")),
        ),
    )


def slab(traction: str) -> Problem:
    """A slab pressed down on a spot of its top."""
    return Problem(
        material=Material(young_modulus=8000.0, poisson_ratio=0.3),
        geometry=Rectangle(lower_left=(0, 0), upper_right=(7, 1.2)),
        boundary=(
            Contact(part="bottom", friction_bound=6.0),
            Traction(part="left", value=(15.0, 0.0)),
            Displacement(part="right", value=(0.0, 0.0)),
            Traction(part="top", value=(0.0, traction)),
        ),
    )


@pytest.mark.parametrize("width", [1e-1, 1e-6])
def test_a_narrow_peak_acts_like_its_resultant(width, comm):
    """Far from it: by Saint-Venant's principle the solution does not depend on a width that is
    small enough."""
    force = 30000.0 * math.sqrt(math.pi) * 1e-3
    solution = adapt(
        slab(f"{-force / (math.sqrt(math.pi) * width)!r}*exp(-((x - 3.137)/{width!r})**2)"),
        1e-3,
        comm=comm,
    )
    assert solution.converged
    mesh = solution.mesh
    top = mesh.nodes_of("top")
    assert mesh.weight[top] @ solution.traction[top, 1] == pytest.approx(-force, rel=1e-3)
    # the peak of width 1e-3 at 1e-6, by this program on finer meshes and on uniform ones of 7000
    # elements a side
    if width < 1e-1:
        assert np.abs(solution.contact.u_t).max() == pytest.approx(0.0015910, rel=2e-3)


def test_data_that_no_mesh_resolves_are_refused(comm):
    solution = adapt(slab("-10*sin(1e5*x)"), 1e-2, comm=comm)
    assert solution.status == "not converged" and "resolve" in solution.reason


def test_torsion_has_the_exponents_of_laplace_s_equation():
    """A disc is turned on the top of a shaft, and no other direction is held there: r^(1/2) where it
    ends."""
    free = [
        {"part": part, "condition": "traction", "value": [0.0, 0.0]} for part in ("top", "side")
    ]
    turned = {"part": "disc", "condition": "displacement", "value": ["free", "free", "x"]}
    held = {"part": "bottom", "condition": "displacement", "value": [0.0, 0.0, 0.0]}
    ends = {"bottom": [2, 0], "side": [2, 2], "top": [1, 2], "disc": [0, 2], "axis": [0, 0]}
    data = {
        "symmetry": "axial",
        "material": {"young_modulus": 1.0, "poisson_ratio": 0.3},
        "geometry": {
            "shape": "outline",
            "loops": [[{"part": k, "to": v} for k, v in ends.items()]],
        },
        "boundary": [held, turned, *free],
    }
    problem = Problem.model_validate(data)
    found = exponents(problem)
    assert [round(a, 3) for a, _ in found] == [1.0, 0.711, 1.0, 0.5]
