"""The dense operators: A_0, G_Ct and the load as PETSc matrices, filled in place, each rank its own rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from ..linalg.row_layout import node_ranges
from ..runtime.petsc import petsc
from .operators import BLOCK, BoundaryOperators


@dataclass(frozen=True)
class DenseBlocks:
    """By rows over ranks: A_0 (dn, dn), G_Ct times `traction_scale` (dn, mk), the load (dn,)."""

    system: Any
    contact: Any
    load: Any


def assemble_dense(operators: BoundaryOperators, comm: Any) -> DenseBlocks:
    """A_0, G_Ct and the load as dense PETSc objects, filled in place in PETSc's memory, each rank its own rows."""
    module = petsc()
    n, d, columns = operators.mesh.n_nodes, operators.kernel.dim, operators.contact_columns
    (m, k), (rank, size) = operators.data.contact_directions.shape, (comm.getRank(), comm.getSize())
    first, last = node_ranges(n, size)[rank]
    contact_first, contact_last = node_ranges(m, size, k)[rank]
    rows = (d * (last - first), d * n)
    # every entry of A_0 is written: no need for PETSc's zeros
    blocks = DenseBlocks(
        module.Mat().createDense((rows, rows), array=np.empty(rows, order="F"), comm=comm),
        module.Mat().createDense((rows, (contact_last - contact_first, m * k)), comm=comm),
        module.Vec().createMPI(rows, comm=comm),
    )
    # set up first: before it PETSc has no leading dimension to give
    blocks.system.setUp()
    blocks.contact.setUp()
    system = blocks.system.getDenseArray().T.reshape(n, d, last - first, d)
    contact = blocks.contact.getDenseArray().T.reshape(m * k, last - first, d)
    load = np.zeros((last - first, d))
    whole: dict[str, Array] = {}
    if (compiled := operators.filler(columns)) is not None:
        compiled.fill(np.arange(first, last), np.arange(n), system, contact)
    else:
        whole = {"system": system, "right_hand_sides": contact}
    column_blocks = operators.blocks(columns)
    for a in range(first, last, BLOCK[0]):
        nodes = np.arange(a, min(a + BLOCK[0], last))
        local = slice(a - first, a - first + len(nodes))
        for block in column_blocks:
            operators.fill(nodes, block, load=load[local], **{name: array[..., local, :] for name, array in whole.items()})
    blocks.load.setArray(load.ravel())
    for matrix in (blocks.system, blocks.contact, blocks.load):
        matrix.assemble()
    return blocks
