"""Gauss points on curved panels for points on them and near them: polar coordinates about the
nearest point of the panel.

The map ζ = M(ξ - ξ_0), MᵀM the metric at the foot ξ_0, makes |y - y_0| = ρ + O(ρ²) in every
direction. From 0 to a side at the distance h its coordinate is t = h sinh s, dφ = ds/cosh s and the
length of the ray h cosh s, so that Gauss points in s do not feel how flat the angle is. Along the
rays ρ itself serves on the panel; beside it |y - x|² ≈ d² + 2bρ + ρ², and with ρ = -b + c sinh v,
c² = max(d² - b², d²/100), the integrand is smooth in v. Their numbers follow from Bernstein's
ellipses through the zeros of |y - y_0| and of the area factor on the true panel. Compare Guiggiani
et al. (J. Appl. Mech. 59, 1992) for the principal value, and Johnston, Johnston and Elliott (J.
Comput. Appl. Math. 245, 2013) for sinh.
"""

from __future__ import annotations

import functools
import math
from dataclasses import field

import numpy as np

from ...arrays import Array
from ...frozen import frozen
from ...geometry.quadratic import REFERENCE
from ...mesh.basis import gauss
from ...mesh.curved.panels import CurvedPanels
from ...round_off import CHAINED, SINGLE

MOST = 40
"""Gauss points in s or v at most."""
MARGIN = 3.3
"""Digits (natural) beyond the tolerance that the rules aim at."""
TIGHTER, USUAL = 0.3, 1e-9
"""More of them for each one beyond a usual tolerance: zeros are known to the second order only."""
STRETCH, GENTLE = {3: 0.3, 4: 2.0}, 0.1
"""Rate of `warp` by the corners, and the bend up to which nothing more is needed."""
AROUND = 2
"""Points about a side beyond what the ellipse asks for."""
LEAST = 3
"""Points along a ray at least."""
CENTRE = 0.5
"""1 less the distance over the radius of curvature, below which that counts for the zeros of |y -
x|²."""
TOGETHER = 4
"""Rays that take the same number of points: a vector of the compiled code."""
Powers = tuple[Array, Array, Array]
"""Vectors along rays, (n, 3) each, by powers of ρ."""


@frozen
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
        There, ∫ e ln ρ̂ dφ less what the points make of it, of which the principal value of 1/r² is
        made.
    """

    local: Array
    weight: Array
    foot: Array | None = None
    end: Array = field(default_factory=lambda: np.zeros(3))


def digits(tolerance: float) -> float:
    """D, natural digits that the rules of a flat panel aim at."""
    return math.log(1.0 / tolerance) + MARGIN + TIGHTER * max(math.log(USUAL / tolerance), 0.0)


def warp(panels: CurvedPanels) -> Array:
    """By how much more digits than flat ones curved panels are integrated, (n,) [-].

    Zeros are sought along rays to the second order only, which is next to enough for triangles of 6
    nodes, but of |y - x|² to the fourth about a centre of curvature. Tried on 600 random panels,
    half of them triangles, whose points were moved by 15 % of their size, the area factors varying
    by up to 2, orders 0 to 3, at seven heights from .0005 to 4 sizes (4200 points): both kernels
    are within 1e-8, but for one point (2e-8, .0005 above the panel and a tenth of that from a
    side), and where the tolerance is 1e-11 within 1e-10 but for that one (8e-10).
    """
    if "warp" not in panels.found:
        panels.found["warp"] = 1.0 + STRETCH[panels.n_corners] * np.maximum(
            panels.bend - GENTLE, 0.0
        )
    return np.asarray(panels.found["warp"])


@functools.cache
def tables() -> tuple[Array, Array]:
    """Gauss points and weights on [-1, 1] by their number, (MOST + 1, MOST) each, zero beyond."""
    result = np.zeros((2, MOST + 1, MOST))
    for count in range(1, MOST + 1):
        result[:, count, :count] = gauss(count - 1)
    return result[0], result[1]


def polar_rule(
    panels: CurvedPanels, number: int, x: Array, foot: Array, distance: float, wanted: float
) -> Rule:
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
    own = distance <= CHAINED * size
    # what the basis and the area factor ask for
    triangle = panels.n_corners == 3
    least = 4 + (order // 2 if triangle else order)
    more = ((order + 1) // 2 if triangle else order + 1) + (not own)
    height, sides, starts, weights = [], [], [], []
    reference = REFERENCE[panels.n_corners]
    for k, (start, stop) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        side = (stop - start) / np.linalg.norm(stop - start)
        h = float(side[1] * start[0] - side[0] * start[1])
        if h < CHAINED * size:
            continue
        ends = np.array([side @ start, side @ stop])
        true = panel.at(
            (
                reference[k]
                + 0.5 * np.arange(3)[:, None] * (reference[k - len(corners) + 1] - reference[k])
            )[None]
        )
        s_1, s_2 = np.arcsinh(ends / h)
        parts = [(s_1, s_2)]
        if wanted > 2.0 * (MOST - AROUND) * _around_side(
            h, ends, parts[0], true[0][0] - y[0, 0]
        ):  # cut above the foot
            cut = 0.0 if s_1 * s_2 < 0.0 else 0.5 * (s_1 + s_2)
            parts = [(s_1, cut), (cut, s_2)]
        for low, high in parts:
            log_rho = _around_side(h, ends, (low, high), true[0][0] - y[0, 0])
            xi, w = gauss(_count(wanted, log_rho, AROUND, least) - 1)
            starts.append(0.5 * (low + high) + 0.5 * (high - low) * xi)
            weights.append(0.5 * (high - low) * w)
            height.append(np.full(len(xi), h))
            sides.append(np.tile(side, (len(xi), 1)))
    s, weight, h, side = (np.concatenate(part) for part in (starts, weights, height, sides))
    cosh = np.cosh(s)
    ray = (np.stack([side[:, 1], -side[:, 0]], axis=1) + np.sinh(s)[:, None] * side) / cosh[:, None]
    reach, share, slope, end = h * cosh, weight / cosh, ray @ to_local.T, np.zeros(2)
    positions, normals = _along_rays(panel, foot, slope)
    zeros = [_nearest_zero(*terms, SINGLE / size**2) for terms in (positions, normals)]
    middle = half = 0.5 * reach
    if not own:
        b = ray @ (frame @ (y[0, 0] - x))
        c = np.sqrt(np.maximum(distance**2 - b * b, 0.01 * distance**2))
        v_1, v_2 = np.arcsinh(b / c), np.arcsinh((reach + b) / c)
        middle, half = 0.5 * (v_1 + v_2), 0.5 * (v_2 - v_1)
        zeros = [np.full(len(c), 0.5j * np.pi), *(np.arcsinh((zero + b) / c) for zero in zeros)]
        about = _about_centres(y[0, 0] - x, 1j * c - b, b, positions, SINGLE / size**2)
        zeros += list(np.arcsinh((about + b) / c))
    log_rho = np.min([ellipse(zero, middle, half) for zero in zeros], axis=0)
    local, total = [], []
    for some in np.split(np.arange(len(s)), range(TOGETHER, len(s), TOGETHER)):
        xi, w = gauss(_count(wanted, float(log_rho[some].min()), more, LEAST) - 1)
        if own:
            rho, w = 0.5 * reach[some, None] * (1.0 + xi), 0.5 * reach[some, None] * w
            end += (share[some] * (np.log(reach[some]) - np.sum(w / rho, axis=1))) @ ray[some]
        else:
            v = middle[some, None] + half[some, None] * xi
            rho, w = (
                c[some, None] * np.sinh(v) - b[some, None],
                half[some, None] * w * c[some, None] * np.cosh(v),
            )
        local.append((foot + rho[..., None] * slope[some, None]).reshape(-1, 2))
        total.append((share[some, None] * w * rho).ravel() / (m_00 * m_11))
    return Rule(np.concatenate(local), np.concatenate(total), foot if own else None, end @ frame)


def ellipse(z: Array, middle: Array, half: Array) -> Array:
    """ln ρ of Bernstein's ellipses through z about intervals."""
    u = (z - middle) / half
    return np.asarray(np.arccosh(np.maximum(0.5 * (np.abs(u - 1.0) + np.abs(u + 1.0)), 1.0)))


def _around_side(height: float, ends: Array, part: tuple[float, float], side: Array) -> float:
    """ln ρ of a part of the angle s about a side, `side` (3, 3) its ends and middle from the foot.

    The flat side's |y - y_0|² vanishes at s = iπ/2, the true one's is a quartic.
    """
    a, b, c = side[1], 0.5 * (side[2] - side[0]), 0.5 * (side[2] + side[0]) - side[1]
    roots = np.roots([c @ c, 2.0 * b @ c, b @ b + 2.0 * a @ c, 2.0 * a @ b, a @ a])
    t, s = 0.5 * ends.sum() + 0.5 * (ends[1] - ends[0]) * roots, np.array(part)
    zeros = np.append(np.arcsinh((t.real + 1j * np.abs(t.imag)) / height), 0.5j * np.pi)
    return float(ellipse(zeros, 0.5 * s.sum(), 0.5 * (s[1] - s[0])).min())


def _along_rays(panel: CurvedPanels, foot: Array, slope: Array) -> tuple[Powers, Powers]:
    """(y - y_0) / ρ and the normal times the area factor by powers of ρ, (n, 3) each, along rays of
    slopes (n, 2)."""
    shift = (np.array([[1.0, z, z * z], [0.0, 1.0, 2.0 * z], [0.0, 0.0, 1.0]]) for z in foot)
    c = np.einsum("ai,bj,ijk->abk", *shift, panel.shape[0].reshape(3, 3, 3))
    xi, eta = slope.T[..., None]
    y_1, y_2 = (
        xi * c[1, 0] + eta * c[0, 1],
        xi * xi * c[2, 0] + xi * eta * c[1, 1] + eta * eta * c[0, 2],
    )
    y_3 = xi * eta * (xi * c[2, 1] + eta * c[1, 2])
    a_1, b_1 = 2.0 * xi * c[2, 0] + eta * c[1, 1], xi * c[1, 1] + 2.0 * eta * c[0, 2]
    a_2, b_2 = eta * (2.0 * xi * c[2, 1] + eta * c[1, 2]), xi * (xi * c[2, 1] + 2.0 * eta * c[1, 2])
    n_1 = np.cross(c[1, 0], b_1) + np.cross(a_1, c[0, 1])
    n_2 = np.cross(c[1, 0], b_2) + np.cross(a_1, b_1) + np.cross(a_2, c[0, 1])
    n_0 = np.broadcast_to(np.cross(c[1, 0], c[0, 1]), n_1.shape)
    return (y_1, y_2, y_3), (n_0, n_1, n_2)


def _about_centres(
    away: Array, flat: Array, slope: Array, position: Powers, straight: float
) -> Array:
    """Zeros of |y - x|² to its fourth order, (2, n), on rays that curve about the target; on others
    the flat panel's."""
    y_1, y_2, y_3 = position
    second, third = 1.0 + 2.0 * y_2 @ away, 2.0 * (np.sum(y_1 * y_2, axis=1) + y_3 @ away)
    fourth = np.maximum(np.sum(y_2 * y_2, axis=1) + 2.0 * np.sum(y_1 * y_3, axis=1), straight)
    result = np.tile(flat, (2, 1))
    for ray in np.flatnonzero(second < CENTRE):
        roots = np.roots([fourth[ray], third[ray], second[ray], 2.0 * slope[ray], away @ away])
        result[:, ray] = np.sort_complex(roots.real + 1j * np.abs(roots.imag))[::2]
    return result


def _nearest_zero(a: Array, b: Array, c: Array, straight: float) -> Array:
    """The zero nearest to 0 of |f|², to its second order, f = a + b ρ + c ρ²."""
    size, slope = np.sum(a * a, axis=1), np.sum(a * b, axis=1)
    bend, slope = (np.sum(b * b, axis=1) + 2.0 * np.sum(a * c, axis=1)) / size, slope / size
    square = np.where(np.abs(bend) > straight, bend, straight)
    root = np.sqrt((slope * slope - square).astype(complex))
    return np.asarray(
        (np.where(root.imag > 0.0, 1.0, np.copysign(1.0, slope)) * root - slope) / square
    )


def _count(wanted: float, log_rho: float, more: int, least: int) -> int:
    """Gauss points for an integrand that is analytic in Bernstein's ellipse of ln ρ."""
    return (
        int(min(max(math.ceil(wanted / (2.0 * log_rho)) + more, least), MOST))
        if log_rho > 0.0
        else MOST
    )
