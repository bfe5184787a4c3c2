"""The contact system on an H-matrix against the dense one: a body in space, bilateral Tresca
contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from prepared import Posed

from petcontact import InputError, SolverError, load
from petcontact.compliance.hierarchical.linear_problem import Balance
from petcontact.compression.hmatrix.matrix import HMatrix
from petcontact.contact.linearisation import Linearisation
from petcontact.runtime.petsc import petsc

pytestmark = pytest.mark.usefixtures("unestimated")

CONFIGS = Path(__file__).parents[2] / "configs"
COARSE = {"mesh.element_size": 1.4}


def problem(name="space_b", **keys):
    return load(CONFIGS / f"{name}.toml", {**COARSE, **keys})


TIGHT = {"bem.mat_type": "hmatrix", "bem.hmatrix_tol": 1e-5}


@pytest.fixture(scope="module")
def dense():
    posed = Posed(problem(), petsc().COMM_SELF)
    yield posed
    posed.close()


@pytest.fixture(scope="module")
def mixed():
    posed = Posed(problem(**TIGHT), petsc().COMM_SELF)
    yield posed
    posed.close()


def near(a, b, tolerance=1e-5):
    return np.abs(a - b).max() <= tolerance * np.abs(b).max()


def test_products_and_robin_solves_are_the_dense_ones_to_the_tolerance(mixed, dense):
    x = dense.operators.mesh.x[dense.operators.data.contact_nodes]
    sigma = 50.0 * np.column_stack([np.cos(x[:, 0]), x[:, 1]])
    system, exact = mixed.system, dense.system
    assert near(system.u_0, exact.u_0) and near(system.apply(sigma), exact.apply(sigma))
    assert "hmatrix 1e-05" in mixed.bodies.describe()
    for a, b in zip(mixed.boundary(sigma), dense.boundary(sigma), strict=True):
        assert near(a, b, 1e-4)
    for rho in (1.0, 1e3, 1e7):
        for a, b in zip(system.robin(rho, sigma), exact.robin(rho, sigma), strict=True):
            assert near(a, b, 1e-3)
        for a, b in zip(
            system.robin_increment(rho, sigma), exact.robin_increment(rho, sigma), strict=True
        ):
            assert near(a, b, 1e-3)


def test_a_compression_that_went_wrong_is_refused(comm, monkeypatch):
    whole = HMatrix.mult
    monkeypatch.setattr(HMatrix, "mult", lambda self, x: 1.001 * whole(self, x))
    with pytest.raises(SolverError, match=r"is off by .*, its tolerance is 1e-05"):
        Posed(problem(**TIGHT), comm)


def test_too_little_memory_is_told_before_the_build(comm, monkeypatch):
    monkeypatch.setattr("petcontact.compliance.hierarchical.rows.physical_memory", lambda: 1e6)
    with pytest.raises(InputError, match=r"compressed operator of \d+ nodes takes about"):
        Posed(problem(**TIGHT), comm)


def test_forces_out_of_balance_are_solved_for_however_small_the_residual_is(mixed, monkeypatch):
    tau = np.zeros(mixed.system.u_0.shape)
    law = Linearisation.from_law(mixed.law, tau), np.ones(tau.shape), 1e-6, None
    for _ in range(2):
        mixed.system.linear_solve(*law)
    assert mixed.system.ksp_iterations == 0
    monkeypatch.setattr(Balance, "share", lambda *_: 0.5)
    for _ in range(3):
        mixed.system.linear_solve(*law)
        assert mixed.system.ksp_iterations > 0
