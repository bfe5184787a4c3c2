"""Polynomials that follow an expression in a body: least squares on points of the body, not of the box around it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...arrays import Array
from ...mesh.boundary_mesh import BoundaryMesh

TRIED = {2: (1, 2, 3, 4, 6, 8, 12, 16, 20, 24), 3: (1, 2, 3, 4, 6, 8, 10, 12)}
"""Total degrees, by the number of dimensions."""
GRID = {2: 50, 3: 18}
"""Points of the grid along each axis of the box."""
ENOUGH = 1e-13
"""Error, over the largest value, at which higher degrees are not tried."""
CANCELLING = 30.0
"""Sum of the terms of a polynomial at the corner of the box over its largest value, above which they cancel one another: the
particular solution would be so much larger than the stress, and the elements would have to take it back."""
NODES = 1500
"""Nodes of the boundary among the points, at most."""
PAIRS = 2_000_000
"""Points times nodes at a time."""
SEED = 2019


def points_in(mesh: BoundaryMesh) -> Array:
    """Points (m, d) of a body: of a grid, dense at the sides of its box, those inside; and nodes of the boundary."""
    d = mesh.dim
    low, high = mesh.x.min(axis=0), mesh.x.max(axis=0)
    line = 0.5 * (1.0 - np.cos(np.pi * (np.arange(GRID[d]) + 0.5) / GRID[d]))
    grid = low + (high - low) * np.stack(np.meshgrid(*[line] * d, indexing="ij"), axis=-1).reshape(-1, d)
    step = max(1, PAIRS // mesh.n_nodes)
    inside = np.concatenate([_wound(mesh, grid[first : first + step]) > 0.5 for first in range(0, len(grid), step)])
    return np.concatenate([grid[inside], mesh.x[:: math.ceil(mesh.n_nodes / NODES)]])


def _wound(mesh: BoundaryMesh, x: Array) -> Array:
    """The part of the full angle under which the boundary is seen from x, by the weights of the nodes: 1 inside."""
    away = mesh.x - x[:, None]
    distance = np.linalg.norm(away, axis=2)
    seen = np.einsum("mnd,nd->mn", away, mesh.normal) / np.maximum(distance, 1e-300) ** mesh.dim
    return np.asarray(seen @ mesh.weight / (2.0 * np.pi * (mesh.dim - 1)))


def fitted(function: Callable[[Array], Array], points: Array, centre: Array, length: float) -> tuple[Array, float]:
    """A polynomial in ξ = (x - centre)/length, and its largest error over the largest value, at points left out of the fit.

    Parameters
    ----------
    function : callable
        Points (m, d) to values (m,).
    points : (m, d) array
    centre : (d,) array
        Middle of the box around the points.
    length : float
        Half the longest side of the box.
    """
    wanted, d = function(points), points.shape[1]
    size = float(np.abs(wanted).max(initial=0.0)) or 1.0
    xi = (points - centre) / length
    half = np.abs(xi).max(axis=0)
    angles = np.arccos(np.clip(xi / half, -1.0, 1.0)).T
    left_out = np.random.default_rng(SEED).permutation(len(points)) % 4 == 0
    best, error = np.zeros((1,) * d), np.inf
    for degree in TRIED[d]:
        exponents = np.indices((degree + 1,) * d).reshape(d, -1)
        exponents = exponents[:, exponents.sum(axis=0) <= degree]
        if 2 * exponents.shape[1] > np.count_nonzero(~left_out):
            break
        basis = np.prod([np.cos(k * angle[:, None]) for angle, k in zip(angles, exponents, strict=True)], axis=0)
        solved = np.linalg.lstsq(basis[~left_out], wanted[~left_out], rcond=1e-14)[0]
        missed = float(np.abs(basis @ solved - wanted).max()) / size
        coefficients = np.zeros((degree + 1,) * d)
        coefficients[tuple(exponents)] = solved
        monomials = _in_monomials(coefficients, half)
        at_the_corner = np.prod([h**e for h, e in zip(half, np.indices(monomials.shape), strict=True)], axis=0)
        if np.sum(at_the_corner * np.abs(monomials)) > CANCELLING * size:
            break
        if missed < error:
            best, error = monomials, missed
        if error <= ENOUGH:
            break
    return best, error


def _in_monomials(coefficients: Array, half: Array) -> Array:
    """Coefficients of monomials in ξ from those of Chebyshev polynomials in ξ/half."""
    count = len(coefficients)
    table = np.eye(count)
    for k in range(2, count):
        table[:, k] = 2.0 * np.roll(table[:, k - 1], 1) - table[:, k - 2]
    for axis, h in enumerate(half):
        scaled = table / h ** np.arange(count)[:, None]
        coefficients = np.moveaxis(np.tensordot(scaled, coefficients, (1, axis)), 0, axis)
    return coefficients
