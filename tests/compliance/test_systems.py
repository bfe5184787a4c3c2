"""The contact system: both formulations, every KSP, against dense algebra of numpy."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import example
from petcontact.compliance.condensed import CondensedSystem
from petcontact.compliance.full import FullSystem
from petcontact.pipeline.prepare import discretise

from petcontact import MeshOptions, SolverError
from petcontact.runtime.petsc import options


@pytest.fixture(scope="module")
def operators():
    return discretise(example(2, mesh=MeshOptions(element_size=0.5, order=1)))


def dense(ops):
    nodes = np.arange(ops.mesh.n_nodes)
    outer = ops.outer_entries(nodes, nodes)[:, ops.right_hand_sides.first[ops.data.contact_nodes]]
    return ops.system_entries(nodes, nodes), outer / ops.traction_scale, ops.load(nodes)


GMRES = {"ksp_type": "gmres", "pc_type": "jacobi", "ksp_rtol": 1e-14, "ksp_gmres_restart": 400}
BICGSTAB = {"ksp_type": "bcgs", "pc_type": "none", "ksp_rtol": 1e-13}


@pytest.mark.parametrize(
    ("kind", "solver"),
    [(CondensedSystem, {}), (CondensedSystem, GMRES), (CondensedSystem, BICGSTAB), (FullSystem, {}), (FullSystem, GMRES)],
)
def test_robin_against_numpy(kind, solver, operators, comm):
    system_matrix, contact, load = dense(operators)
    unknowns = operators.data.contact_unknowns
    rng = np.random.default_rng(3)
    f = 100.0 * rng.standard_normal((len(unknowns), 1))
    with options(solver):
        system = kind(operators, comm)
        for rho in (1.0, 3e3, 1e7):
            robin = system_matrix.copy()
            robin[:, unknowns] += rho * contact
            x = np.linalg.solve(robin, load + contact @ f[:, 0])
            u_t, sigma_t = system.robin(rho, f)
            scale = np.abs(x[unknowns]).max()
            assert np.allclose(u_t[:, 0], x[unknowns], rtol=0, atol=1e-9 * scale)
            assert np.allclose(sigma_t, f - rho * u_t, rtol=0, atol=1e-9 * rho * scale + 1e-8)
            du, dsigma = system.robin_increment(rho, f)
            assert np.allclose(dsigma + rho * du, f, rtol=1e-8, atol=1e-7 * np.abs(f).max())
            assert np.allclose(system.u_0 + system.apply(dsigma), system.u_0 + du, rtol=0, atol=1e-8 * np.abs(du).max())
        compliance = np.linalg.solve(system_matrix, contact)[unknowns]
        assert np.allclose(system.compliance(), compliance, rtol=0, atol=1e-10 * np.abs(compliance).max())
        assert np.allclose(system.u_0[:, 0], np.linalg.solve(system_matrix, load)[unknowns], atol=1e-10)
        u, traction = system.boundary(f)
        nodes = np.arange(operators.mesh.n_nodes)
        assert np.abs(operators.residual(nodes, u, traction)).max() < 1e-11 * max(1.0, np.abs(u).max())
        data = operators.data
        assert np.allclose(np.einsum("ij,ij->i", traction[data.contact_nodes], data.tangent[:, 0]), f[:, 0])
        system.close()


def test_compliance_has_positive_real_eigenvalues(comm):
    system = CondensedSystem(discretise(example(1)), comm)
    values = np.linalg.eigvals(system.compliance())
    assert np.abs(values.imag).max() < 1e-3 * values.real.max()
    assert values.real.min() > 0.0
    system.close()


@pytest.mark.parametrize("kind", [CondensedSystem, FullSystem])
def test_a_ksp_that_fails_raises_with_petscs_reason(kind, operators, comm):
    with options({"ksp_type": "gmres", "pc_type": "none", "ksp_max_it": 2, "ksp_rtol": 1e-14}):
        system = kind(operators, comm)
        with pytest.raises(SolverError, match=r"iterate: KSP gmres ended with DIVERGED_(ITS|MAX_IT)"):
            system.robin(1e4, np.ones((len(operators.data.contact_nodes), 1)))
        system.close()


def test_lu_is_factored_again_only_when_rho_changes(operators, comm):
    from petcontact.runtime.petsc import petsc

    module = petsc()
    module.Log.begin()
    system = CondensedSystem(operators, comm)
    event = module.Log.Event("MatLUFactor")
    f = np.ones((len(operators.data.contact_nodes), 1))

    def factorisations(rho):
        before = event.getPerfInfo()["count"]
        system.robin(rho, f)
        return event.getPerfInfo()["count"] - before

    assert [factorisations(rho) for rho in (10.0, 10.0, 20.0, 20.0, 10.0)] == [1, 0, 1, 0, 1]
    system.close()
