"""KSPs that solve what they are asked to, whatever the options: no silent wrong combination, no
option that does nothing."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import InputError
from petcontact.linalg.ksp import LinearSolver
from petcontact.runtime.petsc import options, petsc


@pytest.fixture
def matrix(comm):
    """A dense matrix far from its diagonal."""
    values = 3.0 * np.eye(30) + np.random.default_rng(1).standard_normal((30, 30)) / 3.0
    found = petsc().Mat().createDense((30, 30), array=np.asfortranarray(values), comm=comm)
    found.assemble()
    yield found, values
    found.destroy()


def solved(matrix, table, **keywords):
    values, (operator, dense) = np.ones(30), matrix
    with options(table):
        solver = LinearSolver(operator.comm, "", "iterate", **keywords)
        assert solver.kind == ""
        solver.set_operator(operator)
        x, b = operator.createVecs()
        b.setArray(values)
        solver.solve(b, x)
        result = np.linalg.norm(dense @ x.getArray() - values), solver.kind, solver.iterations
        solver.close()
    return result


@pytest.mark.parametrize("pc", ["jacobi", "none", "bjacobi", "sor"])
def test_an_inexact_preconditioner_alone_takes_gmres(matrix, pc):
    residual, kind, iterations = solved(matrix, {"pc_type": pc})
    assert residual < 1e-9 and kind == f"KSP gmres, PC {pc}" and iterations <= 30


@pytest.mark.parametrize("pc", ["lu", "svd"])
def test_an_exact_one_is_applied_once(matrix, pc):
    residual, kind, iterations = solved(matrix, {"pc_type": pc})
    assert residual < 1e-9 and kind == f"KSP preonly, PC {pc}" and iterations == 1


def test_preonly_with_an_inexact_preconditioner_is_refused(matrix):
    with pytest.raises(
        InputError, match=r"^-ksp_type preonly: .* with -pc_type jacobi use -ksp_type gmres$"
    ):
        solved(matrix, {"ksp_type": "preonly", "pc_type": "jacobi"})


def test_options_of_gmres_reach_the_gmres_that_was_taken(matrix):
    assert (
        solved(matrix, {"pc_type": "none"})[2]
        < solved(matrix, {"pc_type": "none", "ksp_gmres_restart": 3})[2]
    )
