"""Equations with I + ρS for many ρ: S in Hessenberg's form once, then O(n²) for each.

S = Q H Qᵀ with Q orthogonal and H zero below its first subdiagonal costs about eight LUs; I + ρS =
Q (I + ρH) Qᵀ is then solved by combining neighbouring columns (Henry, "The shifted Hessenberg
system solve computation", 1994).
"""

from __future__ import annotations

import numpy as np
import scipy

from .. import native
from ..arrays import Array
from ..errors import SolverError

_solve = native.function("petcontact_hessenberg_solve", "DidDD")


class HessenbergForm:
    """S = Q H Qᵀ of a matrix (n, n).

    Examples
    --------
    >>> form = HessenbergForm(np.array([[2.0, 1.0], [0.0, 1.0]]))
    >>> x, product = form.solve(1.0, np.array([4.0, 2.0]))
    >>> x.round(12).tolist(), product.round(12).tolist()
    ([1.0, 1.0], [3.0, 1.0])
    """

    def __init__(self, matrix: Array) -> None:
        form, self._basis = scipy.linalg.hessenberg(matrix, calc_q=True, check_finite=False)
        self._columns = np.ascontiguousarray(form.T)

    def solve(self, rho: float, rhs: Array) -> tuple[Array, Array]:
        """x with (I + ρS) x = rhs, and S x.

        Raises
        ------
        SolverError
            If the solution is not finite.
        """
        y = rhs @ self._basis
        _solve(self._columns, len(y), rho, y, np.empty(3 * len(y)))
        if not np.isfinite(y).all():
            raise SolverError(
                "iterate", "the solution is not finite", "look at the data and the mesh"
            )
        x, product = np.array([y, y @ self._columns]) @ self._basis.T
        return x, product
