"""The formulation of the paper: nothing is eliminated; (4.12) and (4.13) are one matrix A(ρ) = A_0
+ ρ G_Ct, a new one each time ρ changes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...bem.operators import BoundaryOperators
from ...contact.system import Modes
from ...linalg.dense_matrix import on_memory
from ...linalg.dense_solver import direct_solver
from ...runtime.petsc import stage
from ..contact_compliance import ContactCompliance, MakeSurrogate
from .base import ElasticBody
from .dense import DenseRows


class FullBody(ElasticBody):
    """A body that its conditions hold, refactored each time ρ changes, with the KSP without a
    prefix.

    Raises
    ------
    SolverError
        If a factorisation fails.
    """

    compliance = None

    def __init__(self, operators: BoundaryOperators, modes: Array, comm: Any) -> None:
        super().__init__(operators, modes)
        with stage("assemble"):
            self._rows = DenseRows(operators, modes, comm)
            # the columns that ρ changes, kept: A(ρ) is written anew and not updated, which would
            # lose digits
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
        """A(ρ)⁻¹ times a right-hand side, this rank's rows of it; ρ (m k,), over all contact
        unknowns. Collective."""
        if not np.array_equal(rho, self._rho):
            each = rho[:, None] / self.operators.traction_scale
            # (4.12): of the columns of u_t on Γ_C each takes ρ G with it
            self._matrix.getDenseArray().T[self._places] = (
                self._displacement_columns + each * self._rows.contact
            )
            self._matrix.assemble()
            self.solver.set_operator(self._matrix)
            self._rho = rho.copy()
        return self.solver.solved(rhs)

    def influence(self, rho: Array, traction: Array) -> Array:
        """Displacement in the contact directions (m k,) by tractions (m k,), those of the Robin
        condition among them."""
        return self.solve(rho, traction / self.operators.traction_scale @ self._rows.contact)[
            self._places
        ]

    def apply(self, traction: Array) -> Array:
        """S t by a solve with A(0), a column each."""
        still = np.zeros(len(self._places))
        if traction.ndim == 1:
            return self.influence(still, traction)
        return np.column_stack([self.influence(still, column) for column in traction.T])

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """All unknowns of the body: one solve with A(0)."""
        pushed = traction.ravel() / self.operators.traction_scale @ self._rows.contact
        return self._rest @ shares + self.solve(np.zeros(len(self._places)), pushed)

    def contact_compliance(self, place: Index, surrogate: MakeSurrogate) -> ContactCompliance:
        """S and Robin problems by A(ρ)."""
        return _FullCompliance(self, place, surrogate)

    def describe(self) -> str:
        """A line for the verdict: the formulation."""
        return "full, dense"

    def close(self) -> None:
        """Free every PETSc object."""
        self.solver.close()


class _FullCompliance(ContactCompliance):
    """S of a body by solves with A(0), I + ρS by solves with A(ρ); nodes in the order of the
    contact system."""

    def __init__(self, body: FullBody, place: Index, surrogate: MakeSurrogate) -> None:
        super().__init__(surrogate)
        self._body, k = body, body.data.contact_shape[1]
        self._order = (k * place[:, None] + np.arange(k)).ravel()

    def apply(self, sigma: Array) -> Array:
        """Displacement S σ of the contact nodes under tractions σ there."""
        return self._by_body(np.zeros(sigma.size), sigma)

    def matrix(self) -> Array:
        """S, one solve with A(0) a column."""
        return np.asarray(
            self._body.apply(np.eye(len(self._order)))[self._order[:, None], self._order]
        )

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """A(ρ) δx = G_Ct r; there are no motions."""
        change = self._by_body(rho.ravel(), r)
        return change, r - rho * change

    @property
    def kind(self) -> str:
        """Of the KSP without a prefix."""
        return self._body.solver.kind

    def _by_body(self, rho: Array, sigma: Array) -> Array:
        each, traction = np.empty(sigma.size), np.empty(sigma.size)
        each[self._order], traction[self._order] = rho, sigma.ravel()
        moved: Array = self._body.influence(each, traction)[self._order].reshape(sigma.shape)
        self.ksp_iterations, self.ksp_reason = (
            self._body.solver.iterations,
            self._body.solver.reason,
        )
        return moved
