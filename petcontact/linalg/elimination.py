"""Dense elimination of all unknowns but a few, by the KSP of prefix `elastic_`."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..errors import SolverError
from .blocked_lu import default_type
from .dense_matrix import on_memory
from .ksp import LinearSolver

PREFIX = "elastic_"
"""Of the options of the elimination's KSP."""


class Elimination:
    """x = A⁻¹ (b s + B y) of a dense PETSc matrix A that the ranks share by rows.

    Of all columns of B and b some unknowns are known at once; the others follow for each y that
    asks for them.

    Parameters
    ----------
    system : (n, rows) array
        This rank's rows of A, by columns; the memory of the matrix, overwritten by its factors.
    contact, loads : (m, rows), (K, rows) arrays
        The same of B and b; overwritten.
    kept : (k,) int array
        Numbers of those unknowns.
    comm : PETSc.Comm

    Attributes
    ----------
    influence : (k, m) array
        Their rows of A⁻¹ B.
    at_rest : (k, K) array
        The same of A⁻¹ b.

    Raises
    ------
    SolverError
        If A is singular, or the solution not finite.
    """

    def __init__(self, system: Array, contact: Array, loads: Array, kept: Index, comm: Any) -> None:
        self._solver = LinearSolver(
            comm, PREFIX, "factor", in_place=True, pc_type=default_type(), last=kept
        )
        matrix = self._solver.owned(on_memory(system, len(system), comm))
        self._solver.set_operator(matrix)
        self._contact, self._load = self._solver.begun(contact), self._solver.begun(loads)
        self.influence, self.at_rest = self._kept(self._contact), self._kept(self._load)

    def with_load(self, loads: Array) -> Elimination:
        """The same matrix and columns with another load (K, rows), which is overwritten.

        Raises
        ------
        SolverError
            If the solution is not finite.
        """
        other = copy.copy(self)
        other._load = self._solver.begun(loads)
        other.at_rest = self._kept(other._load)
        return other

    def _kept(self, begun: Array) -> Array:
        result = self._solver.kept(begun)
        if not np.isfinite(result).all():
            raise SolverError(
                "factor", "the solution is not finite", "look at the data and the mesh"
            )
        return result

    def unknowns(self, shares: Array, y: Array) -> Array:
        """x (n, ...) for loads weighted by `shares` (K, ...) and y (m, ...), one or several
        columns. Collective."""
        return self._solver.combined((self._load, shares), (self._contact, y))

    def solve(self, rhs: Array) -> Array:
        """A⁻¹ of one right-hand side, this rank's rows of it, on every rank. Collective."""
        return self._solver.solved(rhs)

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
