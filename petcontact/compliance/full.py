"""The dense formulation of the paper: the whole matrix A(ρ) = A_0 + ρ G_Ct each time ρ changes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..bem.dense_assembly import assemble_dense
from ..bem.operators import BoundaryOperators
from ..linalg.ksp import LinearSolver
from ..runtime.petsc import stage
from .base import SystemBase


class FullSystem(SystemBase):
    """The paper's formulation: the whole system A(ρ) x = b + G_Ct f, refactored each time ρ changes."""

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        super().__init__(operators, comm)
        with stage("assemble"):
            self._blocks = assemble_dense(operators, comm)
            local = self._blocks.system.getDenseArray()
            # the columns that ρ changes, kept: A(ρ) is written anew and not updated, which would lose digits
            self._displacement_columns = np.array(local[:, operators.data.contact_unknowns])
        self._rho = 0.0
        self._at_rest: Array | None = None
        self._solver = LinearSolver(comm, "", "iterate")
        self._solver.set_operator(self._blocks.system)

    @property
    def u_0(self) -> Array:
        """u_t for σ_t = 0: one solve with A(0), when first asked for."""
        if self._at_rest is None:
            self._at_rest = self._contact_part(self._solve(0.0, None, load=True)) + self.operators.data.sliding
        return self._at_rest

    def apply(self, sigma_t: Array) -> Array:
        """S σ_t by a solve with A(0)."""
        self.applications += 1
        return self._contact_part(self._solve(0.0, sigma_t, load=False))

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """A(ρ) x = b + G_Ct f."""
        self.elastic_solves += 1
        sliding = self.operators.data.sliding
        strained = self._contact_part(self._solve(float(rho), f - rho * sliding, load=True))
        u_t = strained + sliding
        return u_t, f - rho * u_t

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """A(ρ) δx = G_Ct r."""
        self.elastic_solves += 1
        change = self._contact_part(self._solve(float(rho), r, load=False))
        return change, r - rho * change

    def compliance(self) -> Array:
        """S, one solve with A(0) a column."""
        self._set_rho(0.0)
        influence = self._solver.solve_many(self._blocks.contact)
        local = self.contact.contact_rows(influence.getDenseArray()) / self._scale
        influence.destroy()
        return self.contact.everywhere(local)

    def boundary(self, sigma_t: Array) -> tuple[Array, Array]:
        """One solve with A(0)."""
        unknowns = self._solve(0.0, sigma_t, load=True)
        result = self._everywhere(unknowns, sigma_t)
        unknowns.destroy()
        return result

    def describe(self) -> str:
        """Formulation and solver."""
        return f"full, dense; {self._solver.kind}"

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
        for block in (self._blocks.system, self._blocks.contact, self._blocks.load):
            block.destroy()

    def _solve(self, rho: float, f: Array | None, *, load: bool) -> Any:
        self._set_rho(rho)
        rhs = self._blocks.load.duplicate()
        rhs.set(0.0)
        if f is not None:
            x = self.contact.vector(f / self._scale)
            self._blocks.contact.mult(x, rhs)
            x.destroy()
        if load:
            rhs.axpy(1.0, self._blocks.load)
        solution = rhs.duplicate()
        self._solver.solve(rhs, solution)
        rhs.destroy()
        self.ksp_iterations, self.ksp_reason = self._solver.iterations, self._solver.reason
        return solution

    def _contact_part(self, unknowns: Any) -> Array:
        local = self.contact.contact_rows(unknowns.getArray(readonly=True))
        unknowns.destroy()
        return self.contact.everywhere(local).reshape(self.contact.shape)

    def _set_rho(self, rho: float) -> None:
        if rho == self._rho:
            return
        system = self._blocks.system
        columns = system.getDenseArray()
        contact = self._blocks.contact.getDenseArray()
        columns[:, self.operators.data.contact_unknowns] = self._displacement_columns + rho / self._scale * contact
        system.assemble()
        self._solver.set_operator(system)
        self._rho = rho
