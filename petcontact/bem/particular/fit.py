"""Polynomials that follow an expression in a body, by least squares on points of the body instead
of the box around it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import scipy.linalg
from numpy.polynomial import chebyshev

from ...arrays import Array
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import TINY, WRITTEN
from .polynomials import BodyBox, total_degrees

TRIED = {2: (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 40), 3: (1, 2, 3, 4, 6, 8, 10, 12, 16)}
"""Total degrees that are tried, by the number of dimensions."""
GRID = {2: 60, 3: 18}
"""Number of points of the grid along each axis of the box."""
ENOUGH = 3e-13
"""Error over the largest value below which no higher degree is tried."""
NODES = 1500
"""Largest number of nodes of the boundary among the points."""


def points_in(mesh: BoundaryMesh, box: BodyBox) -> Array:
    """Points (m, d) of a body: of a grid, dense at the sides of its box, those inside; and nodes of
    the boundary."""
    count = GRID[mesh.dim]
    grid = box.grid(np.cos(np.pi * (np.arange(count) + 0.5) / count))
    # points times nodes at a time
    step = max(1, 2_000_000 // mesh.n_nodes)
    inside = np.concatenate(
        [winding(mesh, grid[first : first + step]) > 0.5 for first in range(0, len(grid), step)]
    )
    return np.concatenate([grid[inside], mesh.x[:: math.ceil(mesh.n_nodes / NODES)]])


def winding(mesh: BoundaryMesh, x: Array) -> Array:
    """The part of the full angle under which the boundary, of a half section with its image, is
    seen from x, by the weights of the nodes: 1 inside."""
    seen, weighted = np.zeros(len(x)), mesh.normal * mesh.measure[:, None]
    for image in mesh.images(x):
        away = [there - here[:, None] for there, here in zip(mesh.x.T, image.T, strict=True)]
        square = np.maximum(sum(way**2 for way in away), TINY)
        across = sum(way * normal for way, normal in zip(away, weighted.T, strict=True))
        seen += np.sum(across / square ** (0.5 * mesh.dim), axis=1)
    return seen / (2.0 * np.pi * (mesh.dim - 1))


def fitted(
    function: Callable[[Array], Array], points: Array, box: BodyBox
) -> tuple[Array, float, float]:
    """Return coefficients on a box, the largest error over the largest value, and the root mean
    square of the error, at points of which some are left out of the fit.

    Of the degrees tried it is the one whose error and round-off, ε times the sum of its
    coefficients, are least together.

    Parameters
    ----------
    function : callable
        Points (m, d) to values (m,).
    points : (m, d) array
    box : BodyBox
    """
    wanted, d = function(points), points.shape[1]
    size = float(np.abs(wanted).max(initial=0.0)) or 1.0
    along = [
        chebyshev.chebvander(coordinate, TRIED[d][-1])
        for coordinate in np.clip(box.local(points), -1.0, 1.0).T
    ]
    mixed = np.random.default_rng(2019).permutation(len(points))
    best, error, mean = np.zeros((1,) * d), np.inf, np.inf
    for degree in filter(box.highest.__ge__, TRIED[d]):
        exponents = total_degrees(degree, d)
        # three points a coefficient
        used = mixed[: min(3 * exponents.shape[1], 3 * len(points) // 4)]
        if len(used) < 2 * exponents.shape[1]:
            break
        basis = np.prod([table[:, k] for table, k in zip(along, exponents, strict=True)], axis=0)
        # what is left out are polynomials that vanish on the body but not on its box
        solved = scipy.linalg.lstsq(basis[used], wanted[used], cond=WRITTEN, lapack_driver="gelsy")[
            0
        ]
        off = np.abs(basis @ solved - wanted) + np.finfo(float).eps * np.abs(solved).sum()
        if off.max() / size < error:
            error, mean = float(off.max()) / size, math.sqrt(np.mean(off**2))
            best = np.zeros((degree + 1,) * d)
            best[tuple(exponents)] = solved
        if error <= ENOUGH:
            break
    return best, error, mean
