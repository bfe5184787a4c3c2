"""Quadratic triangles and quadrilaterals in space: positions, derivatives, nearest points,
folds."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Mask
from ..round_off import ROUNDED, SOLVED, TINY, WRITTEN

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


def position(shape: Array, local: Array) -> tuple[Array, Array]:
    """Points and derivatives along both local coordinates of cells of given coefficients.

    Parameters
    ----------
    shape : (n, 9, 3) array
        Of ξ^i η^j, number 3i + j [length].
    local : (n, 2) or (n, q, 2) array
        One point a cell, or q.

    Returns
    -------
    y : (n, 3) or (n, q, 3) array
    along : (n, 2, 3) or (n, q, 2, 3) array
        [length]
    """
    if local.ndim == 2:
        y, along = position(shape, local[:, None])
        return y[:, 0], along[:, 0]
    power = np.stack([np.ones_like(local), local, local**2], axis=-1)
    slope = np.stack([np.zeros_like(local), np.ones_like(local), 2.0 * local], axis=-1)
    xi, eta, along, up = power[..., 0, :], power[..., 1, :], slope[..., 0, :], slope[..., 1, :]
    parts = [
        (a[..., :, None] * b[..., None, :]).reshape(*local.shape[:-1], 9) @ shape
        for a, b in ((xi, eta), (along, eta), (xi, up))
    ]
    return parts[0], np.stack(parts[1:], axis=-2)


@dataclass(frozen=True)
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
        return position(self.shape, local)

    def nearest(self, x: Array) -> tuple[Array, Array]:
        """The nearest point of each panel to a point (n, 3): local coordinates (n, 2), and the
        distance (n,) [length].

        Newton's method from the nearest of a few points, along the sides once it has met them.
        """
        grid, left = samples(self.n_corners), np.arange(len(x))
        away = np.linalg.norm(self.at(grid[None])[0] - x[:, None], axis=2)
        foot = grid[away.argmin(axis=1)]
        for _ in range(20):
            step = QuadraticCells(self.points[left])._newton_step(foot[left], x[left])
            foot[left] += step
            left = left[np.abs(step).max(axis=1) >= WRITTEN]
            if not len(left):
                break
        return foot, np.linalg.norm(self.at(foot[:, None])[0][:, 0] - x, axis=1)

    def _newton_step(self, foot: Array, x: Array) -> Array:
        """Return the step from feet (n, 2) towards those nearest to points (n, 3), up to the next
        side."""
        walls, bounds = WALLS[self.n_corners]
        y, along = position(self.shape, foot)
        slope = np.einsum("nik,nk->ni", along, y - x)
        # a panel that has collapsed onto a line or a point has no length across it
        metric = np.einsum("nik,njk->nij", along, along) + np.multiply.outer(
            ROUNDED * np.sum(along**2, axis=(1, 2)) + TINY, np.eye(2)
        )
        hessian = metric + np.einsum("nijk,nk->nij", self._second(foot), y - x)
        # far from a minimum the metric alone leads downhill
        convex = (hessian[:, 0, 0] > 0.2 * metric[:, 0, 0]) & (
            np.linalg.det(hessian) > 0.04 * np.linalg.det(metric)
        )
        hessian = np.where(convex[:, None, None], hessian, metric)
        step = -np.linalg.solve(hessian, slope[..., None])[..., 0]
        active = self._active(foot, slope, step)
        side = (walls @ [[0.0, 1.0], [-1.0, 0.0]])[active.argmax(axis=1)]
        along = np.sum(side * slope, axis=1) / np.einsum("ni,nij,nj->n", side, hessian, side)
        met = active.sum(axis=1)[:, None]
        step = np.where(met == 0, step, np.where(met == 1, -along[:, None] * side, 0.0))
        rate, room = step @ walls.T, np.maximum(bounds - foot @ walls.T, 0.0)
        room[active] = np.inf
        share = np.divide(room, rate, out=np.full_like(rate, np.inf), where=rate > TINY)
        return np.asarray(np.minimum(share.min(axis=1), 1.0)[:, None] * step)

    def _active(self, foot: Array, slope: Array, step: Array) -> Mask:
        """Which sides hold feet (n, 2), (n, sides): those that push them back, or that Newton's
        step would pass.

        In a corner the sides share what pushes: those of a triangle are not at right angles in the
        reference coordinates.
        """
        walls, bounds = WALLS[self.n_corners]
        on, push, gram = foot @ walls.T >= bounds - SOLVED, -(slope @ walls.T), walls @ walls.T
        corner = on.sum(axis=1, keepdims=True) == 2
        rest, beside = np.sum(on * push, axis=1, keepdims=True) - push, on @ gram - np.diag(gram)
        square = np.sum(on * np.diag(gram), axis=1, keepdims=True) - np.diag(gram)
        active = on & (np.where(corner, square * push - beside * rest, push) > 0.0)
        rate = np.where(on & ~active.any(axis=1, keepdims=True), step @ walls.T, 0.0)
        return np.asarray(active | ((rate > 0.0) & (rate == rate.max(axis=1, keepdims=True))))

    def _second(self, local: Array) -> Array:
        """Second derivatives (n, 2, 2, 3) at local coordinates (n, 2)."""
        s, t = local.T[..., None]
        c = self.shape.reshape(-1, 3, 3, 3)
        mixed = c[:, 1, 1] + 2.0 * (t * c[:, 1, 2] + s * c[:, 2, 1]) + 4.0 * s * t * c[:, 2, 2]
        first = 2.0 * (c[:, 2, 0] + t * (c[:, 2, 1] + t * c[:, 2, 2]))
        second = 2.0 * (c[:, 0, 2] + s * (c[:, 1, 2] + s * c[:, 2, 2]))
        return np.stack(
            [np.stack([first, mixed], axis=1), np.stack([mixed, second], axis=1)], axis=1
        )
