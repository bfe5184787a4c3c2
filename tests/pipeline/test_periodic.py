"""Periodic pairs of sides: Westergaard's waves wherever they begin, homogeneous strains, several
bodies."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import drawn, elastic, moved, problem, rectangle, rollers, solid, touching

from petcontact import read_result, solve
from petcontact.reference.hertz import contact_modulus
from petcontact.reference.westergaard import WavyContact

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

SIDES = {"part": "left", "condition": "periodic", "partner": "right"}


def test_westergaards_waves_wherever_the_period_begins():
    """One period of a half plane under a rigid wave whose crest is at x = 0, so that the contact
    goes over the sides; half of it touches."""
    modulus, height = contact_modulus(1.0, 0.3), 0.01
    load, sizes = 0.5 * np.pi * modulus * height, {"top": 0.0125, "left": 0.0625}
    solution = solve(
        problem(
            material=elastic(1.0, 0.3),
            geometry=rectangle([0.0, -2.0], [1.0, 0.0]),
            mesh={"element_size": 0.125, "element_sizes": sizes, "order": 3},
            boundary=[moved("bottom", [0.0, 0.0]), SIDES],
            obstacle=[{"name": "wave", "displacement": [0.0, "free"], "force": [0.0, -load]}],
            contact=[touching("c", "top", "wave", gap=f"{height}*(1-cos(2*pi*x))")],
        )
    )
    pair = solution.pairs["c"]
    wave = WavyContact(load, height, 1.0, modulus)
    exact = wave.pressure((pair.x[:, 0] + 0.5) % 1.0 - 0.5)
    assert solution.converged and not solution.warnings
    assert np.sqrt(pair.weight @ (pair.pressure - exact) ** 2) < 5e-4 * np.sqrt(
        pair.weight @ exact**2
    )
    left, right = (solution.mesh.nodes_of(part) for part in ("left", "right"))
    assert solution.u[left] == pytest.approx(solution.u[right][::-1], abs=1e-13)
    assert solution.traction[left] == pytest.approx(-solution.traction[right][::-1], abs=1e-15)


def test_a_jump_strains_evenly_and_follows_the_steps(tmp_path):
    """σ_xx = E ε in plane stress; sides that are not straight do as well."""
    vertices = [[0.0, 0.0], [2.0, 0.0], [2.3, 0.5], [2.0, 1.0], [0.0, 1.0], [0.3, 0.5]]
    parts = ["bottom", "right", "right", "top", "left", "left"]
    posed = problem(
        material={**elastic(3.0, 0.3), "plane": "stress"},
        geometry={"shape": "polygon", "vertices": vertices, "parts": parts},
        mesh={"element_size": 0.25, "element_sizes": {"right": 0.1}, "order": 2},
        boundary=[*rollers("bottom"), {**SIDES, "jump": [0.02, 0.0]}, drawn("top", [0.0, 0.0])],
        step=[
            {"name": "pull", "increments": 2},
            {"name": "back", "boundary": [{"part": "left", "value": [-0.04, 0.0]}]},
        ],
    )
    solution = solve(posed)
    assert solution.converged
    for step, strain in zip(solution.steps, (0.005, 0.01, -0.02), strict=True):
        assert solution.stress_at([[1.0, 0.5]], step=step)[0] == pytest.approx(
            [3.0 * strain, 0.0, 0.0], abs=1e-10
        )
    solution.save(tmp_path / "r.h5")
    again = read_result(tmp_path / "r.h5")
    assert again.verdict() == solution.verdict() and again.problem == posed


def test_two_layers():
    """Of different materials, bent by nothing: p is what is pressed on, everywhere."""

    def layer(name, low, modulus, other):
        shape, mesh = rectangle([0.0, low], [2.0, low + 1.0]), {"element_size": 0.5, "order": 2}
        return solid(name, shape, SIDES, other, material=elastic(modulus, 0.3), mesh=mesh)

    pressed = {"part": "top", "condition": "traction", "pressure": "0.02"}
    bodies = [
        layer("lower", -1.0, 1.0, {"part": "bottom", "condition": "symmetry"}),
        layer("upper", 0.0, 5.0, pressed),
    ]
    pair = touching("c", "upper.bottom", "lower.top", friction_coefficient=0.2)
    solution = solve(problem(body=bodies, contact=[pair]))
    assert solution.converged and set(solution.pairs) == {"lower.left", "upper.left", "c"}
    assert solution.pairs["c"].pressure == pytest.approx(0.02, abs=1e-12)
    # the lower pair moves by nothing but round-off, beside which its own tractions are no measure
    # of it
    assert solution.last.residuals["normal"] < 1e-6
