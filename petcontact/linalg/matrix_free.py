"""A PETSc KSP over functions of whole vectors: the ranks share its vectors, or every rank iterates
alike."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..runtime.petsc import petsc
from ..untyped import PC, Comm, Mat, Vec, Viewer
from .ksp import LinearSolver, SolverFront
from .row_layout import even_ranges, everywhere

RESTART = 200
"""Directions that GMRES keeps: its products are worth more than these vectors."""


class Krylov(SolverFront):
    """A KSP (GMRES unless the options say otherwise) over functions of whole arrays of one shape.

    Parameters
    ----------
    shape : tuple of int
    prefix : str
        Of its options.
    comm : PETSc.Comm, optional
        Of the ranks that share the vectors; by default every rank iterates alike.
    text : str
        What `-ksp_view` says of the matrix and of the preconditioner.
    """

    def __init__(
        self, shape: tuple[int, ...], prefix: str, comm: Comm = None, text: str = ""
    ) -> None:
        comm, size = petsc().COMM_SELF if comm is None else comm, math.prod(shape)
        self._shape, self._prefix, self._text = shape, prefix, text
        self._product: Callable[[Array], Array] = np.copy
        self._precondition: Callable[[Array], Array] = np.copy
        self._comm = comm
        first, last = even_ranges(size, comm.getSize())[comm.getRank()]
        self._own, layout = slice(first, last), (last - first, size)
        self._solver: LinearSolver = LinearSolver(
            comm, prefix, "iterate", ksp_type="gmres", pc_type="python", context=self
        )
        matrix = petsc().Mat().createPython((layout, layout), context=self, comm=comm)
        matrix.setUp()
        self._matrix = self._solver.owned(matrix)

    def mult(self, matrix: Mat, x: Vec, y: Vec) -> None:
        """The matrix of type python."""
        y.setArray(self._product(self._whole(x)).ravel()[self._own])

    def apply(self, pc: PC, x: Vec, y: Vec) -> None:
        """The preconditioner of type python."""
        y.setArray(self._precondition(self._whole(x)).ravel()[self._own])

    def view(self, matrix: Mat, viewer: Viewer) -> None:
        """The line of -ksp_view."""
        viewer.printfASCII(f"    {self._text}\n")

    def solve(
        self,
        product: Callable[[Array], Array],
        precondition: Callable[[Array], Array],
        rhs: Array,
        floor: float,
        rtol: float,
    ) -> Array:
        """x with product(x) = rhs; `floor` is a residual that is round-off already. Collective."""
        self._product, self._precondition = product, precondition
        given = petsc().Options(self._prefix)
        if not self._solver.kind:
            self._solver.set_operator(self._matrix)
            if not given.hasName("ksp_gmres_restart"):
                self._solver.ksp.setGMRESRestart(RESTART)
        self._solver.ksp.setTolerances(rtol=None if given.hasName("ksp_rtol") else rtol, atol=floor)
        return self._solver.solved(rhs.ravel()[self._own]).reshape(self._shape)

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()

    def _whole(self, vector: Vec) -> Array:
        return everywhere(vector.getArray(readonly=True), self._comm).reshape(self._shape)
