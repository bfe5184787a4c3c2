"""The contact system: both formulations, every KSP, against dense algebra of numpy."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import Posed, filled

from petcontact import MeshOptions, Method, SolverError
from petcontact.compliance.contact_compliance import DenseCompliance
from petcontact.runtime.petsc import options

CASE = example(2, mesh=MeshOptions(element_size=0.5, order=1))
FULL = CASE.model_copy(update={"method": Method(formulation="full")})
GMRES = {"ksp_type": "gmres", "pc_type": "jacobi", "ksp_rtol": 1e-14, "ksp_gmres_restart": 400}
BICGSTAB = {"ksp_type": "bcgs", "pc_type": "none", "ksp_rtol": 1e-13}


@pytest.mark.parametrize(
    ("case", "solver"), [(CASE, {}), (CASE, GMRES), (CASE, BICGSTAB), (FULL, {}), (FULL, GMRES)]
)
def test_robin_against_numpy(case, solver, comm):
    rng = np.random.default_rng(3)

    def near(a, b, allowed):
        return np.abs(a - b).max() <= allowed

    with options(solver):
        posed = Posed(case, comm)
        system, operators = posed.system, posed.operators
        system_matrix, contact, loads = filled(operators)
        contact, load = contact / operators.traction_scale, loads[:, 1]
        unknowns = operators.data.contact_unknowns
        f = 100.0 * rng.standard_normal((len(unknowns), 1))
        for rho in (1.0, 3e3, 1e7):
            robin = system_matrix.copy()
            robin[:, unknowns] += rho * contact
            x = np.linalg.solve(robin, load + contact @ f[:, 0])[unknowns]
            u_t, sigma_t = system.robin(rho, f)
            # u = u_0 + δu: GMRES's u_0 has an error of 4e-12, which is 3e-8 of u at the largest ρ
            # (1e-10 by LU)
            slack = 1e-9 * np.abs(x).max()
            if solver is GMRES and case is FULL:
                slack += 5e-12 * np.abs(system.u_0).max()
            assert near(u_t[:, 0], x, slack)
            assert near(sigma_t, f - rho * u_t, rho * slack + 1e-8)
            du, dsigma = system.robin_increment(rho, f)
            assert near(dsigma + rho * du, f, 1e-7 * np.abs(f).max())
            assert near(system.apply(dsigma), du, 1e-8 * np.abs(du).max())
        compliance = np.linalg.solve(system_matrix, contact)[unknowns]
        assert near(system.compliance(), compliance, 1e-10 * np.abs(compliance).max())
        assert near(system.u_0[:, 0], np.linalg.solve(system_matrix, load)[unknowns], 1e-10)
        u, traction = posed.boundary(f)
        residual = operators.residual(np.arange(operators.mesh.n_nodes), u, traction)
        assert np.abs(residual).max() < 1e-11 * max(1.0, np.abs(u).max())
        data = operators.data
        along = np.sum(traction[data.contact_nodes] * data.contact_frame[:, 0], axis=1)
        assert near(along, f[:, 0], 1e-8 * np.abs(f).max())
        posed.close()


@pytest.mark.parametrize("case", [CASE, FULL], ids=["condensed", "full"])
def test_a_ksp_that_fails_raises_with_petscs_reason(case, comm):
    given = {"ksp_type": "gmres", "pc_type": "none", "ksp_max_it": 2, "ksp_rtol": 1e-14}
    # of the full formulation the solution without tractions fails already
    with (
        options(given),
        pytest.raises(SolverError, match=r"iterate: KSP gmres ended with DIVERGED_(ITS|MAX_IT)"),
    ):
        system = Posed(case, comm).system
        system.robin(1e4, np.ones_like(system.u_0))


def test_a_rho_near_one_that_was_factorised_takes_its_lu(comm):
    n = 600
    root = np.random.default_rng(4).standard_normal((n, n))
    compliance = root @ root.T / n
    system = DenseCompliance(compliance, comm, lambda: None)
    force, kinds = np.sin(np.arange(n, dtype=float)).reshape(-1, 2), []
    for rho in ([1.0, 2.0], [1.3, 1.8], [1.3, 1.9], [90.0, 2.0]):
        factors = np.broadcast_to(rho, force.shape)
        v, sigma = system.robin(factors, force, None, np.zeros(0))
        matrix = np.eye(n) + factors.reshape(-1, 1) * compliance
        exact = np.linalg.solve(matrix, force.ravel())
        assert np.abs(sigma.ravel() - exact).max() < 1e-9 * np.abs(exact).max()
        assert np.abs(v.ravel() - compliance @ exact).max() < 1e-9 * np.abs(v).max()
        kinds.append(system.kind.split(",")[0])
    assert kinds == ["KSP preonly", "KSP gmres", "KSP gmres", "KSP preonly"]
    system.close()
