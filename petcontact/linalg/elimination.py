"""Dense elimination by LAPACK of all unknowns but a few."""

from __future__ import annotations

import copy
import ctypes
import functools
from typing import Any

import numpy as np
import scipy

from .. import native
from ..arrays import Array, Index
from ..errors import SolverError
from ..runtime.threads import SMALL

PANEL, BLOCK = 32, 128
"""Columns of native/lu.c."""
_forth, _back = (
    native.function("petcontact_lu", "ppiippppp"),
    native.function("petcontact_back", "piipiipp"),
)


class Elimination:
    """x = A⁻¹ (b s + B y): LU with some unknowns last, known after forward substitution and a small
    solve, at half the price of all; the others follow from one back substitution for each y that
    asks for them.

    Parameters
    ----------
    system : (n, n) array
        A by columns (Fortran's order), overwritten.
    rhs : (n, m + K) array
        B and b side by side, likewise.
    m : int
    kept : (k,) int array
        Numbers of the unknowns that go last.

    Attributes
    ----------
    influence : (k, m) array
        Their rows of A⁻¹ B.
    at_rest : (k, K) array
        The same of A⁻¹ b.

    Raises
    ------
    SolverError
        If A is singular, or the solution not finite.
    """

    def __init__(self, system: Array, rhs: Array, m: int, kept: Index) -> None:
        n = len(system)
        inner = n - len(kept)
        stays = np.zeros(n, dtype=bool)
        stays[kept] = True
        out, into = np.flatnonzero(stays[:inner]), inner + np.flatnonzero(~stays[inner:])
        by_column = system.T  # one after another in memory
        by_column[into], by_column[out] = by_column[out], by_column[into]
        self._order = np.arange(n)
        self._order[into], self._order[out] = out, into
        self._kept = np.argsort(self._order)[kept]
        self._by_panels = n <= SMALL and system.flags.f_contiguous and _routines() is not None
        half_solved, info = self._factored(system, rhs)
        if info > 0:
            raise SolverError(
                "factor",
                f"zero pivot in LU (row {info})",
                "the matrix is singular: is the body fixed?",
            )
        self._forward, self._load = half_solved[:, :m], half_solved[:, m:]
        self.influence, self.at_rest = np.split(self._corner_solved(half_solved), [m], axis=1)

    def with_load(self, load: Array) -> Elimination:
        """The same matrix and columns with another load (n, K), which is overwritten.

        Raises
        ------
        SolverError
            If the solution is not finite.
        """
        other = copy.copy(self)
        other._load = self._half_solved(load)
        other.at_rest = self._corner_solved(other._load)
        return other

    def _factored(self, system: Array, rhs: Array) -> tuple[Array, int]:
        """L⁻¹ P rhs in its place, with L and U in that of the system, and the row of a zero pivot,
        from 1 on, or 0."""
        if not self._by_panels:
            self._lu, self._swaps, info = scipy.linalg.lapack.dgetrf(system, overwrite_a=True)
            return self._half_solved(rhs), info
        self._lu, self._swaps = system, np.empty(len(system), dtype=np.int32)
        return self._panel_by_panel(rhs)

    def _panel_by_panel(self, rhs: Array, *, factored: bool = False) -> tuple[Array, int]:
        """As `_factored`, of a matrix that may be factored already."""
        assert _forth is not None
        (n, width), (factor, product) = rhs.shape, _routines() or (None, None)
        rhs, info, work = (
            np.asfortranarray(rhs),
            np.empty(1, dtype=np.int64),
            np.empty(PANEL * (BLOCK + n + width)),
        )
        matrix, columns, *others = map(native.pointer, (self._lu, rhs, self._swaps, info, work))
        _forth(matrix, columns, n, width, *others, None if factored else factor, product)
        return rhs, int(info[0])

    def _half_solved(self, rhs: Array) -> Array:
        """L⁻¹ P rhs, in its place."""
        if self._by_panels:
            return self._panel_by_panel(rhs, factored=True)[0]
        swapped = scipy.linalg.lapack.dlaswp(rhs, self._swaps, overwrite_a=True)
        return np.asarray(
            scipy.linalg.blas.dtrsm(1.0, self._lu, swapped, lower=1, diag=1, overwrite_b=1)
        )

    def _corner_solved(self, half_solved: Array) -> Array:
        """The unknowns that are kept."""
        inner = len(self._order) - len(self._kept)
        answer = self._back_solved(self._lu[inner:, inner:], half_solved[inner:])[
            self._kept - inner
        ]
        if not np.isfinite(answer).all():
            raise SolverError(
                "factor", "the solution is not finite", "look at the data and the mesh"
            )
        return np.asarray(answer)

    def _back_solved(self, upper: Array, half_solved: Array) -> Array:
        """U⁻¹ of some columns, for the last rows and columns of U."""
        if not self._by_panels:
            return np.asarray(scipy.linalg.blas.dtrsm(1.0, np.asfortranarray(upper), half_solved))
        assert _back is not None
        result, (_, product) = np.array(half_solved, order="F"), _routines() or (None, None)
        (n, width), work = result.shape, np.empty(PANEL * (PANEL + half_solved.shape[1]))
        matrix, columns, room = map(native.pointer, (upper, result, work))
        _back(matrix, len(self._lu), n, columns, n, width, room, product)
        return result

    def unknowns(self, shares: Array, y: Array) -> Array:
        """x (n, ...) for loads weighted by `shares` (K, ...) and y (m, ...), one or several
        columns."""
        rhs = self._load @ shares + self._forward @ y
        result = np.empty_like(rhs)
        if rhs.ndim == 1:
            result[self._order] = scipy.linalg.blas.dtrsv(self._lu, rhs)
        else:
            result[self._order] = self._back_solved(self._lu, rhs)
        return result


@functools.cache
def _routines() -> tuple[int, int] | None:
    """Where LAPACK's dgetrf and the BLAS' dgemm begin, for code in C; None where they are not, or
    take other integers."""
    from scipy.linalg import cython_blas, cython_lapack

    capsules: list[Any] = [cython_lapack.__pyx_capi__["dgetrf"], cython_blas.__pyx_capi__["dgemm"]]
    name_of, address_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    address_of.restype, address_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    names = [name_of(capsule) for capsule in capsules]
    if _forth is None or any(b"int *" not in name for name in names):
        return None
    factor, product = (
        address_of(capsule, name) for capsule, name in zip(capsules, names, strict=True)
    )
    return factor, product
