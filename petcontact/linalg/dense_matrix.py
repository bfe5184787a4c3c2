"""A dense array that every rank has, as a PETSc matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..runtime.petsc import petsc
from ..runtime.world import of_petsc
from .row_layout import even_ranges


def distributed(matrix: Array, comm: Any = None) -> Any:
    """A dense PETSc Mat (m, n) by rows over the ranks, assembled; PETSc.COMM_WORLD by default.
    Collective."""
    comm = of_petsc(comm) if comm is not None else petsc().COMM_WORLD
    rank, ranks = comm.getRank(), comm.getSize()
    (first, last), (left, right) = (even_ranges(size, ranks)[rank] for size in matrix.shape)
    sizes = ((last - first, matrix.shape[0]), (right - left, matrix.shape[1]))
    result = (
        petsc().Mat().createDense(sizes, array=np.asfortranarray(matrix[first:last]), comm=comm)
    )
    result.assemble()
    return result
