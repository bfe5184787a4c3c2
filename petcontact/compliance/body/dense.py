"""A body eliminated by a dense factorisation: LAPACK's on one rank, or the KSP of prefix `elastic_`
over any number."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...bem.boundary_data import BoundaryData
from ...bem.dense_assembly import fill_dense
from ...bem.operators import BoundaryOperators
from ...linalg.elimination import Elimination
from ...linalg.ksp import LinearSolver, is_asked_for
from ...linalg.row_layout import even_ranges
from ...runtime.petsc import petsc, stage
from ...runtime.world import of_petsc
from .base import ElasticBody, gauge
from .conditioning import forward_error, known_solution

PREFIX = "elastic_"
"""Of the options of the elimination's KSP."""


class DenseBody(ElasticBody):
    """One factorisation of the bordered system for all load states and contact tractions.

    Parameters
    ----------
    operators : BoundaryOperators
    modes : (n, d, r) array
    comm : PETSc.Comm
        Its ranks share the rows of the system; each has S.

    Raises
    ------
    SolverError
        If the factorisation fails.
    """

    compliance: Array
    takes_several = True

    def __init__(self, operators: BoundaryOperators, modes: Array, comm: Any) -> None:
        super().__init__(operators, modes)
        with stage("assemble"):
            system = DenseRows(operators, modes, comm)
        kept = operators.data.contact_unknowns
        with stage("factor"):
            by_ksp = comm.getSize() > 1 or is_asked_for(PREFIX)
            self._solved: Elimination | _ByKSP = (
                _ByKSP(system, comm)
                if by_ksp
                else Elimination(system.system.T, system.rhs.T, len(system.contact), kept)
            )
            influence, at_rest = self._solved.influence, self._solved.at_rest
            if isinstance(self._solved, _ByKSP):
                influence, at_rest = (
                    self._solved.everywhere(rows[system.own(kept)]) for rows in (influence, at_rest)
                )
        self.compliance = influence / operators.traction_scale
        self.digits_lost = self._error_of_known(system.known)
        self.u_0 = self._at_rest(at_rest)

    def with_data(self, data: BoundaryData) -> DenseBody | None:
        """The same body under other known values, by forward substitution of their loads; None
        where a KSP has eliminated it, or the values are those of other components."""
        if isinstance(self._solved, _ByKSP) or not data.has_matrix_of(self.data):
            return None
        body, (n, d) = copy.copy(self), self.mesh.x.shape
        ElasticBody.__init__(body, replace(self.operators, data=data), self.modes)
        loads = np.zeros((data.states + 1, d * n + self.modes.shape[2]))
        with stage("factor"):
            acting = loads[:-1, : d * n].reshape(data.states, n, d)
            fill_dense(body.operators, np.arange(n), None, None, acting)
            acting += body.operators.point_loads.T.reshape(acting.shape)
            body._solved = self._solved.with_load(loads.T)
            body.u_0 = body._at_rest(body._solved.at_rest)
        return body

    def _at_rest(self, solved: Array) -> Array:
        """u_0 from the columns (m k, K + 1) of all loads."""
        data = self.operators.data
        return solved[:, :-1].T.reshape(data.states, *data.contact_shape) + data.sliding

    def apply(self, traction: Array) -> Array:
        """Displacement S t of the contact nodes under tractions t there."""
        return np.asarray(self.compliance @ traction)

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """All unknowns of the body, for one or several increments: one back substitution."""
        y = traction.reshape(*shares.shape[:-1], -1) / self.operators.traction_scale
        return self._solved.unknowns(np.insert(shares, shares.shape[-1], 0.0, axis=-1).T, y.T).T

    def _error_of_known(self, known: Array) -> float:
        """What the last load, whose solution is known, comes to."""
        alone = np.zeros(self.data.states + 1)
        alone[-1] = 1.0
        return forward_error(
            self._solved.unknowns(alone, np.zeros(self.data.contact_directions.size)), known
        )

    def describe(self) -> str:
        """A line for the verdict: how the body is stored."""
        return "condensed, dense"


class DenseRows:
    """This rank's rows of the bordered system, its contact columns and loads; the rows of the
    border are the last rank's.

    Attributes
    ----------
    system : (d n + r, rows) array
        By columns.
    contact, loads : (m k, rows), (K + 1, rows) arrays
        The last load has a solution that is known.
    rhs : (m k + K + 1, rows) array
        Both, of which they are parts.
    known : (d n + r,) array
        That one.
    """

    def __init__(self, operators: BoundaryOperators, modes: Array, comm: Any) -> None:
        mesh, data, (n, d, r) = operators.mesh, operators.data, modes.shape
        rank, ranks = comm.getRank(), comm.getSize()
        first, last = even_ranges(n, ranks)[rank]
        inner, border = d * (last - first), r if rank == ranks - 1 else 0
        self._first, self._last, self.size = d * first, d * last, d * n + r
        rows = inner + border
        # every entry of A_0 is written
        self.system = np.empty((self.size, rows)) if not r else np.zeros((self.size, rows))
        m, k = data.contact_shape
        self.rhs = np.zeros((m * k + data.states + 1, rows))
        self.contact, self.loads = self.rhs[: m * k], self.rhs[m * k :]
        blocks = [
            array[:, :inner].reshape(len(array), last - first, d)
            for array in (self.contact, self.loads[:-1])
        ]
        inside = self.system[: d * n, :inner].reshape(n, d, last - first, d)
        fill_dense(operators, np.arange(first, last), inside, *blocks)
        blocks[1] += operators.point_loads[self._first : self._last].T.reshape(blocks[1].shape)
        self.system[d * n :, :inner] = modes.reshape(d * n, r)[self._first : self._last].T
        if border:
            self.system[: d * n, inner:] = gauge(mesh, data, modes).T
        self.known = known_solution(self.system, comm)
        self.loads[-1] = self.known @ self.system

    def own(self, unknowns: Index) -> Index:
        """Places in this rank's rows of those of some unknowns that are among them."""
        mine: Index = unknowns[(unknowns >= self._first) & (unknowns < self._last)]
        return np.asarray(mine - self._first, dtype=np.int64)


class _ByKSP:
    """All columns of the solution by a KSP.

    Attributes
    ----------
    influence, at_rest : (rows, m k), (rows, K) arrays
        This rank's rows of A⁻¹ B and A⁻¹ b.
    """

    def __init__(self, rows: DenseRows, comm: Any) -> None:
        self._mpi = comm.tompi4py() if comm.getSize() > 1 else None
        module, comm, local = petsc(), of_petsc(comm), rows.system.shape[1]
        columns = len(rows.rhs)
        system = module.Mat().createDense(
            ((local, rows.size), (local, rows.size)), array=rows.system.T, comm=comm
        )
        right = module.Mat().createDense(
            ((local, rows.size), (module.DECIDE, columns)), array=rows.rhs.T, comm=comm
        )
        system.assemble()
        right.assemble()
        solver = LinearSolver(comm, PREFIX, "factor", in_place=True)
        solver.set_operator(system)
        solution: Any = solver.solve_many(right)
        self.influence, self.at_rest = np.split(
            np.array(solution.getDenseArray()), [rows.contact.shape[0]], axis=1
        )
        solver.close()
        for matrix in (solution, right, system):
            matrix.destroy()

    def everywhere(self, local: Array) -> Array:
        """All rows from each rank's."""
        if self._mpi is None:
            return local
        whole: Array = np.concatenate(self._mpi.allgather(local))
        return whole

    def unknowns(self, shares: Array, y: Array) -> Array:
        """All unknowns of the body, as `Elimination.unknowns`."""
        return self.everywhere(self.at_rest @ shares + self.influence @ y)
