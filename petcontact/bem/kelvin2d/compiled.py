"""Both kernels over elements of the plane by compiled code: at targets as `integrals`, or whole columns of the operators."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from ... import native
from ...arrays import Array, Index
from ...mesh.basis import gauss, lagrange_coefficients, product_weights
from ...mesh.curve_mesh import CurveMesh
from ...mesh.elements import Elements, Targets
from ..compiled_filler import CompiledFiller, data_members
from ..kernel import ColumnData
from .moments import RULES

NODES, POINTS, TIERS = 6, 24, 8
"""Of native/plane/elements.h."""
RADII = (1.7, 2.5, 4.0, 6.0, 24.0, 200.0)
"""Distances |z| from which on fewer Gauss points than those of `RULES` are taken."""
DIGITS = 14.5
"""Of what they leave out."""
_integrals = native.function("petcontact_plane_integrals", "pipipp")
_columns = native.function("petcontact_plane_columns", native.FILLER)


@functools.cache
def _rule(order: int) -> Array:
    """How elements of one order are integrated at each distance, as native/plane/elements.h reads it.

    From |z| on the integrands are analytic inside the ellipse of ρ = |z| + sqrt(|z|² - 1) with its foci at the ends, and n
    points leave ρ^(p-2n).
    """
    rule = RULES[order]
    tiers = [(rule.middle, 0.0), (rule.far, rule.far_radius)]
    for radius in RADII:
        digits = math.log10(radius + math.sqrt(radius * radius - 1.0))
        points = max(math.ceil(0.5 * (order + DIGITS / digits)), order // 2 + 2)
        least, most = (0, rule.far) if radius > rule.far_radius else (rule.far, rule.middle)
        if least < points < most:
            tiers.append((points, radius))
    tiers.sort(key=lambda tier: tier[1])
    counts, squares, weight = np.zeros(TIERS), np.zeros(TIERS), np.zeros(NODES)
    counts[: len(tiers)], squares[: len(tiers)] = np.array(tiers).T
    weight[: order + 1] = gauss(order)[1]
    to_basis, tables = np.zeros((NODES, NODES)), np.zeros((POINTS + 1, 1 + NODES, POINTS))
    to_basis[: order + 1, : order + 1] = lagrange_coefficients(order)
    for count in range(1, POINTS + 1):
        tables[count, 0, :count], tables[count, 1 : order + 2, :count] = product_weights(order, count)
    return np.concatenate([[rule.close_sum, len(tiers)], counts, squares**2, weight, to_basis.ravel(), tables.ravel()])


@functools.cache
def _rules() -> Array:
    """Addresses of the rules of all orders."""
    return np.array([native.pointer(_rule(order)) for order in RULES])


def _elements(of: CurveMesh | Elements, index: Index, poisson_ratio: float, length: float, unit: float) -> list[Any]:
    """Members of a struct Elements."""
    order = np.broadcast_to(of.order, len(index))
    whole = [native.contiguous(array, np.int64) for array in (order, of.line, index)]
    return [native.contiguous(of.start), native.contiguous(of.end), *whole, _rules(), poisson_ratio, length, unit]


def _points(targets: Targets) -> list[Any]:
    """Members of a struct Points."""
    whole = [native.contiguous(array, np.int64) for array in (targets.line, targets.element)]
    return [native.contiguous(targets.point), native.contiguous(targets.xi), *whole]


def available(elements: Elements) -> bool:
    """Whether compiled code integrates over these elements."""
    return _integrals is not None and not elements.curvature.any()


def compiled_integrals(
    targets: Targets, elements: Elements, poisson_ratio: float, length: float, kernel_g: Array | None, kernel_h: Array | None
) -> None:
    """Fill `integrals`' results (2, 2, n, p+1, m), G and H or one of them."""
    assert _integrals is not None
    record = native.Record(*_elements(elements, elements.index, poisson_ratio, length, 1.0))
    points = native.Record(*_points(targets))
    _integrals(
        record.address, len(elements.index), points.address, len(targets.line), native.pointer(kernel_g),
        native.pointer(kernel_h),
    )  # fmt: skip


def compiled_columns(kernel: Any, mesh: CurveMesh, data: ColumnData) -> CompiledFiller | None:
    """None where the mesh has arcs, or nothing was compiled; the kernel is a `Kelvin2D`."""
    if _columns is None or mesh.curvature.any():
        return None
    ratio, length = kernel.material.plane_strain_ratio, kernel.unit_length
    return CompiledFiller("petcontact_plane_columns", native.Record(
        *_elements(mesh, np.arange(mesh.n_elements), ratio, length, 1.0 / length), *_points(mesh.targets(slice(None))),
        native.contiguous(mesh.first_node, np.int64), *data_members(data),
    ))  # fmt: skip
