"""Slopes of the boundary displacement with one order of accuracy more than the elements' own.

Each element has superconvergent points, at which the slope of its polynomial is one order more
accurate than elsewhere (Zienkiewicz and Zhu, IJNME 33, 1992). A polynomial is put through the
slopes at these points of an element and at the nearest ones of its neighbours. It has the higher
accuracy on the whole element, the ends included. Slopes are smooth only between neighbours of the
same part and the same state of contact with a smooth boundary between them. Only these are used.
Along curves the polynomial interpolates; on panels, which need not match, it is fitted. Slopes of
linear fields are exact, also on curved elements (see `linear`).
"""

from __future__ import annotations

import functools

from ...arrays import Array, Index
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import as_curve
from ...mesh.surface_mesh import SurfaceMesh
from .curve_slopes import CurveSlopes
from .panel_slopes import PanelSlopes


@functools.singledispatch
def slopes_of(
    mesh: BoundaryMesh, values: Array, x: Array, linear: Array, label: Index
) -> CurveSlopes | PanelSlopes:
    """Return the recovered slopes of nodal values (n, k) at positions (n, d).

    `linear` (n_elements, k, d) are the linear parts. Only elements with the same `label`
    (n_elements,) are neighbours. Its method `at` returns the gradients (q, k, d) at places of
    elements [1/length], see `surface_gradient`.
    """
    return CurveSlopes(as_curve(mesh), values, x, linear, label)


slopes_of.register(SurfaceMesh, PanelSlopes)
