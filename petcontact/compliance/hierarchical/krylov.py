"""PETSc's flexible GMRES for the equations of bodies, with one KSP for each number of unknowns."""

from __future__ import annotations

from ...arrays import Array
from ...linalg.ksp import LinearSolver, SolverFront
from ...linalg.matrix_free import RESTART
from ...runtime.petsc import petsc
from ...untyped import Comm


class FlexibleKrylov(SolverFront):
    """Flexible GMRES with a matrix and a preconditioner of type python.

    Parameters
    ----------
    comm : PETSc communicator
    context : object
        Object whose methods `mult` and `apply` PETSc calls.

    Attributes
    ----------
    iterations : int
        Number of iterations since it was last set.
    """

    iterations = 0

    def __init__(self, comm: Comm, context: object) -> None:
        self._comm, self._context = comm, context
        self._solvers: dict[int, LinearSolver] = {}

    def __call__(self, residual: Array, size: int, target: float) -> Array:
        """Return the parts of all ranks, one after another, of a solution whose residual is at most
        `target`.

        `residual` is this rank's part of the right-hand side, `size` the number of all unknowns.
        """
        if size not in self._solvers:
            comm, context, layout = self._comm, self._context, (len(residual), size)
            matrix = petsc().Mat().createPython((layout, layout), context=context, comm=comm)
            matrix.setUp()
            solver = LinearSolver(
                comm, "", "iterate", ksp_type="fgmres", pc_type="python", context=context
            )
            solver.ksp.setGMRESRestart(RESTART)
            solver.set_operator(solver.owned(matrix))
            self._solvers[size] = solver
        self._solver = self._solvers[size]
        self._solver.ksp.setTolerances(rtol=1e-14, atol=target)
        solution: Array = self._solver.solved(residual)
        self.iterations += self._solver.iterations
        return solution

    def close(self) -> None:
        """Free the PETSc objects."""
        for solver in self._solvers.values():
            solver.close()
        self._solvers = {}
