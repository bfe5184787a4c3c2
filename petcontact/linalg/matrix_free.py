"""A PETSc KSP over functions of whole vectors, on COMM_SELF: every rank iterates alike."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Array
from ..runtime.petsc import petsc
from .ksp import LinearSolver

RESTART = 200
"""Directions that GMRES keeps: its products are worth more than these vectors."""


class Krylov:
    """A KSP (GMRES unless the options say otherwise) over functions of whole arrays of one shape."""

    def __init__(self, shape: tuple[int, ...], prefix: str) -> None:
        comm, size = petsc().COMM_SELF, math.prod(shape)
        self._shape, self._prefix = shape, prefix
        self._product: Callable[[Array], Array] = np.copy
        self._precondition: Callable[[Array], Array] = np.copy
        self._matrix = petsc().Mat().createPython((size, size), context=self, comm=comm)
        self._matrix.setUp()
        self._solver = LinearSolver(
            comm, prefix, "iterate", ksp_type="gmres", pc_type="python", context=_Preconditioner(self)
        )
        self._x, self._b = self._matrix.createVecs()

    @property
    def iterations(self) -> int:
        """Iterations of the last solve."""
        return self._solver.iterations

    def mult(self, matrix: Any, x: Any, y: Any) -> None:
        """The matrix of type python."""
        y.setArray(self._product(x.getArray(readonly=True).reshape(self._shape)))

    def precondition(self, x: Array) -> Array:
        """The preconditioner of type python, on flat vectors."""
        return self._precondition(x.reshape(self._shape))

    def solve(
        self, product: Callable[[Array], Array], precondition: Callable[[Array], Array], rhs: Array,
        floor: float, rtol: float,
    ) -> Array:  # fmt: skip
        """x with product(x) = rhs; `floor` is a residual that is round-off already."""
        self._product, self._precondition = product, precondition
        self._b.setArray(rhs)
        self._x.set(0.0)
        if not self._solver.kind:
            self._solver.set_operator(self._matrix)
            if not petsc().Options(self._prefix).hasName("ksp_gmres_restart"):
                self._solver.ksp.setGMRESRestart(RESTART)
        self._solver.ksp.setTolerances(rtol=rtol, atol=floor)
        self._solver.solve(self._b, self._x)
        return np.array(self._x.getArray(readonly=True)).reshape(self._shape)

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
        for item in (self._matrix, self._x, self._b):
            item.destroy()


class _Preconditioner:
    def __init__(self, owner: Krylov) -> None:
        self._owner = owner

    def apply(self, pc: Any, x: Any, y: Any) -> None:
        y.setArray(self._owner.precondition(x.getArray(readonly=True)))
