"""Choice of the coordinates along which panels are halved.

Edges of contact and of bodies need panels that are narrow across them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from ...mesh.basis import gauss, lagrange_coefficients
from ...mesh.surface_mesh import CURVED, TRIANGLE, SurfaceMesh
from ...round_off import WRITTEN
from .edges import TOGETHER
from .tail import distances, rim_of

SLIGHT = 0.1
"""Squared tail along one coordinate over that along the other from which both are halved [-]."""
NARROWEST = {False: 8.0, True: 4.0}
"""Largest ratio of the sides of flat (False) and curved (True) panels. With flat panels of ratio 32
the preconditioner fails."""


def sides(mesh: SurfaceMesh) -> Array:
    """Return the extents of panels along their two coordinates, as vectors, (n_elements, 2, 3)
    [length]."""
    a, b, c, d = mesh.corners.transpose(1, 0, 2)
    triangle = np.isnan(d[:, :1])
    along = (
        np.where(triangle, b - a, 0.5 * (b + c - a - d)),
        np.where(triangle, c - a, 0.5 * (c + d - a - b)),
    )
    return np.stack(along, axis=1)


def directions(mesh: SurfaceMesh, values: Array) -> Array:
    """Return the squared highest coefficients of nodal values (n, c) along both coordinates,
    (n_elements, 2) [values²].

    They are equal on triangles and on panels of order 0.
    """
    result = np.ones((mesh.n_elements, 2))
    for kind in np.unique(mesh.kind).tolist():
        order = kind % TRIANGLE
        if kind & TRIANGLE or not order:
            continue
        panels = np.flatnonzero(mesh.kind == kind)
        nodes = mesh.first_node[panels][:, None] + np.arange((order + 1) ** 2)
        grid = values[nodes].reshape(len(panels), order + 1, order + 1, -1)
        last, weight = lagrange_coefficients(order)[:, order], gauss(order)[1]
        for axis, coefficients in enumerate(
            (np.einsum("nijc,i->njc", grid, last), np.einsum("nijc,j->nic", grid, last))
        ):
            result[panels, axis] = np.einsum("nkc,k->n", coefficients**2, weight)
    return result


def halved(mesh: SurfaceMesh, marked: Mask, square: Array) -> Mask:
    """Return along which coordinates marked panels (n_elements,) are halved, (n_elements, 2).

    Both are halved unless the tail along one of them is small. `square` are the values of
    `directions`. No panel gets too narrow.
    """
    along = (square > SLIGHT * square.max(axis=1, keepdims=True)) | too_narrow(mesh)
    return np.asarray((along | ~along.any(axis=1, keepdims=True)) & marked[:, None])


def too_narrow(mesh: SurfaceMesh) -> Mask:
    """Return along which coordinates panels are halved, too, where they are halved across, so that
    none gets too narrow, (n_elements, 2)."""
    length = np.linalg.norm(sides(mesh), axis=2)
    narrow = np.where(mesh.kind & CURVED > 0, NARROWEST[True], NARROWEST[False])[:, None]
    return np.asarray(length > 0.75 * narrow * length[:, ::-1])


def matched(sides: Array, others: Array) -> Index:
    """Return the coordinate (k, 2) of other panels that corresponds to each coordinate of given
    panels.

    Both arguments are vectors (k, 2, 3).
    """
    cosine = np.abs(
        np.einsum(
            "kad,kbd->kab", *(v / np.linalg.norm(v, axis=2, keepdims=True) for v in (sides, others))
        )
    )
    crossed = cosine[:, 0, 1] + cosine[:, 1, 0] > cosine[:, 0, 0] + cosine[:, 1, 1]
    return np.where(crossed[:, None], [1, 0], [0, 1])


def at_edges(
    mesh: SurfaceMesh, part: str, pressing: Sequence[Array], mirrors: Sequence[str] = ()
) -> Mask:
    """Return the coordinates along which quadrilaterals of a part end at its rim, or at a line that
    presses on it, (n_elements, 2).

    Points (k, 3) of such lines are `pressing`, see `gap_edges`. A part in a plane of symmetry,
    among `mirrors`, makes no rim, see `rim_of`.
    """
    panels = mesh.elements_of(part)
    panels = panels[mesh.kind[panels] & TRIANGLE == 0]
    corners = mesh.corners[panels]
    following = np.roll(corners, -1, axis=1)
    bent = ~np.isnan(mesh.middles[panels, :4])
    middle = np.where(bent, mesh.middles[panels, :4], 0.5 * (corners + following)).reshape(-1, 3)
    near = TOGETHER * np.linalg.norm(following - corners, axis=2).ravel()
    rim = rim_of(mesh, mesh.nodes_of(part), mesh.part_names.index(part), mirrors)
    off = distances(rim, middle, near)
    for points in pressing:
        off = np.minimum(off, _off_line(points, middle))
    result = np.zeros((mesh.n_elements, 2), dtype=bool)
    # the first coordinate runs from the last side to the second one
    result[panels] = (off <= near).reshape(-1, 2, 2).any(axis=1)[:, ::-1]
    return result


def _off_line(points: Array, x: Array) -> Array:
    """Return the distance (n,) of places (n, 3) from the line through points (k, 3) [length];
    infinite where these do not lie on one."""
    middle = points.mean(axis=0)
    size, ways = np.linalg.svd(points - middle, full_matrices=False)[1:]
    if size[1] > WRITTEN * size[0]:
        return np.full(len(x), np.inf)
    return np.asarray(np.linalg.norm(np.cross(x - middle, ways[0]), axis=1))
