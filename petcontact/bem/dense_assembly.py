"""The dense system of a body, its contact columns and its loads, filled in place."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Index
from .operators import BoundaryOperators

COLUMNS = 256
"""Nodes whose columns are filled at a time."""


def fill_dense(operators: BoundaryOperators, rows: Index, system: Array, contact: Array, loads: Array) -> None:
    """Equations of some nodes, a whole range of them in increasing order.

    Parameters
    ----------
    operators : BoundaryOperators
    rows : (r,) array
    system : (n, d, r, d) array
        By column, direction, row and component; every entry is written.
    contact : (m k, r, d) array
        G times `traction_scale`, a column for each contact node and direction.
    loads : (K, r, d) array
        Zero before.
    """
    n, rhs, d = operators.mesh.n_nodes, operators.right_hand_sides, operators.kernel.dim
    of_contact, amplitudes = operators.of_contact, operators.amplitudes

    for first in range(0, n, COLUMNS):
        columns = np.arange(first, min(first + COLUMNS, n))
        mine = slice(int(rhs.first[first]), int(rhs.first[columns[-1]] + rhs.count[columns[-1]]))
        target = system[first : columns[-1] + 1]
        block = target if target.flags.c_contiguous else np.empty(target.shape)
        beside = np.empty((mine.stop - mine.start, len(rows), d))
        operators.fill_columns(rows, columns, block, beside)
        if block is not target:
            target[:] = block
        chosen = of_contact[mine]
        place = int(np.count_nonzero(of_contact[: mine.start]))
        count = int(np.count_nonzero(chosen))
        np.compress(chosen, beside, axis=0, out=contact[place : place + count])
        if count < len(chosen):
            loads += (amplitudes[mine].T @ beside.reshape(len(beside), -1)).reshape(loads.shape)
