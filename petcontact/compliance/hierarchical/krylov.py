"""PETSc's flexible GMRES for the equations of bodies, with one KSP for each number of unknowns."""

from __future__ import annotations

from typing import Any

from ...arrays import Array
from ...linalg.ksp import LinearSolver
from ...linalg.matrix_free import RESTART
from ...runtime.petsc import petsc


class FlexibleKrylov:
    """Flexible GMRES with a matrix and a preconditioner of type python.

    Parameters
    ----------
    comm : PETSc communicator
    context : object
        Object whose methods `mult` and `apply` PETSc calls.

    Attributes
    ----------
    iterations, reason : int
        Number of iterations since it was last set, and PETSc's reason why the last solve stopped.
    """

    def __init__(self, comm: Any, context: Any) -> None:
        self._comm, self._context = comm, context
        self.iterations, self.reason = 0, 0
        self._solvers: dict[int, LinearSolver] = {}
        self._last: LinearSolver | None = None

    def __call__(self, residual: Array, size: int, target: float) -> Array:
        """Return this rank's part of a solution whose residual is at most `target`.

        `residual` is this rank's part of the right-hand side, `size` the number of all unknowns.
        """
        module, comm, layout = petsc(), self._comm, (len(residual), size)
        rhs = module.Vec().createMPI(layout, comm=comm)
        rhs.setArray(residual)
        solution = rhs.duplicate()
        solution.set(0.0)
        solver = self._solvers.get(size)
        if solver is None:
            matrix = module.Mat().createPython((layout, layout), context=self._context, comm=comm)
            matrix.setUp()
            solver = LinearSolver(
                comm, "", "iterate", ksp_type="fgmres", pc_type="python", context=self._context
            )
            solver.ksp.setGMRESRestart(RESTART)
            solver.set_operator(matrix)
            matrix.destroy()
            self._solvers[size] = solver
        self._last = solver
        solver.ksp.setTolerances(rtol=1e-14, atol=target)
        solver.solve(rhs, solution)
        self.iterations, self.reason = self.iterations + solver.iterations, solver.reason
        own: Array = solution.getArray(readonly=True).copy()
        rhs.destroy()
        solution.destroy()
        return own

    @property
    def kind(self) -> str:
        """Types of the KSP and its PC; empty before the first solve."""
        return "" if self._last is None else self._last.kind

    def close(self) -> None:
        """Free the PETSc objects."""
        for solver in self._solvers.values():
            solver.close()
        self._solvers = {}
