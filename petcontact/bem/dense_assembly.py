"""Assembly of the dense system of a body, its contact columns and its loads in place."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Index
from .operators import BoundaryOperators

COLUMNS = 256
"""Number of nodes whose columns are filled at a time."""


def fill_dense(
    operators: BoundaryOperators,
    rows: Index,
    system: Array | None,
    contact: Array | None,
    loads: Array,
) -> None:
    """Fill the equations of a range of nodes in increasing order. Without system and contact
    columns, fill their loads only.

    Parameters
    ----------
    operators : BoundaryOperators
    rows : (r,) array
    system : (n, d, r, d) array, optional
        By column, direction, row and component; every entry is written.
    contact : (m k, r, d) array, optional
        G times `traction_scale`, a column for each contact node and direction.
    loads : (K, r, d) array
        Zero before.
    """
    n, rhs, d = operators.mesh.n_nodes, operators.right_hand_sides, operators.kernel.dim
    of_contact, amplitudes = operators.of_contact, operators.amplitudes

    for first in range(0, n, COLUMNS):
        columns = np.arange(first, min(first + COLUMNS, n))
        if system is None:
            columns = np.intersect1d(columns, rhs.node[~of_contact])
        if not len(columns):
            continue
        own, _ = rhs.columns_of(columns)
        beside = np.empty((len(own), len(rows), d))
        chosen = of_contact[own]
        if system is None or contact is None:
            operators.fill_columns(rows, columns, None, beside)
        else:
            target = system[first : columns[-1] + 1]
            block = target if target.flags.c_contiguous else np.empty(target.shape)
            operators.fill_columns(rows, columns, block, beside)
            if block is not target:
                target[:] = block
            begin = int(np.count_nonzero(of_contact[: own[0]])) if len(own) else 0
            taken = np.flatnonzero(chosen)
            # "clip": what may raise is written to a buffer first
            np.take(beside, taken, axis=0, out=contact[begin : begin + len(taken)], mode="clip")
        if not chosen.all():
            loads += (amplitudes[own].T @ beside.reshape(len(beside), -1)).reshape(loads.shape)
