"""Entries of a matrix: functions that fill blocks, compiled or in Python."""

from __future__ import annotations

import ctypes
from typing import Protocol

import numpy as np

from ...arrays import AnyArray, Array, Index


class Entries(Protocol):
    """Blocks of a matrix with d rows and d columns for each node. Certain nodes have further
    columns, which are stored beside the others.

    Attributes
    ----------
    components : int
        d.
    beside : (n + 1,) array
        Node i has the columns beside[i] to beside[i + 1] - 1 among those beside.
    compiled : (int, int) or None
        Addresses of a C function `Filler` (see native/hmatrix.c) and of its context.
    """

    @property
    def components(self) -> int: ...
    @property
    def beside(self) -> Index: ...
    @property
    def compiled(self) -> tuple[int, int] | None: ...

    def fill(self, rows: Index, columns: Index, system: Array | None, beside: Array | None) -> None:
        """Fill the arrays that are not None.

        Parameters
        ----------
        rows, columns : (m,) and (k,) arrays
            Nodes, increasing.
        system : (k, d, m, d) array or None
            By column, direction, row and component.
        beside : (q, m, d) array or None
            The columns beside of the column nodes, one after another.
        """
        ...


def block(entries: Entries, rows: Index, columns: Index) -> Array:
    """Return all entries of a block by columns, (d k + q, d m). The q columns beside come last."""
    d, (k, m) = entries.components, (len(columns), len(rows))
    q = int(np.diff(entries.beside)[columns].sum())
    whole = np.empty((d * k + q, d * m))
    entries.fill(rows, columns, whole[: d * k].reshape(k, d, m, d), whole[d * k :].reshape(q, m, d))
    return whole


_POINTER, _NUMBER = ctypes.c_void_p, ctypes.c_int64
_FILLER = ctypes.CFUNCTYPE(None, _POINTER, _NUMBER, _POINTER, _NUMBER, _POINTER, _POINTER, _POINTER)


class Callback:
    """A C function that calls `fill` of entries without compiled code. It stores an exception in
    `error`."""

    def __init__(self, entries: Entries) -> None:
        self.error: Exception | None = None
        self._function = _FILLER(self._fill)
        self._entries = entries
        address = ctypes.cast(self._function, ctypes.c_void_p).value
        assert address is not None
        self.addresses = address, 0

    def _fill(
        self,
        context: object,
        m: int,
        rows: int,
        k: int,
        columns: int,
        system: int | None,
        beside: int | None,
    ) -> None:
        entries = self._entries
        try:
            d = entries.components
            row = _array(rows, m, np.int64)
            column = _array(columns, k, np.int64)
            q = int((entries.beside[column + 1] - entries.beside[column]).sum())
            entries.fill(
                row,
                column,
                None if not system else _array(system, k * d * m * d).reshape(k, d, m, d),
                None if not beside else _array(beside, q * m * d).reshape(q, m, d),
            )
        except Exception as error:  # C cannot raise it
            self.error = error

    def check(self) -> None:
        """Raise the exception of a call from C, if there was one."""
        if self.error is not None:
            raise self.error


def _array(address: int, count: int, dtype: type = np.float64) -> AnyArray:
    number = ctypes.c_int64 if dtype is np.int64 else ctypes.c_double
    return (
        np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(number)), (count,))
        if count
        else np.empty(0, dtype)
    )
