"""What once said "converged" and was not: tiny ρ, tiny data, full stick, tractions beyond the
friction bound."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shapes import closing, elastic, problem

from petcontact import load, solve
from petcontact.contact.friction_law import contact_norm

pytestmark = pytest.mark.usefixtures("unestimated")

EXAMPLE = Path(__file__).parents[2] / "configs" / "example1.toml"
COARSE = {"element_size": 0.4}
NEWTON = {"name": "semismooth-newton"}


def example(method, mesh=COARSE, **changes):
    """Example 1 with changes, __ for a dot."""
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return load(EXAMPLE, {"mesh": mesh, "method": method, **changes})


@pytest.fixture(scope="module")
def exact(comm):
    return solve(example(NEWTON), comm=comm).contact


@pytest.mark.parametrize(
    ("rho", "rule"),
    [(1e-300, "fixed"), (1e-300, "self-adaptive"), (1e-300, "modified"), (1e3, "modified")],
)
def test_a_tiny_rho_is_no_convergence(rho, rule, exact, comm):
    """Squares of σ_t underflow: all norms were zero, and nothing seemed to change. A rule that may
    change ρ begins anew with another one."""
    method = {"name": "projection", "rule": rule, "rho": rho, "max_iterations": 100}
    solution = solve(example(method), comm=comm)
    error = contact_norm(solution.contact.u_t - exact.u_t, exact.weight) / contact_norm(
        exact.u_t, exact.weight
    )
    assert solution.converged == (rule != "fixed")
    assert error > 1.0 if rule == "fixed" else error < 1e-4
    assert solution.last.history.change[0] > 0.0


@pytest.mark.parametrize(
    ("unit", "name"),
    [(1e-170, "projection"), (1e140, "semismooth-newton"), (1e-170, "operator-robin")],
)
def test_data_of_any_size_give_the_same_solution(unit, name, exact, comm):
    stiffness = max(unit, 1.0)  # displacements of 1e138 are refused, see the next test
    scaled = example(
        {"name": name, "rho": 1e3 * stiffness, "tolerance": 1e-8},
        material__young_modulus=1e4 * stiffness,
        boundary__0__friction_bound=150.0 * unit,
        boundary__2__value=[400.0 * unit, 0.0],
    )
    solution = solve(scaled, comm=comm)
    assert solution.converged, solution.reason
    u_t = solution.contact.u_t / unit * stiffness
    assert np.allclose(u_t, exact.u_t, rtol=0, atol=1e-6 * np.abs(exact.u_t).max())


def test_displacements_beyond_all_sizes_are_not_accepted(recwarn, comm):
    """One line, whatever overflows on the way."""
    solution = solve(example(NEWTON, material__young_modulus=1e-300), comm=comm)
    assert not solution.converged and "times its size, at most 1e+09 is accepted" in solution.reason
    assert not recwarn.list


@pytest.mark.parametrize(
    ("mesh", "name"),
    [
        (COARSE, "tao"),
        ({"element_size": 0.4, "order": 2}, "projection"),
        # cond(S) is 1e6 there: no scalar ρ gets there in reasonable time
        ({"order": 3, "levels": 8}, "semismooth-newton"),
        ({"order": 3, "levels": 8}, "operator-robin"),
    ],
)
def test_full_stick_is_a_solution(mesh, name, comm):
    """u_t is round-off there, and cannot be the measure of itself."""
    method = {"name": name, "rho": 1e4}
    solution = solve(example(method, mesh, boundary__0__friction_bound=1e4), comm=comm)
    assert solution.converged, solution.reason
    assert not solution.contact.state.any() and [zone.name for zone in solution.zones] == ["stick"]
    assert np.abs(solution.contact.u_t).max() < 1e-5 * np.abs(solution.u).max()
    assert solution.last.residuals["tangential"] < 1e-3


@pytest.mark.parametrize("shift", [1e8, 1e12])
@pytest.mark.parametrize(
    "keys",
    [
        {"name": "operator-robin"},
        {"name": "semismooth-newton"},
        {"name": "projection", "rule": "modified", "rho": 1e4},
        {"name": "semismooth-newton", "formulation": "full"},
    ],
)
def test_a_rigid_displacement_swallows_no_error(shift, keys, comm):
    """The clamped top is moved far along x, and all slides: what strains the body is the same, or
    it is refused."""

    def solved(way, **bem):
        given = {"boundary__1__value": [way, 0.0], "boundary__2__value": [0.0, 0.0], **bem}
        return solve(example(keys, **given), comm=comm)

    near, far = solved(5.0), solved(shift)
    exact = near.contact.sigma_n
    assert near.converged and near.contact.state.all()
    assert far.converged or shift > 1e8 or keys.get("name") != "semismooth-newton"
    found = [far]
    if keys == {"name": "semismooth-newton"}:
        bem = {"mat_type": "hodlr", "hodlr_tol": 1e-8, "hodlr_leaf": 8}
        found.append(solved(shift, bem=bem))
    for solution in found:
        if solution.converged:
            assert np.allclose(solution.contact.sigma_t, -150.0, rtol=1e-3)
            assert np.allclose(
                solution.contact.sigma_n, exact, rtol=0, atol=1e-3 * np.abs(exact).max()
            )


@pytest.mark.parametrize(
    "loads",
    [{"point_force": [{"at": [0.0, 0.0], "force": [0.0, -0.01]}]}, {"loads": {"temperature": 9.0}}],
)
def test_a_body_that_is_held_all_around_has_a_solution(loads):
    """Where all sticks u is round-off, and no measure of the residuals of a body."""
    rim = {"part": "rim", "center": [0.0, 0.0], "radius": 1.0}
    solution = solve(
        problem(
            material={**elastic(1.0, 0.3), "thermal_expansion": 1e-5},
            mesh={"element_size": 0.2},
            geometry={"shape": "outline", "loops": [rim]},
            boundary=[closing("rim", friction_bound=0.1)],
            **loads,
        )
    )
    assert solution.converged, solution.reason
    pair, wanted = solution.last.pairs["rim"], [0.0, 0.01 * ("point_force" in loads)]
    assert np.abs(solution.last.bodies["body"].u).max() < 1e-15
    assert pair.force == pytest.approx(wanted, abs=1e-14)
    assert 0.003 < np.abs(pair.pressure).max() < 0.004 or pair.pressure == pytest.approx(
        1.3 * 9e-5 / 0.52, rel=0.02
    )
