"""Algorithm 1 on Example 1: its solution does not depend on how it is reached, and a run ends as it says."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import example

from petcontact import MeshOptions, Method, SolverError, solve
from petcontact.compliance.condensed import CondensedSystem
from petcontact.contact.friction_law import contact_norm, projection_residual
from petcontact.contact.methods.projection import Criterion, project
from petcontact.contact.rho_rules import Fixed, Modified, make_rule
from petcontact.pipeline.run import discretise, prepare, run

COARSE = MeshOptions(element_size=0.4)


@pytest.fixture(scope="module")
def system(comm):
    system = CondensedSystem(discretise(example(1, mesh=COARSE)), comm)
    yield system
    system.close()


def run_project(system, rule=None, rho=1e4, tolerance=1e-6, **keywords):
    arguments = {"omega": 1.8, "criterion": Criterion(tolerance), "max_iterations": 2000} | keywords
    return project(system, rule or Modified(), rho=rho, **arguments)


def test_each_step_satisfies_the_robin_condition_4_11(system):
    states = []
    run_project(system, rho=100.0, monitor=states.append)
    bound = system.operators.data.friction_bound
    u, sigma = np.zeros_like(states[0].u_t), np.zeros_like(states[0].u_t)
    for state in states:
        rho = state.rho
        expected = sigma + rho * u - 1.8 * projection_residual(u, sigma, bound, rho)
        scale = np.abs(state.sigma_t).max()
        assert np.allclose(state.sigma_t + rho * state.u_t, expected, rtol=0, atol=1e-10 * scale)
        assert np.allclose(state.u_t, system.u_0 + system.apply(state.sigma_t), rtol=0, atol=1e-12)
        u, sigma = state.u_t, state.sigma_t


def test_history_says_what_happened(system):
    states = []
    state = run_project(system, rho=3.0, monitor=states.append)
    history = state.history
    assert state.converged and len(history) == len(states)
    weight = system.operators.mesh.weight[system.operators.data.contact_nodes]
    du, ds = states[7].u_t - states[6].u_t, states[7].sigma_t - states[6].sigma_t
    assert history.rho[0] == 3.0
    assert history.w[7] == pytest.approx(contact_norm(ds, weight) / contact_norm(du, weight), rel=1e-9)
    residual = projection_residual(states[6].u_t, states[6].sigma_t, system.operators.data.friction_bound, history.rho[7])
    assert history.residual[7] == pytest.approx(contact_norm(residual, weight), rel=1e-9)
    change = (contact_norm(du, weight) + contact_norm(ds, weight)) / (
        contact_norm(states[7].u_t, weight) + contact_norm(states[7].sigma_t, weight)
    )
    assert history.change[7] == pytest.approx(change, rel=1e-9)
    assert history.change[-1] <= 1e-6 < history.change[-2]


def test_rules_and_parameters_reach_one_solution(system):
    exact = run_project(system, tolerance=1e-11)
    for rho in (1.0, 1e7):
        for name in ("self-adaptive", "modified", "modified-safeguarded"):
            state = run_project(system, make_rule(Method(rule=name)), rho, 1e-11)
            assert np.abs(state.u_t - exact.u_t).max() < 1e-8 * np.abs(exact.u_t).max()
            assert np.abs(state.sigma_t - exact.sigma_t).max() < 1e-8 * np.abs(exact.sigma_t).max()


def test_start_and_rule_of_the_users_own(system):
    exact = run_project(system, tolerance=1e-10)
    again = run_project(system, start=(exact.u_t, exact.sigma_t))
    assert again.converged and len(again.history) <= 2

    class HalfWay:
        def update(self, rho, balance):
            return (rho * balance) ** 0.5

    state = run_project(system, HalfWay(), 1.0)
    assert state.converged and np.abs(state.u_t - exact.u_t).max() < 1e-4 * np.abs(exact.u_t).max()


def test_a_rule_that_gives_nonsense_is_an_error(system):
    class Broken:
        def update(self, rho, balance):
            return -rho

    with pytest.raises(SolverError, match="the rule gave"):
        run_project(system, Broken())


def test_small_change_with_a_wrong_rho_is_not_convergence(system):
    """A tiny fixed ρ makes steps of any smallness far from the solution."""
    state = run_project(system, Fixed(), 1e-3, 1e-4, max_iterations=50)
    assert not state.converged and "max_iterations" in state.reason


@pytest.mark.parametrize("stop", ["both", "displacement", "residual"])
def test_criteria(system, stop):
    state = project(system, Modified(), rho=1.0, omega=1.8, criterion=Criterion(1e-5, stop), max_iterations=500)
    exact = run_project(system, tolerance=1e-11)
    assert state.converged
    assert np.abs(state.u_t - exact.u_t).max() < 1e-3 * np.abs(exact.u_t).max()


def test_max_iterations_keeps_the_last_iterate():
    solution = solve(example(1, mesh=COARSE, max_iterations=5))
    assert solution.status == "not converged" and solution.iterations == 5
    assert np.abs(solution.contact.u_t).max() > 0.0
    assert "max_iterations = 5" in solution.reason


def test_frictionless_start_and_start_from_a_result_file(tmp_path):
    from petcontact import write_solution

    case = example(1, mesh=COARSE)
    first = solve(case)
    frictionless = solve(example(1, mesh=COARSE, start="frictionless"))
    assert frictionless.converged
    write_solution(tmp_path / "first.h5", first)
    prepared = prepare(case)
    again = run(prepared, example(1, mesh=COARSE, start=str(tmp_path / "first.h5")))
    finer = solve(example(1, mesh=MeshOptions(element_size=0.2), start=str(tmp_path / "first.h5")))
    prepared.close()
    assert again.converged and again.iterations < first.iterations / 2
    assert finer.converged


def test_frictionless_contact_is_solved():
    case = example(1, mesh=COARSE)
    boundary = (case.boundary[0].model_copy(update={"friction_bound": 0.0}), *case.boundary[1:])
    solution = solve(case.model_copy(update={"boundary": boundary}))
    assert solution.converged
    assert np.abs(solution.contact.sigma_t).max() < 1e-2


def test_no_load_is_solved_at_once():
    case = example(1, mesh=COARSE)
    boundary = [c if c.part != "left" else c.model_copy(update={"value": (0.0, 0.0)}) for c in case.boundary]
    solution = solve(case.model_copy(update={"boundary": tuple(boundary)}))
    assert solution.converged and np.abs(solution.u).max() == 0.0


def test_a_small_change_alone_is_no_convergence():
    """At a ρ far off the iterates hardly move: the friction residual has a say, too."""
    criterion = Criterion(1e-6)
    assert criterion.met(1e-7, 1e-4) and not criterion.met(1e-7, 1e-2) and not criterion.met(1e-5, 0.0)
    residual = Criterion(1e-6, "residual")
    assert residual.met(1.0, 1e-7) and not residual.met(0.0, 1e-5)
    state = solve(example(1, mesh=MeshOptions(element_size=0.4), rule="fixed", rho=1e-9, max_iterations=50))
    assert not state.converged and state.history.change[-1] < 1e-6
