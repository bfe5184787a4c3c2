"""Both kernels over curved panels, by quadrature throughout: Gauss points from afar, `polar` ones
near them and on them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Index
from ...mesh.curved.panels import CurvedPanels, reference_rule
from ...round_off import CHAINED
from .polar import Rule, digits, polar_rule, warp
from .rules import MOST_POINTS, fewest, point_counts
from .tensors import Result, kernels

CHUNK = 1 << 16
"""Pairs of a source point and a target at once."""


def quadrature(
    points: Array, panels: CurvedPanels, tolerance: float
) -> Iterator[tuple[int, Index, Rule]]:
    """Rules for all panels and points (m, 3): the panel, the points, and what stands for the panel
    there."""
    nodes, wanted, least = (
        panels.at(panels.nodes)[0],
        digits(tolerance) * warp(panels),
        fewest(panels, tolerance),
    )
    for number in range(len(panels.index) if len(points) else 0):
        counts = point_counts(points, panels, number, tolerance, int(least[number]))
        close = counts[:, 0] * counts[:, 1] > MOST_POINTS[type(panels)][panels.order]
        for count in np.unique(counts[~close], axis=0).tolist():
            rows = np.flatnonzero(~close & np.all(counts == count, axis=1))
            yield number, rows, Rule(*reference_rule(panels.n_corners, (count[0], count[1])))
        near = np.flatnonzero(close)
        if not len(near):
            continue
        feet, distances = panels.take(np.full(len(near), number)).nearest(points[near])
        for row, foot, distance in zip(near.tolist(), feet, distances.tolist(), strict=True):
            apart = np.linalg.norm(nodes[number] - points[row], axis=1)
            if apart.min() < CHAINED * panels.chord.size[number]:
                foot, distance = panels.nodes[number, apart.argmin()], 0.0
            yield (
                number,
                np.array([row]),
                polar_rule(panels, number, points[row], foot, distance, float(wanted[number])),
            )


def sources(panels: CurvedPanels, number: int, rule: Rule) -> tuple[Array, Array, Array]:
    """Points (q, 3) and unit normals (q, 3) of a rule, and weights times area times basis, (k,
    q)."""
    panel = panels.take(slice(number, number + 1))
    y, along = panel.at(rule.local[None])
    normal = np.cross(along[0, :, 0], along[0, :, 1])
    area = np.linalg.norm(normal, axis=1)
    return y[0], normal / area[:, None], panel.basis(rule.local[None])[0].T * (area * rule.weight)


def fill(points: Array, panels: CurvedPanels, tolerance: float, result: Result) -> None:
    """All pairs of a curved panel and a point."""
    for number, rows, rule in quadrature(points, panels, tolerance):
        y, normal, weight = sources(panels, number, rule)
        step = max(1, CHUNK // len(y))
        for first in range(0, len(rows), step):
            some = rows[first : first + step]
            r = y[:, None] - points[some]
            g, h = (
                np.einsum("bq,ijqm->ijbm", weight, kernel, optimize=True)
                for kernel in kernels(r, normal[:, None], result.poisson_ratio)
            )
            if rule.foot is not None:
                h[..., 0] += _principal_value(panels, number, rule, result.poisson_ratio)
            result.write(number, some, g, h)


def _principal_value(panels: CurvedPanels, number: int, rule: Rule, poisson_ratio: float) -> Array:
    """What the Gauss points of a panel miss of ∫ T L_b at a point on it, (3, 3, k)."""
    assert rule.foot is not None
    panel = panels.take(slice(number, number + 1))
    along = panel.at(rule.foot[None, None])[1][0, 0]
    normal = np.cross(along[0], along[1])
    twist = np.outer(rule.end, normal / np.linalg.norm(normal))
    scale = (1.0 - 2.0 * poisson_ratio) / (8.0 * np.pi * (1.0 - poisson_ratio))
    return np.asarray(
        scale * (twist - twist.T)[..., None] * panel.basis(rule.foot[None, None])[0, 0]
    )
