"""A body eliminated by a dense factorisation."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array
from ...bem.operators import BLOCK
from ...linalg.ksp import LinearSolver
from ...runtime.petsc import petsc
from .base import BodyCompliance, BodyOperators, gauge
from .conditioning import forward_error, known_solution


class DenseBody(BodyCompliance):
    """One LU of the bordered system, on one rank, for all load states and contact tractions.

    Raises
    ------
    SolverError
        If the factorisation fails.
    """

    compliance: Array
    digits_lost: float

    def __init__(self, operators: BodyOperators, modes: Array) -> None:
        super().__init__(operators, modes)
        n, r, count = operators.n_unknowns, modes.shape[2], int(operators.of_contact.sum())
        matrix, rhs = _assembled(operators, r)
        matrix[n:, :n] = modes.reshape(n, r).T
        matrix[:n, n:] = gauge(self.mesh, self.loading.traction_known, modes).T
        # `matrix` holds columns of the system as rows: what PETSc calls a matrix by columns
        known = known_solution(matrix)
        rhs[-1] = known @ matrix
        solution = _solved(matrix, rhs)
        self.digits_lost = forward_error(solution[-1], known)
        solution[:count] /= operators.traction_scale
        self._influence, self._rest = solution[:count].T, solution[count:-1].T
        places = operators.data.contact_unknowns
        self.compliance = self._influence[places]
        self.u_0 = self._rest[places].T.reshape(-1, *operators.data.contact_directions.shape)

    def apply(self, traction: Array) -> Array:
        """S t."""
        return np.asarray(self.compliance @ traction)

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """From the solutions of all load states and unit tractions."""
        return np.asarray(self._rest @ shares + self._influence @ traction.ravel())

    def describe(self) -> str:
        """Dense."""
        return "dense"


def _assembled(operators: BodyOperators, r: int) -> tuple[Array, Array]:
    """The system by columns (d n + r, d n + r), zero beyond d n, and contact columns, loads, and a row to come,
    (d m + K + 1, d n + r)."""
    n, d = operators.mesh.n_nodes, operators.kernel.dim
    size, of_contact, amplitudes = d * n + r, operators.of_contact, operators.amplitudes
    matrix, rhs = np.zeros((size, size)), np.zeros((int(of_contact.sum()) + amplitudes.shape[1] + 1, size))
    system = matrix[: d * n, : d * n].reshape(n, d, n, d)
    blocks = operators.blocks(operators.right_hand_sides)
    for first in range(0, n, BLOCK[0]):
        rows = np.arange(first, min(first + BLOCK[0], n))
        beside = np.zeros((len(of_contact), len(rows), d))
        for block in blocks:
            operators.fill(rows, block, system=system[:, :, rows[0] : rows[-1] + 1], right_hand_sides=beside)
        columns = beside.reshape(len(of_contact), -1)
        loads = amplitudes[~of_contact].T @ columns[~of_contact]
        rhs[:-1, d * rows[0] : d * (rows[-1] + 1)] = np.concatenate([columns[of_contact], loads])
    rhs[-1 - amplitudes.shape[1] : -1, : d * n] += operators.point_loads.T
    return matrix, rhs


def _solved(columns: Array, rhs: Array) -> Array:
    """Rows x_k with system · x_k = rhs_k, in place; the system's columns are the rows of `columns`, overwritten, too."""
    module = petsc()
    comm = module.COMM_SELF
    size, count = len(columns), len(rhs)
    system = module.Mat().createDense((size, size), array=columns.T, comm=comm)
    right = module.Mat().createDense((size, count), array=rhs.T, comm=comm)
    system.assemble()
    right.assemble()
    solver = LinearSolver(comm, "elastic_", "factor", in_place=True)
    solver.set_operator(system)
    solution: Any = solver.solve_many(right)
    solver.close()
    for matrix in (right, system):
        matrix.destroy()
    rhs[:] = solution.getDenseArray().T
    solution.destroy()
    return rhs
