"""Along which of its two coordinates a panel is to be halved: edges of contact and of bodies ask
for narrow panels."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, Mask
from ...geometry.surface import BoxSurface
from ...mesh.basis import gauss, lagrange_coefficients
from ...mesh.surface_mesh import CURVED, TRIANGLE, SurfaceMesh
from ...round_off import WRITTEN

SLIGHT = 0.1
"""Share of the squared tail along one coordinate over that along the other from which on both are
halved."""
NARROWEST = {False: 8.0, True: 4.0}
"""Largest ratio of the sides of flat panels, and of curved ones. On flat ones of 32 the
preconditioner fails."""


def sides(mesh: SurfaceMesh) -> Array:
    """How far panels reach along their two coordinates, as vectors, (n_elements, 2, 3) [length]."""
    a, b, c, d = mesh.corners.transpose(1, 0, 2)
    triangle = np.isnan(d[:, :1])
    along = (
        np.where(triangle, b - a, 0.5 * (b + c - a - d)),
        np.where(triangle, c - a, 0.5 * (c + d - a - b)),
    )
    return np.stack(along, axis=1)


def directions(mesh: SurfaceMesh, values: Array) -> Array:
    """Squares of the highest coefficients of nodal values (n, c) along the two coordinates,
    (n_elements, 2) [values²]; equal on triangles and on panels of order 0."""
    result = np.ones((mesh.n_elements, 2))
    for kind in np.unique(mesh.kind).tolist():
        order = kind % TRIANGLE
        if kind & TRIANGLE or not order:
            continue
        mine = np.flatnonzero(mesh.kind == kind)
        nodes = mesh.first_node[mine][:, None] + np.arange((order + 1) ** 2)
        grid = values[nodes].reshape(len(mine), order + 1, order + 1, -1)
        last, weight = lagrange_coefficients(order)[:, order], gauss(order)[1]
        for axis, found in enumerate(
            (np.einsum("nijc,i->njc", grid, last), np.einsum("nijc,j->nic", grid, last))
        ):
            result[mine, axis] = np.einsum("nkc,k->n", found**2, weight)
    return result


def halved(mesh: SurfaceMesh, marked: Mask, square: Array) -> Mask:
    """Along which coordinates marked panels (n_elements,) are halved, (n_elements, 2), by the
    squares of `directions`.

    Both, but where the tail along one is slight, and the panel does not get too narrow.
    """
    length = np.linalg.norm(sides(mesh), axis=2)
    narrow = np.where(mesh.kind & CURVED > 0, NARROWEST[True], NARROWEST[False])[:, None]
    along = (square > SLIGHT * square.max(axis=1, keepdims=True)) | (
        length > 0.75 * narrow * length[:, ::-1]
    )
    return np.asarray((along | ~along.any(axis=1, keepdims=True)) & marked[:, None])


def matched(sides: Array, others: Array) -> Index:
    """The coordinate of other panels, (k, 2), that goes with each one of panels: vectors (k, 2, 3)
    of both."""
    cosine = np.abs(
        np.einsum(
            "kad,kbd->kab", *(v / np.linalg.norm(v, axis=2, keepdims=True) for v in (sides, others))
        )
    )
    crossed = cosine[:, 0, 1] + cosine[:, 1, 0] > cosine[:, 0, 0] + cosine[:, 1, 1]
    return np.where(crossed[:, None], [1, 0], [0, 1])


def at_edges(mesh: SurfaceMesh, box: BoxSurface) -> Mask:
    """Along which coordinates panels of a box end at an edge of their face, (n_elements, 2)."""
    low, high = mesh.boxes
    vectors = np.abs(sides(mesh))
    near = WRITTEN * (box.upper - box.lower)
    ends = (low - box.lower < near) | (box.upper - high < near)
    axis = vectors.argmax(axis=2)
    return np.take_along_axis(ends, axis, axis=1)
