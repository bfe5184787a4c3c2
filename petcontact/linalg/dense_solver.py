"""Solves with a dense matrix that is written anew now and then: by LAPACK, or by a KSP over any
number of ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from ..arrays import Array
from ..errors import SolverError
from ..runtime.petsc import petsc
from ..runtime.world import of_petsc
from .ksp import LinearSolver, SolverFront, is_asked_for
from .row_layout import even_ranges


class LapackSolver:
    """LU of a matrix that this process has whole.

    Attributes
    ----------
    iterations, reason : int
        0: nothing iterates.
    kind : str
        Empty, as of every direct solve by LAPACK.
    """

    iterations, reason, kind = 0, 0, ""

    def __init__(self) -> None:
        self._lu: Any = None
        self._matrix = np.zeros((0, 0))

    def rows(self, size: int) -> tuple[Array, int]:
        """This rank's rows of a matrix, to be written, and the number of the first."""
        if len(self._matrix) != size:
            self._matrix = np.empty((size, size))
        return self._matrix, 0

    def factor(self) -> None:
        """Factorise what was written.

        Raises
        ------
        SolverError
            If the matrix is singular.
        """
        lu, pivots, info = scipy.linalg.lapack.dgetrf(
            self._matrix.T, overwrite_a=True
        )  # of the transposed: no copy
        if info > 0:
            raise SolverError(
                "iterate",
                f"zero pivot in LU (row {info})",
                "the matrix is singular: is the body fixed?",
            )
        self._lu = lu, pivots

    def solve(self, rhs: Array) -> Array:
        """matrix⁻¹ rhs.

        Raises
        ------
        SolverError
            If the solution is not finite.
        """
        solution = np.asarray(scipy.linalg.lapack.dgetrs(*self._lu, rhs, trans=1)[0])
        if not np.isfinite(solution).all():
            raise SolverError(
                "iterate", "the solution is not finite", "look at the data and the mesh"
            )
        return solution

    def close(self) -> None:
        """Free the factors."""
        self._lu, self._matrix = None, np.zeros((0, 0))


class KspSolver(SolverFront):
    """The KSP without a prefix over a PETSc matrix by rows, with the members of `LapackSolver`."""

    def __init__(self, comm: Any) -> None:
        self._comm = of_petsc(comm)
        self._matrix: Any = None
        self._vectors: Any = None
        self._solver = LinearSolver(self._comm, "", "iterate")

    def rows(self, size: int) -> tuple[Array, int]:
        """This rank's rows of a matrix, to be written, and the number of the first. Collective."""
        if self._matrix is None or self._matrix.getSize()[0] != size:
            # a KSP keeps the size that it was used with
            self.close()
            self._solver = LinearSolver(self._comm, "", "iterate")
            first, last = even_ranges(size, self._comm.getSize())[self._comm.getRank()]
            layout = (last - first, size)
            self._matrix = petsc().Mat().createDense((layout, layout), comm=self._comm)
            self._matrix.setUp()
            self._vectors = self._matrix.createVecs()
        return self._matrix.getDenseArray(), int(self._matrix.getOwnershipRange()[0])

    def factor(self) -> None:
        """Take what was written."""
        self._matrix.assemble()
        self._solver.set_operator(self._matrix)

    def solve(self, rhs: Array) -> Array:
        """matrix⁻¹ rhs on every rank. Collective."""
        solution, right = self._vectors
        first, last = right.getOwnershipRange()
        right.setArray(rhs[first:last])
        self._solver.solve(right, solution)
        own = np.array(solution.getArray(readonly=True))
        return (
            own
            if self._comm.getSize() == 1
            else np.concatenate(self._comm.tompi4py().allgather(own))
        )

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
        if self._matrix is not None:
            for item in (self._matrix, *self._vectors):
                item.destroy()
            self._matrix = None


def dense_solver(comm: Any) -> LapackSolver | KspSolver:
    """LAPACK, or the KSP where ranks share the rows or options speak of it."""
    return KspSolver(comm) if comm.getSize() > 1 or is_asked_for("") else LapackSolver()
