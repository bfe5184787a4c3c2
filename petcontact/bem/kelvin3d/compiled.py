"""Integrals of both kernels over panels by compiled code, at points (`integrals`) or as whole
blocks of the operators."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np

from ... import native
from ...arrays import Array, Index
from ...mesh.curved.curved_panels import CurvedPanels, reference_rule
from ...mesh.panels import HIGHEST_ORDER, Panels, make_panels
from ...mesh.surface_mesh import CURVED, TRIANGLE, SurfaceMesh
from ..column_fillers import CompiledFiller
from ..kernel import ColumnData
from .rules import (
    COUNTS,
    MOST_GAUSS,
    MOST_POINTS,
    degrees,
    digits,
    fewest,
    gauss_table,
    least_log_rho,
    tolerance_of,
    warp,
)

AnyPanels = Panels | CurvedPanels
ROOM = 256
"""Gauss points of a panel that the compiled code has room for."""
_panels = native.function("petcontact_panels", "piDiiDDD")
_field = native.function("petcontact_panel_field", "piDiiDDDB")


@functools.lru_cache(maxsize=16)
def _rules(tolerance: float, most: tuple[int, ...]) -> Array:
    """Return the limits of the choice of Gauss points and the rules, in the form that
    native/space/panel.h reads."""
    # half the sum of the distances from both ends over half the length is (ρ + 1/ρ)/2
    least = [
        np.cosh(np.minimum(least_log_rho(degree, tolerance), 700.0))
        for degree in range(2 * HIGHEST_ORDER + 2)
    ]
    points = gauss_table(COUNTS)
    return np.concatenate([np.minimum(most, ROOM), np.ravel(least), COUNTS, points.ravel()]).astype(
        np.float64
    )


def _weights(kind: int, tolerance: float) -> Array:
    """Gauss weights times the basis on a rectangle or triangle of area 1, (numbers of points, 256,
    16), zero beyond.

    Of curved panels on the reference element; then follow the coefficients of the basis, the digits
    wanted near a panel, and Gauss points and weights by their number.
    """
    order, corners = kind % TRIANGLE, 3 if kind & TRIANGLE else 4
    return (
        _curved_weights(order, corners, tolerance)
        if kind & CURVED
        else _flat_weights(order, corners)
    )


@functools.cache
def _flat_weights(order: int, corners: int) -> Array:
    corner = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    panels, _, weight = make_panels(corner[None, :corners], order, np.arange(1))
    table = np.zeros((len(COUNTS), len(COUNTS), ROOM, (HIGHEST_ORDER + 1) ** 2))
    for i, j in itertools.product(range(len(COUNTS)), repeat=2):
        points = COUNTS[i] * COUNTS[j]
        if points <= ROOM:
            table[i, j, :points, : panels.n_nodes] = (
                panels.rule((COUNTS[i], COUNTS[j]))[1][0].T / weight.sum()
            )
    return table


@functools.cache
def _curved_weights(order: int, corners: int, tolerance: float) -> Array:
    panels = CurvedPanels(np.zeros((1, 6 if corners == 3 else 9, 3)), order, np.arange(1))
    table = np.zeros((len(COUNTS), len(COUNTS), ROOM, (HIGHEST_ORDER + 1) ** 2))
    for i, j in itertools.product(range(len(COUNTS)), repeat=2):
        if (points := COUNTS[i] * COUNTS[j]) <= ROOM:
            local, weight = reference_rule(corners, (COUNTS[i], COUNTS[j]))
            table[i, j, :points, : panels.n_nodes] = panels.basis(local[None])[0] * weight[:, None]
    coefficients = np.zeros(((HIGHEST_ORDER + 1) ** 2,) * 2)
    coefficients[: panels.n_nodes, : panels.n_nodes] = panels.coefficients.T
    return np.concatenate(
        [
            table.ravel(),
            coefficients.ravel(),
            [digits(tolerance)],
            np.pad(gauss_table(range(1, MOST_GAUSS + 1)), ((0, 0), (1, 0), (0, 0))).ravel(),
        ]
    )


def _records(panels: AnyPanels, tolerance: float) -> Array:
    """Return centre (3), frame (9), size (1), polygon (8), degrees (2) and coefficients (k²) of
    each panel.

    Instead of the last of curved ones the warp 1, the place of the fewest points 1, the box 6, the
    shape 27, and position and local coordinates of the nodes 5 k.
    """
    chord = panels.chord
    n, corners = chord.corners.shape[:2]
    polygon = np.zeros((n, 8))
    polygon[:, : 2 * corners] = chord.polygon.reshape(n, -1)
    parts = [chord.centre, chord.frame.reshape(n, 9), chord.size[:, None], polygon, degrees(panels)]
    if isinstance(panels, Panels):
        parts.append(panels.coefficients.reshape(n, -1))
    else:
        nodes = np.concatenate([panels.at(panels.nodes)[0], panels.nodes], axis=2)
        numbers = warp(panels), fewest(panels, tolerance), panels.box, panels.shape, nodes
        parts += [array.reshape(n, -1) for array in numbers]
    return np.concatenate(parts, axis=1)


def _kind(panels: AnyPanels) -> int:
    corners = panels.corners.shape[1]
    return panels.order + TRIANGLE * (corners == 3) + CURVED * isinstance(panels, CurvedPanels)


def compiled_integrals(
    points: Array,
    panels: AnyPanels,
    poisson_ratio: float,
    tolerance: float,
    most: tuple[int, ...],
    kernel_g: Array,
    kernel_h: Array,
) -> None:
    """Fill `integrals`' results (3, 3, n k, m); `most` are the Gauss points of far panels."""
    points, records, kind = native.contiguous(points), _records(panels, tolerance), _kind(panels)
    family = _family(kind, tolerance, most, poisson_ratio)
    _panels(family.address, *_counted(records), len(points), points, kernel_g, kernel_h)


def _family(kind: int, tolerance: float, most: tuple[int, ...], nu: float) -> native.Struct:
    """Return the struct Family of native/space/panel.h."""
    return native.Struct("iDDd", kind, _rules(tolerance, most), _weights(kind, tolerance), nu)


def _counted(records: Array) -> tuple[int, Array, int]:
    """Return how many records there are, they themselves, and how many numbers each has."""
    return len(records), records, records.shape[1]


def compiled_field(
    points: Array, panels: AnyPanels, poisson_ratio: float, tolerance: float | None, data: Array
) -> tuple[Array, tuple[Index, Index]]:
    """Return displacement and stress that panels with their boundary data cause at points inside
    the body.

    Parameters
    ----------
    points : (m, 3) array
        [length]
    panels : Panels
        n panels of k nodes.
    poisson_ratio : float
    tolerance : float, optional
        By default `rules.TOLERANCE`.
    data : (n k, 6) array
        Traction over 2µ [-] and displacement [length] at their nodes.

    Returns
    -------
    field : (m, 10) array
        Displacement [length], stress over 2µ, and the share of the solid angle that the panels
        take.
    close : pair of arrays
        Panels and points too near for Gauss points, whose stress is missing.
    """
    tolerance = tolerance_of(panels, tolerance)
    points, data = native.contiguous(points), native.contiguous(data)
    records, kind = _records(panels, tolerance), _kind(panels)
    family = _family(kind, tolerance, (ROOM,) * (HIGHEST_ORDER + 1), poisson_ratio)
    field = np.empty((len(points), 10))
    close = np.zeros((len(records), len(points)), dtype=np.bool_)
    _field(family.address, *_counted(records), len(points), points, data, field, close)
    element, column = np.nonzero(close)
    return field, (element, column)


def compiled_columns(kernel: Any, mesh: SurfaceMesh, data: ColumnData) -> CompiledFiller:
    """The compiled filler of columns for a `Kelvin3D`."""
    kind = np.zeros(mesh.n_elements, dtype=np.int64)
    first = np.zeros(mesh.n_elements, dtype=np.int64)
    records, start = [], 0
    kinds: dict[int, tuple[Array, Array]] = {}
    for panels in (batch.elements for batch in mesh.batches()):
        tolerance = tolerance_of(panels, kernel.tolerance)
        part = _records(panels, tolerance)
        kind[panels.index] = _kind(panels)
        first[panels.index] = start + part.shape[1] * np.arange(len(part))
        records.append(part.ravel())
        start += part.size
        kinds[_kind(panels)] = (
            _rules(tolerance, MOST_POINTS[type(panels)]),
            _weights(_kind(panels), tolerance),
        )
    rules, weights = (
        np.array([native.pointer(kinds[k][part]) if k in kinds else 0 for k in range(2 * CURVED)])
        for part in range(2)
    )
    return CompiledFiller(
        "petcontact_panel_columns",
        "DNNNDNNNdd",
        [
            native.contiguous(mesh.x),
            *(native.contiguous(array, np.int64) for array in (mesh.element, mesh.first_node)),
            kind,
            np.concatenate(records),
            first,
            rules,
            weights,
            kernel.material.poisson_ratio,
            kernel.unit_length,
        ],
        data,
        kinds,
    )
