"""Kelvin's solution of plane strain and its traction, integrated over boundary elements (the
kernels of 4.10).

With r = x - y, n the outward normal at x, and the direction start -> end running with the body on
its left:

    U = 1/(8πµ(1-ν)) [-(3-4ν) ln r I + r r/r²]
    T = -1/(4π(1-ν)) [(r·n/r²) ((1-2ν) I + 2 r r/r²) + (1-2ν)/r² (n r - r n)]

U[i, j] and T[i, j] take the traction or displacement component j at x to component i at y. Both are
a multiple of I plus a deviator (a complex number m stands for [[Re m, Im m], [Im m, -Re m]]) plus,
in T, a rotation by 90 degrees.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...mesh.basis import gauss
from ...mesh.elements import Elements, Targets
from .arcs import Arcs
from .compiled import available, compiled_integrals
from .segments import Segments
from .tensors import Result

__all__ = ["Elements", "Targets", "integrals"]

POINT_CHUNK = 98_304
"""Pairs of a Gauss point and a target in one temporary: a few of them nearly fit a core's
second-level cache."""


def integrals(
    targets: Targets, elements: Elements, poisson_ratio: float, length: float
) -> tuple[Array, Array]:
    """Both kernels integrated over elements against their Lagrange bases, at targets.

    Parameters
    ----------
    targets : Targets
        m points.
    elements : Elements
        n elements of order p.
    poisson_ratio : float
        ν of plane strain; for plane stress pass ν/(1+ν).
    length : float
        Length that scales the argument of the logarithm [length].

    Returns
    -------
    G : (2, 2, n(p+1), m) array
        2µ ∫ U_ij L_b ds [length], i the component at the target, j the component at the element;
        element after element on the third axis.
    H : (2, 2, n(p+1), m) array
        ∫ T_ij L_b ds [-]; the principal value, without the free term, at a node of the element
        itself.
    """
    n, nodes, m = len(elements.index), elements.order + 1, len(targets.line)
    kernel_g, kernel_h = (np.empty((2, 2, n, nodes, m)) for _ in range(2))
    result = Result(kernel_g, kernel_h, poisson_ratio, length)
    curved = elements.curved
    if n == 0 or m == 0:
        pass
    elif available():
        compiled_integrals(targets, elements, poisson_ratio, length, kernel_g, kernel_h)
    elif curved.any() and not curved.all():
        for chosen in (np.flatnonzero(~curved), np.flatnonzero(curved)):
            parts = integrals(targets, elements.take(chosen), poisson_ratio, length)
            for whole, part in zip((kernel_g, kernel_h), parts, strict=True):
                whole[:, :, chosen] = part.reshape(2, 2, len(chosen), nodes, m)
    else:
        _polynomial(targets, elements, result)
        if elements.order == 0 and curved.any():
            _add_slopes(targets, elements, kernel_h, poisson_ratio)
    return kernel_g.reshape(2, 2, n * nodes, m), kernel_h.reshape(2, 2, n * nodes, m)


def _add_slopes(
    targets: Targets, elements: Elements, kernel_h: Array, poisson_ratio: float
) -> None:
    """What constant arcs miss of the slope of the displacement, from the difference of their
    neighbours.

    Along the boundary T is c/s J with c = (1-2ν)/(4π(1-ν)) and J the rotation by 90°. A
    displacement s u' that is constant on elements of length h has ∫ u/s = u' Σ ∫ s_j/s ds = u' (L -
    h ln 2), whose defect makes constant elements of first order. h u' is half the difference of the
    neighbours. On straight sides the elements stay those of the paper.
    """
    if targets.before is None or targets.after is None:
        return
    share = 0.5 * np.log(2.0) * (1.0 - 2.0 * poisson_ratio) / (4.0 * np.pi * (1.0 - poisson_ratio))
    for numbers, sign in ((targets.before, 1.0), (targets.after, -1.0)):
        place, column = _pairs(numbers, elements)
        kernel_h[0, 1, place, 0, column] += sign * share
        kernel_h[1, 0, place, 0, column] -= sign * share


def _pairs(numbers: Index, elements: Elements) -> tuple[Index, Index]:
    """Pairs (place of the element, target) where the number that a target has is that of the
    element."""
    order = np.argsort(elements.index, kind="stable")
    place = np.searchsorted(elements.index, numbers, sorter=order)
    place = order[np.minimum(place, len(order) - 1)]
    column = np.flatnonzero(elements.index[place] == numbers)
    return place[column], column


def _off_line(targets: Targets, line: Index) -> Array | None:
    """0 where an element and a target lie on one line, else 1: (n, m), or (1, m) for elements of
    one line, or None."""
    first = line[0]
    if np.all(line == first):
        apart = (targets.line != first)[None] if first >= 0 else np.ones((1, 1), dtype=bool)
    else:
        apart = targets.line != np.where(line < 0, -2, line)[:, None]
    return None if apart.all() else apart.astype(np.float64)


def _polynomial(targets: Targets, elements: Elements, result: Result) -> None:
    """Elements of any order and shape: Gauss quadrature for all pairs, then what is not far enough
    once more."""
    order = elements.order
    point = targets.point[:, 0] + 1j * targets.point[:, 1]
    shape = shape_of(elements)
    near: list[tuple[Index, Index]] = []
    step = max(1, POINT_CHUNK // (shape.far_points(order) * len(point)))
    for first in range(0, len(elements.index), step):
        rows = slice(first, first + step)
        some = shape.take(rows)
        part, turn, (element, column) = some.far(
            order, point, _off_line(targets, elements.line[rows])
        )
        result.write(rows, part, some.half, turn, gauss(order)[1][:, None])
        near.append((element + first, column))
    element, column = (np.concatenate(part) for part in zip(*near, strict=True))
    if len(element):
        _near(targets, elements, shape, element, column, result)


def _near(
    targets: Targets,
    elements: Elements,
    shape: Arcs | Segments,
    element: Index,
    column: Index,
    result: Result,
) -> None:
    """Pairs of an element and a target that are not far."""
    order, weight = elements.order, gauss(elements.order)[1][:, None]
    point = targets.point[column, 0] + 1j * targets.point[column, 1]
    left, right, h = shape.take(element).coordinates(point)
    own = elements.index[element] == targets.element[column]
    on_line = own | (
        (elements.line[element] >= 0) & (elements.line[element] == targets.line[column])
    )
    xi = targets.xi[column]
    h = np.where(on_line, 0.0, h)
    left, right = np.where(own, xi + 1.0, left), np.where(own, xi - 1.0, right)
    is_close = np.sqrt(left * left + h * h) + np.sqrt(right * right + h * h) < shape.close_sum(
        order
    )
    chosen = np.flatnonzero(is_close)
    if len(chosen):
        some = shape.take(element[chosen])
        part = some.close(order, left[chosen], right[chosen], h[chosen], on_line[chosen])
        result.scatter(element[chosen], column[chosen], part, some.half, some.tangent**2, weight)
    chosen = np.flatnonzero(~is_close)
    if len(chosen):
        some = shape.take(element[chosen])
        part, turn = some.middle_range(
            order, point[chosen], 0.5 * (left + right)[chosen], h[chosen]
        )
        result.scatter(element[chosen], column[chosen], part, some.half, turn, weight)


def shape_of(elements: Elements) -> Arcs | Segments:
    """Geometry of elements that are all straight or all arcs."""
    if elements.curved.any():
        return Arcs.through(elements.start, elements.end, elements.curvature)
    return Segments.through(elements.start, elements.end)
