"""Intersections of polygons in the plane, and quadrature on them.

Polygons are padded by repeating their last corner.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Index
from ...geometry.arcs import cross
from ...round_off import ROUNDED
from ..basis import gauss


def clip(subject: Array, clipper: Array) -> Array:
    """Return the intersections of convex polygons (Sutherland and Hodgman, CACM 17, 1974).

    Parameters
    ----------
    subject, clipper : (n, v, 2), (n, w, 2) arrays
        Corners, counter-clockwise; corners may be repeated.

    Returns
    -------
    (n, v + w, 2) array
        Corners of the intersections. All corners of an empty intersection coincide.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    >>> shared = clip(square, square + 0.5)
    >>> float(area(shared)[0])
    0.25
    """
    result = subject
    for k in range(clipper.shape[1]):
        start, end = clipper[:, k], clipper[:, (k + 1) % clipper.shape[1]]
        result = _on_the_left(result, start[:, None], (end - start)[:, None])
    return result


def shared(subject: Array, clipper: Array) -> list[tuple[Index, Array, Array]]:
    """Return the intersections of quadrilaterals with curved sides, as convex polygons with signs.

    A curved side bounds the straight quadrilateral and the sliver between them, which is added or
    taken away.

    Parameters
    ----------
    subject, clipper : (n, 4, m + 1, 2), (n, 4, l + 1, 2) arrays
        Points along each side, counter-clockwise, its corners first and last; sides of length 0 are
        allowed.

    Returns
    -------
    list of ((k,) int array, (k, v, 2) array, (k,) array)
        Which of the n, corners, and signs: first what the straight ones share, then all with
        slivers.

    Examples
    --------
    A square and one whose lower side is bent inwards by 0.1, a triangle:

    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> following = np.roll(corners, -1, axis=0)
    >>> sides = np.stack([corners, 0.5 * (corners + following), following], axis=1)
    >>> bent = sides.copy()
    >>> bent[0, 1, 1] = 0.1
    >>> parts = shared(sides[None], bent[None])
    >>> [round(float(sign @ area(polygon)), 9) for _, polygon, sign in parts]
    [1.0, -0.05]
    """
    pieces = list[tuple[Index, Array, Array]]()
    for own, sign in _straight_and_slivers(subject):
        for triangle, opposite in _straight_and_slivers(clipper):
            signs = sign * opposite
            apart = (own.max(axis=1) <= triangle.min(axis=1)) | (
                triangle.max(axis=1) <= own.min(axis=1)
            )
            near = np.flatnonzero((signs != 0.0) & ~apart.any(axis=1))
            polygon = clip(own[near], triangle[near])
            kept = area(polygon) > ROUNDED
            if kept.any() or not pieces:
                pieces.append((near[kept], polygon[kept], signs[near[kept]]))
    return pieces


def _straight_and_slivers(lines: Array) -> Iterator[tuple[Array, Array]]:
    """Yield the corners (n, 4, 2) of quadrilaterals with curved sides (n, 4, m + 1, 2), and their
    slivers.

    The slivers have signs, 0 for none.
    """
    yield lines[:, :, 0], np.ones(len(lines))
    for side in range(lines.shape[1]):
        sliver = lines[:, side]
        size = area(sliver)
        if (np.abs(size) > ROUNDED).any():
            ordered = np.where((size < 0.0)[:, None, None], sliver[:, ::-1], sliver)
            yield ordered, np.where(np.abs(size) > ROUNDED, np.sign(size), 0.0)


def _on_the_left(polygon: Array, start: Array, along: Array) -> Array:
    """Return the part of each polygon (n, v, 2) to the left of a line, (n, v + 1, 2)."""
    n, v, _ = polygon.shape
    side = cross(along, polygon - start)
    # a corner on the line, and a line through two places that are one
    side[np.abs(side) <= ROUNDED] = 0.0
    following, after = np.roll(polygon, -1, axis=1), np.roll(side, -1, axis=1)
    crosses = side * after < 0.0
    share = np.divide(side, side - after, out=np.zeros_like(side), where=crosses)
    # a corner that stays, then the point in which the edge after it crosses the line
    points = np.stack(
        [polygon, polygon + share[..., None] * (following - polygon)], axis=2
    ).reshape(n, 2 * v, 2)
    kept = np.stack([side >= 0.0, crosses], axis=2).reshape(n, 2 * v)
    order = np.argsort(~kept, axis=1, kind="stable")[:, : v + 1]
    last = np.maximum(kept.sum(axis=1) - 1, 0)
    order = np.take_along_axis(order, np.minimum(np.arange(v + 1), last[:, None]), axis=1)
    return np.take_along_axis(points, order[..., None], axis=1)


def area(polygon: Array) -> Array:
    """Return the areas (n,) of polygons (n, v, 2), positive if counter-clockwise."""
    away = polygon - polygon[:, :1]
    return np.asarray(0.5 * cross(away[:, :-1], away[:, 1:]).sum(axis=1))


def fan_rule(polygon: Array, points: int) -> tuple[Array, Array]:
    """Return a Gauss rule on convex polygons, on each triangle of the fan about their first corner.

    Parameters
    ----------
    polygon : (n, v, 2) array
    points : int
        q: polynomials of degree 2q - 2 are integrated exactly.

    Returns
    -------
    x : (n, (v - 2) q², 2) array
    weight : (n, (v - 2) q²) array
        Their sum is the area.
    """
    xi, w = gauss(points - 1)
    s = 0.5 * (1.0 + xi)
    # the square onto the triangle: (s, t) to barycentric coordinates (1 - t, t (1 - s), t s)
    first, second = (np.outer(s, factor).ravel() for factor in (1.0 - s, s))
    reference = np.outer(0.25 * w * s, w).ravel()
    origin = polygon[:, :1]
    a, b = polygon[:, 1:-1] - origin, polygon[:, 2:] - origin
    x = origin[:, None] + first[:, None] * a[:, :, None] + second[:, None] * b[:, :, None]
    weight = cross(a, b)[..., None] * reference
    return x.reshape(len(polygon), -1, 2), weight.reshape(len(polygon), -1)
