"""Slow and obviously right: Kelvin's kernels in space as printed, summed over panels that are cut
until every piece is far; and flat panels of random shape in random planes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from kelvin_oracle import kelvin

from petcontact.arrays import Array
from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.geometry.quadratic import REFERENCE
from petcontact.mesh.curved.curved_panels import CurvedPanels
from petcontact.mesh.panels import Panels, make_panels, monomials, rule_points

Kernels = tuple[Callable[[Array, Array, float], tuple[Array, Array]], ...]


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


def worst(points: Array, panel: Panels | CurvedPanels, nu: float, **how: float) -> float:
    """The largest relative error of both kernels at points off a panel."""
    exact = zip(*(by_subdivision(panel, x, nu) for x in points), strict=True)
    return max(
        np.abs(ours[..., k] - values).max() / np.abs(values).max()
        for ours, true in zip(integrals(points, panel, nu, **how), exact, strict=True)
        for k, values in enumerate(true)
    )


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


def placed(outline: np.ndarray, order: int, rng: np.random.Generator) -> Panels:
    """A panel of given corners (c, 2), turned and moved at random."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return make_panels((outline @ turn[:2] + rng.normal(size=3))[None], order, np.arange(1))[0]


def a_panel(corners: int, order: int, rng: np.random.Generator) -> Panels:
    """Corners on an ellipse: no quadrilateral of these is a parallelogram."""
    angle = np.sort(rng.uniform(0.0, 0.5, corners)) + 2.0 * np.pi * np.arange(corners) / corners
    return placed(
        np.column_stack([np.cos(angle), rng.uniform(0.3, 1.0) * np.sin(angle)]), order, rng
    )
