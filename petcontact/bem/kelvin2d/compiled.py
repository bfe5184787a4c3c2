"""Integrals of both kernels over elements of the plane by compiled code, at targets (`integrals`)
or as whole columns of the operators."""

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
from ..column_fillers import CompiledFiller
from ..kernel import ColumnData
from .arc_elements import MIDDLE, Arcs, counts, series
from .moments import RULES

NODES, POINTS, TIERS, SERIES = 6, 24, 8, 48
"""Sizes of arrays in native/plane/elements.h."""
RADII = (1.7, 2.5, 4.0, 6.0, 24.0, 200.0)
"""Distances |z| beyond which fewer Gauss points than those of `RULES` suffice."""
DIGITS = 14.5
"""Digits to which the rules with fewer points are accurate."""
STEPS = 64
"""Number of classes of arcs for each radian of their angle. One class has one rule."""


@functools.cache
def rule_of(order: int) -> Array:
    """Return the integration rule of one order at each distance, in the form that
    native/plane/elements.h reads.

    From |z| on the integrands are analytic inside the ellipse of ρ = |z| + sqrt(|z|² - 1) with its
    foci at the ends, and n points leave ρ^(p-2n).
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
    to_basis = np.zeros((NODES, NODES))
    to_basis[: order + 1, : order + 1] = lagrange_coefficients(order)
    room = np.zeros((POINTS + 1) * (1 + NODES) * POINTS)
    result = np.concatenate(
        [[rule.close_sum, len(tiers)], counts, squares**2, weight, to_basis.ravel(), room]
    )
    # the stress takes one point more, and the most next to close elements
    used = np.add.outer((0.0, 1.0), counts[: len(tiers)]).astype(np.int64)
    for count in {MIDDLE, *used.ravel().tolist()}:
        add_points(result, order, count)
    return result


def add_points(rule: Array, order: int, count: int) -> None:
    """Write Gauss points to their place in a rule, unless they are there already."""
    table = rule[-(POINTS + 1) * (1 + NODES) * POINTS :].reshape(POINTS + 1, 1 + NODES, POINTS)[
        count
    ]
    if not table.any():
        table[0, :count], table[1 : order + 2, :count] = product_weights(order, count)


def _rules(orders: Index) -> Array:
    """Addresses of rules by order, of those that are asked for."""
    there = np.bincount(orders, minlength=len(RULES))
    return np.array([native.pointer(rule_of(order)) if there[order] else 0 for order in RULES])


@functools.cache
def _series() -> Array:
    """Return the coefficients of the remainders of arcs, a row for each."""
    return native.contiguous(series(SERIES - 1).T)


def _arcs(of: CurveMesh | Elements, order: Index) -> Array | None:
    """Return the structs Arc of all elements, zero for straight ones, or None where all elements
    are straight."""
    curved = np.flatnonzero(of.curvature)
    if not len(curved):
        return None
    arcs = Arcs.bent(of.start[curved], of.end[curved], of.curvature[curved])
    result = np.zeros((len(order), 13 + 2 * NODES))
    result[curved, :9] = np.column_stack(
        [
            *(part for z in (arcs.middle, arcs.tangent) for part in (z.real, z.imag)),
            arcs.angle,
            arcs.half,
            arcs.curvature,
            np.cos(arcs.angle),
            np.sin(arcs.angle),
        ]
    )
    for p in np.unique(order[curved]).tolist():
        numbers = np.flatnonzero(order[curved] == p)
        some = arcs.take(numbers)
        rows = result[curved[numbers]]
        rows[:, 9] = some.reach(RULES[p].far_radius) ** 2
        bound = np.minimum(np.ceil(STEPS * np.abs(some.angle)) / STEPS, 0.5 * np.pi)
        rows[:, 10:13] = [counts(p, angle) for angle in bound.tolist()]
        for count in {*np.ravel(rows[:, [10, 10, 11]] + [0, 1, 0]).astype(np.int64).tolist()}:
            add_points(rule_of(p), p, count)
        s, product = product_weights(p, POINTS)
        wave = np.exp(-1j * np.multiply.outer(some.angle, s)) @ product.T
        rows[:, 13 : 14 + p], rows[:, 13 + NODES : 14 + NODES + p] = wave.real, wave.imag
        result[curved[numbers]] = rows
    return result


ELEMENTS, NODES_OF = "DDNNNNDDddd", "DDNNNN"
"""Kinds of the members of the structs Elements and Points (`native.function`)."""


def element_members(
    of: CurveMesh | Elements, index: Index, poisson_ratio: float, length: float, unit: float
) -> list[native.Member]:
    """Members of a struct Elements."""
    order = np.broadcast_to(of.order, len(index))
    whole = [native.contiguous(array, np.int64) for array in (order, of.line, index)]
    shape = [
        native.contiguous(of.start),
        native.contiguous(of.end),
        *whole,
        _rules(order),
        _arcs(of, order),
        _series(),
    ]
    return [*shape, poisson_ratio, length, unit]


def point_members(targets: Targets) -> list[native.Member]:
    """Members of a struct Points."""
    whole = [
        None if array is None else native.contiguous(array, np.int64)
        for array in (targets.line, targets.element, targets.before, targets.after)
    ]
    return [native.contiguous(targets.point), native.contiguous(targets.xi), *whole]


def integrated(
    name: str,
    letters: str,
    curve: list[native.Member],
    targets: Targets,
    elements: Elements,
    *shape: int,
) -> tuple[Array, Array]:
    """Two kernels of n elements at m targets by a compiled function, each (*shape, n(p+1), m).

    `curve` has the members of the struct that the function takes for the elements, `letters` their
    kinds.
    """
    n, m = len(elements.index), len(targets.line)
    result = np.zeros((2, *shape, n * (elements.order + 1), m))
    record = native.Struct(letters, *curve)
    points = native.Struct(NODES_OF, *point_members(targets))
    native.function(name, "pipiDD")(record.address, n, points.address, m, *result)
    return result[0], result[1]


def curve_columns(
    name: str, letters: str, curve: list[native.Member], mesh: CurveMesh, data: ColumnData
) -> CompiledFiller:
    """The filler of columns by a compiled function; `curve` has the members for all elements,
    `letters` their kinds."""
    first_node = native.contiguous(mesh.first_node, np.int64)
    nodes = point_members(mesh.targets(slice(None)))
    return CompiledFiller(name, letters + NODES_OF + "N", [*curve, *nodes, first_node], data)


def compiled_columns(kernel: Any, mesh: CurveMesh, data: ColumnData) -> CompiledFiller:
    """The compiled filler of columns for a `Kelvin2D`."""
    length, elements = kernel.unit_length, np.arange(mesh.n_elements)
    curve = element_members(mesh, elements, kernel.poisson_ratio, length, 1.0 / length)
    return curve_columns("petcontact_plane_columns", ELEMENTS, curve, mesh, data)
