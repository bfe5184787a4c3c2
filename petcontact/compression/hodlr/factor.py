"""The direct solver of a compressed square operator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arrays import Array
from .elimination import eliminate
from .hodlr_matrix import HODLR


def factor(matrix: HODLR, *, use_up: bool = False) -> Callable[[Array], Array]:
    """Factorise a compressed square operator, with the threads and ranks that it was compressed on.
    Collective.

    The result is a function that returns H⁻¹ b for this rank's share of b (n,), or of columns
    (n, s). It is collective, too.

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
    return matrix.forest.like(parts, top, left).sweep
