"""Systems [[A, B], [C, 0]] with few columns B and rows C, A by its products, arrays of any shape
for vectors."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..untyped import Comm
from .ksp import SolverFront
from .matrix_free import Krylov

Map = Callable[[Array], Array]


class BorderedElimination:
    """y and c with A y + B c = rhs and C y = work, by an inverse of A that need not be exact: C y =
    work whatever it is.

    Parameters
    ----------
    inverse : callable
    columns, rows : (q, ...) arrays
        B and C, one array of the shape of y each.
    """

    def __init__(self, inverse: Map, columns: Array, rows: Array) -> None:
        shape = len(rows), math.prod(rows.shape[1:])
        self._inverse, self._rows = inverse, rows.reshape(shape)
        self._solved = np.array([inverse(column) for column in columns]).reshape(shape)
        self._coordinates = np.linalg.pinv(self._rows @ self._solved.T)

    def __call__(self, rhs: Array, work: Array) -> tuple[Array, Array]:
        """Return the solution y and the multipliers c (q,) of a right-hand side."""
        y = self._inverse(rhs)
        c = self._coordinates @ (self._rows @ y.ravel() - work)
        return y - (c @ self._solved).reshape(y.shape), c


class BorderedKrylov(SolverFront):
    """A KSP of a prefix (GMRES unless the options say otherwise), preconditioned by an inverse of
    A.

    Parameters
    ----------
    shape : tuple of int
        Of y.
    most : int
        Largest q.
    prefix, comm, text
        As of `Krylov`.
    """

    def __init__(
        self, shape: tuple[int, ...], most: int, prefix: str, comm: Comm = None, text: str = ""
    ) -> None:
        self._shape, self._n = shape, math.prod(shape)
        self._size = self._n + most
        self._solver = Krylov((self._size,), prefix, comm, text)

    def solve(
        self,
        product: Map,
        inverse: Map,
        columns: Array,
        rows: Array,
        rhs: Array,
        work: Array,
        floor: float,
        rtol: float,
    ) -> tuple[Array, Array]:
        """y and c as of `BorderedElimination`; C y = work to round-off.

        `floor` is a residual that is round-off already.
        """
        n, q, shape = self._n, len(work), self._shape
        eliminated, flat = BorderedElimination(inverse, columns, rows), rows.reshape(q, n)

        def whole_product(z: Array) -> Array:
            y, result = z[:n].reshape(shape), z.copy()
            result[:n] = (product(y) + np.tensordot(z[n : n + q], columns, 1)).ravel()
            result[n : n + q] = flat @ y.ravel()
            return result

        def whole_inverse(z: Array) -> Array:
            result = z.copy()
            y, result[n : n + q] = eliminated(z[:n].reshape(shape), z[n : n + q])
            result[:n] = y.ravel()
            return result

        right = np.zeros(self._size)
        right[:n], right[n : n + q] = rhs.ravel(), work
        solved = self._solver.solve(whole_product, whole_inverse, right, floor, rtol)
        y = solved[:n].reshape(shape)
        return y + eliminated(np.zeros(shape), work - flat @ y.ravel())[0], solved[n : n + q]

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
