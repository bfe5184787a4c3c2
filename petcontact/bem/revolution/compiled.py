"""Kernels of rings over elements of generating curves by compiled code, at targets or as columns of
operators."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from ... import native
from ...arrays import Array, Index
from ...geometry.arcs import half_angles
from ...mesh.basis import gauss
from ...mesh.curve_mesh import CurveMesh
from ...mesh.elements import Elements, Targets
from ..column_fillers import CompiledFiller
from ..kelvin2d.arc_elements import resolving_points
from ..kelvin2d.compiled import (
    ELEMENTS,
    add_points,
    curve_columns,
    element_members,
    integrated,
    rule_of,
)
from ..kernel import ColumnData

TOLERANCE = 1e-9
"""Relative error of quadrature by default."""
ORDERS, MOST_POINTS, RULES = 6, 64, 12
"""Sizes of arrays in native/revolution/sums.h. `MOST_POINTS` numbers are whole vectors of the C
code."""
LOADS = ((0, 0), (0, 1), (1, 0), (1, 1), (2, 2))
"""Component of u and of the load that each row has, of native/revolution/ring.h."""
STRESSES = (
    *((0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1)),
    *((4, 2), (5, 2)),
)
"""Component of stress (rr, zz, rz, θθ, rθ, zθ) and of the load, of native/revolution/ring.h."""
COUNTS = (24, 19, 15, 12, 10, 8, 7, 6, 5, 4, 3)
"""Numbers of Gauss points for far targets."""
GUARD = 1.5
"""Digits beyond those wanted that Gauss quadrature is asked for: on ellipses through the target the
kernels are larger than 1."""


@functools.cache
def _quadrature(tolerance: float, of_stress: bool) -> Array:
    """A struct Quadrature.

    With the target on the ellipse of half axes a and b around an element, n Gauss points leave
    (a+b)^(p-2n). The points of panels near a target are those that kept D digits of 400 random
    pairs: 2D+2 on the element itself, p + D - 3 + D/6 arsinh(length/distance) beside it, D+3 on
    panels further off. Stress varies like 1/distance²: from near it is integrated to round-off,
    from afar to two digits more.
    """
    digits = -math.log10(tolerance) + 2.0 * of_stress
    numbers, points = np.zeros(ORDERS), np.zeros((2, ORDERS, RULES))
    for order in range(ORDERS):
        counts = np.array([count for count in COUNTS if count >= order // 2 + 2])
        axes = 10.0 ** ((digits + GUARD) / (2 * counts - order))
        numbers[order] = len(counts)
        points[:, order, : len(counts)] = counts, axes + 1.0 / axes
        for count in counts.tolist():
            add_points(rule_of(order), order, count)
    # whole vectors, filled up with nothing
    table = np.full((MOST_POINTS + 1, 2, MOST_POINTS), [[0.5], [0.0]])
    for count in range(1, MOST_POINTS + 1):
        table[count, :, :count] = _gauss(count)
    near = [math.ceil(2.0 * digits + 2.0), digits - 3.0, digits / 6.0, math.ceil(digits + 3.0)]
    near = [20.0, 22.0, 3.0, 18.0] if of_stress else near
    return np.concatenate([numbers, points.ravel(), near, table.ravel()])


def _gauss(count: int) -> tuple[Array, Array]:
    """Gauss points in (0, 1) and weights to the last digit; numpy's lose two from 40 points on."""
    x = gauss(count - 1)[0].astype(np.longdouble)
    for _ in range(2):
        below, value = np.ones_like(x), x
        for k in range(2, count + 1):
            below, value = value, ((2 * k - 1) * x * value - (k - 1) * below) / k
        slope = count * (below - x * value) / (1 - x * x)
        x = x - value / slope
    return (0.5 + 0.5 * x).astype(np.float64), (1 / ((1 - x * x) * slope**2)).astype(np.float64)


CURVE = ELEMENTS + "NDii"
"""Kinds of the members of the struct Curve."""


def _curve(
    of: CurveMesh | Elements, index: Index, kernel: Any, of_stress: bool = False
) -> list[native.Member]:
    """Members of a struct Curve."""
    tolerance = kernel.tolerance or TOLERANCE
    angle = np.abs(half_angles(np.hypot(*(of.end - of.start).T), of.curvature))
    order = np.broadcast_to(of.order, len(index))
    steps = np.ceil(64.0 * angle) / 64.0  # a few values for all arcs
    least = [
        resolving_points(p, 1.5 * a, tolerance) if a else 0
        for p, a in zip(order.tolist(), steps.tolist(), strict=True)
    ]
    unit = kernel.unit_length
    plane = element_members(of, index, kernel.poisson_ratio, unit, 1.0 / unit)
    quadrature = _quadrature(tolerance, of_stress)
    return [*plane, np.array(least, dtype=np.int64), quadrature, kernel.dim, int(of_stress)]


def ring_integrals(
    kernel: object, targets: Targets, elements: Elements, *shape: int, of_stress: bool = False
) -> tuple[Array, Array]:
    """G and H as `bem.kernel.Kernel.integrals`, or D and S of the stress, each (*shape, n(p+1), m).

    The shape is (d, d) of G and H. It is (10,) of D and S, whose rows go by component of stress and
    of load as `STRESSES` says.
    """
    curve = _curve(elements, elements.index, kernel, of_stress)
    return integrated("petcontact_ring_integrals", CURVE, curve, targets, elements, *shape)


def ring_forces(x: Array, source: Array, nu: float) -> tuple[Array, Array]:
    """2µ u (5, m) and stress (10, m) at points (m, 2) by forces 1 on the ring through a point (2,),
    rows by `LOADS` and `STRESSES`."""
    points = np.zeros((2, len(x) + -len(x) % MOST_POINTS))
    points[:, : len(x)] = x.T
    result = np.empty((len(LOADS) + len(STRESSES), points.shape[1]))
    forces = native.function("petcontact_ring_forces", "iDdddD")
    forces(len(points[0]), points, *source.tolist(), nu, result)
    result = result[:, : len(x)] / (16.0 * np.pi**2 * (1.0 - nu))
    return result[: len(LOADS)], result[len(LOADS) :]


def compiled_columns(kernel: object, mesh: CurveMesh, data: ColumnData) -> CompiledFiller:
    """The compiled filler of columns for a kernel of rings."""
    curve = _curve(mesh, np.arange(mesh.n_elements), kernel)
    return curve_columns("petcontact_ring_columns", CURVE, curve, mesh, data)
