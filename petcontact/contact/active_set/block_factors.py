"""Factors of the block of a dense S on an active set, and solves with near blocks by them."""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array, Index
from ...errors import SingularMatrixError
from ...linalg.dense_solver import DenseSolver
from ...round_off import CHAINED
from ...runtime.petsc import petsc

EPSILON, REPEATED = 1e-6, 4
"""`EPSILON` regularises a least-squares solution, relative to the longest column [-]. `REPEATED` is
the number of its corrections."""


class BlockFactors:
    """The KSP of a block of a dense S, which solves near blocks, too.

    From step to step few components become active or inactive, and few columns change. Then the
    unknowns of the factorised block are kept. Those that have gone are 0, and a force on each
    equation that has gone is unknown instead. A Schur complement of the size of the change gives
    these and the new unknowns (W. W. Hager, Updating the inverse of a matrix, SIAM Rev. 31 (1989)
    221-239).
    """

    def __init__(self) -> None:
        self._of: tuple[Array, Index, Array] | None = None
        self._solver: DenseSolver | None = None

    @property
    def iterations(self) -> int:
        """Iterations of the KSP in the last solve."""
        return 0 if self._solver is None else self._solver.iterations

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
        if self._of is not None and self._of[0] is dense:
            answer = self._near(active, marks, matrix, rhs)
            if answer is not None:
                return answer
        self._of = None
        self._solver = self._solver or DenseSolver(petsc().COMM_SELF, "stick_")
        self._solver.take(matrix)
        try:
            answer = self._solver.solve(rhs)
        except SingularMatrixError:
            self._solver.close()
            self._solver = None
            return _least(matrix, rhs)
        self._of = dense, active, marks
        return answer

    def _near(self, active: Index, marks: Array, matrix: Array, rhs: Array) -> Array | None:
        """Return matrix⁻¹ rhs by the factors of the last block, or None if the matrix differs too
        much from it."""
        assert self._of is not None and self._solver is not None
        equations, unknowns = _shared(active, marks, *self._of[1:])
        sizes = len(rhs), self._solver.size
        more, gone = map(_others, sizes, equations)
        new, out = map(_others, sizes, unknowns)
        # LU of n unknowns costs as much as n/3 solves
        if 6 * (len(new) + len(gone)) > sizes[0]:
            return None
        columns = np.zeros((1 + len(new) + len(gone), sizes[1]))
        columns[0, equations[1]] = rhs[equations[0]]
        columns[1 : len(new) + 1, equations[1]] = matrix[np.ix_(equations[0], new)].T
        columns[np.arange(len(new) + 1, len(columns)), gone] = 1.0
        columns = self._solver.solve_all(columns)
        kept = columns[:, unknowns[1]]
        system = np.vstack([columns[:, out].T, matrix[np.ix_(more, unknowns[0])] @ kept.T])
        system[len(out) :, 1 : len(new) + 1] -= matrix[np.ix_(more, new)]
        system[len(out) :, 0] -= rhs[more]
        try:
            y = np.linalg.solve(system[:, 1:], system[:, 0])
        except np.linalg.LinAlgError:
            return None
        answer = np.empty(sizes[0])
        answer[unknowns[0]], answer[new] = kept[0] - y @ kept[1:], y[: len(new)]
        left = np.abs(matrix @ answer - rhs).max()
        return answer if left <= CHAINED * np.abs(rhs).max() else None


def _shared(
    active: Index, marks: Array, before: Index, before_marks: Array
) -> tuple[tuple[Index, Index], tuple[Index, Index]]:
    """Return the equations and the unknowns that two blocks share, each as places in both."""
    _, own, old = np.intersect1d(active, before, assume_unique=True, return_indices=True)
    same = (marks[own] == before_marks[old]).all(axis=1)
    return (own, old), (own[same], old[same])


def _others(size: int, places: Index) -> Index:
    """Return the places below a size that are not among others."""
    return np.delete(np.arange(size), places)


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
