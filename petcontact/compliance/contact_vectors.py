"""Vectors on Γ_C between numpy (whole, on every rank) and PETSc (by rows over the ranks)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..bem.operators import BoundaryOperators
from ..linalg.row_layout import node_ranges, redistribute
from ..runtime.petsc import petsc


class ContactVectors:
    """Vectors on Γ_C between numpy (whole (m, k), on every rank) and PETSc (split by whole nodes over the ranks)."""

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        nodes, (m, k) = operators.data.contact_nodes, operators.data.contact_directions.shape
        self.comm, self.shape, self.size = comm, (m, k), m * k
        rank, ranks = comm.getRank(), comm.getSize()
        self.even = node_ranges(m, ranks, k)
        self.owned = slice(*self.even[rank])
        # where u_t stands among the unknowns of this rank's nodes, and which contact nodes those are on every rank
        node_owner = node_ranges(operators.mesh.n_nodes, ranks)
        self.by_node = [tuple(k * int(place) for place in np.searchsorted(nodes, bounds)) for bounds in node_owner]
        mine = slice(*self.by_node[rank])
        self.local_unknowns = operators.data.contact_unknowns[mine] - operators.kernel.dim * node_owner[rank][0]
        self._mpi = comm.tompi4py() if ranks > 1 else None

    @property
    def layout(self) -> tuple[int, int]:
        """Local and global size of a contact vector."""
        return self.owned.stop - self.owned.start, self.size

    def everywhere(self, local: Array) -> Array:
        """The whole array on every rank from each rank's rows."""
        return np.array(local) if self._mpi is None else np.concatenate(self._mpi.allgather(np.array(local)))

    def contact_rows(self, unknowns: Array) -> Array:
        """Rows of u_t out of the local rows of unknowns, moved to the even layout of contact vectors."""
        return redistribute(unknowns[self.local_unknowns], self.by_node, self.even, self.comm)  # type: ignore[arg-type]

    def vector(self, values: Array) -> Any:
        """A PETSc vector of a whole (m, k) array; the caller destroys it."""
        vector = petsc().Vec().createMPI(self.layout, comm=self.comm)
        vector.setArray(values.ravel()[self.owned])
        return vector

    def gather(self, vector: Any) -> Array:
        """The whole (m, k) array of a PETSc vector, which is destroyed."""
        whole = self.everywhere(vector.getArray(readonly=True)).reshape(self.shape)
        vector.destroy()
        return whole
