"""The dense formulation that eliminates once and solves I + ρS."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..bem.dense_assembly import DenseBlocks, assemble_dense
from ..bem.operators import BoundaryOperators
from ..linalg.elimination import Elimination
from ..linalg.ksp import LinearSolver
from ..runtime.petsc import petsc, stage
from .base import EliminatedSystem
from .contact_vectors import ContactVectors

PREFIX = "elastic_"
"""Of the options of the elimination's KSP."""


class CondensedSystem(EliminatedSystem):
    """Eliminated once to u_t = u_0 + S σ_t on Γ_C; a new ρ costs a solve with the small matrix I + ρS."""

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        super().__init__(operators, comm)
        with stage("assemble"):
            blocks = assemble_dense(operators, comm)
        with stage("factor"):
            self._elimination = (ByKSP if comm.getSize() > 1 or _wants_ksp() else ByLapack)(blocks, self.contact)
        self.u_0 = self.contact.everywhere(self._elimination.at_rest).reshape(self.contact.shape) + operators.data.sliding
        local = self._elimination.influence / self._scale
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

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """(I + ρS) δσ = r, δu = S δσ."""
        self._set_rho(float(rho))
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
        return self.operators.split(self._elimination.unknowns(sigma_t / self._scale), sigma_t)

    def describe(self) -> str:
        """Formulation and solver."""
        return "; ".join(filter(None, ["condensed, dense", self._solver.kind]))

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
        self._elimination.close()
        for item in (self._compliance, self._robin_matrix):
            if item is not None:
                item.destroy()

    def _set_rho(self, rho: float) -> None:
        if rho == self._rho:
            return
        if self._robin_matrix is None:
            self._robin_matrix = self._compliance.duplicate(copy=False)
        np.multiply(self._compliance.getDenseArray(), rho, out=self._robin_matrix.getDenseArray())
        self._robin_matrix.shift(1.0)
        self._solver.set_operator(self._robin_matrix)
        self._rho = rho


class ByLapack:
    """A_0 x = load + G_Ct σ eliminated on one rank.

    Attributes
    ----------
    influence : (r, m k) array
        Rows of u_t of A_0⁻¹ G_Ct, this rank's of the even layout of contact vectors.
    at_rest : (r,) array
        The same of A_0⁻¹ load.
    """

    def __init__(self, blocks: DenseBlocks, contact: ContactVectors) -> None:
        self._blocks = blocks
        arrays = blocks.system.getDenseArray(), blocks.contact.getDenseArray(), blocks.load.getArray()
        self._elimination = Elimination(*arrays, contact.local_unknowns)
        self.influence, self.at_rest = self._elimination.influence, self._elimination.at_rest

    def unknowns(self, sigma: Array) -> Array:
        """All of x, on every rank, for tractions (m, k) over `traction_scale`."""
        return self._elimination.unknowns(sigma.ravel())

    def close(self) -> None:
        """Free every PETSc object."""
        for block in (self._blocks.system, self._blocks.contact, self._blocks.load):
            block.destroy()


class ByKSP:
    """The same by the KSP of prefix `elastic_` and all columns of A_0⁻¹ G_Ct, over any number of ranks."""

    def __init__(self, blocks: DenseBlocks, contact: ContactVectors) -> None:
        self._contact = contact
        solver = LinearSolver(contact.comm, PREFIX, "factor", in_place=True)
        solver.set_operator(blocks.system)
        self._columns = solver.solve_many(blocks.contact)
        self._rest = blocks.load.duplicate()
        solver.solve(blocks.load, self._rest)
        solver.close()
        for block in (blocks.system, blocks.contact, blocks.load):
            block.destroy()
        self.influence = contact.contact_rows(self._columns.getDenseArray())
        self.at_rest = contact.contact_rows(self._rest.getArray(readonly=True))

    def unknowns(self, sigma: Array) -> Array:
        """As of `ByLapack`."""
        x, result = self._contact.vector(sigma), self._rest.duplicate()
        self._columns.multAdd(x, self._rest, result)
        whole = self._contact.everywhere(result.getArray(readonly=True))
        x.destroy()
        result.destroy()
        return whole

    def close(self) -> None:
        """Free every PETSc object."""
        self._columns.destroy()
        self._rest.destroy()


def _wants_ksp() -> bool:
    """Whether options speak of the KSP, -help among them, which lists what there is."""
    return any(name == "help" or name.startswith(PREFIX) for name in petsc().Options().getAll())
