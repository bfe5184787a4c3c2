"""A `ColumnFiller` that is one compiled function and what it knows of a mesh."""

from __future__ import annotations

import numpy as np

from .. import native
from ..arrays import AnyArray, Array, Index
from .kernel import ColumnData


def data_members(data: ColumnData) -> list[AnyArray]:
    """The last members of such a struct: what makes columns out of G and H."""
    return [
        native.contiguous(data.traction_known, np.int64), native.contiguous(data.frame),
        native.contiguous(data.rhs_first, np.int64), native.contiguous(data.rhs_traction),
        native.contiguous(data.rhs_displacement),
    ]  # fmt: skip


class CompiledFiller:
    """A function of C and the struct that it reads.

    Parameters
    ----------
    name : str
        Of a function of the library with the arguments `native.FILLER`.
    mesh : native.Record
    kept : object
        What the struct points to beyond its members.
    """

    def __init__(self, name: str, mesh: native.Record, kept: object = None) -> None:
        function, address = native.function(name, native.FILLER), native.address(name)
        assert function is not None and address is not None
        self._function, self._mesh, self._kept = function, mesh, kept
        self.compiled: tuple[int, int] | None = address, mesh.address

    def fill(self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None) -> None:
        """As in `ColumnFiller`."""
        rows, columns = native.contiguous(rows, np.int64), native.contiguous(columns, np.int64)
        self._function(
            self._mesh.address, len(rows), native.pointer(rows), len(columns), native.pointer(columns),
            native.pointer(system), native.pointer(right_hand_sides),
        )  # fmt: skip
