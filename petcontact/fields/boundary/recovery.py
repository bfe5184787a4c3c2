"""Slopes of the boundary displacement with one order of accuracy more than the elements' own.

Between the nodes of an element there are places at which the slope of its polynomial is of one
order more accurate than elsewhere (superconvergent points: Zienkiewicz and Zhu, IJNME 33, 1992). A
polynomial through the slopes there, and through those at the nearest such places of the neighbours,
has that accuracy on the whole element, its ends too. Neighbours count that belong to the same part
and to the same state of contact, and to which the boundary runs on smoothly: the slope is smooth
over no other. Along curves the polynomial interpolates; on panels, which need not match, it is
fitted. Of linear fields the slopes are exact, on curved elements too: see `linear`.
"""

from __future__ import annotations

import functools
from typing import Any, Protocol

from ...arrays import Array, Index
from ...mesh.curve_mesh import CurveMesh
from ...mesh.surface_mesh import SurfaceMesh
from .curve_slopes import CurveSlopes
from .panel_slopes import PanelSlopes


class Slopes(Protocol):
    """Gradients along the boundary of the values that it was made of."""

    def at(self, element: Index, place: Array) -> Array:
        """At places of elements, as of `surface_gradient`: (q, k, d) [1/length]."""
        ...


@functools.singledispatch
def slopes_of(mesh: Any, values: Array, x: Array, linear: Array, label: Index) -> Slopes:
    """Recovered slopes of nodal values (n, k) at positions (n, d), linear parts (n_elements, k, d),
    over neighbours of one label (n_elements,) only."""
    raise TypeError(f"no slopes on {type(mesh).__name__}")


slopes_of.register(CurveMesh, CurveSlopes)
slopes_of.register(SurfaceMesh, PanelSlopes)
