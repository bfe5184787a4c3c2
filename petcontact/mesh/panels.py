"""Flat panels of order 0 to 3 in space: quadrilaterals and triangles with interior nodes."""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array, Index, Rows
from ..record import record
from .basis import gauss

HIGHEST_ORDER = 3
_TRIANGLE_ORBITS = {
    0: ((1.0 / 3.0, 1.0 / 3.0),),
    1: ((1.0 / 6.0, 1.0 / 6.0),),
    # degree 4 (Dunavant, IJNME 21, 1985) and degree 5: the weights are the integrals of the basis
    # and positive
    2: ((0.091576213509770743, 0.091576213509770743), (0.44594849091596489, 0.44594849091596489)),
    3: ((1.0 / 3.0, 1.0 / 3.0), (0.055, 0.055), (0.07020314414956398, 0.29501595385862195)),
}
"""Barycentric coordinates (a, b, 1-a-b); each stands for all its permutations."""


@functools.cache
def reference_nodes(corners: int, order: int) -> tuple[Array, Array]:
    """Return the nodes of the square [-1, 1]² or of the triangle with corners (0, 0), (1, 0), (0,
    1), and exponents of its monomials.

    Parameters
    ----------
    corners : int
        4 or 3.
    order : int
        p, 0 to 3.

    Returns
    -------
    nodes : (k, 2) array
        (p+1)² Gauss points, the second coordinate running fastest, or (p+1)(p+2)/2 points of a
        triangle.
    exponents : (k, 2) int array
        (a, b) of ξ^a η^b: a, b <= p on quadrilaterals, a + b <= p on triangles.
    """
    limit = order if corners == 3 else 2 * order
    exponents = np.array(
        [(a, b) for a in range(order + 1) for b in range(order + 1) if a + b <= limit]
    )
    if corners == 4:
        xi = gauss(order)[0]
        nodes = np.stack(np.meshgrid(xi, xi, indexing="ij"), axis=-1).reshape(-1, 2)
    else:
        points = []
        for a, b in _TRIANGLE_ORBITS[order]:
            c = 1.0 - a - b
            permutations = ((a, b), (b, c), (c, a), (b, a), (c, b), (a, c))
            points += [
                p
                for k, p in enumerate(permutations)
                if not any(np.allclose(p, q) for q in permutations[:k])
            ]
        nodes = np.array(points)
    for array in (nodes, exponents):
        array.setflags(write=False)
    return nodes, exponents


def monomials(points: Array, exponents: Array) -> Array:
    """Return ξ^a η^b at points (..., 2), (..., k)."""
    powers = np.stack([points**k for k in range(int(exponents.max(initial=0)) + 1)], axis=-1)
    return np.asarray(powers[..., 0, exponents[:, 0]] * powers[..., 1, exponents[:, 1]])


def monomial_slopes(points: Array, exponents: Array) -> Array:
    """Return derivatives of ξ^a η^b by both at points (..., 2), (..., k, 2)."""
    lowered = np.maximum(exponents[None] - np.eye(2, dtype=int)[:, None], 0)
    return np.stack([exponents[:, c] * monomials(points, lowered[c]) for c in range(2)], axis=-1)


@record
class Panels(Rows):
    """Flat panels of one shape and order, each with a frame and the polynomials of its basis.

    Attributes
    ----------
    corners : (n, c, 3) array
        Counter-clockwise seen from outside the body, c = 4 or 3 [length].
    order : int
        p, 0 to 3.
    index : (n,) int array
        Number of each panel in the mesh.
    centre : (n, 3) array
        Mean of the corners.
    frame : (n, 3, 3) array
        Rows: two directions in the plane and the outward normal.
    size : (n,) array
        Largest distance of a corner from the centre: the unit of local coordinates [length].
    polygon : (n, c, 2) array
        Corners in local coordinates [-].
    coefficients : (n, k, k) array
        Basis function b is Σ_m coefficients[b, m] ξ^a η^b of local coordinates, with the exponents
        of `reference_nodes`.
    """

    corners: Array
    order: int
    index: Index
    centre: Array
    frame: Array
    size: Array
    polygon: Array
    coefficients: Array

    @property
    def n_nodes(self) -> int:
        """Number of nodes of a panel."""
        return int(self.coefficients.shape[1])

    @property
    def n_corners(self) -> int:
        """3 of triangles, 4 of quadrilaterals."""
        return int(self.corners.shape[1])

    @property
    def exponents(self) -> Array:
        """Exponents of the basis' monomials, (k, 2)."""
        return reference_nodes(self.n_corners, self.order)[1]

    @property
    def nodes(self) -> Array:
        """Nodes in local coordinates, (n, k, 2)."""
        return _mapped(self.polygon, reference_nodes(self.n_corners, self.order)[0])

    @property
    def chord(self) -> Panels:
        """Flat panels through the corners, here the panels themselves."""
        return self

    @property
    def shape(self) -> Array:
        """Positions as polynomials of local coordinates, like those of `QuadraticCells`: (n, 9, 3)
        [length]."""
        result = np.zeros((len(self.index), 9, 3))
        result[:, 0], result[:, [3, 1]] = self.centre, self.size[:, None, None] * self.frame[:, :2]
        return result

    def basis(self, local: Array) -> Array:
        """Return values (n, q, k) of the basis at points (n, q, 2) of local coordinates."""
        return np.asarray(monomials(local, self.exponents) @ self.coefficients.transpose(0, 2, 1))

    def mapped(self, reference: Array) -> Array:
        """Return local coordinates (n, q, 2) of places (q, 2) of the reference square or
        triangle."""
        return _mapped(self.polygon, reference)

    def feet(self, x: Array) -> tuple[Array, Array, Array]:
        """Return the foot of one point on each panel's plane, for points (n, 3).

        The result is local coordinates (n, 2) of the foot, the distance from the plane [length],
        and the distance of the foot inside the panel over `size`, negative outside.
        """
        away = x - self.centre
        local = np.einsum("ncd,nd->nc", self.frame[:, :2], away) / self.size[:, None]
        edge = np.roll(self.polygon, -1, axis=1) - self.polygon
        to = local[:, None] - self.polygon
        inside = (edge[..., 0] * to[..., 1] - edge[..., 1] * to[..., 0]) / np.linalg.norm(
            edge, axis=2
        )
        return local, np.abs(np.sum(away * self.frame[:, 2], axis=1)), inside.min(axis=1)

    def basis_slopes(self, local: Array) -> Array:
        """Return derivatives (n, q, k, 2) of the basis by the two local coordinates at points (n,
        q, 2)."""
        return np.asarray(
            np.einsum("nqmc,nbm->nqbc", monomial_slopes(local, self.exponents), self.coefficients)
        )

    def tangent_vectors(self, local: Array) -> Array:
        """Return derivatives (n, q, 2, 3) of the position by the local coordinates at points (n, q,
        2) [length]."""
        vectors = self.size[:, None, None] * self.frame[:, :2]
        return np.broadcast_to(vectors[:, None], (*local.shape[:2], 2, 3))

    def rule(self, points: tuple[int, int]) -> tuple[Array, Array]:
        """Return a tensor Gauss rule on each panel, a triangle being a quadrilateral with two
        corners in one.

        Parameters
        ----------
        points : (int, int)
            Points along the two directions of the frame's first and second axis.

        Returns
        -------
        x : (n, q, 3) array
            [length]
        weight : (n, k, q) array
            Times the basis: Σ_q weight[b, q] f(x_q) is the integral of f L_b [length²].
        """
        local, area = rule_points(self.polygon, points)
        x = self.centre[:, None] + self.size[:, None, None] * (local @ self.frame[:, :2])
        return x, (self.basis(local) * (area * self.size[:, None] ** 2)[..., None]).transpose(
            0, 2, 1
        )


def rule_points(polygon: Array, points: tuple[int, int]) -> tuple[Array, Array]:
    """Return points (n, q, 2) and weights (n, q) of a tensor Gauss rule on polygons (n, 3 or 4,
    2)."""
    (xi, wx), (eta, wy) = gauss(points[0] - 1), gauss(points[1] - 1)
    s, t = (c.ravel() for c in np.meshgrid(xi, eta, indexing="ij"))
    a, b, c, d = (polygon[:, min(k, polygon.shape[1] - 1), None] for k in range(4))
    s, t = s[:, None], t[:, None]
    local = 0.25 * (
        (1 - s) * (1 - t) * a
        + (1 + s) * (1 - t) * b
        + (1 + s) * (1 + t) * c
        + (1 - s) * (1 + t) * d
    )
    along = 0.25 * ((1 - t) * (b - a) + (1 + t) * (c - d))
    up = 0.25 * ((1 - s) * (d - a) + (1 + s) * (c - b))
    return local, (along[..., 0] * up[..., 1] - along[..., 1] * up[..., 0]) * np.outer(
        wx, wy
    ).ravel()


def make_panels(corners: Array, order: int, index: Index) -> tuple[Panels, Array, Array]:
    """Return panels through given corners, their nodes and the nodes' weights.

    Parameters
    ----------
    corners : (n, c, 3) array
        Corners of flat convex panels, counter-clockwise seen from outside.
    order : int
    index : (n,) int array

    Returns
    -------
    panels : Panels
    x : (n, k, 3) array
        [length]
    weight : (n, k) array
        Integrals of the basis [length²].
    """
    centre = corners.mean(axis=1)
    diagonal = (corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
    normal = (
        np.cross(*diagonal)
        if corners.shape[1] == 4
        else np.cross(corners[:, 1] - corners[:, 0], diagonal[0])
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    first = (
        corners[:, 1]
        - corners[:, 0]
        + (corners[:, 2] - corners[:, 3] if corners.shape[1] == 4 else 0.0)
    )
    first -= np.sum(first * normal, axis=1, keepdims=True) * normal
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    frame = np.stack([first, np.cross(normal, first), normal], axis=1)
    offset = corners - centre[:, None]
    size = np.linalg.norm(offset, axis=2).max(axis=1)
    polygon = np.einsum("nkj,ncj->nck", frame[:, :2], offset) / size[:, None, None]
    nodes, exponents = reference_nodes(corners.shape[1], order)
    local = _mapped(polygon, nodes)
    coefficients = np.linalg.inv(monomials(local, exponents)).transpose(0, 2, 1)
    panels = Panels(
        corners, order, index, centre, frame, size, polygon, np.ascontiguousarray(coefficients)
    )
    weight = panels.rule((order + 2, order + 2))[1].sum(axis=2)
    return panels, centre[:, None] + size[:, None, None] * (local @ frame[:, :2]), weight


def _mapped(polygon: Array, nodes: Array) -> Array:
    """Return reference nodes in local coordinates, (n, k, 2): bilinear on quadrilaterals, affine on
    triangles."""
    return np.asarray(np.einsum("cq,ncj->nqj", linear_shapes(nodes, polygon.shape[1]), polygon))


def linear_shapes(nodes: Array, corners: int) -> Array:
    """Return the shape functions (c, k) of an element's corners at reference nodes (k, 2).

    They are bilinear on quadrilaterals and linear on triangles.
    """
    s, t = nodes.T
    if corners < 4:
        return np.stack([1.0 - s - t, s, t])
    quarters = [(1 - s) * (1 - t), (1 + s) * (1 - t), (1 + s) * (1 + t), (1 - s) * (1 + t)]
    return np.asarray(0.25 * np.stack(quarters))
