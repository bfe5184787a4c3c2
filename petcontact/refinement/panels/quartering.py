"""Panels cut into four; nodes lie inside of panels, so that corners may hang on the edges of neighbours."""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Mask
from ...geometry.surface import SolidSurface
from ...mesh.panels import monomials, reference_nodes
from ...mesh.surface_mesh import SurfaceMesh

POINTS = {
    3: np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]]),
    4: np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [0, -1], [1, 0], [0, 1], [-1, 0], [0, 0]], dtype=float),
}
"""Corners, middles of the sides, and of quadrilaterals the middle, in the coordinates of `reference_nodes`."""


def quartered(mesh: SurfaceMesh, marked: Mask, surface: SolidSurface | None = None) -> SurfaceMesh:
    """The mesh with each marked panel replaced by four in its reference coordinates, in its place.

    Parameters
    ----------
    mesh : SurfaceMesh
    marked : (n_elements,) bool array
    surface : SolidSurface, optional
        The exact one, onto which the points of new panels are brought.
    """
    points, parent = [np.concatenate([mesh.corners, mesh.middles], axis=1)[~marked]], [np.flatnonzero(~marked)]
    for number in np.unique(mesh.kind[marked]).tolist():
        mine = np.flatnonzero(marked & (mesh.kind == number))
        corners = 3 if np.isnan(mesh.corners[mine[0], 3, 0]) else 4
        curved = not np.isnan(mesh.middles[mine[0], 0, 0])
        given = [mesh.corners[mine, :corners], *([mesh.middles[mine, : 2 * corners - 3]] if curved else [])]
        found = np.einsum("pqk,nkd->npqd", _quarters(corners, curved), np.concatenate(given, axis=1))
        piece = np.full((len(mine), 4, 9, 3), np.nan)
        piece[:, :, :corners] = found[:, :, :corners]
        piece[:, :, 4 : 4 + found.shape[2] - corners] = found[:, :, corners:]
        if surface is not None:
            piece = surface.onto(mesh.part[mine], piece.reshape(len(mine), -1, 3)).reshape(piece.shape)
        points.append(piece.reshape(-1, 9, 3))
        parent.append(np.repeat(mine, 4))
    numbers = np.concatenate(parent)
    order = np.argsort(numbers, kind="stable")
    old, new = numbers[order], np.concatenate(points)[order]
    return SurfaceMesh(new[:, :4], mesh.order[old], mesh.part[old], mesh.part_names, new[:, 4:])


@functools.cache
def _quarters(corners: int, curved: bool) -> Array:
    """Points (k,) that define a panel to those of its quarters, (4, k, k)."""
    here = POINTS[corners] if curved else POINTS[corners][:corners]
    middle = POINTS[corners][corners : 2 * corners]
    if corners == 4:
        pieces = [[here[k], middle[k], POINTS[4][8], middle[k - 1]] for k in range(4)]
    else:
        pieces = [[here[k], middle[k], middle[k - 1]] for k in range(3)] + [list(middle)]
    linear, exponents = (reference_nodes(corners, degree)[1] for degree in (1, 2 if curved else 1))
    shape = monomials(here, linear) @ np.linalg.inv(monomials(POINTS[corners][:corners], linear))
    inverse = np.linalg.inv(monomials(here, exponents))
    return np.stack([monomials(shape @ np.array(piece), exponents) @ inverse for piece in pieces])
