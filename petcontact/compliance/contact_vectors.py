"""Values at contact nodes, whole on every rank, out of the unknowns that each rank has."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..bem.operators import BoundaryOperators
from ..linalg.row_layout import even_ranges


class ContactVectors:
    """Where the contact nodes stand among the unknowns, which are split by whole nodes over the
    ranks."""

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        nodes, k = operators.data.contact_nodes, operators.data.contact_directions.shape[1]
        rank, ranks = comm.getRank(), comm.getSize()
        owned = even_ranges(operators.mesh.n_nodes, ranks)[rank]
        self.here = slice(*(k * int(place) for place in np.searchsorted(nodes, owned)))
        self.local_unknowns = (
            operators.data.contact_unknowns[self.here] - operators.kernel.dim * owned[0]
        )
        self._mpi = comm.tompi4py() if ranks > 1 else None

    def everywhere(self, local: Array) -> Array:
        """The whole array on every rank from each rank's rows."""
        return (
            np.array(local)
            if self._mpi is None
            else np.concatenate(self._mpi.allgather(np.array(local)))
        )
