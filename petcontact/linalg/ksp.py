"""One KSP with petcontact's defaults: every linear solve goes through here, and none fails
silently."""

from __future__ import annotations

import atexit
import ctypes
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ..arrays import Array, Index
from ..errors import InputError, SolverError
from ..runtime.memory import give_back
from ..runtime.petsc import (
    given_options,
    options_error,
    petsc,
    petsc_library,
    reason_name,
    solver_error,
)
from ..runtime.ranks import meet
from ..untyped import KSP, PC, Comm, Mat, Vec
from . import blocked_lu
from .dense_matrix import on_memory
from .row_layout import everywhere

T = TypeVar("T")
EXACT = ("lu", "cholesky", "svd", "redundant", blocked_lu.TYPE)
"""Preconditioners that one application solves with."""

LOOKING = ("monitor", "view_", "residual", "compute_", "test_")
"""Parts of names of options of a KSP that multiply with the matrix, or show it."""

_UNCLOSED: dict[int, KSP] = {}
"""KSPs over several ranks, in the order in which all ranks made them. To free one is collective, so
no rank does it when it drops the solver. PETSc ends after Python, and then it cannot free those
whose preconditioner is Python's."""


@atexit.register
def _free_all() -> None:
    for ksp in list(_UNCLOSED.values()):
        ksp.destroy()
    _UNCLOSED.clear()


def is_asked_for() -> bool:
    """Whether options speak of the KSP without a prefix; -help is one, which lists what there
    is."""
    return any(name == "help" or name.startswith(("ksp_", "pc_")) for name in given_options())


def _looks_at_matrix(prefix: str) -> bool:
    """Whether an option of the KSP of a prefix multiplies with its matrix, or shows it."""
    return any(
        option.startswith(f"{prefix}ksp_") and any(word in option for word in LOOKING)
        for option in given_options()
    )


def _orthogonalise_again(ksp: KSP) -> None:
    """Let GMRES orthogonalise again what cancels: else next to motions that contact hardly resists
    its residual stays. petsc4py has no call for it, and other methods ignore it."""
    petsc_library().KSPGMRESSetCGSRefinementType(ctypes.c_void_p(ksp.handle), 1)


class LinearSolver:
    """A PETSc KSP over one operator that may be replaced, with checked outcomes.

    It is created, and its options are read, when it is first needed: options of a KSP that never
    solves count as unused. A preconditioner that does not solve by itself takes GMRES, unless
    another method is asked for.

    Parameters
    ----------
    comm : PETSc.Comm
    prefix : str
        Options prefix: "" for the Robin solve, "elastic_" for the ρ-independent elastic one.
    stage : str
        Stage named in errors.
    ksp_type, pc_type : str
        Defaults, under what the user says.
    in_place : bool
        Whether LU may overwrite the operator (halves the memory of a factorisation).
    context : object, optional
        Of a preconditioner of type python.
    last : (k,) int array
        Numbers of the unknowns that `kept` gives.

    Raises
    ------
    InputError
        From the first solve, if an option has a value that PETSc refuses, or `preonly` goes with an
        inexact preconditioner.
    SolverError
        From the solves, if the KSP ends with a negative reason or the solution is not finite.
    """

    def __init__(
        self,
        comm: Comm,
        prefix: str,
        stage: str,
        *,
        in_place: bool = False,
        ksp_type: str = "preonly",
        pc_type: str = "lu",
        context: object = None,
        last: Index | None = None,
    ) -> None:
        self.stage, self.iterations, self.reason = stage, 0, 0
        self._comm, self._prefix, self._in_place, self._context = comm, prefix, in_place, context
        self._is_alone = comm.getSize() == 1  # its end may come after that of the communicator
        self._types, self._last = (ksp_type, pc_type), np.arange(0) if last is None else last
        self._ksp: KSP | None = None
        self._corrected = False
        self._owned: list[Mat] = []
        self._blocked: blocked_lu.BlockedLU | None = None

    @property
    def ksp(self) -> KSP:
        """The PETSc KSP."""
        if self._ksp is None:
            self._ksp = petsc().KSP().create(self._comm)
            if self._comm.getSize() > 1:
                _UNCLOSED[id(self._ksp)] = self._ksp
            try:
                self._configure(self._ksp)
            except petsc().Error as error:
                raise options_error(self._prefix, error) from error
        return self._ksp

    @property
    def kind(self) -> str:
        """KSP and PC by their types; empty as long as nothing was solved."""
        return (
            ""
            if self._ksp is None
            else f"KSP {self._ksp.getType()}, PC {self._ksp.getPC().getType()}"
        )

    def _configure(self, ksp: KSP) -> None:
        pc, database = ksp.getPC(), petsc().Options(self._prefix)
        blocked_lu.register()
        ksp.setOptionsPrefix(self._prefix)
        ksp.setType(self._types[0])
        pc.setType(self._types[1])
        ksp.setTolerances(rtol=1e-12, atol=0.0, max_it=2000)
        ksp.setFromOptions()
        name = pc.getType()
        if name == "python":
            pc.setPythonContext(self._context)
        elif ksp.getType() == "preonly" and name not in EXACT:
            if database.hasName("ksp_type"):
                raise InputError(
                    f"-{self._prefix}ksp_type preonly: needs a preconditioner that solves by "
                    f"itself (-{self._prefix}pc_type lu); with -{self._prefix}pc_type {name} use "
                    f"-{self._prefix}ksp_type gmres"
                )
            ksp.setType("gmres")
            ksp.setFromOptions()
        if not database.hasName("ksp_gmres_cgs_refinement_type"):
            _orthogonalise_again(ksp)
        self._prepare(pc, ksp.getType() == "preonly")

    def _prepare(self, pc: PC, alone: bool) -> None:
        """An LU for what PETSc has none of, or in the place of a matrix that nothing else needs."""
        name, database = pc.getType(), petsc().Options(self._prefix)
        several = self._comm.getSize() > 1
        in_place = self._in_place and alone and not _looks_at_matrix(self._prefix)
        if name == blocked_lu.TYPE and several:
            lu = blocked_lu.BlockedLU(self._comm, self.stage, self._last, in_place=in_place)
            pc.setPythonContext(lu)
            self._blocked = lu if alone else None
        elif name == blocked_lu.TYPE:
            pc.setType("lu")  # PETSc has one for one rank
        elif name == "lu" and several:
            pc.setType("redundant")  # PETSc has no LU of dense matrices over ranks
        if pc.getType() == "lu" and in_place:
            if not database.hasName("pc_factor_mat_solver_type"):
                pc.setFactorSolverType("petsc")
            if not database.hasName("pc_factor_in_place"):
                # petsc4py has no call for it
                petsc_library().PCFactorSetUseInPlace(ctypes.c_void_p(pc.handle), 1)

    def set_operator(self, matrix: Mat, *, corrected: bool = False) -> None:
        """Solve with this matrix from now on: LU is computed at the next solve, or if `corrected`
        GMRES takes the LU of the matrix before as its preconditioner."""
        self.ksp.setOperators(matrix)
        if corrected != self._corrected:  # else options decide
            self.ksp.getPC().setReusePreconditioner(corrected)
            self.ksp.setType("gmres" if corrected else self._types[0])
            _orthogonalise_again(self.ksp)
            self._corrected = corrected

    def solved(self, rhs: Array) -> Array:
        """operator⁻¹ of this rank's rows of a right-hand side, on every rank. Collective."""
        solution, right = vectors = self.ksp.getOperators()[0].createVecs()
        right.setArray(rhs)
        try:
            self.solve(right, solution)
            return everywhere(np.array(solution.getArray(readonly=True)), self._comm)
        finally:
            for vector in vectors:
                vector.destroy()

    def solve(self, rhs: Vec, solution: Vec) -> None:
        """operator · solution = rhs."""
        self._guard(lambda: self.ksp.solve(rhs, solution))
        self.iterations = self.ksp.getIterationNumber()
        self._check(solution)

    def begun(self, rhs: Array) -> Array:
        """What `kept` and `combined` make operator⁻¹ of some right-hand sides from: all of it, or
        where our LU solves alone its forward substitution. Collective.

        Parameters
        ----------
        rhs : (c, rows) array
            This rank's rows of each; of no use afterwards.
        """
        self._guard(self.ksp.setUp)
        if self._blocked is not None:
            return self._blocked.begun(rhs)
        result, operator = np.empty(rhs.shape), self.ksp.getOperators()[0]
        own = slice(*operator.getOwnershipRange())
        if self.ksp.getType() == "preonly":
            pair = [on_memory(array, operator.getSize()[0], self._comm) for array in (rhs, result)]
            self._guard(lambda: self.ksp.getPC().matApply(*pair))
            for matrix in pair:
                matrix.destroy()
            give_back(rhs)
            return result
        for column, column_result in zip(rhs, result, strict=True):
            column_result[:] = self.solved(column)[own]
        return result

    def kept(self, begun: Array) -> Array:
        """The unknowns `last` of all columns, (k, c), on every rank. Collective."""
        if self._blocked is not None:
            return self._blocked.kept(begun)
        return np.asarray(everywhere(begun.T, self._comm).T[:, self._last].T)

    def combined(self, *pairs: tuple[Array, Array]) -> Array:
        """All unknowns of operator⁻¹ (B_1 y_1 + B_2 y_2 + ...), (n, ...), on every rank, from what
        was `begun` with each B, and its y (c, ...). Collective."""
        if self._blocked is not None:
            return self._blocked.combined(*pairs)
        return everywhere(np.sum([begun.T @ y for begun, y in pairs], axis=0), self._comm)

    def owned(self, item: T) -> T:
        """A PETSc object that lives as long as this solver."""
        self._owned.append(item)
        return item

    def close(self) -> None:
        """Free the KSP, its preconditioner, and what it owns."""
        _UNCLOSED.pop(id(self._ksp), None)
        self._free()

    def _free(self) -> None:
        if self._ksp is not None:
            self._ksp.destroy()
            self._ksp = None
        while self._owned:
            self._owned.pop().destroy()

    def __del__(self) -> None:
        """One rank frees what nobody closed: petsc4py would keep it until PETSc ends.

        At the end of Python the names of this module may be gone before its last solver.
        """
        if self._is_alone:
            self._free()

    def _guard(self, call: Callable[[], object]) -> None:
        meet(f"the KSP of prefix {self._prefix!r}", self._comm)
        try:
            call()
        except petsc().Error as error:
            raise solver_error(self.stage, error, self._prefix) from error

    def _check(self, solution: Vec) -> None:
        self.reason = self.ksp.getConvergedReason()
        if self.reason < 0:
            name = (
                f"KSP {self.ksp.getType()} ended with {reason_name(self.reason)} after "
                f"{self.iterations} iterations"
            )
            ours = f"-{self._prefix}"
            # what is known by its products only has no LU
            by_products = self.ksp.getOperators()[0].getType() == "python"
            other = (
                "-bem_mat_type dense" if by_products else f"{ours}ksp_type preonly {ours}pc_type lu"
            )
            raise SolverError(
                self.stage, name, f"try {other}, or look with {ours}ksp_monitor_true_residual"
            )
        if solution is not None and not np.isfinite(solution.norm()):
            raise SolverError(
                self.stage,
                "the solution is not finite (KSP_DIVERGED_NANORINF)",
                "look at the data and the mesh",
            )


class SolverFront:
    """What leaves its solves to another solver, and reports how the last one ended as that does."""

    _solver: Any = None

    @property
    def iterations(self) -> int:
        """Iterations of the last solve; 0 without a solver."""
        return int(getattr(self._solver, "iterations", 0))

    @property
    def reason(self) -> int:
        """PETSc's number of how the last solve ended; 0 without a solver."""
        return int(getattr(self._solver, "reason", 0))

    @property
    def kind(self) -> str:
        """KSP and PC by their types; empty as long as nothing was solved."""
        return str(getattr(self._solver, "kind", ""))
