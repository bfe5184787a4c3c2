"""The contact system on an H-matrix against the dense one: a body in space, bilateral Tresca
contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from marks import slow
from prepared import Posed

from petcontact import InputError, SolverError, load, solve
from petcontact.compliance.body.dense import DenseBody
from petcontact.compliance.hierarchical.body import HierarchicalBody
from petcontact.compliance.hierarchical.posed import Balance
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


@pytest.mark.parametrize(
    ("name", "method"),
    [
        slow("space_a", {}),
        slow("space_bracket", {}),
        slow("space_b", {"method.rule": "self-adaptive"}),
        slow("space_a", {"method.name": "operator-robin"}),
        slow("space_b", {"method.rule": "modified"}),
    ],
    ids=["A", "bracket", "B 4.2", "A by T", "B 4.3"],
)
def test_solves_are_those_of_dense_operators(name, method, comm):
    mesh, found = {"mesh": {"order": 1}} if name == "space_bracket" else COARSE, {}
    for kind in ("dense", "hmatrix"):
        given = {**method, "bem.mat_type": kind, "bem.hmatrix_tol": 1e-5}
        case = load(CONFIGS / f"{name}.toml", {**mesh, **given})
        found[kind] = solve(case, comm=comm)
        assert found[kind].converged
    one, other = found["hmatrix"].contact, found["dense"].contact
    assert near(one.sigma_t, other.sigma_t, 2e-4) and near(one.u_t, other.u_t, 1e-4)
    assert abs(found["hmatrix"].iterations - found["dense"].iterations) <= 8
    assert found["hmatrix"].elastic_residual < 1e-5


def test_a_compression_that_went_wrong_is_refused(comm, monkeypatch):
    whole = HMatrix.mult
    monkeypatch.setattr(HMatrix, "mult", lambda self, x: 1.001 * whole(self, x))
    with pytest.raises(SolverError, match=r"is off by .*, its tolerance is 1e-05"):
        Posed(problem(**TIGHT), comm)


def test_too_little_memory_is_told_before_the_build(comm, monkeypatch):
    monkeypatch.setattr("petcontact.compliance.hierarchical.rows.physical_memory", lambda: 1e6)
    with pytest.raises(InputError, match=r"compressed operator of \d+ nodes takes about"):
        Posed(problem(**TIGHT), comm)


@pytest.mark.slow
def test_auto_compresses_what_is_cheaper_compressed(comm):
    small, large = (
        Posed(load(CONFIGS / "space_a.toml", {"mesh.element_size": h}), comm) for h in (1.4, 0.9)
    )
    assert isinstance(small.body, DenseBody) and isinstance(large.body, HierarchicalBody)
    for made in (small, large):
        made.close()
    with pytest.raises(InputError, match="compresses surfaces in space"):
        Posed(load(CONFIGS / "example1.toml", {"bem.mat_type": "hmatrix"}), comm)


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
