"""Algorithm 1 on Example 1: its solution does not depend on how it is reached, and a run ends as it
says."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import Posed

from petcontact import InputError, MeshOptions, solve, write_solution
from petcontact.contact.criterion import Criterion
from petcontact.contact.friction_law import contact_norm
from petcontact.contact.iteration import Iteration
from petcontact.contact.law_protocol import law_residual
from petcontact.contact.laws import Tresca
from petcontact.contact.methods.projection import Projection
from petcontact.contact.rho_rules import Modified

COARSE = MeshOptions(element_size=0.4)


@pytest.fixture(scope="module")
def posed(comm):
    posed = Posed(example(1, mesh=COARSE), comm)
    yield posed
    posed.close()


def run_project(posed, rho, **keywords):
    iteration = Iteration(Criterion(1e-6), 2000, **keywords)
    return Projection(Modified(), rho, 1.8)(posed.system, posed.law, iteration)


def test_each_step_satisfies_the_robin_condition_4_11(posed):
    """From zero, and from an iterate of another ρ."""
    first, again = [], []
    run_project(posed, rho=100.0, monitor=first.append)
    start = first[5].v, first[5].sigma
    run_project(posed, rho=1e4, monitor=again.append, start=start)
    zero = np.zeros_like(first[0].v)
    for states, (u, sigma) in ((first, (zero, zero)), (again, start)):
        for state in states:
            rho = state.rho
            expected = sigma + rho * u - 1.8 * law_residual(Tresca(posed.bound), u, sigma, rho)
            scale = np.abs(state.sigma).max()
            assert np.allclose(state.sigma + rho * state.v, expected, rtol=0, atol=1e-10 * scale)
            moved = posed.system.u_0 + posed.system.apply(state.sigma)
            assert np.allclose(state.v, moved, rtol=0, atol=1e-12)
            u, sigma = state.v, state.sigma


def test_history_says_what_happened(posed):
    states = []
    state = run_project(posed, rho=3.0, monitor=states.append)
    history = state.history
    assert state.converged and len(history) == len(states)
    weight = posed.weight
    du, ds = states[7].v - states[6].v, states[7].sigma - states[6].sigma
    assert history.rho[0] == 3.0
    assert history.w[7] == pytest.approx(
        contact_norm(ds, weight) / contact_norm(du, weight), rel=1e-9
    )
    residual = law_residual(Tresca(posed.bound), states[6].v, states[6].sigma, history.rho[7])
    assert history.residual[7] == pytest.approx(contact_norm(residual, weight), rel=1e-9)
    change = (contact_norm(du, weight) + contact_norm(ds, weight)) / (
        contact_norm(states[7].v, weight) + contact_norm(states[7].sigma, weight)
    )
    assert history.change[7] == pytest.approx(change, rel=1e-9)
    assert history.change[-1] <= 1e-6 < history.change[-2]


def test_frictionless_start_and_start_from_a_result_file(tmp_path):
    first = solve(example(1, mesh=COARSE))
    frictionless = solve(example(1, mesh=COARSE, start="frictionless"))
    assert frictionless.converged
    write_solution(tmp_path / "first.h5", first)
    again = solve(example(1, mesh=COARSE, start=str(tmp_path / "first.h5")))
    finer = solve(example(1, mesh=MeshOptions(element_size=0.2), start=str(tmp_path / "first.h5")))
    assert again.converged and again.iterations < first.iterations / 2
    assert finer.converged
    for start, said in (
        ("nowhere.h5", "method.start: nowhere.h5: no such file"),
        (__file__, f"method.start: {__file__}: not a whole HDF5 file"),
        ("nowhere", "neither"),
        (f"{tmp_path}/first.h5:1", r"a problem without \[\[step\]\] starts from all of a file"),
    ):
        with pytest.raises(InputError, match=said):
            solve(example(1, mesh=COARSE, start=start))


def test_a_small_change_alone_is_no_convergence():
    """At a ρ far off the iterates hardly move: the friction residual has a say, too."""
    criterion = Criterion(1e-6)
    assert criterion.met(1e-7, 1e-4) and not criterion.met(1e-7, 1e-2)
    assert not criterion.met(1e-5, 0.0)
    residual = Criterion(1e-6, "residual")
    assert residual.met(1.0, 1e-7) and not residual.met(0.0, 1e-5)
    state = solve(
        example(1, mesh=MeshOptions(element_size=0.4), rule="fixed", rho=1e-9, max_iterations=50)
    )
    assert not state.converged and state.last.history.change[-1] < 1e-6
