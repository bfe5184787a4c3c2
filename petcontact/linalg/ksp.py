"""One KSP with petcontact's defaults: every linear solve goes through here, and none fails
silently."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError, SolverError
from ..runtime.petsc import (
    given_options,
    has_scalapack,
    options_error,
    petsc,
    reason_name,
    solver_error,
)
from ..runtime.world import of_petsc
from .row_layout import redistribute

RTOL = 1e-12
EXACT = ("lu", "cholesky", "svd", "redundant")
"""Preconditioners that one application solves with."""


def is_asked_for(prefix: str) -> bool:
    """Whether options speak of the KSP of a prefix; -help is one, which lists what there is."""
    return any(
        name == "help" or name.startswith((f"{prefix}ksp_", f"{prefix}pc_"))
        for name in given_options()
    )


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
        comm: Any,
        prefix: str,
        stage: str,
        *,
        in_place: bool = False,
        ksp_type: str = "preonly",
        pc_type: str = "lu",
        context: Any = None,
    ) -> None:
        self.stage, self.iterations, self.reason = stage, 0, 0
        self._comm, self._prefix, self._in_place, self._context = (
            of_petsc(comm),
            prefix,
            in_place,
            context,
        )
        self._types = (ksp_type, pc_type)
        self._ksp: Any = None
        self._converted: Any = None

    @property
    def ksp(self) -> Any:
        """The PETSc KSP."""
        if self._ksp is None:
            self._ksp = petsc().KSP().create(self._comm)
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

    def _configure(self, ksp: Any) -> None:
        pc, database = ksp.getPC(), petsc().Options(self._prefix)
        ksp.setOptionsPrefix(self._prefix)
        ksp.setType(self._types[0])
        pc.setType(self._types[1])
        ksp.setTolerances(rtol=RTOL, atol=0.0, max_it=2000)
        ksp.setFromOptions()
        name = pc.getType()
        if name == "python":
            pc.setPythonContext(self._context)
        elif ksp.getType() == "preonly" and name not in EXACT:
            if database.hasName("ksp_type"):
                raise InputError(
                    f"-{self._prefix}ksp_type preonly: needs a preconditioner that solves by "
                    f"itself (-{self._prefix}pc_type "
                    f"lu); with -{self._prefix}pc_type {name} use -{self._prefix}ksp_type gmres"
                )
            ksp.setType("gmres")
            ksp.setFromOptions()
        # any other KSP needs the matrix itself
        if (
            self._in_place
            and self._comm.getSize() == 1
            and (ksp.getType(), name) == ("preonly", "lu")
        ):
            if not database.hasName("pc_factor_mat_solver_type"):
                pc.setFactorSolverType("petsc")
            if not database.hasName("pc_factor_in_place"):
                _use_in_place(pc, self._prefix)

    def set_operator(self, matrix: Any) -> None:
        """Solve with this matrix from now on; LU is computed at the next solve.

        A dense LU over several ranks is ScaLAPACK's: the matrix is converted, which no option of
        PETSc does by itself. Where PETSc lacks ScaLAPACK, or has not a row for each rank, every
        rank factors a copy.
        """
        self._drop_converted()
        if (
            self._comm.getSize() > 1
            and matrix.getType() == "mpidense"
            and self.ksp.getPC().getType() == "lu"
        ):
            if has_scalapack() and self._in_even_blocks(matrix.getSize()[0]):
                self._converted = matrix = matrix.convert("scalapack", petsc().Mat())
            else:
                self.ksp.getPC().setType("redundant")
        self.ksp.setOperators(matrix)

    def solve(self, rhs: Any, solution: Any) -> None:
        """operator · solution = rhs."""
        if self._converted is None:
            self._guard(lambda: self.ksp.solve(rhs, solution))
        else:
            self._solve_converted(rhs, solution)
        self.iterations = self.ksp.getIterationNumber()
        self._check(solution)

    def solve_many(self, rhs: Any) -> Any:
        """operator · X = rhs for a dense matrix of right-hand sides; returns X, dense."""
        in_blocks = self._converted is None or self._in_even_blocks(rhs.getSize()[1])
        if self.ksp.getType() != "preonly" or not in_blocks:
            solution = rhs.duplicate()
            self._solve_columns(rhs, solution)
        elif self._converted is not None:
            solution = self._solve_scalapack(rhs)
        else:
            solution = rhs.duplicate()
            self._guard(lambda: (self.ksp.setUp(), self.ksp.getPC().matApply(rhs, solution)))
        if not np.isfinite(solution.norm()):
            raise SolverError(
                self.stage, "the solution is not finite", "look at the data and the mesh"
            )
        return solution

    def _in_even_blocks(self, count: int) -> bool:
        """Whether ScaLAPACK can share out rows or columns: equal blocks, the last rank's may be
        smaller."""
        size = int(self._comm.getSize())
        return (size - 1) * -(-count // size) <= count

    def _solve_converted(self, rhs: Any, solution: Any) -> None:
        """ScaLAPACK's matrices have a layout of their own, whatever that of the matrix they came
        from."""
        x, b = self._converted.createVecs()
        ours, theirs = self._ranges(rhs.getOwnershipRange()), self._ranges(b.getOwnershipRange())
        b.setArray(redistribute(rhs.getArray(readonly=True), ours, theirs, self._comm))
        self._guard(lambda: self.ksp.solve(b, x))
        solution.setArray(redistribute(x.getArray(readonly=True), theirs, ours, self._comm))
        x.destroy()
        b.destroy()

    def _solve_scalapack(self, rhs: Any) -> Any:
        """PCMatApply refuses ScaLAPACK's blocks: the factor is asked itself."""
        module = petsc()
        blocks = rhs.convert("scalapack", module.Mat())
        solution = blocks.duplicate()
        self._guard(
            lambda: (
                self.ksp.setUp(),
                self.ksp.getPC().getFactorMatrix().matSolve(blocks, solution),
            )
        )
        even = solution.convert("dense", module.Mat())
        result = rhs.duplicate()
        ours, theirs = self._ranges(rhs.getOwnershipRange()), self._ranges(even.getOwnershipRange())
        result.getDenseArray()[:] = redistribute(even.getDenseArray(), theirs, ours, self._comm)
        result.assemble()
        for matrix in (blocks, solution, even):
            matrix.destroy()
        return result

    def _ranges(self, mine: tuple[int, int]) -> list[tuple[int, int]]:
        return list(self._comm.tompi4py().allgather(mine))

    def _solve_columns(self, rhs: Any, solution: Any) -> None:
        b, x = rhs.createVecLeft(), rhs.createVecLeft()
        columns, results = rhs.getDenseArray(), solution.getDenseArray()
        for k in range(rhs.getSize()[1]):
            b.setArray(columns[:, k])
            self.solve(b, x)
            results[:, k] = x.getArray(readonly=True)
        solution.assemble()
        x.destroy()
        b.destroy()

    def close(self) -> None:
        """Free the KSP, its preconditioner and what was converted for it."""
        self._drop_converted()
        if self._ksp is not None:
            self._ksp.destroy()
            self._ksp = None

    def _drop_converted(self) -> None:
        if self._converted is not None:
            self._converted.destroy()
            self._converted = None

    def _guard(self, call: Any) -> None:
        try:
            call()
        except petsc().Error as error:
            raise solver_error(self.stage, error, self._prefix) from error

    def _check(self, solution: Any) -> None:
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


def _use_in_place(pc: Any, prefix: str) -> None:
    """petsc4py has no call for PCFactorSetUseInPlace: the option is set for this one PC and removed
    again."""
    database = petsc().Options()
    key = f"{prefix}pc_factor_in_place"
    database.setValue(key, "true")
    pc.setFromOptions()
    database.delValue(key)


class SolverFront:
    """What leaves its solves to another solver, and reports how the last one ended as that does."""

    _solver: Any

    @property
    def iterations(self) -> int:
        """Iterations of the last solve."""
        return int(self._solver.iterations)

    @property
    def reason(self) -> int:
        """PETSc's number of how the last solve ended."""
        return int(self._solver.reason)

    @property
    def kind(self) -> str:
        """KSP and PC by their types; empty as long as nothing was solved."""
        return str(self._solver.kind)
