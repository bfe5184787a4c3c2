"""Slow and obviously right: Kelvin's kernels in space as printed, summed over panels that are cut
until every piece is far."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from petcontact.arrays import Array
from petcontact.bem.kelvin import COMPONENTS
from petcontact.geometry.quadratic import REFERENCE
from petcontact.mesh.curved.panels import CurvedPanels
from petcontact.mesh.panels import Panels, monomials, rule_points

DELTA = np.eye(3)
Kernels = tuple[Callable[[Array, Array, float], tuple[Array, Array]], ...]


def kelvin(r: Array, normal: Array, nu: float) -> tuple[Array, Array]:
    """2µU and T, (3, 3, q), of vectors r and normals (q, 3) at their ends."""
    distance = np.linalg.norm(r, axis=-1)
    e, n = np.moveaxis(r, -1, 0) / distance, np.moveaxis(np.broadcast_to(normal, r.shape), -1, 0)
    w, identity = np.sum(e * n, axis=0), DELTA.reshape(3, 3, *([1] * distance.ndim))
    dyad, skew = e[:, None] * e, e[:, None] * n
    scale = 1.0 / (8.0 * np.pi * (1.0 - nu) * distance)
    u = scale * ((3.0 - 4.0 * nu) * identity + dyad)
    t = (1.0 - 2.0 * nu) * (skew - skew.swapaxes(0, 1) - w * identity) - 3.0 * w * dyad
    return u, scale / distance * t


def stress_of_kelvin(r: Array, normal: Array, nu: float) -> tuple[Array, Array]:
    """D and S/2µ, (6, 3, q): Brebbia, Telles and Wrobel (1984), section 5.6."""
    distance, shape = np.linalg.norm(r, axis=-1), r.shape[:-1]
    e, n = np.moveaxis(r, -1, 0) / distance, np.moveaxis(np.broadcast_to(normal, r.shape), -1, 0)
    w = np.sum(e * n, axis=0)
    d, s = np.empty((2, 6, 3, *shape))
    for (c, (i, j)), k in itertools.product(enumerate(COMPONENTS[3]), range(3)):
        ij, ki, kj = DELTA[i, j], DELTA[k, i], DELTA[k, j]
        d[c, k] = (1.0 - 2.0 * nu) * (ki * e[j] + kj * e[i] - ij * e[k]) + 3.0 * e[i] * e[j] * e[k]
        s[c, k] = 3.0 * w * ((1.0 - 2.0 * nu) * ij * e[k] + nu * (ki * e[j] + kj * e[i]))
        s[c, k] += 3.0 * nu * (n[i] * e[j] + n[j] * e[i]) * e[k] - 15.0 * w * e[i] * e[j] * e[k]
        s[c, k] += (1.0 - 2.0 * nu) * (3.0 * n[k] * e[i] * e[j] + n[j] * ki + n[i] * kj)
        s[c, k] -= (1.0 - 4.0 * nu) * n[k] * ij
    scale = 1.0 / (8.0 * np.pi * (1.0 - nu))
    return scale / distance**2 * d, -scale / distance**3 * s


def by_subdivision(
    panel: Panels | CurvedPanels,
    x: Array,
    nu: float,
    kernels: Kernels = (kelvin,),
    points: int = 14,
) -> list[Array]:
    """Integrals of kernels (..., q) against the basis of one panel, (..., k), at a point off it:
    cut into four until every piece is far, then Gauss points."""
    totals: list[Array] = []
    pieces = [panel.polygon[0] if isinstance(panel, Panels) else REFERENCE[panel.n_corners]]
    while pieces:
        piece = pieces.pop()
        y = _placed(panel, np.vstack([piece, piece.mean(axis=0)]))[0]
        if np.linalg.norm(y[-1] - x) < 3.0 * np.linalg.norm(y[:-1] - y[-1], axis=1).max():
            sides = 0.5 * (piece + np.roll(piece, -1, axis=0))
            middle = [piece.mean(axis=0)] if len(piece) == 4 else []
            pieces += [
                np.array([piece[k], sides[k], *middle, sides[k - 1]]) for k in range(len(piece))
            ]
            pieces += [] if middle else [sides]
            continue
        local, weight = rule_points(piece[None], (points, points))
        y, normal, basis = _placed(panel, local[0])
        values = [part for kernel in kernels for part in kernel(y - x, normal, nu)]
        parts = [value @ (weight[0][:, None] * basis) for value in values]
        totals = [a + b for a, b in zip(totals, parts, strict=True)] if totals else parts
    return totals


def _placed(panel: Panels | CurvedPanels, local: Array) -> tuple[Array, ...]:
    """Points (q, 3), unit normals and the basis times the area factor (q, k) at local points."""
    if isinstance(panel, Panels):
        size = panel.size[0]
        basis = monomials(local, panel.exponents) @ panel.coefficients[0].T
        y = panel.centre[0] + size * (local @ panel.frame[0, :2])
        return y, np.tile(panel.frame[0, 2], (len(local), 1)), size**2 * basis
    y, along = panel.at(local[None])
    normal = np.cross(along[0, :, 0], along[0, :, 1])
    area = np.linalg.norm(normal, axis=1, keepdims=True)
    return y[0], normal / area, area * panel.basis(local[None])[0]
