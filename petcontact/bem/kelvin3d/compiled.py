"""Both kernels over flat panels by compiled code: at points as `integrals`, or whole blocks of the boundary operators."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np

from ... import native
from ...arrays import Array, Index
from ...mesh.basis import gauss
from ...mesh.panels import HIGHEST_ORDER, Panels, make_panels
from ...mesh.surface_mesh import SurfaceMesh
from ..compiled_filler import CompiledFiller, data_members
from ..kernel import ColumnData
from .rules import COUNTS, MOST_POINTS, degrees, least_log_rho

TRIANGLE = 4
"""Is added to the order of triangles: the kind of a panel."""
ROOM = 256
"""Gauss points of a panel that the compiled code has room for."""
_panels = native.function("petcontact_panels", "pipiippp")
_field = native.function("petcontact_panel_field", "pipiipppp")
_columns = native.function("petcontact_panel_columns", native.FILLER)


@functools.lru_cache(maxsize=16)
def _rules(tolerance: float, most: tuple[int, ...]) -> Array:
    """The limits of the choice of Gauss points and their rules as native/space/panel.h reads them."""
    # half the sum of the distances from both ends over half the length is (ρ + 1/ρ)/2
    least = [np.cosh(np.minimum(least_log_rho(degree, tolerance), 700.0)) for degree in range(2 * HIGHEST_ORDER + 2)]
    points = np.zeros((2, len(COUNTS), COUNTS[-1]))
    for row, count in enumerate(COUNTS):
        points[:, row, :count] = gauss(count - 1)
    return np.concatenate([np.minimum(most, ROOM), np.ravel(least), COUNTS, points.ravel()]).astype(np.float64)


@functools.cache
def _weights(kind: int) -> Array:
    """Gauss weights times the basis on a rectangle or triangle of area 1, (numbers of points, 256, 16), zero beyond."""
    order, corners = kind % TRIANGLE, 3 if kind >= TRIANGLE else 4
    corner = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    panels, _, weight = make_panels(corner[None, :corners], order, np.arange(1))
    table = np.zeros((len(COUNTS), len(COUNTS), ROOM, (HIGHEST_ORDER + 1) ** 2))
    for i, j in itertools.product(range(len(COUNTS)), repeat=2):
        points = COUNTS[i] * COUNTS[j]
        if points <= ROOM:
            table[i, j, :points, : panels.n_nodes] = panels.rule((COUNTS[i], COUNTS[j]))[1][0].T / weight.sum()
    return table


def _records(panels: Panels) -> Array:
    """Centre 3, frame 9, size 1, polygon 8, degrees 2 and coefficients k² of each panel, (n, 23 + k²)."""
    n, corners = panels.corners.shape[:2]
    polygon = np.zeros((n, 8))
    polygon[:, : 2 * corners] = panels.polygon.reshape(n, -1)
    degree, coefficients = degrees(panels), panels.coefficients.reshape(n, -1)
    parts = (panels.centre, panels.frame.reshape(n, 9), panels.size[:, None], polygon, degree, coefficients)
    return np.concatenate(parts, axis=1)


def _kind(panels: Panels) -> int:
    return panels.order + (TRIANGLE if panels.corners.shape[1] == 3 else 0)


def available() -> bool:
    """Whether anything was compiled."""
    return _panels is not None


def compiled_integrals(
    points: Array, panels: Panels, poisson_ratio: float, tolerance: float, most: tuple[int, ...], kernel_g: Array | None,
    kernel_h: Array | None,
) -> None:  # fmt: skip
    """Fill `integrals`' results (3, 3, n k, m), G and H or one of them; `most` are the Gauss points of far panels."""
    assert _panels is not None
    points, records, kind = native.contiguous(points), _records(panels), _kind(panels)
    family = native.Record(kind, _rules(tolerance, most), _weights(kind), poisson_ratio)
    _panels(
        family.address, len(records), native.pointer(records), records.shape[1], len(points),
        *(native.pointer(a) for a in (points, kernel_g, kernel_h)),
    )  # fmt: skip


def compiled_field(
    points: Array, panels: Panels, poisson_ratio: float, tolerance: float, data: Array
) -> tuple[Array, tuple[Index, Index]] | None:
    """What panels add to displacement and stress at points inside the body, contracted with the boundary data.

    Parameters
    ----------
    points : (m, 3) array
        [length]
    panels : Panels
        n panels of k nodes.
    poisson_ratio, tolerance : float
    data : (n k, 6) array
        Traction over 2µ [-] and displacement [length] at their nodes.

    Returns
    -------
    field : (m, 10) array
        Displacement [length], stress over 2µ, and the share of the solid angle that the panels take.
    close : pair of arrays
        Panels and points too near for Gauss points, whose stress is missing. Nothing where nothing was compiled.
    """
    if _field is None:
        return None
    points, data, records, kind = native.contiguous(points), native.contiguous(data), _records(panels), _kind(panels)
    family = native.Record(kind, _rules(tolerance, (ROOM,) * len(MOST_POINTS)), _weights(kind), poisson_ratio)
    field, close = np.empty((len(points), 10)), np.zeros((len(records), len(points)), dtype=np.bool_)
    _field(
        family.address, len(records), native.pointer(records), records.shape[1], len(points),
        *(native.pointer(a) for a in (points, data, field, close)),
    )  # fmt: skip
    element, column = np.nonzero(close)
    return field, (element, column)


def compiled_columns(kernel: Any, mesh: SurfaceMesh, data: ColumnData) -> CompiledFiller | None:
    """None where nothing was compiled; the kernel is a `Kelvin3D`."""
    if _columns is None:
        return None
    kind, first = np.zeros(mesh.n_elements, dtype=np.int64), np.zeros(mesh.n_elements, dtype=np.int64)
    records, start = [], 0
    for panels in (batch.elements for batch in mesh.batches()):
        part = _records(panels)
        kind[panels.index] = _kind(panels)
        first[panels.index] = start + part.shape[1] * np.arange(len(part))
        records.append(part.ravel())
        start += part.size
    used = np.unique(kind).tolist()
    weights = np.array([native.pointer(_weights(k)) if k in used else 0 for k in range(2 * TRIANGLE)])
    return CompiledFiller("petcontact_panel_columns", native.Record(
        native.contiguous(mesh.x), *(native.contiguous(array, np.int64) for array in (mesh.element, mesh.first_node)), kind,
        np.concatenate(records), first, _rules(kernel.tolerance, MOST_POINTS), weights, kernel.material.poisson_ratio,
        kernel.unit_length, *data_members(data),
    ))  # fmt: skip
