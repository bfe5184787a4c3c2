"""Solves with a dense PETSc matrix that is written anew now and then, by a KSP over any number of
ranks."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..runtime.ranks import meet
from ..untyped import Comm, Mat
from .blocked_lu import direct_type
from .dense_matrix import on_memory
from .ksp import LinearSolver, SolverFront
from .row_layout import even_ranges

ALONE = 512
"""Largest number of unknowns for which each rank factorises a matrix for itself: LU takes 9 ms at
10 GFLOP/s, half of which a second rank saves, and sends 20 messages and 2 MB for it."""


def direct_solver(comm: Comm, prefix: str) -> LinearSolver:
    """A KSP for few right-hand sides of each matrix."""
    return LinearSolver(comm, prefix, "iterate", pc_type=direct_type(comm))


class DenseSolver(SolverFront):
    """A KSP over a matrix that the ranks share by rows.

    Parameters
    ----------
    comm : PETSc.Comm
    prefix : str
        Of the KSP's options.

    Attributes
    ----------
    comm : PETSc.Comm

    Examples
    --------
    >>> from petcontact.runtime.petsc import petsc
    >>> solver = DenseSolver(petsc().COMM_SELF, "")
    >>> rows, first = solver.rows(2)
    >>> rows[:] = [[2.0, 0.0], [0.0, 4.0]]
    >>> solver.factor()
    >>> solver.solve(np.array([2.0, 2.0])).tolist()
    [1.0, 0.5]
    """

    def __init__(self, comm: Comm, prefix: str) -> None:
        self.comm, self._prefix = comm, prefix
        self._matrix: Mat = None
        self._solver = direct_solver(comm, prefix)

    def rows(self, size: int) -> tuple[Array, int]:
        """This rank's rows of a matrix, to be written by columns, and the number of the first.
        Collective."""
        if self._matrix is None or self._matrix.getSize()[0] != size:
            self.close()  # a KSP keeps the size that it was used with
            self._solver = direct_solver(self.comm, self._prefix)
            first, last = even_ranges(size, self.comm.getSize())[self.comm.getRank()]
            memory = np.zeros((size, last - first))
            self._matrix = self._solver.owned(on_memory(memory, size, self.comm))
        rows: Array = self._matrix.getDenseArray()
        return rows, int(self._matrix.getOwnershipRange()[0])

    def take(self, matrix: Array) -> None:
        """A matrix that every rank has whole. Collective."""
        rows, first = self.rows(len(matrix))
        rows[:] = matrix[first : first + len(rows)]
        self.factor()

    def factor(self, *, corrected: bool = False) -> None:
        """Assemble the rows that were written; the next solve factorises them, or if `corrected`
        corrects the factors of the matrix before."""
        meet("a new matrix", self.comm)
        self._matrix.assemble()
        self._solver.set_operator(self._matrix, corrected=corrected)

    def solve_all(self, rhs: Array) -> Array:
        """Return matrix⁻¹ of each row of an array (c, n), (c, n), which every rank has; the array
        may be overwritten. Collective."""
        begun = self._solver.begun(np.ascontiguousarray(rhs[:, self._own]))
        return np.asarray(self._solver.combined((begun, np.eye(len(rhs)))).T)

    def solve(self, rhs: Array) -> Array:
        """matrix⁻¹ rhs on every rank. Collective.

        Raises
        ------
        SolverError
            If the matrix is singular, or the solution not finite.
        """
        return np.asarray(self._solver.solved(rhs[self._own]))

    @property
    def _own(self) -> slice:
        return slice(*self._matrix.getOwnershipRange())

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
        self._matrix = None
