"""Elimination to u_t on Γ_C: LAPACK's, with these unknowns last, is what a KSP makes of all unknowns."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import example
from petcontact.compliance.condensed import ByKSP, ByLapack, CondensedSystem
from petcontact.pipeline.prepare import discretise

from petcontact import MeshOptions, SolverError
from petcontact.bem.dense_assembly import assemble_dense
from petcontact.compliance.contact_vectors import ContactVectors
from petcontact.linalg.elimination import Elimination
from petcontact.runtime.petsc import options, petsc


@pytest.mark.parametrize("mesh", [MeshOptions(element_size=0.5), MeshOptions(element_size=0.8, order=2)])
@pytest.mark.parametrize("place", ["first", "last", "anywhere"])
def test_both_ways_agree_wherever_the_unknowns_stand(mesh, place):
    comm = petsc().COMM_SELF
    operators = discretise(example(2, mesh=mesh))
    contact = ContactVectors(operators, comm)
    n, m = operators.n_unknowns, contact.size
    kept = {"first": np.arange(m), "last": np.arange(n - m, n), "anywhere": operators.data.contact_unknowns}[place]
    by_ksp, blocks = ByKSP(assemble_dense(operators, comm), contact), assemble_dense(operators, comm)
    by_lapack = Elimination(blocks.system.getDenseArray(), blocks.contact.getDenseArray(), blocks.load.getArray(), kept)
    sigma = np.random.default_rng(1).standard_normal(contact.shape)
    every = by_ksp.unknowns(sigma)
    close = {"rtol": 0.0, "atol": 1e-12 * np.abs(every).max()}
    np.testing.assert_allclose(by_lapack.unknowns(sigma.ravel()), every, **close)
    np.testing.assert_allclose(by_lapack.at_rest + by_lapack.influence @ sigma.ravel(), every[kept], **close)
    by_ksp.close()


def test_options_of_the_ksp_are_heard():
    comm = petsc().COMM_SELF
    operators = discretise(example(1, mesh=MeshOptions(element_size=1.0)))
    for given, kind in (({}, ByLapack), ({"elastic_pc_type": "lu"}, ByKSP)):
        with options(given):
            system = CondensedSystem(operators, comm)
        assert type(system._elimination) is kind
        system.close()


@pytest.mark.parametrize(("entry", "message"), [(0.0, "zero pivot in LU.*is the body fixed"), (np.nan, "not finite")])
def test_a_matrix_without_a_solution_is_refused(entry, message):
    comm = petsc().COMM_SELF
    operators = discretise(example(1, mesh=MeshOptions(element_size=1.0)))
    blocks = assemble_dense(operators, comm)
    blocks.system.getDenseArray()[:, 3] = entry
    with pytest.raises(SolverError, match=message):
        ByLapack(blocks, ContactVectors(operators, comm))
