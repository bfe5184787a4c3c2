"""The Hessenberg form of S that cases share, against solves with I + ρS."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from marks import slow
from prepared import Posed

from petcontact import MeshOptions
from petcontact.compliance.contact_compliance import DenseCompliance
from petcontact.compliance.hessenberg import HessenbergCompliance
from petcontact.contact.system import Modes
from petcontact.model.solver_options import Bem
from petcontact.runtime.petsc import options

MESHES = [
    MeshOptions(element_size=0.1),
    MeshOptions(element_size=0.4, order=3),
    MeshOptions(order=2, grading=0.4, levels=5),
]


@pytest.mark.parametrize(
    ("number", "mesh"),
    [slow(1, MESHES[0], id="uniform"), slow(2, MESHES[1], id="order 3"), (1, MESHES[2])],
)
def test_robin_solves_are_those_of_the_system(number, mesh, comm):
    rng = np.random.default_rng(3)
    for bem in (Bem(mat_type="dense"), Bem(mat_type="hodlr", hodlr_leaf=16)):
        case = example(number, mesh=mesh).model_copy(update={"bem": bem})
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


def test_motions_and_several_rho_take_lus(comm):
    """What the form does not solve is solved with S itself."""
    rng, m, k = np.random.default_rng(4), 9, 2
    root = rng.standard_normal((m * k, m * k))
    matrix = root @ root.T / (m * k) + np.eye(m * k)
    shared = HessenbergCompliance(DenseCompliance(matrix, comm, lambda: None), comm)
    dense = DenseCompliance(matrix, comm, lambda: None)
    modes = Modes(rng.standard_normal((m, k, 1)), rng.standard_normal((1, m, k)), np.ones(1))
    r, none = rng.standard_normal((m, k)), np.zeros(0)
    for rho, motions, work in (
        (np.full((m, k), 3.0), None, none),
        (rng.uniform(1.0, 9.0, (m, k)), None, none),
        (np.full((m, k), 3.0), modes, np.array([0.7])),
    ):
        for ours, theirs in zip(
            shared.robin(rho, r, motions, work), dense.robin(rho, r, motions, work), strict=True
        ):
            assert np.abs(ours - theirs).max() < 1e-11 * np.abs(theirs).max()
    shared.close()
    dense.close()


@pytest.mark.parametrize(
    "given", [{}, {"ksp_type": "gmres"}, {"ksp_monitor": ""}, {"pc_type": "lu"}]
)
def test_whoever_names_a_ksp_gets_it(given):
    case = example(2, mesh=MeshOptions(element_size=0.4))
    with options(given):
        posed = Posed(case, cases=8)
    assert ("Hessenberg" in posed.bodies.describe()) == (not given)
    posed.close()
