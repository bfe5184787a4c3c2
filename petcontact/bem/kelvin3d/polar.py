"""Gauss points on curved panels for points on them and near them: polar coordinates about the nearest point of the panel.

The map ζ = M(ξ - ξ_0), MᵀM the metric at the foot ξ_0, makes |y - y_0| = ρ + O(ρ²) in every direction. From 0 to a side at
the distance h its coordinate is t = h sinh s, dφ = ds/cosh s and the length of the ray h cosh s, so that Gauss points in s
do not feel how flat the angle is. Along the rays ρ itself serves on the panel; beside it |y - x|² ≈ d² + 2bρ + ρ², and with
ρ = -b + c sinh v, c² = max(d² - b², d²/100), the integrand is smooth in v. Compare Guiggiani et al. (J. Appl. Mech. 59,
1992) for the principal value, and Johnston, Johnston and Elliott (J. Comput. Appl. Math. 245, 2013) for sinh.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array
from ...geometry.quadratic import REFERENCE
from ...mesh.basis import gauss
from ...mesh.curved_panels import CurvedPanels

MOST = 40
"""Gauss points in s or v at most."""
MARGIN = 5.0
"""Digits (natural) beyond the tolerance that the rules aim at."""
STRETCH, GENTLE = 2.7, 0.1
"""Rate of `warp`, and the bend up to which nothing more is needed."""
ON_PANEL = 1e-10
"""Distance over the panel's size below which a point lies on it."""
TOGETHER = 4
"""Rays that take the same number of points: a vector of the compiled code."""
FLATTEST = 1e-10
"""Height of a side over the panel's size below which the foot is on the side."""


@dataclass(frozen=True)
class Rule:
    """Points that stand for one panel.

    Attributes
    ----------
    local : (q, 2) array
        Local coordinates.
    weight : (q,) array
        Without the area factor.
    foot : (2,) array, optional
        Where on the panel the target lies.
    end : (3,) array
        There, ∫ e ln ρ̂ dφ less what the points make of it, of which the principal value of 1/r² is made.
    """

    local: Array
    weight: Array
    foot: Array | None = None
    end: Array = field(default_factory=lambda: np.zeros(3))


def digits(tolerance: float) -> float:
    """D, natural digits that the rules of a flat panel aim at."""
    return math.log(1.0 / tolerance) + MARGIN


def warp(panels: CurvedPanels) -> Array:
    """By how much more digits than flat ones curved panels are integrated, (n,) [-].

    Where a panel leaves its tangent plane |y - x| / ρ varies along the rays, and its zeros come near. Fitted to 120 random
    panels whose points were moved by 1 to 15 % of their size, the area factors varying by up to 2, and tried on 48 others:
    both kernels are within 1e-8. Next to 1 on spheres.
    """
    if "warp" not in panels.found:
        panels.found["warp"] = 1.0 + STRETCH * np.maximum(panels.bend - GENTLE, 0.0)
    return np.asarray(panels.found["warp"])


@functools.cache
def tables() -> tuple[Array, Array]:
    """Gauss points and weights on [-1, 1] by their number, (MOST + 1, MOST) each, zero beyond."""
    result = np.zeros((2, MOST + 1, MOST))
    for count in range(1, MOST + 1):
        result[:, count, :count] = gauss(count - 1)
    return result[0], result[1]


def polar_rule(panels: CurvedPanels, number: int, x: Array, foot: Array, distance: float, wanted: float) -> Rule:
    """Points of a panel for a point x (3,) at a distance from its foot (2,), `wanted` being D."""
    panel, order = panels.take(slice(number, number + 1)), panels.order
    y, along = panel.at(foot[None, None])
    first, second = along[0, 0]
    m_00 = float(np.linalg.norm(first))
    e_1 = first / m_00
    m_01 = float(second @ e_1)
    e_2 = second - m_01 * e_1
    m_11 = float(np.linalg.norm(e_2))
    e_2 /= m_11
    to_zeta = np.array([[m_00, m_01], [0.0, m_11]])
    to_local, frame = np.linalg.inv(to_zeta), np.stack([e_1, e_2])
    corners = (REFERENCE[panels.n_corners] - foot) @ to_zeta.T
    size = float(np.linalg.norm(corners, axis=1).max())
    own = distance <= ON_PANEL * size
    # what the basis and the area factor ask for along a ray
    least = 4 + (order if panels.n_corners == 4 else order // 2)
    height, sides, starts, weights = [], [], [], []
    for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = (stop - start) / np.linalg.norm(stop - start)
        h = float(side[1] * start[0] - side[0] * start[1])
        if h < FLATTEST * size:
            continue
        s_1, s_2 = np.arcsinh(side @ start / h), np.arcsinh(side @ stop / h)
        xi, w = gauss(_count(wanted, s_2 - s_1, least) - 1)
        starts.append(0.5 * (s_1 + s_2) + 0.5 * (s_2 - s_1) * xi)
        weights.append(0.5 * (s_2 - s_1) * w)
        height.append(np.full(len(xi), h))
        sides.append(np.tile(side, (len(xi), 1)))
    s, weight, h, side = (np.concatenate(part) for part in (starts, weights, height, sides))
    cosh = np.cosh(s)
    ray = (np.stack([side[:, 1], -side[:, 0]], axis=1) + np.sinh(s)[:, None] * side) / cosh[:, None]
    reach, share, end = h * cosh, weight / cosh, np.zeros(2)
    if own:
        xi, w = gauss(min(int(0.25 * wanted) + least - 2, MOST) - 1)
        rho, w = 0.5 * reach[:, None] * (1.0 + xi), 0.5 * reach[:, None] * w
        end = (share * (np.log(reach) - np.sum(w / rho, axis=1))) @ ray
        along_rays = [(rho, w)]
    else:
        b = ray @ (frame @ (y[0, 0] - x))
        c = np.sqrt(np.maximum(distance**2 - b * b, 0.01 * distance**2))
        v_1, v_2 = np.arcsinh(b / c), np.arcsinh((reach + b) / c)
        along_rays = []
        for some in np.split(np.arange(len(s)), range(TOGETHER, len(s), TOGETHER)):
            xi, w = gauss(_count(wanted + 2.0, float((v_2 - v_1)[some].max()), least) - 1)
            middle, half = 0.5 * (v_1 + v_2)[some, None], 0.5 * (v_2 - v_1)[some, None]
            v = middle + half * xi
            along_rays.append((c[some, None] * np.sinh(v) - b[some, None], half * w * c[some, None] * np.cosh(v)))
    local, total, first = [], [], 0
    for rho, w in along_rays:
        some = slice(first, first + len(rho))
        local.append((foot + rho[..., None] * (ray[some] @ to_local.T)[:, None]).reshape(-1, 2))
        total.append((share[some, None] * w * rho).ravel() / (m_00 * m_11))
        first += len(rho)
    return Rule(np.concatenate(local), np.concatenate(total), foot if own else None, end @ frame)


def _count(wanted: float, span: float, least: int) -> int:
    """Gauss points on an interval whose integrand is analytic in the strip of half width π about it."""
    return min(max(math.ceil(wanted / (2.0 * math.asinh(math.pi / span))), least), MOST)
