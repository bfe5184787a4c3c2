"""KSPs that solve what they are asked to, whatever the options: no silent wrong combination, no
option that does nothing."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import InputError
from petcontact.linalg.dense_solver import DenseSolver
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


def test_a_preconditioner_that_options_keep_is_not_made_anew(comm):
    """With -ksp_reuse_preconditioner the LU of the first matrix serves the next one."""
    iterations = []
    with options({"ksp_type": "gmres", "ksp_reuse_preconditioner": True}):
        solver = DenseSolver(comm, "")
        for factor in (1.0, 1.5):
            matrix = np.eye(30) + factor * np.diag(np.arange(30.0))
            solver.take(matrix)
            assert np.allclose(matrix @ solver.solve(np.ones(30)), 1.0)
            iterations.append(solver.iterations)
        solver.close()
    assert iterations[0] == 1 < iterations[1]
