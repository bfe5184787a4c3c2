"""Factors of the block of a dense S on an active set, and solves with near blocks by them."""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array, Index
from ...errors import SingularMatrixError
from ...linalg.dense_solver import ALONE, DenseSolver
from ...round_off import CHAINED
from ...runtime.petsc import petsc
from ...untyped import Comm

EPSILON, REPEATED = 1e-6, 4
"""`EPSILON` regularises a least-squares solution, relative to the longest column [-]. `REPEATED` is
the number of its corrections."""


class BlockFactors:
    """The KSP of a block of a dense S, which solves near blocks, too.

    From step to step few components become active or inactive, and few columns change. Unknowns
    whose columns are equal in both blocks are kept. The others of the factorised block are 0, and a
    force on each of their equations is unknown instead. A Schur complement of the size of the
    change gives these forces and the new unknowns (W. W. Hager, Updating the inverse of a matrix,
    SIAM Rev. 31 (1989) 221-239).

    Parameters
    ----------
    comm : PETSc.Comm, optional
        Ranks that share the factors of large blocks, which each of them has whole; by default each
        factorises for itself.
    """

    def __init__(self, comm: Comm = None) -> None:
        self._comm = comm
        # solver, S, number of unknowns, components and marks of the factorised block
        self._of: tuple[DenseSolver, Array, int, Index, Array] | None = None

    @property
    def iterations(self) -> int:
        """Iterations of the KSP in the last solve."""
        return 0 if self._of is None else self._of[0].iterations

    def solve(self, dense: Array, active: Index, marks: Array, matrix: Array, rhs: Array) -> Array:
        """Return matrix⁻¹ rhs (n,), or the least-squares solution.

        Parameters
        ----------
        dense : array
            S; factors of another one are of no use.
        active : (q,) array
            Numbers of the components of the first unknowns and equations, increasing.
        marks : (q, l) array
            Numbers that are equal where columns on the same components are.
        matrix : (n, n) array
            The block and, beyond it, its border, which is new in each solve.
        rhs : (n,) array
        """
        if not len(rhs):
            return rhs
        if self._of is not None and self._of[1] is dense:
            answer = _near(
                self._of[0], self._of[2], *_shared(active, marks, *self._of[3:]), matrix, rhs
            )
            if answer is not None:
                return answer
        shared = self._comm is not None and len(rhs) > ALONE
        comm = self._comm if shared else petsc().COMM_SELF
        if self._of is not None and self._of[0].comm == comm:
            solver = self._of[0]
        else:
            self.close()
            solver = DenseSolver(comm, "stick_")
        self._of = None
        solver.take(matrix)
        try:
            answer = solver.solve(rhs)
        except SingularMatrixError:
            solver.close()
            return _least(matrix, rhs)
        self._of = solver, dense, len(rhs), active, marks
        return answer

    def close(self) -> None:
        """Free the KSP."""
        if self._of is not None:
            self._of[0].close()
            self._of = None


def _shared(active: Index, marks: Array, before: Index, before_marks: Array) -> tuple[Index, Index]:
    """Return the places in two blocks of the components whose columns are equal in both."""
    _, own, old = np.intersect1d(active, before, assume_unique=True, return_indices=True)
    same = (marks[own] == before_marks[old]).all(axis=1)
    return own[same], old[same]


def _near(
    solver: DenseSolver, size: int, kept: Index, before: Index, matrix: Array, rhs: Array
) -> Array | None:
    """Return matrix⁻¹ rhs by the factors of a near block, or None if the matrix differs too much.

    Parameters
    ----------
    solver : DenseSolver
        Of the near block.
    size : int
        Its number of unknowns.
    kept, before : (c,) arrays
        Places of the unknowns that both share, in the matrix and in the near block.
    matrix : (n, n) array
    rhs : (n,) array
    """
    new, gone = np.delete(np.arange(len(rhs)), kept), np.delete(np.arange(size), before)
    # LU of n unknowns costs as much as n/3 solves
    if 6 * (len(new) + len(gone)) > len(rhs):
        return None
    right, first = np.column_stack([rhs, matrix[:, new]]), 1 + len(new)
    columns = np.zeros((first + len(gone), size))
    columns[:first, before] = right[kept].T
    columns[np.arange(first, len(columns)), gone] = 1.0
    columns = solver.solve_all(columns)
    solved = columns[:, before]
    system = np.vstack([columns[:, gone].T, matrix[np.ix_(new, kept)] @ solved.T])
    system[len(gone) :, :first] -= right[new]
    try:
        y = np.linalg.solve(system[:, 1:], system[:, 0])
    except np.linalg.LinAlgError:
        return None
    answer = np.empty(len(rhs))
    answer[kept], answer[new] = solved[0] - y @ solved[1:], y[: len(new)]
    left = np.abs(matrix @ answer - rhs).max()
    return answer if left <= CHAINED * np.abs(rhs).max() else None


def _least(matrix: Array, rhs: Array) -> Array:
    """Return the least-squares solution of a singular system.

    The system is singular if a body is about to slide away, or if two contacts close at the same
    nodes. (AᵀA + ε²) δx = Aᵀr is solved repeatedly, in a fifth of the time of singular values.
    """
    normal = matrix.T @ matrix
    normal.flat[:: len(matrix) + 1] += EPSILON**2 * (
        float(normal.diagonal().max(initial=0.0)) or 1.0
    )
    factors = scipy.linalg.cho_factor(normal, overwrite_a=True, check_finite=False)
    result = np.zeros_like(rhs)
    for _ in range(REPEATED):
        result += scipy.linalg.cho_solve(
            factors, matrix.T @ (rhs - matrix @ result), check_finite=False
        )
    return result
