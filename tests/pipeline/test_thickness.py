"""Plane bodies with a thickness: forces are whole ones, stresses and motions those per length."""

from __future__ import annotations

import numpy as np
import pytest
from problems import posed

from petcontact import (
    Contact,
    Displacement,
    Material,
    Problem,
    Rectangle,
    Symmetry,
    Traction,
    read_result,
    solve,
)
from petcontact.errors import InputError

FORCE, THICK = 0.5, 10.0


def blocks(first: float | None, second: float | None, modulus: float = 2000.0, scale: float = 1.0):
    """A block with a point force and a tool at its side, on a larger block."""
    thick = [f", thickness = {t}" if t else "" for t in (first, second)]
    return posed(f"""
[[body]]
name = "upper"
material = {{ young_modulus = 1000.0, poisson_ratio = 0.3{thick[0]} }}
geometry = {{ shape = "rectangle", lower_left = [-1, 0], upper_right = [1, 1] }}
mesh = {{ element_size = 0.25, order = 2 }}
boundary = [{{ part = "top", condition = "traction", value = [0.2, -1.0] }}]
point_force = [{{ at = [0.1, 0.5], force = [0.0, {-FORCE * scale}] }}]
[[body]]
name = "lower"
material = {{ young_modulus = {modulus}, poisson_ratio = 0.3{thick[1]} }}
geometry = {{ shape = "rectangle", lower_left = [-2, -2], upper_right = [2, 0] }}
mesh = {{ element_size = 0.5, order = 2 }}
boundary = [{{ part = "bottom", condition = "displacement", value = [0, 0] }}]
[[obstacle]]
name = "side"
displacement = ["free", 0.0]
force = [{-0.1 * scale}, 0.0]
[[contact]]
name = "seat"
secondary = "upper.bottom"
primary = "lower.top"
friction_coefficient = 0.5
[[contact]]
name = "pushed"
secondary = "upper.right"
primary = "side"
""")


def told(solution):
    """Force, its opposite, moment and area of the seat."""
    seat = solution.pairs["seat"]
    return np.array([*seat.force, *seat.force_primary, seat.moment, seat.area])


def test_forces_of_a_thickness_are_whole_ones(tmp_path):
    flat, thick = solve(blocks(None, None)), solve(blocks(THICK, THICK, scale=THICK))
    assert flat.converged and thick.converged
    assert not any("equilibrium" in warning for warning in thick.warnings)
    for name, pair in flat.pairs.items():
        assert np.allclose(thick.pairs[name].pressure, pair.pressure, atol=1e-8)
    assert np.allclose(told(thick), THICK * told(flat), rtol=1e-7)
    assert np.allclose(
        thick.last.obstacles["side"].displacement, flat.last.obstacles["side"].displacement
    )
    inside = [s.stress_at([[0.3, 0.4]]) for s in (flat, thick)]
    assert np.allclose(*inside, rtol=1e-7)
    assert "forces per length" in flat.verdict() and "whole forces" in thick.verdict()
    thick.save(tmp_path / "r.h5")
    again = read_result(tmp_path / "r.h5")
    assert again.verdict() == thick.verdict() and again.meshes["upper"].thickness == THICK


def test_bodies_of_two_thicknesses_carry_the_same_force():
    """A body twice as thick is as stiff as one of twice the modulus."""
    thick = solve(blocks(THICK, 2.0 * THICK, scale=THICK))
    stiff = solve(blocks(THICK, THICK, modulus=4000.0, scale=THICK))
    assert np.allclose(told(thick), told(stiff), rtol=1e-6)
    both = [s.bodies["lower"] for s in (thick, stiff)]
    assert np.allclose(both[0].u, both[1].u, atol=1e-9)
    assert np.allclose(2.0 * both[0].traction, both[1].traction, atol=1e-6)


def test_thickness_of_some_bodies_only_is_refused():
    with pytest.raises(InputError, match=r"body\[1\].material.thickness: give it to all bodies"):
        blocks(THICK, None)


def test_a_body_of_revolution_has_no_thickness():
    text = """
symmetry = "axial"
material = { young_modulus = 1.0, poisson_ratio = 0.3, thickness = 1.0 }
geometry = { shape = "rectangle", lower_left = [0, 0], upper_right = [1, 1] }
boundary = [{ part = "top", condition = "displacement", value = [0, 0] },
            { part = "bottom", condition = "traction", value = [0, 0] },
            { part = "right", condition = "traction", value = [0, 0] }]
""".replace(",\n            ", ", ")
    with pytest.raises(InputError, match=r"material.thickness: a body of revolution has none"):
        posed(text)


def test_a_body_is_as_thick_as_asked_whatever_was_solved_before():
    """Adaptive meshes join sides of the outline, which two problems share."""
    forces = [
        solve(
            Problem(
                material=Material(1000.0, 0.3, thickness=thickness),
                geometry=Rectangle((0.0, 0.0), (2.0, 1.0)),
                boundary=[
                    Contact("bottom", normal="unilateral"),
                    Displacement("top", ("free", -0.01)),
                    Symmetry("left"),
                    Traction("right", (0.0, 0.0)),
                ],
            )
        )
        .last.pairs["bottom"]
        .force[1]
        for thickness in (None, THICK)
    ]
    assert forces[1] == pytest.approx(THICK * forces[0], rel=1e-9)
