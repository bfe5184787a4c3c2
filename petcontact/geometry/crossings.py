"""Whether triangles of a surface cross one another, and what lies inside of closed ones."""

from __future__ import annotations

import numpy as np
import scipy

from ..arrays import Array, Index, scattered
from ..round_off import WRITTEN


def first_crossing(points: Array, triangles: Index) -> Array | None:
    """A point (3,) where an edge of one triangle runs through another with which it shares no
    corner, None if none does.

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
    rank = scattered(np.arange(len(order)), order, len(order))
    for first in range(0, len(triangles), 4096):
        block = np.arange(first, min(first + 4096, len(triangles)))
        lists = tree.query_ball_point(middle[block], 2.0 * radius[block])
        first_of_pair = np.repeat(block, [len(neighbours) for neighbours in lists])
        second_of_pair = np.concatenate(
            [np.asarray(neighbours, dtype=np.int64) for neighbours in lists]
        )
        keep = rank[second_of_pair] < rank[first_of_pair]
        first_of_pair, second_of_pair = first_of_pair[keep], second_of_pair[keep]
        apart = (
            np.linalg.norm(middle[first_of_pair] - middle[second_of_pair], axis=1)
            > radius[first_of_pair] + radius[second_of_pair]
        )
        shared = np.any(
            triangles[first_of_pair][:, :, None] == triangles[second_of_pair][:, None], axis=(1, 2)
        )
        first_of_pair = first_of_pair[~apart & ~shared]
        second_of_pair = second_of_pair[~apart & ~shared]
        for a, b in ((first_of_pair, second_of_pair), (second_of_pair, first_of_pair)):
            place = _pierced(corners[a], corners[b])
            if place is not None:
                return place
    return None


def _pierced(edges_of: Array, triangle: Array) -> Array | None:
    """Where an edge of the first triangles (n, 3, 3) runs through the second ones (Möller and
    Trumbore, 1997)."""
    if not len(triangle):
        return None
    origin = triangle[:, 0]
    e_1, e_2 = triangle[:, 1] - origin, triangle[:, 2] - origin
    for k in range(3):
        start, direction = edges_of[:, k], edges_of[:, (k + 1) % 3] - edges_of[:, k]
        across = np.cross(direction, e_2)
        volume = np.sum(e_1 * across, axis=1)
        size = (
            np.linalg.norm(direction, axis=1)
            * np.linalg.norm(e_1, axis=1)
            * np.linalg.norm(e_2, axis=1)
        )
        proper = np.abs(volume) > WRITTEN * size
        safe = np.where(proper, volume, 1.0)
        offset = start - origin
        u = np.sum(offset * across, axis=1) / safe
        turned = np.cross(offset, e_1)
        v = np.sum(direction * turned, axis=1) / safe
        t = np.sum(e_2 * turned, axis=1) / safe
        # closed: what runs through the joint of two triangles would slip between them
        inside = (
            proper
            & (u > -WRITTEN)
            & (v > -WRITTEN)
            & (u + v < 1.0 + WRITTEN)
            & (t > WRITTEN)
            & (t < 1.0 - WRITTEN)
        )
        if inside.any():
            n = int(np.argmax(inside))
            return np.asarray(start[n] + t[n] * direction[n])
    return None


def winding(corners: Array, points: Array) -> Array:
    """|Solid angle| (n,) of closed triangles (t, 3, 3) from points (n, 3), over 4π: 1 inside, 0
    outside.

    By A. van Oosterom and J. Strackee, IEEE Trans. BME 30 (1983) 125-126.

    >>> unit = np.vstack([np.zeros(3), np.eye(3)])
    >>> faces = unit[np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])]
    >>> winding(faces, np.array([[0.1, 0.2, 0.3], [1.0, 1.0, 1.0]])).round(12).tolist()
    [1.0, 0.0]
    """
    # pairs of a point and a triangle that are seen at once
    result, step = np.empty(len(points)), max(1, 100_000 // max(len(corners), 1))
    for first in range(0, len(points), step):
        x = points[first : first + step].T[:, :, None]
        # components (n, t) of the ways from the points to the three corners
        a, b, c = ([corners[:, k, i] - x[i] for i in range(3)] for k in range(3))
        la, lb, lc = (np.sqrt(_dot(v, v)) for v in (a, b, c))
        above = _dot(
            a, [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]]
        )
        below = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
        result[first : first + step] = np.abs(np.sum(np.arctan2(above, below), axis=1)) / (
            2.0 * np.pi
        )
    return result


def _dot(a: list[Array], b: list[Array]) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
