"""Panels cut into four; nodes lie inside of panels, so that corners may hang on the edges of neighbours."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, Mask
from ...mesh.surface_mesh import SurfaceMesh


def quartered(mesh: SurfaceMesh, marked: Mask) -> SurfaceMesh:
    """The mesh with each marked panel replaced by four at the middles of its edges, in its place.

    Parameters
    ----------
    mesh : SurfaceMesh
    marked : (n_elements,) bool array
    """
    pieces, parent = [mesh.corners[~marked]], [np.flatnonzero(~marked)]
    for triangle in (False, True):
        mine = np.flatnonzero(marked & (np.isnan(mesh.corners[:, 3, 0]) == triangle))
        pieces.append(_quarters(mesh.corners[mine, : 3 if triangle else 4]).reshape(-1, 4, 3))
        parent.append(np.repeat(mine, 4))
    numbers = np.concatenate(parent)
    order = np.argsort(numbers, kind="stable")
    old: Index = numbers[order]
    return SurfaceMesh(np.concatenate(pieces)[order], mesh.order[old], mesh.part[old], mesh.part_names)


def _quarters(corners: Array) -> Array:
    """Corners (n, 4, 4, 3) of the quarters of panels (n, 3 or 4, 3)."""
    middle = 0.5 * (corners + np.roll(corners, -1, axis=1))
    count = corners.shape[1]
    if count == 4:
        centre = corners.mean(axis=1)
        inner = [np.stack([corners[:, k], middle[:, k], centre, middle[:, k - 1]], axis=1) for k in range(4)]
        return np.stack(inner, axis=1)
    none = np.full_like(corners[:, 0], np.nan)
    outer = [np.stack([corners[:, k], middle[:, k], middle[:, k - 1], none], axis=1) for k in range(3)]
    return np.stack([*outer, np.concatenate([middle, none[:, None]], axis=1)], axis=1)
