"""Dense elimination of all unknowns but a few, by the KSP of prefix `elastic_`."""

from __future__ import annotations

import copy
from typing import Self

import numpy as np

from ..arrays import Array, Index, linked
from ..errors import SolverError
from ..record import record
from ..untyped import Comm
from .blocked_lu import direct_type
from .dense_matrix import on_memory
from .ksp import LinearSolver
from .row_layout import summed

PREFIX = "elastic_"
"""Prefix of the options of the elimination's KSP."""


@record
class _Block:
    """A group of unknowns that no equation couples with the others.

    Attributes
    ----------
    unknowns, rows, own : int arrays
        Numbers of its unknowns, of its equations on this rank, and of its columns of B.
    solver : LinearSolver
    contact : array
        Its columns of B, begun.
    """

    unknowns: Index
    rows: Index
    own: Index
    solver: LinearSolver
    contact: Array


class Elimination:
    """x = A⁻¹ (b s + B y) of a dense PETSc matrix A that the ranks share by rows.

    Of all columns of B and b some unknowns are known at once; the others follow for each y that
    asks for them. Unknowns that do not know of each other, as torsion and the rest of a body of
    revolution, have a factorisation each.

    Parameters
    ----------
    system : (n, rows) array
        This rank's rows of A, by columns; the memory of the matrix, overwritten by its factors.
    contact, loads : (k, rows), (K, rows) arrays
        The same of B and b; overwritten.
    kept : (k,) int array
        Numbers of those unknowns, one for each column of B.
    comm : PETSc.Comm
    kinds : pair of int arrays, optional
        Kinds of the unknowns (n,) and of the equations (rows,), 0, 1, ...: those of one kind stay
        together. By default all do.

    Attributes
    ----------
    influence : (k, k) array
        Their rows of A⁻¹ B.
    at_rest : (k, K) array
        The same of A⁻¹ b.

    Raises
    ------
    SolverError
        If A is singular, or the solution not finite.
    """

    def __init__(
        self,
        system: Array,
        contact: Array,
        loads: Array,
        kept: Index,
        comm: Comm,
        kinds: tuple[Index, Index] | None = None,
    ) -> None:
        self._size = len(system)
        unknown, row = kinds or [np.zeros(count, dtype=np.int64) for count in system.shape]
        group = _groups(system, contact, kept, unknown, row, comm)
        self._blocks, influence = list[_Block](), list[Array]()
        for number in range(group.max(initial=0) + 1):
            own = np.flatnonzero(group[unknown[kept]] == number)
            inside, rows = (np.flatnonzero(group[kind] == number) for kind in (unknown, row))
            solver = _factors(_part(system, inside, rows), np.searchsorted(inside, kept[own]), comm)
            begun = solver.begun(_part(contact, own, rows))
            influence.append(_kept(solver, begun))
            self._blocks.append(_Block(inside, rows, own, solver, begun))
        self.influence = influence[0]  # of the only block without a copy
        if len(influence) > 1:
            self.influence = np.zeros((len(kept), len(kept)))
            for block, part in zip(self._blocks, influence, strict=True):
                self.influence[np.ix_(block.own, block.own)] = part
        self._load(loads)

    def _load(self, loads: Array) -> None:
        self._loads = list[Array]()
        self.at_rest = np.empty((len(self.influence), len(loads)))
        for block in self._blocks:
            load = block.solver.begun(np.ascontiguousarray(loads[:, block.rows]))
            self._loads.append(load)
            self.at_rest[block.own] = _kept(block.solver, load)

    def with_load(self, loads: Array) -> Self:
        """Return the elimination with the same matrix and another load (K, rows), which may be
        overwritten.

        Raises
        ------
        SolverError
            If the solution is not finite.
        """
        copied = copy.copy(self)
        copied._load(loads)
        return copied

    def unknowns(self, shares: Array, y: Array) -> Array:
        """x (n,) for loads weighted by `shares` (K,) and y (k,). Collective."""
        result = np.empty(self._size)
        for block, load in zip(self._blocks, self._loads, strict=True):
            result[block.unknowns] = block.solver.combined(
                (load, shares), (block.contact, y[block.own])
            )
        return result

    def solve(self, rhs: Array) -> Array:
        """A⁻¹ of one right-hand side, this rank's rows of it, on every rank. Collective."""
        result = np.empty(self._size)
        for block in self._blocks:
            result[block.unknowns] = block.solver.solved(rhs[block.rows])
        return result

    def close(self) -> None:
        """Free every PETSc object."""
        for block in self._blocks:
            block.solver.close()


def _groups(
    system: Array, contact: Array, kept: Index, unknown: Index, row: Index, comm: Comm
) -> Index:
    """Return the group of each kind: kinds of different groups share no entry. Collective."""
    count = int(unknown.max(initial=0)) + 1
    if count == 1:
        return np.zeros(1, dtype=np.int64)
    places = [np.flatnonzero(row == kind) for kind in range(count)]
    coupled = np.zeros((count, count))
    for kind in range(count):
        columns = [system[i] for i in np.flatnonzero(unknown == kind)]
        columns += [contact[j] for j in np.flatnonzero(unknown[kept] == kind)]
        # most often the first entries say so
        coupled[kind] = [any(column[at].any() for column in columns) for at in places]
    return linked(np.array(np.nonzero(summed(coupled, comm))), count)


def _factors(matrix: Array, last: Index, comm: Comm) -> LinearSolver:
    """Return the solver of a matrix, in whose place its factors go."""
    kind = direct_type(comm)
    solver = LinearSolver(comm, PREFIX, "factor", in_place=True, pc_type=kind, last=last)
    solver.set_operator(solver.owned(on_memory(matrix, len(matrix), comm)))
    return solver


def _part(columns: Array, some: Index, rows: Index) -> Array:
    """Return rows of some columns; all of them are returned in their place."""
    whole = columns.shape == (len(some), len(rows))
    return columns if whole else np.ascontiguousarray(columns[np.ix_(some, rows)])


def _kept(solver: LinearSolver, begun: Array) -> Array:
    result = solver.kept(begun)
    if not np.isfinite(result).all():
        raise SolverError("factor", "the solution is not finite", "look at the data and the mesh")
    return result
