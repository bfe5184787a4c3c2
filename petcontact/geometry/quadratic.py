"""Quadratic triangles and quadrilaterals in space: positions, derivatives, nearest points,
folds."""

from __future__ import annotations

import functools

import numpy as np

from .. import native
from ..arrays import Array, Index
from ..record import record
from ..round_off import SOLVED

REFERENCE = {
    3: np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
    4: np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
}
"""Corners of the reference elements, by their number."""
WALLS = {
    3: (np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]]), np.array([0.0, 0.0, 1.0])),
    4: (np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]]), np.ones(4)),
}
"""Outward normals N and bounds c of the sides of the reference elements: inside is N ξ <= c."""
SAMPLES = 5
"""Points in each direction at which a panel is looked at."""
ACROSS = 0.2
"""Weight of the distance across a tangent plane in `QuadraticCells.bend`."""


@functools.cache
def reference_points(corners: int) -> Array:
    """Corners, middles of the sides, and of a quadrilateral the middle, (6 or 9, 2)."""
    corner, middle = REFERENCE[corners], np.zeros((corners - 3, 2))
    return np.concatenate([corner, 0.5 * (corner + np.roll(corner, -1, axis=0)), middle])


@functools.cache
def _shape_functions(corners: int) -> Array:
    """Values at the geometry's points to coefficients of ξ^i η^j, number 3i + j: (9, points)."""
    points = reference_points(corners)
    powers = np.array([(i, j) for i in range(3) for j in range(3) if corners == 4 or i + j <= 2])
    result = np.zeros((9, len(points)))
    result[3 * powers[:, 0] + powers[:, 1]] = np.linalg.inv(
        np.prod(points[:, None] ** powers, axis=2)
    )
    # 0, 1, ½ and ¼ are what these are
    return np.asarray(np.round(4.0 * result) / 4.0)


def on_side(start: Array, middle: Array, stop: Array, t: Array | float) -> Array:
    """Points of quadratic sides through three points each, at shares t of the way along them.

    >>> on_side(np.zeros(1), np.array([0.5]), np.ones(1), 0.25)
    array([0.25])
    """
    return np.asarray(
        (1.0 - t) * (1.0 - 2.0 * t) * start
        + 4.0 * t * (1.0 - t) * middle
        + t * (2.0 * t - 1.0) * stop
    )


@functools.cache
def samples(corners: int) -> Array:
    """Points (q, 2) spread evenly over a reference element, its corners and the middles of its
    sides among them."""
    t = np.linspace(0.0, 1.0, SAMPLES)
    grid = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(2.0 * grid - 1.0 if corners == 4 else grid[grid.sum(axis=1) <= 1.0 + SOLVED])


def position(shape: Array, local: Array, cell: Index) -> tuple[Array, Array]:
    """Points and derivatives along both local coordinates of cells of given coefficients.

    Parameters
    ----------
    shape : (n, 9, 3) array
        Of ξ^i η^j, number 3i + j [length].
    local : (k, 2) array
    cell : (k,) array
        Numbers of the cells.

    Returns
    -------
    y : (k, 3) array
    along : (k, 2, 3) array
        [length]
    """
    y, along = np.empty((len(cell), 3)), np.empty((len(cell), 2, 3))
    places = native.function("petcontact_space_places", "iNDDDD")
    places(len(cell), cell, native.contiguous(shape), native.contiguous(local), y, along)
    return y, along


@record
class QuadraticCells:
    """Quadratic cells of one shape; local coordinates are those of the reference element.

    Attributes
    ----------
    points : (n, 6 or 9, 3) array
        Corners, counter-clockwise seen from outside the body, middles of the sides 01, 12, ..., and
        the middle of quadrilaterals, in Gmsh's order [length].
    """

    points: Array

    @property
    def n_corners(self) -> int:
        """3 or 4."""
        return 3 if self.points.shape[1] == 6 else 4

    @property
    def corners(self) -> Array:
        """(n, c, 3) [length]."""
        return self.points[:, : self.n_corners]

    @functools.cached_property
    def shape(self) -> Array:
        """y(ξ, η) = Σ shape[3i + j] ξ^i η^j, (n, 9, 3) [length]."""
        return np.asarray(_shape_functions(self.n_corners) @ self.points)

    @functools.cached_property
    def distortion(self) -> Array:
        """Largest over smallest area factor of each panel, (n,) [-]; infinite where it is
        folded."""
        _, along = self.at(self.each(samples(self.n_corners)))
        area = np.cross(along[:, :, 0], along[:, :, 1])
        factor = np.sum(area * area.mean(axis=1, keepdims=True), axis=2)
        size = np.linalg.norm(area, axis=2)
        with np.errstate(divide="ignore"):
            return np.where(factor.min(axis=1) > 0.0, size.max(axis=1) / size.min(axis=1), np.inf)

    @functools.cached_property
    def bend(self) -> Array:
        """Return how far each panel leaves its tangent planes, (n,) [-].

        Samples of the panel are taken as feet. The tangent plane at a foot predicts the corners and
        the middles of the sides. The result is the largest error of these, over their distance from
        the foot. The error across the plane counts a fifth. It moves the zeros of |y - foot| across
        the ray, and these harm quadrature less than zeros beyond the end of the ray.
        """
        corners, feet = REFERENCE[self.n_corners], samples(self.n_corners)
        ends = np.concatenate([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))])
        y, along = self.at(self.each(feet))
        flat = np.einsum("feb,nfbk->nfek", ends[None] - feet[:, None], along)
        off = self.at(self.each(ends))[0][:, None] - y[:, :, None] - flat
        normal = np.cross(along[:, :, 0], along[:, :, 1])
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        across = np.einsum("nfek,nfk->nfe", off, normal)
        square = np.maximum(np.sum(off**2, axis=3) - (1.0 - ACROSS**2) * across**2, 0.0)
        reach = np.sum(flat**2, axis=3)
        return np.asarray(
            np.sqrt(
                np.max(
                    np.divide(square, reach, out=np.zeros_like(reach), where=reach > 0.0),
                    axis=(1, 2),
                )
            )
        )

    def each(self, local: Array) -> Array:
        """Local coordinates (q, 2) that are the same on all cells, (n, q, 2)."""
        return np.broadcast_to(local, (len(self.points), *local.shape))

    def at(self, local: Array) -> tuple[Array, Array]:
        """Points (n, q, 3) at local coordinates (n, q, 2), and the derivatives along both, (n, q,
        2, 3) [length]."""
        cell = np.repeat(np.arange(len(local)), local.shape[1])
        y, along = position(self.shape, local.reshape(-1, 2), cell)
        return y.reshape(*local.shape[:2], 3), along.reshape(*local.shape[:2], 2, 3)

    def nearest(self, x: Array) -> tuple[Array, Array]:
        """The nearest point of each panel to a point (n, 3): local coordinates (n, 2), and the
        distance (n,) [length].

        Newton's method from the nearest of a few points, along the sides once it has met them, in
        native/space/foot.h.
        """
        place, distance = np.empty((len(x), 2)), np.empty(len(x))
        shape, x = native.contiguous(self.shape), native.contiguous(x)
        feet = native.function("petcontact_space_feet", "iiDDDD")
        feet(len(x), self.n_corners, shape, x, place, distance)
        return place, distance
