"""Columns of the boundary operators of straight elements of order 0, a whole block of them in one compiled call."""

from __future__ import annotations

import numpy as np

from ... import native
from ...arrays import Array, Index
from ...mesh.curve_mesh import CurveMesh
from ..kernel import ColumnData
from .kernel import Kelvin2D

_columns = native.function("petcontact_columns", "ipipppppppppp" + "ddpp")


class CompiledColumns:
    """A `ColumnFiller` over one mesh, whose arrays stay where they are while this lives."""

    def __init__(self, mesh: CurveMesh, data: ColumnData, poisson_ratio: float, length: float) -> None:
        self._constants = poisson_ratio, length
        real = (data.frame, data.rhs_traction, data.rhs_displacement)
        frame, traction, displacement = (native.contiguous(a) for a in real)
        known, rhs_first = (native.contiguous(a, np.int64) for a in (data.traction_known, data.rhs_first))
        start, end, x = (native.contiguous(a) for a in (mesh.start, mesh.end, mesh.x))
        line = native.contiguous(mesh.line, np.int64)
        self._arrays = start, end, line, x, known, frame, rhs_first, traction, displacement
        self._pointers = [native.pointer(array) for array in self._arrays]

    def fill(self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None) -> None:
        """As in `ColumnFiller`."""
        assert _columns is not None
        rows, columns = native.contiguous(rows, np.int64), native.contiguous(columns, np.int64)
        _columns(
            len(rows), native.pointer(rows), len(columns), native.pointer(columns), *self._pointers, *self._constants,
            native.pointer(system), native.pointer(right_hand_sides),
        )  # fmt: skip


def compiled_columns(kernel: Kelvin2D, mesh: CurveMesh, data: ColumnData) -> CompiledColumns | None:
    """None where the mesh has other elements, or nothing was compiled."""
    if _columns is None or mesh.order.any() or mesh.curvature.any():
        return None
    return CompiledColumns(mesh, data, kernel.material.plane_strain_ratio, kernel.unit_length)
