"""Whether triangles of a surface cross one another."""

from __future__ import annotations

import numpy as np
import scipy

from ..arrays import Array, Index

MARGIN = 1e-9
"""Of an edge's parameter and of barycentric coordinates: an edge that only ends on a triangle does not cross it."""


def first_crossing(points: Array, triangles: Index) -> Array | None:
    """A point (3,) where an edge of one triangle runs through another with which it shares no corner, None if none does.

    Parameters
    ----------
    points : (n, 3) array
    triangles : (t, 3) int array
    """
    corners = points[triangles]
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    tree = scipy.spatial.cKDTree(middle)
    # triangles by size: each looks for those that are no larger than itself
    order = np.argsort(radius)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    for first in range(0, len(triangles), 4096):
        mine = np.arange(first, min(first + 4096, len(triangles)))
        lists = tree.query_ball_point(middle[mine], 2.0 * radius[mine])
        one = np.repeat(mine, [len(found) for found in lists])
        other = np.concatenate([np.asarray(found, dtype=np.int64) for found in lists])
        keep = rank[other] < rank[one]
        one, other = one[keep], other[keep]
        apart = np.linalg.norm(middle[one] - middle[other], axis=1) > radius[one] + radius[other]
        shared = np.any(triangles[one][:, :, None] == triangles[other][:, None], axis=(1, 2))
        one, other = one[~apart & ~shared], other[~apart & ~shared]
        for a, b in ((one, other), (other, one)):
            place = _pierced(corners[a], corners[b])
            if place is not None:
                return place
    return None


def _pierced(edges_of: Array, triangle: Array) -> Array | None:
    """Where an edge of the first triangles (n, 3, 3) runs through the second ones (Möller and Trumbore, 1997)."""
    if not len(triangle):
        return None
    origin = triangle[:, 0]
    e_1, e_2 = triangle[:, 1] - origin, triangle[:, 2] - origin
    for k in range(3):
        start, direction = edges_of[:, k], edges_of[:, (k + 1) % 3] - edges_of[:, k]
        across = np.cross(direction, e_2)
        volume = np.sum(e_1 * across, axis=1)
        size = np.linalg.norm(direction, axis=1) * np.linalg.norm(e_1, axis=1) * np.linalg.norm(e_2, axis=1)
        proper = np.abs(volume) > MARGIN * size
        safe = np.where(proper, volume, 1.0)
        offset = start - origin
        u = np.sum(offset * across, axis=1) / safe
        turned = np.cross(offset, e_1)
        v = np.sum(direction * turned, axis=1) / safe
        t = np.sum(e_2 * turned, axis=1) / safe
        # closed: what runs through the joint of two triangles would slip between them
        inside = proper & (u > -MARGIN) & (v > -MARGIN) & (u + v < 1.0 + MARGIN) & (t > MARGIN) & (t < 1.0 - MARGIN)
        if inside.any():
            n = int(np.argmax(inside))
            return np.asarray(start[n] + t[n] * direction[n])
    return None
