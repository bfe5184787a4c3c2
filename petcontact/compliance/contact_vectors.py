"""Values at contact nodes, gathered on every rank from the unknowns of each rank."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..bem.operators import BoundaryOperators
from ..linalg.row_layout import even_ranges


class ContactVectors:
    """Places of the contact nodes among the unknowns, which are distributed over the ranks by whole
    nodes.

    Attributes
    ----------
    here : slice
        Contact components of this rank among those of all.
    local_unknowns : (n,) array
        Their numbers among the unknowns of this rank.
    """

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        nodes, k = operators.data.contact_nodes, operators.data.contact_directions.shape[1]
        rank, ranks = comm.getRank(), comm.getSize()
        owned = even_ranges(operators.mesh.n_nodes, ranks)[rank]
        self.here = slice(*(k * int(position) for position in np.searchsorted(nodes, owned)))
        self.local_unknowns = (
            operators.data.contact_unknowns[self.here] - operators.kernel.dim * owned[0]
        )
        self._mpi = comm.tompi4py() if ranks > 1 else None

    def everywhere(self, local: Array) -> Array:
        """Return the whole array on every rank, from the rows of each rank."""
        return (
            np.array(local)
            if self._mpi is None
            else np.concatenate(self._mpi.allgather(np.array(local)))
        )
