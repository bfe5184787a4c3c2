"""The dense system of a body, its contact columns and its loads, filled in place."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Index
from .operators import BLOCK, BoundaryOperators

COLUMNS = 256
"""Nodes whose columns compiled code fills at a time."""


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

    def shared_out(beside: Array, mine: slice, here: slice) -> None:
        chosen = of_contact[mine]
        first = int(np.count_nonzero(of_contact[: mine.start]))
        contact[first : first + int(chosen.sum()), here] = beside[chosen]
        if not chosen.all():
            loads[:, here] += np.tensordot(amplitudes[mine][~chosen].T, beside[~chosen], 1)

    if operators.is_compiled:
        for first in range(0, n, COLUMNS):
            columns = np.arange(first, min(first + COLUMNS, n))
            mine = slice(int(rhs.first[first]), int(rhs.first[columns[-1]] + rhs.count[columns[-1]]))
            target = system[first : columns[-1] + 1]
            block = target if target.flags.c_contiguous else np.empty(target.shape)
            beside = np.empty((mine.stop - mine.start, len(rows), d))
            operators.fill_columns(rows, columns, block, beside)
            if block is not target:
                target[:] = block
            shared_out(beside, mine, slice(0, len(rows)))
        return
    blocks, whole = operators.blocks(), slice(0, len(rhs.node))
    for first in range(0, len(rows), BLOCK[0]):
        here = slice(first, min(first + BLOCK[0], len(rows)))
        beside = np.zeros((len(rhs.node), here.stop - here.start, d))
        for column_block in blocks:
            operators.fill(rows[here], column_block, system=system[:, :, here], right_hand_sides=beside)
        shared_out(beside, whole, here)
    operators.add_corners(rows, np.arange(n), system)
