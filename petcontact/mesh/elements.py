"""Elements and targets as the kernels need them."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Index, Mask, Rows
from ..record import record


@record
class Elements(Rows):
    """Elements of one order.

    Attributes
    ----------
    start, end : (n, 2) arrays
        End points, the body on the left [length].
    curvature : (n,) array
        0 for straight elements, 1/R for arcs that turn left, -1/R for arcs that turn right, at most
        half a circle.
    order : int
        p, 0 to 5: p+1 nodes at the Gauss points.
    line : (n,) int array
        Number of the straight line that the element lies on, -1 on arcs.
    index : (n,) int array
        Number of the element in the mesh.
    """

    start: Array
    end: Array
    curvature: Array
    order: int
    line: Index
    index: Index

    @property
    def curved(self) -> Mask:
        """Which elements are arcs, (n,)."""
        return np.not_equal(self.curvature, 0.0)


@record
class Targets:
    """Points at which the potentials of elements are computed.

    Attributes
    ----------
    point : (m, 2) array
        [length]
    line, element : (m,) int arrays
        Number of the straight line that the point lies on and of the element that it is a node of,
        or -1.
    xi : (m,) array
        Local coordinate on its own element, in (-1, 1).
    before, after : (m,) int arrays, optional
        Numbers of the constant arcs of the same length and curvature before and after the point's
        own element, or -2.
    """

    point: Array
    line: Index
    element: Index
    xi: Array
    before: Index | None = None
    after: Index | None = None
