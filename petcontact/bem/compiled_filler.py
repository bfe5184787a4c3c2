"""A `ColumnFiller` that is one compiled function and the arrays of a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import native
from ..arrays import Array, Index


class CompiledFiller:
    """The function of C and what it knows of one mesh; the arrays stay where they are while this lives.

    Parameters
    ----------
    function : callable
        Takes rows, columns, the arrays, the constants, and the two blocks to fill.
    arrays : sequence of (array, type)
    constants : sequence of float
    """

    def __init__(self, function: native.Compiled, arrays: Sequence[tuple[Any, type]], constants: Sequence[float]) -> None:
        self._function = function
        self._arrays = [native.contiguous(array, dtype) for array, dtype in arrays]
        self._known = [*(native.pointer(array) for array in self._arrays), *constants]

    def fill(self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None) -> None:
        """As in `ColumnFiller`."""
        rows, columns = native.contiguous(rows, np.int64), native.contiguous(columns, np.int64)
        self._function(
            len(rows), native.pointer(rows), len(columns), native.pointer(columns), *self._known,
            native.pointer(system), native.pointer(right_hand_sides),
        )  # fmt: skip

    @property
    def compiled(self) -> tuple[int, int] | None:
        """As in `ColumnFiller`."""
        return None
