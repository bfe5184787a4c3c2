"""The dense operators: A_0, G_Ct and the load as PETSc matrices, filled in place, each rank its own rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..linalg.row_layout import even_ranges, node_ranges
from ..runtime.petsc import petsc
from .operators import TILE, BoundaryOperators


@dataclass(frozen=True)
class DenseBlocks:
    """What the formulations need, by rows over ranks: A_0 (2n, 2n), G_Ct times `traction_scale` (2n, m), the load (2n,)."""

    system: Any
    contact: Any
    load: Any


def assemble_dense(operators: BoundaryOperators, comm: Any) -> DenseBlocks:
    """A_0, G_Ct and the load as dense PETSc objects, filled in place in PETSc's memory, each rank its own rows."""
    module = petsc()
    mesh, data = operators.mesh, operators.data
    n, m = mesh.n_nodes, len(data.contact_nodes)
    rank, size = comm.getRank(), comm.getSize()
    first, last = node_ranges(n, size)[rank]
    contact_range = even_ranges(m, size)[rank]
    rows = (2 * (last - first), 2 * n)
    blocks = DenseBlocks(
        module.Mat().createDense((rows, rows), comm=comm),
        module.Mat().createDense((rows, (contact_range[1] - contact_range[0], m)), comm=comm),
        module.Vec().createMPI(rows, comm=comm),
    )
    # set up first: before it PETSc has no leading dimension to give
    blocks.system.setUp()
    blocks.contact.setUp()
    system = blocks.system.getDenseArray().T.reshape(n, 2, last - first, 2)
    contact = blocks.contact.getDenseArray().T.reshape(m, last - first, 2)
    load = np.zeros((last - first, 2))
    tiles = operators.tiles()
    for a in range(first, last, TILE[0]):
        nodes = np.arange(a, min(a + TILE[0], last))
        local = slice(a - first, a - first + len(nodes))
        for tile in tiles:
            operators.fill(nodes, tile, system=system[:, :, local], beside=contact[:, local], load=load[local])
    blocks.load.setArray(load.ravel())
    for block in (blocks.system, blocks.contact, blocks.load):
        block.assemble()
    return blocks
