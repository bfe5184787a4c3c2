"""Dense PETSc matrices by rows over the ranks, on memory that numpy has filled."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..runtime.petsc import petsc
from ..runtime.ranks import meet
from ..untyped import Comm, Mat
from .row_layout import even_ranges


def on_memory(columns: Array, size: int, comm: Comm) -> Mat:
    """A dense PETSc Mat (size, c) on the memory of this rank's rows of it, which are given by
    columns (c, rows); assembled. Collective."""
    count, local = columns.shape
    own = local if count == size else petsc().DECIDE
    layout = ((local, size), (own, count))
    result = petsc().Mat().createDense(layout, array=columns.T, comm=comm)
    meet("a matrix", comm)
    result.assemble()
    return result


def distributed(matrix: Array, comm: Comm = None) -> Mat:
    """A dense PETSc Mat (m, n) of an array that every rank has, assembled; PETSc.COMM_WORLD by
    default. Collective."""
    comm = comm if comm is not None else petsc().COMM_WORLD
    first, last = even_ranges(len(matrix), comm.getSize())[comm.getRank()]
    return on_memory(np.ascontiguousarray(matrix[first:last].T), len(matrix), comm)
