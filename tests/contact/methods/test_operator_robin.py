"""The operator-valued Robin condition: its rate knows no mesh, and it is Douglas-Rachford
splitting."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import Posed

import petcontact.contact.active_set.solvers
from petcontact import MeshOptions
from petcontact.contact.criterion import Criterion
from petcontact.contact.friction_law import contact_norm
from petcontact.contact.iteration import Iteration
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.methods.operator_robin import OperatorRobin

MESHES = {
    "h=0.05": MeshOptions(element_size=0.05),
    "order 2": MeshOptions(element_size=0.4, order=2),
    "graded finely": MeshOptions(order=4, levels=16, grading=0.3),
}


def newton(prepared, max_iterations):
    return SemismoothNewton()(
        prepared.system, prepared.law, Iteration(Criterion(1e-10), max_iterations)
    )


def solve(prepared, tolerance, omega=1.8, max_iterations=100, **options):
    return OperatorRobin(omega)(
        prepared.system, prepared.law, Iteration(Criterion(tolerance), max_iterations, **options)
    )


def error(prepared, state, exact):
    pairs = ((state.v, exact.v), (state.sigma, exact.sigma))
    return max(
        contact_norm(a - b, prepared.weight) / contact_norm(b, prepared.weight) for a, b in pairs
    )


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_iterations_do_not_depend_on_the_mesh(number, mesh, comm):
    prepared = Posed(example(number, mesh=mesh), comm)
    exact = newton(prepared, 50)
    state = solve(prepared, 1e-6)
    assert state.converged and 7 <= len(state.history) <= 10
    assert error(prepared, state, exact) < 1e-6
    tight = solve(prepared, 1e-10)
    assert tight.converged and 12 <= len(tight.history) <= 17
    assert error(prepared, tight, exact) < 1e-10
    prepared.close()


def test_krylov_and_direct_steps_agree(comm, monkeypatch):
    prepared = Posed(example(1), comm)
    direct = solve(prepared, 1e-8)
    monkeypatch.setattr(petcontact.contact.active_set.solvers, "DIRECT_SIZE", 0)
    krylov = solve(prepared, 1e-8)
    few = solve(prepared, 1e-8, max_iterations=3)
    assert not few.converged and "max_iterations = 3" in few.reason
    assert len(krylov.history) == len(direct.history)
    assert np.allclose(krylov.v, direct.v, atol=1e-10 * np.abs(direct.v).max())
    assert max(krylov.history.ksp_iterations) <= 12
    prepared.close()
