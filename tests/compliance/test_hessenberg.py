"""The Hessenberg form of S that cases share, against solves with I + ρS."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import Posed

from petcontact import MeshOptions
from petcontact.compliance.hessenberg import HessenbergCompliance
from petcontact.model.solver_options import Bem
from petcontact.runtime.petsc import options

GRADED = MeshOptions(order=2, grading=0.4, levels=5)


def test_robin_solves_are_those_of_the_system(comm):
    rng = np.random.default_rng(3)
    for bem in (Bem(mat_type="dense"), Bem(mat_type="hodlr", hodlr_leaf=16)):
        case = example(1, mesh=GRADED).model_copy(update={"bem": bem})
        alone, together = Posed(case, comm), Posed(case, comm, cases=8)
        system, shared = alone.system, together.system
        assert isinstance(together.bodies.operator, HessenbergCompliance)
        exact = system.compliance()
        for rho in (1e-6, 1.0, 1e3, 1e7, 1e12):
            r = rng.standard_normal((len(exact), 1))
            u_t, sigma_t = shared.robin_increment(rho, r)
            # both equations, whatever the condition of S: u = S σ and σ + ρ u = r
            assert (
                np.abs(u_t - exact @ sigma_t).max()
                < 1e-9 * np.abs(exact).sum(axis=1).max() * np.abs(sigma_t).max()
            )
            assert np.abs(sigma_t + rho * u_t - r).max() < 1e-9 * np.abs(r).max()
        rho = 1e4
        with options({"ksp_rtol": 1e-12}):
            pairs = list(zip(system.robin(rho, r), shared.robin(rho, r), strict=True))
        for a, b in pairs:
            assert np.abs(a - b).max() < 1e-8 * np.abs(a).max()
        for a, b in zip(alone.boundary(sigma_t), together.boundary(sigma_t), strict=True):
            assert np.allclose(a, b, rtol=0, atol=1e-8 * np.abs(a).max())
        alone.close()
        together.close()


@pytest.mark.parametrize(
    "given", [{}, {"ksp_type": "gmres"}, {"ksp_monitor": ""}, {"pc_type": "lu"}]
)
def test_whoever_names_a_ksp_gets_it(given):
    case = example(2, mesh=MeshOptions(element_size=0.4))
    with options(given):
        posed = Posed(case, cases=8)
    assert ("Hessenberg" in posed.bodies.describe()) == (not given)
    posed.close()
