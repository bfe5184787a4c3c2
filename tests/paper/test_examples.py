"""Examples 1 and 2 of the paper against converged high-order finite elements.

The reference numbers are copied from a P4 finite-element solution on graded triangles (plane
strain, up to a million unknowns, agreement of its last two refinements to 1e-11 in the norms and
5e-9 in u_t).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from examples import example
from scipy.interpolate import CubicSpline

from petcontact import MeshOptions, solve

NORM_U_T = {1: 0.053203416272211854, 2: 0.6837781009339343}
INTEGRAL_SIGMA_T = {1: -741.9213651876003, 2: -364.3738052669273}
TRANSITIONS = {1: [3.377767813205719], 2: [2.4115453362464914, 8.435704696178437]}
# relative L2(Γ_C) error of u_t at h = 0.1, 0.05, 0.025 of an independent prototype of the same
# discretisation
PROTOTYPE = {1: [3.0e-3, 1.4e-3, 6.5e-4], 2: [4.9e-3, 2.5e-3, 1.2e-3]}


def reference(number):
    """u_t of the reference along Γ_C: some of its nodes, a cubic spline between them (relative
    error 1e-6)."""
    x, u = np.loadtxt(
        Path(__file__).parent / f"example{number}_u_t.csv", delimiter=",", skiprows=1
    ).T
    return CubicSpline(x, u)


def error(solution, number):
    contact = solution.contact
    exact = reference(number)(contact.x[:, 0])
    weight = contact.weight
    return float(np.sqrt(weight @ (contact.u_t[:, 0] - exact) ** 2 / (weight @ exact**2)))


@pytest.mark.parametrize("number", [1, 2])
def test_errors_zones_and_integrals_are_those_of_the_prototype(number):
    for h, expected in zip((0.1, 0.05, 0.025), PROTOTYPE[number], strict=True):
        solution = solve(example(number, mesh=MeshOptions(element_size=h)))
        assert solution.converged
        assert error(solution, number) == pytest.approx(expected, rel=0.04)
    zones, contact = solution.zones, solution.contact
    signs = {1: [1, 0], 2: [1, 0, -1]}[number]
    assert [zone.sign for zone in zones] == signs
    assert [zone.name for zone in zones] == ["slip" if sign else "stick" for sign in signs]
    for zone, expected in zip(zones, TRANSITIONS[number], strict=False):
        assert zone.end == pytest.approx(expected, abs=0.03)
    total = contact.weight @ contact.sigma_t[:, 0]
    assert total == pytest.approx(INTEGRAL_SIGMA_T[number], rel=2e-3)
    norm = np.sqrt(contact.weight @ contact.u_t[:, 0] ** 2)
    assert norm == pytest.approx(NORM_U_T[number], rel=2e-3)
