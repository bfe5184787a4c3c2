"""Volume loads that jump along curves: stress in closed form on both sides of the jump."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import drawn, elastic, outline, problem, rectangle, rollers

from petcontact import solve

POISSON = 0.3
HOT = elastic(1000.0, POISSON) | {"thermal_expansion": 1e-3}
EALPHA = 1.0 / (1.0 - POISSON)


def heat_within(r):
    """The integral of T r from 0 to r, for T = 100 r² up to r = 1 and 20 r² beyond."""
    return np.where(r < 1.0, 25.0 * r**4, 25.0 + 5.0 * (r**4 - 1.0))


def temperature(r):
    return np.where(r < 1.0, 100.0 * r**2, 20.0 * r**2)


@pytest.mark.usefixtures("unsampled")
@pytest.mark.parametrize("text", [True, False], ids=["expression", "function"])
def test_a_disc_with_a_hot_core(text):
    """In plane strain, with a temperature that varies on both sides of its jump."""
    given = "where(x**2 + y**2 < 1, 100*(x**2 + y**2), 20*(x**2 + y**2))"
    side = 2.0
    quarter = problem(
        material=HOT,
        geometry=outline(b=(side, 0.0), rim=(0.0, side, side), c=(0.0, 0.0)),
        loads={"temperature": given if text else lambda x, y: temperature(np.hypot(x, y))},
        boundary=[*rollers("b", "c"), drawn("rim", [0.0, 0.0])],
    )
    solution = solve(quarter)
    r = np.array([0.3, 0.8, 0.98, 0.999, 1.001, 1.02, 1.5])
    x = r[:, None] * np.array([np.cos(0.7), np.sin(0.7)])
    xx, yy, xy = solution.stress_at(x).T
    radial = xx * np.cos(0.7) ** 2 + yy * np.sin(0.7) ** 2 + xy * np.sin(1.4)
    mean = heat_within(side) / side**2
    exact = EALPHA * (mean - heat_within(r) / r**2)
    hoop = EALPHA * (mean + heat_within(r) / r**2 - temperature(r))
    assert np.allclose(radial, exact, atol=0.1)
    assert np.allclose(xx + yy - radial, hoop, atol=0.1)
    assert not any("polynomial" in text for text in solution.warnings)


def test_a_shaft_with_a_hot_core_between_planes():
    """It is 100 warmer up to r = 1 of 2: the hoop stress jumps from -53.6 to 89.3."""
    shaft = problem(
        symmetry="axial",
        material=HOT,
        geometry=rectangle([0.0, 0.0], [2.0, 1.0]),
        loads={"temperature": "where(x < 1, 100, 0)"},
        boundary=[*rollers("bottom", "top"), drawn("right", [0.0, 0.0])],
    )
    solution = solve(shaft)
    found = {number.name: number for number in solution.numbers}
    hoop = EALPHA * 50.0 * (0.25 + 1.0)
    radial, along = -EALPHA * 50.0 * 0.75, POISSON * EALPHA * 50.0 * 0.5
    inside = [radial, radial, 2.0 * POISSON * radial - 100.0]
    for name, exact in (
        ("first principal stress on the surface", hoop),
        ("von Mises stress on the surface", max(mises(radial, hoop, along), mises(*inside))),
        ("force on bottom", np.array([100.0 * np.pi])),
    ):
        off = np.abs(found[name].value - exact).max()
        assert off <= found[name].error < 0.01 * np.abs(exact).max(), name


def mises(*principal):
    return np.sqrt(0.5 * np.sum((np.array(principal) - np.roll(principal, 1)) ** 2))


@pytest.mark.usefixtures("unsampled")
def test_a_force_that_jumps_pulls_a_bar():
    """Over half of the length: σ falls linearly there, and is 0 beyond."""
    bar = problem(
        material=elastic(1000.0, 0.0),
        geometry=rectangle([0.0, 0.0], [2.0, 1.0]),
        loads={"force": ["where(x < 0.9, 3, 0)", 0.0]},
        boundary=[*rollers("left", "bottom"), drawn("right", [0, 0]), drawn("top", [0, 0])],
    )
    solution = solve(bar)
    x = np.array([0.2, 0.6, 0.89, 0.91, 1.5])
    stress = solution.stress_at(np.column_stack([x, np.full(5, 0.4)]))
    assert np.allclose(stress[:, 0], 3.0 * np.maximum(0.9 - x, 0.0), atol=2e-3)
    assert np.allclose(solution.reactions()["left"], [-2.7, 0.0], atol=1e-3)
