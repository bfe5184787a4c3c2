"""The dense system A_0 x = load + G_Ct σ eliminated to u_t on Γ_C: by LAPACK, or by a KSP if options or ranks ask."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy

from ..arrays import Array, Index
from ..bem.dense_assembly import DenseBlocks
from ..errors import SolverError
from ..linalg.ksp import LinearSolver
from ..runtime.petsc import petsc
from .contact_vectors import ContactVectors

PREFIX = "elastic_"
"""Of the options of the KSP."""


class Elimination(Protocol):
    """x = A_0⁻¹ (load + G_Ct σ).

    Attributes
    ----------
    influence : (r, m k) array
        Rows of u_t of A_0⁻¹ G_Ct, this rank's of the even layout of contact vectors.
    at_rest : (r,) array
        The same of A_0⁻¹ load.
    """

    influence: Array
    at_rest: Array

    def unknowns(self, sigma: Array) -> Array:
        """All of x, on every rank, for tractions (m, k) over `traction_scale`."""
        ...

    def close(self) -> None:
        """Free every PETSc object."""
        ...


def eliminate(blocks: DenseBlocks, contact: ContactVectors) -> Elimination:
    """The blocks' elimination, which uses them up.

    Raises
    ------
    SolverError
        If the matrix is singular, the KSP fails, or the solution is not finite.
    """
    # -help lists the options of the KSP, which must be there for that
    asked = any(name == "help" or name.startswith(PREFIX) for name in petsc().Options().getAll())
    if contact.comm.getSize() > 1 or asked:
        return KSPElimination(blocks, contact)
    return LapackElimination(blocks, contact.local_unknowns)


class LapackElimination:
    """LU with the unknowns on Γ_C last: what stands there is known after forward substitution and a small solve, at half the
    price of all unknowns; these follow from one back substitution for each σ that asks for them.

    Parameters
    ----------
    blocks : DenseBlocks
        Overwritten.
    kept : (m k,) array
        Numbers of the unknowns on Γ_C.
    """

    def __init__(self, blocks: DenseBlocks, kept: Index) -> None:
        self._blocks = blocks
        system = blocks.system.getDenseArray()
        n = len(system)
        inner = n - len(kept)
        last = np.arange(inner, n)
        out, into = np.setdiff1d(kept, last), np.setdiff1d(last, kept)
        columns = system.T  # one after another in memory
        columns[into], columns[out] = columns[out], columns[into]
        self._order = np.arange(n)
        self._order[into], self._order[out] = out, into
        place = np.argsort(self._order)[kept] - inner
        self._lu, swaps, info = scipy.linalg.lapack.dgetrf(system, overwrite_a=True)
        if info > 0:
            raise SolverError("factor", f"zero pivot in LU (row {info})", "the matrix is singular: is the body fixed?")
        self._forward = self._half_solved(blocks.contact.getDenseArray(), swaps)
        self._load = self._half_solved(blocks.load.getArray()[:, None], swaps)[:, 0]
        corner = np.asfortranarray(self._lu[inner:, inner:])
        both = np.column_stack([self._forward[inner:], self._load[inner:]])
        answer = scipy.linalg.blas.dtrsm(1.0, corner, both)[place]
        if not np.isfinite(answer).all():
            raise SolverError("factor", "the solution is not finite", "look at the data and the mesh")
        self.influence, self.at_rest = answer[:, :-1], answer[:, -1]

    def _half_solved(self, rhs: Array, swaps: Index) -> Array:
        """L⁻¹ P rhs, in its place."""
        swapped = scipy.linalg.lapack.dlaswp(rhs, swaps, overwrite_a=True)
        return np.asarray(scipy.linalg.blas.dtrsm(1.0, self._lu, swapped, lower=1, diag=1, overwrite_b=1))

    def unknowns(self, sigma: Array) -> Array:
        """As in `Elimination`."""
        result = np.empty(len(self._order))
        result[self._order] = scipy.linalg.blas.dtrsv(self._lu, self._load + self._forward @ sigma.ravel())
        return result

    def close(self) -> None:
        """Free the blocks."""
        for block in (self._blocks.system, self._blocks.contact, self._blocks.load):
            block.destroy()


class KSPElimination:
    """By the KSP of prefix `elastic_`: all columns of A_0⁻¹ G_Ct.

    Parameters
    ----------
    blocks : DenseBlocks
        Freed.
    contact : ContactVectors
    """

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
        """As in `Elimination`."""
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
