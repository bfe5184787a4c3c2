"""Corners and kinks that are known before anything is solved, and adaptive solves that need them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_lines import line_of

from petcontact import Contact, Displacement, Material, Polygon, Problem, Traction, adapt, load
from petcontact.refinement.contact_line import displacement
from petcontact.refinement.singular_points import RIGHT_ANGLE, corner_powers, kinks

CONFIGS = Path(__file__).parents[2] / "configs"


def l_shaped(friction_bound: float | str) -> Problem:
    """A reentrant corner between two free sides, at (4, 2)."""
    free = [Traction(part=name, value=(0.0, 0.0)) for name in ("right", "shelf", "inner")]
    return Problem(
        material=Material(young_modulus=10_000.0, poisson_ratio=0.3),
        geometry=Polygon(vertices=((0, 0), (8, 0), (8, 2), (4, 2), (4, 4), (0, 4)),
                         parts=("bottom", "right", "shelf", "inner", "top", "left")),
        boundary=(Contact(part="bottom", friction_bound=friction_bound), Displacement(part="top", value=(0.0, 0.0)),
                  Traction(part="left", value=(300.0, 0.0)), *free),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("bound", "expected"),
    [("60 + 30*abs(x - 3)", [3.0]), ("60 + 5*abs(sin(2*x))", np.pi / 2 * np.arange(1, 6)),
     ("60 + 30*(x > 2.345678)", [2.345678]), ("60 + 10*x", []),
     ("60 + 30*sin(3*x)", []), ("60 + sqrt(x)", []), ("exp(-x)", []), (80.0, [])],
)  # fmt: skip
def test_kinks_and_jumps_of_the_data_are_located(bound, expected):
    problem = l_shaped(bound)
    found = kinks(problem, problem.geometry.outline())
    assert np.allclose(found[0], expected, rtol=0, atol=1e-7) and len(found[0]) == len(expected)
    assert all(len(places) == 0 for places in found[1:])


def test_kinks_of_tractions_are_found_on_arcs_by_arc_length():
    case = load(CONFIGS / "gallery_disc.toml")
    rim = Traction(part="rim", pressure="abs(s - 5)")
    boundary = tuple(rim if condition.part == "rim" else condition for condition in case.boundary)
    outline = case.geometry.outline()
    found = kinks(case.model_copy(update={"boundary": boundary}), outline)
    first = next(k for k, side in enumerate(outline.sides) if side.part == "rim")
    assert np.allclose(found[first], [5.0], atol=1e-7)
    assert sum(map(len, found)) == 1


def test_corners_are_as_strong_as_their_angles():
    problem = l_shaped(80.0)
    powers = corner_powers(problem, problem.geometry.outline())
    # all right angles but the reentrant one between shelf and inner
    assert powers[2] == (RIGHT_ANGLE, 1.0) and powers[3] == (1.0, RIGHT_ANGLE)
    assert all(pair == (RIGHT_ANGLE, RIGHT_ANGLE) for k, pair in enumerate(powers) if k not in (2, 3))
    # held and free sides in one line: r^(1/2); held and free around a reentrant corner: r^(1/3) or more
    flat = Polygon(vertices=((0, 0), (4, 0), (8, 0), (8, 4), (0, 4)), parts=("a", "b", "right", "top", "left"))
    boundary = (Contact(part="a", friction_bound=1.0), *(Traction(part=p, value=(0.0, 0.0)) for p in ("b", "right", "left")),
                Displacement(part="top", value=(0.0, 0.0)))  # fmt: skip
    problem = problem.model_copy(update={"geometry": flat, "boundary": boundary})
    assert corner_powers(problem, flat.outline())[0] == pytest.approx((RIGHT_ANGLE, 1.0))
    held = tuple(Displacement(part="shelf", value=(0.0, 0.0)) if c.part == "shelf" else c for c in l_shaped(80.0).boundary)
    problem = l_shaped(80.0).model_copy(update={"boundary": held})
    assert corner_powers(problem, problem.geometry.outline())[2][1] == pytest.approx(1.5)


@pytest.mark.parametrize("bound", [80.0, "60 + 30*abs(x - 3)"])
def test_estimates_are_honest_with_a_reentrant_corner_and_a_kink(bound, comm):
    problem = l_shaped(bound)
    best = adapt(problem, 1e-7, comm=comm)
    assert best.converged
    for accuracy in (1e-3, 1e-5):
        solution = adapt(problem, accuracy, comm=comm)
        contact, exact = solution.contact, displacement(line_of(best), solution.contact.arc_length)
        error = contact.u_t[:, 0] - exact
        true = np.sqrt(contact.weight @ error**2 / (contact.weight @ exact**2))
        assert true <= accuracy and 1 / 3 < solution.info["estimated_error"] / true < 3


@pytest.mark.parametrize("name", ["toe", "disc", "dovetail", "plate", "bracket"])
def test_the_gallery_can_be_solved_adaptively(name, comm):
    """Frictionless parts, arcs, holes, several contact sides."""
    solution = adapt(load(CONFIGS / f"gallery_{name}.toml"), 1e-4, comm=comm)
    assert solution.converged and solution.info["estimated_error"] <= 1e-4
    assert solution.elastic_residual < 1e-10
