"""Elimination to u_t on Γ_C: by the LU that has these unknowns last, and by any KSP."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from examples import example
from prepared import filled, operators

from petcontact import Contact, MeshOptions, SolverError, Traction
from petcontact.compliance.body.dense import DenseBody
from petcontact.linalg.dense_elimination import Elimination
from petcontact.pipeline.eliminate import operators_of
from petcontact.pipeline.pose.discretise import discretise
from petcontact.runtime.petsc import options


def by_column(matrix):
    return np.array(matrix.T, order="C")


def test_kinds_that_share_no_entry_have_a_factorisation_each(comm):
    """As torsion of a body of revolution, which elasticity does not couple with the rest; a border
    row goes with its own kind. One entry of a kept unknown's column couples all again."""
    random, kind = np.random.default_rng(3), np.append(np.tile(np.arange(3), 4), 3)
    apart = np.array([0, 0, 1, 1])[kind]
    kept = np.array([3, 5, 8])
    system, contact = random.standard_normal((13, 13)), random.standard_normal((13, 3))
    system *= apart[:, None] == apart
    contact *= apart[:, None] == apart[kept]
    load, sizes = random.standard_normal((13, 2)), []
    for extra in (0.0, 1e-3):
        contact[0, 1] = extra
        found = Elimination(*map(by_column, (system, contact, load)), kept, comm, (kind, kind))
        sizes.append([len(block.unknowns) for block in found._blocks])
        y, shares = random.standard_normal(3), random.standard_normal(2)
        every = np.linalg.solve(system, contact @ y + load @ shares)
        np.testing.assert_allclose(found.unknowns(shares, y), every, rtol=1e-9)
        np.testing.assert_allclose(found.influence @ y + found.at_rest @ shares, every[kept])
        np.testing.assert_allclose(found.solve(load[:, 0]), np.linalg.solve(system, load[:, 0]))
    assert sizes == [[8, 5], [13]]


@pytest.mark.parametrize(
    "given", [{"elastic_pc_type": "lu"}, {"elastic_ksp_type": "gmres", "elastic_ksp_rtol": 1e-14}]
)
def test_every_ksp_finds_the_same(given, comm):
    """Options of the elimination's KSP are heard, for two load states, of a body that is held and
    of one that is free."""
    held = operators(example(2, mesh=MeshOptions(element_size=0.5)))
    value = np.concatenate(
        [held.data.value, held.data.value[1:] * np.linspace(-1.0, 2.0, held.mesh.n_nodes)[:, None]]
    )
    held = replace(held, data=replace(held.data, value=value, force=np.zeros((3, 0, 2))))
    free = loose_operators(comm)
    for ops, modes in ((held, np.zeros((*held.mesh.x.shape, 0))), free):
        bodies = [DenseBody(ops, modes, comm)]
        with options(given):
            bodies.append(DenseBody(ops, modes, comm))
        blocked, ksp = bodies
        shares = np.arange(1.0, ops.data.states + 1.0)
        traction = np.cos(ops.mesh.x[ops.data.contact_nodes])[:, : ops.data.contact_shape[1]]
        for one, other in (
            (blocked.compliance, ksp.compliance),
            (blocked.u_0, ksp.u_0),
            (blocked.unknowns(shares, traction), ksp.unknowns(shares, traction)),
        ):
            np.testing.assert_allclose(other, one, rtol=0.0, atol=1e-10 * np.abs(one).max())


def loose_operators(comm):
    """A body that nothing but contact holds, and its three motions."""
    case = example(1, mesh=MeshOptions(element_size=0.5))
    loads = [
        Traction(part=c.part, value=(0.0, -1.0)) if c.condition == "displacement" else c
        for c in case.boundary[1:]
    ]
    contact = Contact(part="bottom", normal="unilateral", friction_coefficient=0.3)
    ops, modes = operators_of(
        discretise(case.model_copy(update={"boundary": (contact, *loads)})), 0
    )
    assert modes.shape[2] == 3
    return ops, modes


@pytest.mark.parametrize(
    ("entry", "message"), [(0.0, "zero pivot in LU.*is the body fixed"), (np.nan, "not finite")]
)
def test_a_matrix_without_a_solution_is_refused(entry, message, comm):
    ops = operators(example(1, mesh=MeshOptions(element_size=1.0)))
    system, contact, loads = filled(ops)
    system[:, 3] = entry
    with pytest.raises(SolverError, match=message):
        Elimination(*map(by_column, (system, contact, loads)), ops.data.contact_unknowns, comm)
