"""The two dense formulations: `CondensedSystem` eliminates once and solves I + ρS, `FullSystem` is the paper's, the whole
matrix A(ρ) = A_0 + ρ G_Ct each time ρ changes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..bem.dense_assembly import assemble_dense
from ..bem.operators import BoundaryOperators
from ..linalg.ksp import LinearSolver
from ..runtime.petsc import petsc, stage
from .base import EliminatedSystem, SystemBase


class CondensedSystem(EliminatedSystem):
    """Eliminated once to u_t = u_0 + S σ_t on Γ_C; a new ρ costs a solve with the small matrix I + ρS."""

    def __init__(self, operators: BoundaryOperators, comm: Any, timings: dict[str, float] | None = None) -> None:
        super().__init__(operators, comm)
        with stage("assemble", timings):
            blocks = assemble_dense(operators, comm)
        with stage("factor", timings):
            elastic = LinearSolver(comm, "elastic_", "factor", in_place=True)
            elastic.set_operator(blocks.system)
            self._influence = elastic.solve_many(blocks.contact)
            self._at_rest = blocks.load.duplicate()
            elastic.solve(blocks.load, self._at_rest)
            elastic.close()
            for block in (blocks.system, blocks.contact, blocks.load):
                block.destroy()
        local = self.contact.contact_rows(self._influence.getDenseArray()) / self._scale
        at_rest = self.contact.contact_rows(self._at_rest.getArray(readonly=True))
        self.u_0 = self.contact.everywhere(at_rest).reshape(-1, 1)
        layout = self.contact.layout
        self._compliance = petsc().Mat().createDense((layout, layout), array=np.asfortranarray(local), comm=comm)
        self._compliance.assemble()
        self._robin_matrix: Any = None
        self._rho = 0.0
        self._solver = LinearSolver(comm, "", "iterate")

    def apply(self, sigma_t: Array) -> Array:
        """S σ_t."""
        self.applications += 1
        x = self.contact.vector(sigma_t)
        y = x.duplicate()
        self._compliance.mult(x, y)
        x.destroy()
        return self.contact.gather(y)

    def robin_increment(self, rho: float, r: Array) -> tuple[Array, Array]:
        """(I + ρS) δσ = r, δu = S δσ."""
        self._set_rho(rho)
        rhs = self.contact.vector(r)
        solution = rhs.duplicate()
        self._solver.solve(rhs, solution)
        rhs.destroy()
        sigma_t = self.contact.gather(solution)
        self.elastic_solves += 1
        self.ksp_iterations, self.ksp_reason = self._solver.iterations, self._solver.reason
        return self.apply(sigma_t), sigma_t

    def compliance(self) -> Array:
        """S, gathered."""
        return self.contact.everywhere(self._compliance.getDenseArray())

    def boundary(self, sigma_t: Array) -> tuple[Array, Array]:
        """Unknowns at rest plus the influence of σ_t."""
        x = self.contact.vector(sigma_t / self._scale)
        unknowns = self._at_rest.duplicate()
        self._influence.multAdd(x, self._at_rest, unknowns)
        result = _gather_unknowns(self, unknowns, sigma_t)
        x.destroy()
        unknowns.destroy()
        return result

    def describe(self) -> str:
        """Formulation and solver."""
        ksp = self._solver.ksp
        return f"condensed, dense; KSP {ksp.getType()}, PC {ksp.getPC().getType()}"

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
        for item in (self._influence, self._at_rest, self._compliance, self._robin_matrix):
            if item is not None:
                item.destroy()

    def _set_rho(self, rho: float) -> None:
        if rho == self._rho:
            return
        if self._robin_matrix is None:
            self._robin_matrix = self._compliance.duplicate(copy=False)
        self._compliance.copy(self._robin_matrix)
        self._robin_matrix.scale(rho)
        self._robin_matrix.shift(1.0)
        self._solver.set_operator(self._robin_matrix)
        self._rho = rho


class FullSystem(SystemBase):
    """The paper's formulation: the whole system A(ρ) x = b + G_Ct f, refactored each time ρ changes."""

    def __init__(self, operators: BoundaryOperators, comm: Any, timings: dict[str, float] | None = None) -> None:
        super().__init__(operators, comm)
        with stage("assemble", timings):
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
            self._at_rest = self._contact_part(self._solve(0.0, None, load=True))
        return self._at_rest

    def apply(self, sigma_t: Array) -> Array:
        """S σ_t by a solve with A(0)."""
        self.applications += 1
        return self._contact_part(self._solve(0.0, sigma_t, load=False))

    def robin(self, rho: float, f: Array) -> tuple[Array, Array]:
        """A(ρ) x = b + G_Ct f."""
        self.elastic_solves += 1
        u_t = self._contact_part(self._solve(rho, f, load=True))
        return u_t, f - rho * u_t

    def robin_increment(self, rho: float, r: Array) -> tuple[Array, Array]:
        """A(ρ) δx = G_Ct r."""
        self.elastic_solves += 1
        change = self._contact_part(self._solve(rho, r, load=False))
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
        result = _gather_unknowns(self, unknowns, sigma_t)
        unknowns.destroy()
        return result

    def describe(self) -> str:
        """Formulation and solver."""
        return f"full, dense; KSP {self._solver.ksp.getType()}, PC {self._solver.ksp.getPC().getType()}"

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
        return self.contact.everywhere(local).reshape(-1, 1)

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


def _gather_unknowns(system: CondensedSystem | FullSystem, unknowns: Any, sigma_t: Array) -> tuple[Array, Array]:
    whole = system.contact.everywhere(unknowns.getArray(readonly=True))
    return system.operators.split(whole, sigma_t)
