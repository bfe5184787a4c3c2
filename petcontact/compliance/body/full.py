"""The formulation of the paper, without elimination.

(4.12) and (4.13) are one matrix A(ρ) = A_0 + ρ G_Ct, which changes with ρ.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...bem.operators import BoundaryOperators
from ...contact.system import Modes
from ...linalg.dense_matrix import on_memory
from ...linalg.dense_solver import direct_solver
from ...runtime.petsc import stage
from ...untyped import Comm
from ..contact_compliance import ContactCompliance, MakeSurrogate
from .dense import DenseRows
from .eliminated import ElasticBody


class FullBody(ElasticBody):
    """A body held by its conditions, factorised anew each time ρ changes.

    It uses the KSP without a prefix.

    Raises
    ------
    SolverError
        If a factorisation fails.
    """

    compliance = None

    def __init__(self, operators: BoundaryOperators, modes: Array, comm: Comm) -> None:
        super().__init__(operators, modes)
        with stage("assemble"):
            self._rows = DenseRows(operators, modes, comm)
            self.missed = self._rows.missed
            # the columns that ρ changes are stored, because updates of A(ρ) would lose digits
            self._places = operators.data.contact_unknowns
            self._displacement_columns = self._rows.system[self._places].copy()
            self.solver = direct_solver(comm, "")
            matrix = on_memory(self._rows.system, self._rows.size, comm)
            self._matrix = self.solver.owned(matrix)
        self.solver.set_operator(self._matrix)
        self._rho = np.zeros(len(self._places))
        with stage("factor"):
            self._rest = np.column_stack(
                [
                    self.solve(self._rho, load) if load.any() else np.zeros(self._rows.size)
                    for load in self._rows.loads
                ]
            )
        self.u_0 = (
            self._rest[self._places].T.reshape(-1, *operators.data.contact_shape)
            + operators.data.sliding
        )

    def solve(self, rho: Array, rhs: Array) -> Array:
        """Return A(ρ)⁻¹ times a right-hand side, of which `rhs` has this rank's rows. Collective.

        `rho` (m k,) has a value for each contact unknown.
        """
        if not np.array_equal(rho, self._rho):
            factors = rho[:, None] / self.operators.traction_scale
            # (4.12): ρ G is added to each column of u_t on Γ_C
            self._matrix.getDenseArray().T[self._places] = (
                self._displacement_columns + factors * self._rows.contact
            )
            self._matrix.assemble()
            self.solver.set_operator(self._matrix)
            self._rho = rho.copy()
        return self.solver.solved(rhs)

    def influence(self, rho: Array, traction: Array) -> Array:
        """Return the displacement (m k,) along contact directions under tractions (m k,) [length].

        The Robin condition with this ρ acts in addition to the tractions.
        """
        return self.solve(rho, traction / self.operators.traction_scale @ self._rows.contact)[
            self._places
        ]

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """Return all unknowns of the body, by one solve with A(0)."""
        pushed = traction.ravel() / self.operators.traction_scale @ self._rows.contact
        return self._rest @ shares + self.solve(np.zeros(len(self._places)), pushed)

    def contact_compliance(self, order: Index, surrogate: MakeSurrogate) -> ContactCompliance:
        """Return S, which solves Robin problems by A(ρ)."""
        return _FullCompliance(self, order, surrogate)

    def describe(self) -> str:
        """Return the text for the verdict: the formulation."""
        return "full, dense"

    def close(self) -> None:
        """Free every PETSc object."""
        self.solver.close()


class _FullCompliance(ContactCompliance):
    """S by solves with A(0) and (I + ρS)⁻¹ by solves with A(ρ).

    Nodes are in the order of the contact system.
    """

    def __init__(self, body: FullBody, order: Index, surrogate: MakeSurrogate) -> None:
        super().__init__(surrogate)
        self._body, self._solver, k = body, body.solver, body.data.contact_shape[1]
        self._order, self._shape = (k * order[:, None] + np.arange(k)).ravel(), (len(order), k)

    def apply(self, sigma: Array) -> Array:
        """Return the displacement S σ of the contact nodes under their tractions σ [length]."""
        return self._by_body(np.zeros(sigma.size), sigma)

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """Return δv and δσ from A(ρ) δx = G_Ct r; there are no motions."""
        change = self._by_body(rho.ravel(), r)
        return change, r - rho * change

    def _by_body(self, rho: Array, sigma: Array) -> Array:
        factors, traction = np.empty(sigma.size), np.empty(sigma.size)
        factors[self._order], traction[self._order] = rho, sigma.ravel()
        return np.asarray(self._body.influence(factors, traction)[self._order].reshape(sigma.shape))
