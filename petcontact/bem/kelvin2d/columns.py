"""Columns of the boundary operators of straight elements of order 0, a whole block of them in one compiled call."""

from __future__ import annotations

import numpy as np

from ... import native
from ...mesh.curve_mesh import CurveMesh
from ..compiled_filler import CompiledFiller
from ..kernel import ColumnData
from .kernel import Kelvin2D

_columns = native.function("petcontact_columns", "ipipppppppppp" + "ddpp")


def compiled_columns(kernel: Kelvin2D, mesh: CurveMesh, data: ColumnData) -> CompiledFiller | None:
    """None where the mesh has other elements, or nothing was compiled."""
    if _columns is None or mesh.order.any() or mesh.curvature.any():
        return None
    arrays = [
        (mesh.start, np.float64), (mesh.end, np.float64), (mesh.line, np.int64), (mesh.x, np.float64),
        (data.traction_known, np.int64), (data.frame, np.float64), (data.rhs_first, np.int64),
        (data.rhs_traction, np.float64), (data.rhs_displacement, np.float64),
    ]  # fmt: skip
    return CompiledFiller(_columns, arrays, (kernel.material.plane_strain_ratio, kernel.unit_length))
