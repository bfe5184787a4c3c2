"""The active set and the semismooth Newton method: any positive definite S, and the examples."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from examples import example
from hypothesis import given, settings
from hypothesis import strategies as st
from prepared import Posed
from reduced_system import ReducedSystem

import petcontact.contact.active_set.solvers
from petcontact import MeshOptions
from petcontact.contact.active_set.pivots import pivots
from petcontact.contact.active_set.solvers import DenseActiveSetSolver
from petcontact.contact.criterion import Criterion
from petcontact.contact.iteration import Iteration
from petcontact.contact.laws import Tresca
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.system import Modes
from petcontact.errors import SolverError


def newton(prepared, max_iterations, predict=None, **keywords):
    iteration = Iteration(Criterion(1e-10), max_iterations, **keywords)
    return SemismoothNewton(predict)(prepared.system, prepared.law, iteration)


def satisfies(matrix, base, bound, sigma, u):
    """The friction condition itself, node by node."""
    assert np.allclose(u, base + matrix @ sigma, atol=1e-9)
    assert np.all(np.abs(sigma) <= bound * (1 + 1e-9))
    moving = np.abs(u) > 1e-8
    assert np.allclose(sigma[moving], -bound[moving] * np.sign(u[moving]))


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 30), st.integers(0, 10_000), st.floats(0.0, 3.0))
def test_any_positive_definite_matrix_is_solved(m, seed, skewness):
    rng = np.random.default_rng(seed)
    factor, skew = rng.standard_normal((m, m)), rng.standard_normal((m, m))
    matrix = factor @ factor.T + 0.05 * np.eye(m) + skewness * (skew - skew.T)
    base, bound = 3 * rng.standard_normal(m), np.where(rng.random(m) < 0.1, 0.0, rng.random(m))
    start = 2.0 * rng.integers(-1, 2, (m, 1))
    solver = DenseActiveSetSolver(ReducedSystem(base[:, None], matrix, np.ones(m)), None)
    # steps that are asked for beyond the solution end, too
    (last,) = deque(pivots(solver, Tresca(bound), base[:, None], None, start), maxlen=1)
    assert last.wrong == 0
    satisfies(matrix, base, bound, last.sigma[:, 0], last.v[:, 0])


@settings(max_examples=5, deadline=None)
@given(st.integers(2, 40), st.integers(0, 10_000), st.integers(-95, 95))
def test_a_body_that_all_slips_both_ways_is_held_where_its_slip_turns(m, seed, percent):
    """Stiff blocks drawn apart by far more than friction holds: the one whose σ is not ±g carries
    what the others leave."""
    rng = np.random.default_rng(seed)
    base, bound = 10.0 * rng.permutation(m)[:, None], rng.uniform(0.5, 1.5, m)
    load = 0.01 * percent * bound.sum()
    every, matrix = np.ones((m, 1, 1)), 1e-3 * np.eye(m)
    modes = Modes(every, every.reshape(1, m, 1), np.array([load]))
    system = ReducedSystem(base, matrix, np.ones(m), modes)
    state = SemismoothNewton(predict=False)(system, Tresca(bound), Iteration(Criterion(1e-10), 30))
    assert state.converged and len(state.history) <= 8, state.reason
    satisfies(matrix, base[:, 0] + state.alpha, bound, state.sigma[:, 0], state.v[:, 0])
    assert np.isclose(state.sigma.sum(), -load, atol=1e-9)


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize(
    "mesh, most",
    [
        (MeshOptions(element_size=0.05), 8),
        (MeshOptions(order=5, levels=16, grading=0.3), 7),
    ],
)
def test_examples_from_full_stick(number, mesh, most, comm):
    prepared = Posed(example(number, mesh=mesh), comm)
    state = newton(prepared, 50, predict=False)
    satisfies(
        prepared.system.compliance(),
        prepared.system.u_0[:, 0],
        prepared.bound,
        state.sigma[:, 0],
        state.v[:, 0],
    )
    assert state.converged and len(state.history) <= most
    again = newton(prepared, 50, start=(state.v, state.sigma))
    assert len(again.history) == 1 and np.allclose(again.v, state.v, atol=1e-12)
    predicted = newton(prepared, 50, predict=True)
    assert predicted.converged and len(predicted.history) <= 4
    assert np.allclose(predicted.v, state.v, rtol=1e-9, atol=1e-11 * np.abs(state.v).max())
    prepared.close()


def test_where_krylov_solves_break_down_a_dense_s_takes_their_place(comm, monkeypatch):
    solvers = petcontact.contact.active_set.solvers
    prepared = Posed(example(1, mesh=MeshOptions(element_size=0.2)), comm)
    direct = newton(prepared, 50, predict=False)

    def breakdown(self, *arguments):
        raise SolverError("iterate", "DIVERGED_BREAKDOWN", "")

    monkeypatch.setattr(solvers, "DIRECT_SIZE", 0)
    monkeypatch.setattr(solvers.BorderedKrylov, "solve", breakdown)
    state = newton(prepared, 50, predict=True)
    assert state.converged and state.direct and not direct.direct
    assert np.allclose(state.sigma, direct.sigma, atol=1e-9 * np.abs(direct.sigma).max())
    monkeypatch.setattr(solvers, "LARGEST", 10)
    with pytest.raises(SolverError, match="BREAKDOWN"):
        newton(prepared, 50, predict=True)
    prepared.close()
