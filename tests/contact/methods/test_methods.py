"""One problem, one solution: every method on dense, compressed and graded problems; the iterations of
the operator-valued Robin condition know no mesh."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import Posed

import petcontact.contact.active_set.solvers
from petcontact import (
    Bem,
    MeshOptions,
    Method,
)
from petcontact.contact.criterion import Criterion
from petcontact.contact.friction_law import contact_norm
from petcontact.contact.iteration import Iteration
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.methods.operator_robin import OperatorRobin

NAMES = ("projection", "operator-robin", "semismooth-newton", "tao")


COARSE, GRADED = MeshOptions(element_size=0.2), MeshOptions(order=3, levels=8)


@pytest.mark.parametrize(("number", "mesh"), [(2, COARSE), (1, GRADED)], ids=["coarse", "graded"])
def test_all_methods_find_one_solution(number, mesh, comm):
    prepared = Posed(example(number, mesh=mesh), comm)
    states = {}
    for name in NAMES:
        if name == "projection" and mesh is GRADED:
            continue  # cond(S) is 1e6 there: no scalar ρ gets there in reasonable time
        tolerance = 1e-11 if name == "projection" else 1e-10
        method = Method(name=name, rho=100.0, tolerance=tolerance, max_iterations=5000)
        states[name] = prepared.iterate(method)
        assert states[name].converged, (name, states[name].reason)
        assert len(states[name].history) >= 1
    exact, weight = states["semismooth-newton"], prepared.weight
    for name, state in states.items():
        for found, wanted in ((state.v, exact.v), (state.sigma, exact.sigma)):
            off = contact_norm(found - wanted, weight)
            assert off <= 1e-8 * contact_norm(wanted, weight), name
    prepared.close()


def test_compressed_systems_serve_every_method(comm):
    case = example(2, mesh=COARSE)
    dense = Posed(case, comm)
    compressed = Posed(case.model_copy(update={"bem": Bem(mat_type="hodlr", hodlr_leaf=32)}), comm)
    exact = dense.iterate(Method())
    assert compressed.system.matrix_free
    for name in NAMES:
        method = Method(name=name, rho=1e4, tolerance=1e-9)
        states = [p.iterate(method) for p in (dense, compressed)]
        assert states[1].converged, (name, states[1].reason)
        # with S compressed Newton's sets are predicted, with a small dense one they are not
        if name != "semismooth-newton":
            assert len(states[0].history) == len(states[1].history)
        assert np.allclose(states[1].v, exact.v, rtol=0, atol=1e-7 * np.abs(exact.v).max()), name
    before = compressed.system.applications
    few = compressed.iterate(Method())
    assert len(few.history) <= 5 and compressed.system.applications - before <= 80
    dense.close()
    compressed.close()


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
