"""The direct solver of a compressed square operator."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from .elimination import eliminate
from .matrix import HODLR
from .subtrees import Forest


class Factorisation:
    """The inverse of a compressed square operator; `factor` makes one."""

    def __init__(self, forest: Forest) -> None:
        self._forest = forest

    def solve(self, b: Array) -> Array:
        """Return H⁻¹ b for this rank's share of b (n,) or of columns (n, s). Collective."""
        return self._forest.sweep(b)

    @property
    def nbytes(self) -> int:
        """Memory beyond that of the matrix, on all ranks [bytes]. Collective."""
        return sum(self._forest.workers.gather([self._forest.nbytes]))


def factor(matrix: HODLR, *, use_up: bool = False) -> Factorisation:
    """Factorise a compressed square operator, with the threads and ranks that it was compressed on.
    Collective.

    The factorisation shares the bases of the matrix. It needs nothing else of it: with `use_up` the
    matrix gives up its dense blocks level by level, which spares memory, and can multiply no more.

    Raises
    ------
    ValueError
        If a node has not as many columns as rows.
    numpy.linalg.LinAlgError
        If a block to eliminate is singular.
    """
    if not matrix.operator.square:
        raise ValueError(
            "only an operator with as many columns as rows at every node can be factorised"
        )
    workers = matrix.workers
    parts = workers.map(lambda part: eliminate(part, [], use_up), matrix.parts)
    top = None
    if matrix.top is not None:
        top = eliminate(matrix.top, workers.gather([part.left[0] for part in parts]), use_up)
    left = np.array(workers.gather([len(part.left[0].values) for part in parts]))
    return Factorisation(matrix.forest.like(parts, top, left))
