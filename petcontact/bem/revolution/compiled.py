"""Kernels of rings over elements of generating curves by compiled code: at targets, or as columns
of operators."""

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
from ..kelvin2d.compiled import add_points, element_members, point_members, rule_of
from ..kernel import ColumnData

TOLERANCE = 1e-9
"""Relative error of quadrature where none is asked for."""
ORDERS, MOST, RULES = 6, 64, 12
"""Of native/revolution/elements.h."""
COUNTS = (24, 19, 15, 12, 10, 8, 7, 6, 5, 4, 3)
"""Gauss points from afar."""
GUARD = 1.5
"""Digits beyond those wanted that Gauss quadrature is asked for: on ellipses through the target the
kernels are larger than 1."""


@functools.cache
def _quadrature(tolerance: float) -> Array:
    """A struct Quadrature.

    With the target on the ellipse of half axes a and b around an element, n Gauss points leave
    (a+b)^(p-2n). The points of panels near a target are those that kept the digits D of 400 random
    pairs: 2D+2 on the element itself, D + D/6 arsinh(length/distance) beside it, D+3 on the others.
    """
    digits = -math.log10(tolerance)
    numbers, points = np.zeros(ORDERS), np.zeros((2, ORDERS, RULES))
    for order in range(ORDERS):
        counts = np.array([count for count in COUNTS if count >= order // 2 + 2])
        axes = 10.0 ** ((digits + GUARD) / (2 * counts - order))
        numbers[order] = len(counts)
        points[:, order, : len(counts)] = counts, 0.5 * (axes + 1.0 / axes)
        for count in counts.tolist():
            add_points(rule_of(order), order, count)
    table = np.zeros((MOST + 1, 2, MOST))
    for count in range(1, MOST + 1):
        x, weight = gauss(count - 1)
        table[count, :, :count] = 0.5 + 0.5 * x, 0.5 * weight
    near = [math.ceil(2.0 * digits + 2.0), digits, digits / 6.0, math.ceil(digits + 3.0)]
    return np.concatenate([numbers, points.ravel(), near, table.ravel()])


@functools.cache
def _arc_points(order: int, angle: float, tolerance: float) -> int:
    """Gauss points that resolve an arc: the normal and two components turn with it, by e^(3iαs)."""
    degree, size = 0, 1.0
    while size > tolerance:
        degree += 1
        size *= 1.5 * angle / degree
    return (degree + order + 1) // 2


def _curve(
    of: CurveMesh | Elements, index: Index, nu: float, unit: float, tolerance: float, d: int
) -> list[Any]:
    """Members of a struct Curve."""
    angle = np.abs(half_angles(np.hypot(*(of.end - of.start).T), of.curvature))
    order = np.broadcast_to(of.order, len(index))
    steps = np.ceil(64.0 * angle) / 64.0  # a few values for all arcs
    least = [
        _arc_points(p, a, tolerance) if a else 0
        for p, a in zip(order.tolist(), steps.tolist(), strict=True)
    ]
    plane = element_members(of, index, nu, unit, 1.0 / unit)
    return [*plane, np.array(least, dtype=np.int64), _quadrature(tolerance), d]


def ring_integrals(
    targets: Targets, elements: Elements, nu: float, unit: float, tolerance: float, d: int
) -> tuple[Array, Array]:
    """G and H as `bem.kernel.Kernel.integrals`, (d, d, n(p+1), m)."""
    shape = d, d, len(elements.index) * (elements.order + 1), len(targets.line)
    kernel_g, kernel_h = np.zeros(shape), np.zeros(shape)
    curve = native.Record(*_curve(elements, elements.index, nu, unit, tolerance, d))
    points = native.Record(*point_members(targets))
    integrate = native.function("petcontact_ring_integrals", "pipipp")
    assert integrate is not None
    integrate(
        curve.address,
        len(elements.index),
        points.address,
        shape[3],
        native.pointer(kernel_g),
        native.pointer(kernel_h),
    )
    return kernel_g, kernel_h


def compiled_columns(kernel: Any, mesh: CurveMesh, data: ColumnData) -> CompiledFiller:
    """The compiled filler of columns for a kernel of rings."""
    every = np.arange(mesh.n_elements)
    tolerance = kernel.tolerance or TOLERANCE
    return CompiledFiller(
        "petcontact_ring_columns",
        [
            *_curve(mesh, every, kernel.poisson_ratio, kernel.unit_length, tolerance, kernel.dim),
            *point_members(mesh.targets(slice(None))),
            native.contiguous(mesh.first_node, np.int64),
        ],
        data,
    )
