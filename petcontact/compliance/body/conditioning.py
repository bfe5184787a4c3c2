"""The number of digits that an elimination loses, measured on a known solution.

The residual of an ill-conditioned system is small for any solution. The error of a known solution
is not. Its unknowns have random signs and equal weight in the equations. The error is then about
the round-off times the condition number of the system with columns of equal length.

Source: N. J. Higham, Accuracy and stability of numerical algorithms, 2nd ed., section 7.3.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...linalg.row_layout import summed
from ...untyped import Comm


def known_solution(columns: Array, comm: Comm) -> Array:
    """Return unknowns (q,) of random sign, inverse to the lengths of their columns.

    `columns` (q, rows) holds the rows of this rank.
    """
    squares = np.einsum("ij,ij->i", columns, columns)
    length = np.sqrt(summed(squares, comm))
    signs = np.random.default_rng(1912).choice([-1.0, 1.0], len(columns))
    return np.asarray(signs / np.where(length > 0.0, length, 1.0))


def forward_error(computed: Array, exact: Array) -> float:
    """Return the largest relative error of the unknowns (q,) [-]."""
    return float(np.abs(computed / exact - 1.0).max(initial=0.0))
