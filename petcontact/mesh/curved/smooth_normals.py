"""Normals of the smooth surfaces that curved panels stand for, at their nodes.

A quadratic panel follows a surface to order h⁴, its normal only to h³, so that neighbours meet at
small angles. Here each panel is a height over the plane of its corners. The height is a polynomial
of degree 4. It has the panel's points, and in these the mean normals of the panels that meet there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from ...arrays import Array, Index
from ...round_off import SINGLE
from ..panels import monomial_slopes, monomials
from .curved_panels import CurvedPanels

SMOOTH = 0.9
"""Least cosine between normals of panels that meet on a smooth surface; a smaller one is an
edge."""
QUADRATIC, HEIGHT = (
    np.array([(a, b) for a in range(d + 1) for b in range(d + 1 - a)]) for d in (2, 4)
)
"""Exponents of the heights of degree 2 and 4."""


def smooth_normals(groups: Sequence[CurvedPanels]) -> list[Array]:
    """Return unit normals at the nodes of all curved panels of a body, (n, k, 3) for each group.

    Normals at the panels' points are those of the panels, or those of quadratic heights, which suit
    spheres. Those that differ less between panels are taken.

    Examples
    --------
    >>> import numpy as np
    >>> from petcontact.mesh.curved.curved_panels import CurvedPanels
    >>> corners = np.eye(3)
    >>> middles = 0.5**0.5 * (corners + np.roll(corners, -1, axis=0))
    >>> octant = CurvedPanels(np.concatenate([corners, middles])[None], 0, np.array([0]))
    >>> smooth_normals([octant])[0].round(6).tolist()
    [[[0.57735, 0.57735, 0.57735]]]
    """
    if not groups:
        return []
    points = [_local(group, group.points) for group in groups]
    candidates = (
        [group.normals(group.each(group.places)) for group in groups],
        [
            _normals(group, at, _through(at), QUADRATIC)
            for group, at in zip(groups, points, strict=True)
        ],
    )
    pairs = _pairs(groups)
    flat = [np.concatenate([normal.reshape(-1, 3) for normal in each]) for each in candidates]
    kinks = [np.sum((each[pairs[0]] - each[pairs[1]]) ** 2) for each in flat]
    mean = _mean(groups, flat[int(np.argmin(kinks))], pairs)
    means = np.split(mean, np.cumsum([group.points[..., 0].size for group in groups])[:-1])
    return [
        _normals(
            group,
            _local(group, group.at(group.nodes)[0]),
            _height(group, at, each.reshape(at.shape)),
            HEIGHT,
        )
        for group, at, each in zip(groups, points, means, strict=True)
    ]


def _local(panels: CurvedPanels, x: Array) -> Array:
    """Return points (n, q, 3) in the frames of the panels' corners, over their size."""
    chord = panels.chord
    return np.asarray(
        np.einsum("nij,nqj->nqi", chord.frame, x - chord.centre[:, None])
        / chord.size[:, None, None]
    )


def _through(points: Array) -> Array:
    """Return coefficients (n, 6) of quadratic heights through points (n, q, 3), by least
    squares."""
    return np.asarray(
        np.einsum(
            "ncq,nq->nc", np.linalg.pinv(monomials(points[..., :2], QUADRATIC)), points[..., 2]
        )
    )


def _normals(panels: CurvedPanels, points: Array, height: Array, exponents: Array) -> Array:
    """Return unit normals (n, q, 3) at points of heights with coefficients (n, c)."""
    slope = np.einsum("nc,nqci->nqi", height, monomial_slopes(points[..., :2], exponents))
    local = np.concatenate([-slope, np.ones_like(slope[..., :1])], axis=2)
    return np.asarray(
        np.einsum(
            "nij,nqi->nqj", panels.chord.frame, local / np.linalg.norm(local, axis=2, keepdims=True)
        )
    )


def _pairs(groups: Sequence[CurvedPanels]) -> tuple[Index, Index]:
    """Return the numbers of coinciding points of panels that meet smoothly."""
    x = np.concatenate([group.points.reshape(-1, 3) for group in groups])
    normal = np.concatenate(
        [group.normals(group.each(group.places)).reshape(-1, 3) for group in groups]
    )
    least = min(float(group.chord.size.min()) for group in groups)
    i, j = scipy.spatial.cKDTree(x).query_pairs(SINGLE * least, output_type="ndarray").T
    smooth = np.sum(normal[i] * normal[j], axis=1) > SMOOTH
    return i[smooth], j[smooth]


def _mean(groups: Sequence[CurvedPanels], normal: Array, pairs: tuple[Index, Index]) -> Array:
    """Return the unit mean of the normals (q, 3) at the same point.

    The weight of a panel is 1/h³, since its error is of order h³.
    """
    share = (
        np.concatenate([np.repeat(group.chord.size, group.points.shape[1]) for group in groups])[
            :, None
        ]
        ** -3.0
    )
    mean = share * normal
    for one, other in (pairs, pairs[::-1]):
        np.add.at(mean, one, (share * normal)[other])
    return np.asarray(mean / np.linalg.norm(mean, axis=1, keepdims=True))


def _height(panels: CurvedPanels, points: Array, normal: Array) -> Array:
    """Return coefficients (n, c) of the heights with given points (n, q, 3) and normals, by least
    squares."""
    local = np.einsum("nij,nqj->nqi", panels.chord.frame, normal)
    # two panels meet in the middle of a side only: it weighs less than corners
    weight = np.where(np.arange(points.shape[1]) < panels.n_corners, 1.0, 0.3)
    slope = -local[..., :2] / np.maximum(local[..., 2:], 0.1)
    rows = [monomials(points[..., :2], HEIGHT)]
    rows += [
        weight[:, None] * each
        for each in np.moveaxis(monomial_slopes(points[..., :2], HEIGHT), -1, 0)
    ]
    wanted = np.concatenate(
        [points[..., 2], weight * slope[..., 0], weight * slope[..., 1]], axis=1
    )
    return np.asarray(np.einsum("ncq,nq->nc", np.linalg.pinv(np.concatenate(rows, axis=1)), wanted))
