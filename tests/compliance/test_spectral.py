"""The eigenbasis of S that cases share, against solves with I + ρS."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import example
from petcontact.compliance.compressed import CompressedSystem
from petcontact.compliance.condensed import CondensedSystem
from petcontact.pipeline.prepare import discretise, prepare

from petcontact import MeshOptions
from petcontact.compliance.spectral import SpectralSystem
from petcontact.model.solver_options import Bem
from petcontact.pipeline.run import run
from petcontact.runtime.petsc import options

MESHES = [MeshOptions(element_size=0.1), MeshOptions(element_size=0.4, order=3),
          MeshOptions(order=2, grading=0.4, levels=5)]  # fmt: skip


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("mesh", MESHES, ids=["uniform", "order 3", "graded"])
def test_robin_solves_are_those_of_the_system(number, mesh, comm):
    operators = discretise(example(number, mesh=mesh))
    rng = np.random.default_rng(3)
    for make in (lambda: CondensedSystem(operators, comm), lambda: CompressedSystem(operators, comm, Bem(hodlr_leaf=16))):
        system, shared = make(), SpectralSystem(make(), operators, comm)
        exact = system.compliance()
        for rho in (1e-6, 1.0, 1e3, 1e7, 1e12):
            r = rng.standard_normal((len(exact), 1))
            u_t, sigma_t = shared.robin_increment(rho, r)
            # both equations, whatever the condition of S: u = S σ and σ + ρ u = r
            assert np.abs(u_t - exact @ sigma_t).max() < 1e-9 * np.abs(exact).sum(axis=1).max() * np.abs(sigma_t).max()
            assert np.abs(sigma_t + rho * u_t - r).max() < 1e-9 * np.abs(r).max()
        rho = 1e4
        with options({"ksp_rtol": 1e-12}):
            pairs = list(zip(system.robin(rho, r), shared.robin(rho, r), strict=True))
        for a, b in pairs:
            assert np.abs(a - b).max() < 1e-8 * np.abs(a).max()
        for a, b in zip(system.boundary(sigma_t), shared.boundary(sigma_t), strict=True):
            assert np.allclose(a, b, rtol=0, atol=1e-8 * np.abs(a).max())
        system.close()
        shared.close()


@pytest.mark.parametrize("rule", ["self-adaptive", "modified"])
def test_a_case_among_many_takes_the_same_iterations(rule):
    case = example(1, mesh=MeshOptions(element_size=0.1), rule=rule, rho=10.0)
    solutions = []
    for cases in (1, 8):
        prepared = prepare(case, cases=cases)
        solutions.append(run(prepared, case))
        prepared.close()
    alone, together = solutions
    assert "KSP preonly" in alone.info["solver"] and "eigenbasis" in together.info["solver"]
    assert alone.converged and alone.iterations == together.iterations
    assert np.abs(alone.contact.u_t - together.contact.u_t).max() < 1e-10 * np.abs(alone.contact.u_t).max()
    assert together.elastic_residual < 1e-12


@pytest.mark.parametrize(
    ("given", "ksp"), [({"ksp_type": "gmres"}, True), ({"ksp_monitor": ""}, True), ({"pc_type": "lu"}, False)]
)
def test_whoever_names_a_ksp_gets_it(given, ksp):
    case = example(2, mesh=MeshOptions(element_size=0.4))
    with options(given):
        prepared = prepare(case, cases=8)
    assert ("eigenbasis" in prepared.system.describe()) == (not ksp)
    prepared.close()


def test_an_eigenbasis_that_cannot_be_used_is_not(monkeypatch):
    """Complex eigenvalues stand for whatever a mesh may do to S."""
    case = example(1, mesh=MeshOptions(element_size=0.4))
    monkeypatch.setattr(np.linalg, "eig", lambda matrix: (np.full(len(matrix), 1.0 + 1e-3j), np.eye(len(matrix))))
    prepared = prepare(case, cases=8)
    prepared.system.robin(1.0, prepared.system.u_0)
    assert "KSP preonly" in prepared.system.describe()
    assert run(prepared, case).converged
    prepared.close()
