"""Curved panels of order 0 to 3 in space: quadratic cells with polynomial bases in reference
coordinates."""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Index
from ...geometry.quadratic import REFERENCE, WALLS, QuadraticCells, reference_points, samples
from ...record import field, record
from ...untyped import Keyed
from ..panels import Panels, make_panels, monomial_slopes, monomials, reference_nodes, rule_points

WEIGHT_POINTS = 12
"""Gauss points in each direction for the integrals of the basis; the area factor is no
polynomial."""


@functools.cache
def reference_rule(corners: int, points: tuple[int, int]) -> tuple[Array, Array]:
    """Return points (q, 2) and weights (q,) of a tensor Gauss rule on a reference element."""
    local, weight = rule_points(REFERENCE[corners][None], points)
    return local[0], weight[0]


@record
class CurvedPanels(QuadraticCells):
    """Quadratic panels of one shape and order, with the reference element's coordinates.

    Attributes
    ----------
    points : (n, 6 or 9, 3) array
        Points as in `QuadraticCells`.
    order : int
        p, 0 to 3.
    index : (n,) int array
        Number of each panel in the mesh.
    found : dict of (n, ...) arrays
        Stored results for each panel, by name; `take` keeps those of the chosen panels.
    """

    order: int
    index: Index
    found: Keyed = field(default_factory=dict, repr=False, compare=False)

    @property
    def n_nodes(self) -> int:
        """Number of nodes of a panel."""
        return len(self.exponents)

    @property
    def exponents(self) -> Array:
        """Exponents of the basis' monomials, (k, 2)."""
        return reference_nodes(self.n_corners, self.order)[1]

    @property
    def coefficients(self) -> Array:
        """Basis function b is Σ_m coefficients[b, m] ξ^a η^b, (k, k)."""
        return _coefficients(self.n_corners, self.order)

    @property
    def nodes(self) -> Array:
        """Nodes in local coordinates, (n, k, 2)."""
        return self.each(reference_nodes(self.n_corners, self.order)[0])

    @property
    def places(self) -> Array:
        """Local coordinates of `points`, (6 or 9, 2)."""
        return reference_points(self.n_corners)

    @property
    def polygon(self) -> Array:
        """Corners in local coordinates, (n, c, 2)."""
        return self.each(REFERENCE[self.n_corners])

    @functools.cached_property
    def chord(self) -> Panels:
        """Flat panels through the corners, which give the position and size of a panel."""
        return make_panels(self.corners, 0, self.index)[0]

    @functools.cached_property
    def box(self) -> Array:
        """Least and largest coordinates in the frames of `chord`, over its size, (n, 2, 3)."""
        x = self.at(self.each(samples(self.n_corners)))[0]
        local = (
            np.einsum("nij,nqj->nqi", self.chord.frame, x - self.chord.centre[:, None])
            / self.chord.size[:, None, None]
        )
        return np.stack([local.min(axis=1), local.max(axis=1)], axis=1)

    @property
    def centre(self) -> Array:
        """Mean of the corners, (n, 3) [length]."""
        return self.chord.centre

    @functools.cached_property
    def size(self) -> Array:
        """Largest distance of a point from the centre, (n,) [length]."""
        away = self.at(self.each(samples(self.n_corners)))[0] - self.centre[:, None]
        return np.asarray(np.linalg.norm(away, axis=2).max(axis=1))

    def take(self, chosen: Index | slice) -> CurvedPanels:
        """Return some of the panels."""
        found = {name: values[chosen] for name, values in self.found.items()}
        return CurvedPanels(self.points[chosen], self.order, self.index[chosen], found)

    def basis(self, local: Array) -> Array:
        """Return values (n, q, k) of the basis at points (n, q, 2) of local coordinates."""
        return np.asarray(monomials(local, self.exponents) @ self.coefficients.T)

    def basis_slopes(self, local: Array) -> Array:
        """Return derivatives (n, q, k, 2) of the basis by the two local coordinates at points (n,
        q, 2)."""
        return np.asarray(
            np.swapaxes(monomial_slopes(local, self.exponents), -1, -2) @ self.coefficients.T
        ).swapaxes(-1, -2)

    def tangent_vectors(self, local: Array) -> Array:
        """Return derivatives (n, q, 2, 3) of the position by the local coordinates at points (n, q,
        2) [length]."""
        return self.at(local)[1]

    def normals(self, local: Array) -> Array:
        """Return outward unit normals (n, q, 3) at points (n, q, 2) of local coordinates."""
        along = self.tangent_vectors(local)
        normal = np.cross(along[:, :, 0], along[:, :, 1])
        return np.asarray(normal / np.linalg.norm(normal, axis=2, keepdims=True))

    def mapped(self, reference: Array) -> Array:
        """Return local coordinates (n, q, 2) of places (q, 2) of the reference square or
        triangle."""
        return self.each(reference)

    def feet(self, x: Array) -> tuple[Array, Array, Array]:
        """Return the nearest point of each panel to one point, for points (n, 3).

        The result is its local coordinates (n, 2), its distance [length], and how far inside the
        panel it lies, in local coordinates.
        """
        walls, bounds = WALLS[self.n_corners]
        local, distance = self.nearest(x)
        return (
            local,
            distance,
            np.min((bounds - local @ walls.T) / np.linalg.norm(walls, axis=1), axis=1),
        )


@functools.cache
def _coefficients(corners: int, order: int) -> Array:
    nodes, exponents = reference_nodes(corners, order)
    return np.ascontiguousarray(np.linalg.inv(monomials(nodes, exponents)).T)


def make_curved_panels(
    points: Array, order: int, index: Index
) -> tuple[CurvedPanels, Array, Array, Array]:
    """Return panels through given points, their nodes, and the nodes' weights and normals.

    Parameters
    ----------
    points : (n, 6 or 9, 3) array
        See `QuadraticCells`.
    order : int
    index : (n,) int array

    Returns
    -------
    panels : CurvedPanels
    x : (n, k, 3) array
        [length]
    weight : (n, k) array
        Integrals of the basis [length²].
    normal : (n, k, 3) array
        Outward unit normals.
    """
    panels = CurvedPanels(points, order, index)
    x, normal = panels.at(panels.nodes)[0], panels.normals(panels.nodes)
    local, weight = reference_rule(panels.n_corners, (WEIGHT_POINTS, WEIGHT_POINTS))
    _, along = panels.at(panels.each(local))
    area = np.linalg.norm(np.cross(along[:, :, 0], along[:, :, 1]), axis=2) * weight
    return panels, x, np.einsum("nq,qk->nk", area, panels.basis(local)), normal
