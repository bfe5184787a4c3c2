"""The active set and the semismooth Newton method: finite on every positive definite S, exact on the examples."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from conftest import example
from hypothesis import given, settings
from hypothesis import strategies as st

import petcontact.contact.restricted
from petcontact import MeshOptions
from petcontact.contact.active_set import initial_set, pivots, revised_set, solve_box
from petcontact.contact.criterion import Criterion
from petcontact.contact.iteration import Iteration
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.pipeline.prepare import prepare


def newton(prepared, max_iterations, predict=None, **keywords):
    iteration = Iteration(Criterion(1e-10), max_iterations, **keywords)
    return SemismoothNewton(predict)(prepared.system, prepared.law, iteration)


class Dense:
    """A compliance given as a matrix."""

    def __init__(self, matrix):
        self.matrix = matrix

    def apply(self, x):
        return self.matrix @ x

    def stick_solve(self, stick, rhs):
        x = np.zeros_like(rhs)
        x[stick] = np.linalg.solve(self.matrix[np.ix_(stick, stick)], rhs[stick])
        return x


def satisfies(matrix, base, bound, sigma, u):
    """The friction condition itself, node by node."""
    assert np.allclose(u, base + matrix @ sigma, atol=1e-9)
    assert np.all(np.abs(sigma) <= bound * (1 + 1e-9))
    moving = np.abs(u) > 1e-8
    assert np.allclose(sigma[moving], -bound[moving] * np.sign(u[moving]))


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 30), st.integers(0, 10_000), st.floats(0.0, 3.0))
def test_any_positive_definite_matrix_is_solved(m, seed, skewness):
    rng = np.random.default_rng(seed)
    factor, skew = rng.standard_normal((m, m)), rng.standard_normal((m, m))
    matrix = factor @ factor.T + 0.05 * np.eye(m) + skewness * (skew - skew.T)
    base, bound = 3 * rng.standard_normal(m), np.where(rng.random(m) < 0.1, 0.0, rng.random(m))
    start = rng.integers(-1, 2, m).astype(np.int8)
    steps = list(itertools.islice(pivots(Dense(matrix), base, bound, start, np.zeros(m)), 2000))
    assert steps[-1].wrong == 0
    satisfies(matrix, base, bound, steps[-1].sigma, steps[-1].u)


def test_backup_ends_where_full_exchanges_cycle():
    """A cyclic matrix on which full exchanges repeat for ever: the single exchanges of the backup end it."""
    cycling = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        skew = rng.standard_normal((6, 6))
        matrix, base, bound = 0.3 * np.eye(6) + skew - skew.T, rng.standard_normal(6), np.full(6, 0.5)
        active, seen = np.zeros(6, dtype=np.int8), set()
        while active.tobytes() not in seen:
            seen.add(active.tobytes())
            step = next(pivots(Dense(matrix), base, bound, active, np.zeros(6)))
            if step.wrong == 0:
                break
            active = revised_set(step.active, step.sigma, np.where(active == 0, 0.0, step.u), bound, 1e-12)
        cycling += step.wrong > 0
        last = solve_box(Dense(matrix), base, bound, np.zeros(6, dtype=np.int8), np.zeros(6))
        satisfies(matrix, base, bound, last.sigma, last.u)
    assert cycling > 0


def test_sets_of_hand_made_states():
    sigma, u, bound = np.array([2.0, 0.5, -1.0, 1.0]), np.array([0.0, 0.0, 0.4, -0.3]), np.ones(4)
    assert initial_set(sigma, u, bound, 1.0).tolist() == [1, 0, -1, 1]
    revised = revised_set(np.array([0, 0, -1, 1], dtype=np.int8), sigma, -u, bound, 0.0)
    assert revised.tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("mesh, most", [(MeshOptions(element_size=0.1), 8), (MeshOptions(element_size=0.05), 8),
                                        (MeshOptions(order=3), 7),
                                        (MeshOptions(order=5, levels=16, grading=0.3), 7)])  # fmt: skip
def test_examples_from_full_stick(number, mesh, most, comm):
    prepared = prepare(example(number, mesh=mesh), comm)
    data = prepared.operators.data
    state = newton(prepared, 50, predict=False)
    satisfies(prepared.system.compliance(), prepared.system.u_0[:, 0], data.friction_bound, state.sigma[:, 0],
              state.v[:, 0])  # fmt: skip
    assert state.converged and len(state.history) <= most
    again = newton(prepared, 50, start=(state.v, state.sigma)
    )
    assert len(again.history) == 1 and np.allclose(again.v, state.v, atol=1e-12)
    predicted = newton(prepared, 50, predict=True)
    assert predicted.converged and len(predicted.history) <= 4
    assert np.allclose(predicted.v, state.v, rtol=1e-9, atol=1e-11 * np.abs(state.v).max())
    prepared.close()


@pytest.mark.parametrize("size", [0.1, 0.05, 0.025])
def test_krylov_solves_find_the_same_in_three_steps(size, comm, monkeypatch):
    prepared = prepare(example(1, mesh=MeshOptions(element_size=size)), comm)
    direct = newton(prepared, 50, predict=False)
    monkeypatch.setattr(petcontact.contact.restricted, "DIRECT_SIZE", 0)
    before = prepared.system.applications
    krylov = newton(prepared, 50, predict=True)
    assert krylov.converged and len(krylov.history) <= 4
    assert max(krylov.history.ksp_iterations) <= 16
    assert prepared.system.applications - before <= 60
    assert np.allclose(krylov.sigma, direct.sigma, atol=1e-7 * np.abs(direct.sigma).max())
    prepared.close()


def test_it_says_when_it_has_not_ended(comm):
    prepared = prepare(example(1), comm)
    states = []
    state = newton(prepared, 2, predict=False, monitor=states.append
    )
    assert not state.converged and len(state.history) == 2 and "wrong side" in state.reason
    assert [len(s.history) for s in states] == [2, 2]  # one history, shared
    prepared.close()
