"""Number of Gauss points for panels far from the target, and number of digits for curved panels
near it."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index
from ...mesh.basis import gauss
from ...mesh.curved.curved_panels import CurvedPanels, reference_rule
from ...mesh.panels import Panels
from ...round_off import SOLVED

TOLERANCE = {Panels: 1e-11, CurvedPanels: 1e-9}
"""Relative error of quadrature by default: of far flat panels, and of all curved ones, near or
far."""
MOST_POINTS: dict[type, tuple[int, ...]] = {Panels: (64, 64, 144, 256), CurvedPanels: (256,) * 4}
"""Gauss points up to which a panel of each order is far: as dear as what is done near it; closed
forms lose digits afar."""
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24)
"""Numbers of points in one direction that are used."""
EXACT = 16
"""Points along both directions that integrate what is left from afar, see `fewest`."""
AFAR = 8.0
"""Error over a usual tolerance that is left there: what the rules near panels come to, too."""
SAFETY = 2.5
MOST_GAUSS = 40
"""Gauss points in s or v at most."""
MARGIN = 3.3
"""Digits (natural) beyond the tolerance that the rules aim at."""
TIGHTER = 0.3
"""More of them for each one beyond the tolerance of curved panels: zeros are known to the second
order only."""
STRETCH, GENTLE = {3: 0.3, 4: 2.0}, 0.1
"""Rate of `warp` by the corners, and the bend up to which nothing more is needed."""
CURVED = 1
"""Degree that the area factor of curved panels and their bend add: both are no polynomials, but
close to low ones."""


def tolerance_of(panels: Panels | CurvedPanels, wanted: float | None) -> float:
    """Return the tolerance that is given, or the default."""
    return TOLERANCE[type(panels)] if wanted is None else wanted


def degrees(panels: Panels | CurvedPanels) -> Index:
    """Return the degree of basis times area factor along both directions of a panel's Gauss points.

    The basis is u^a v^b of the plane, a, b <= p on quadrilaterals and a + b <= p on triangles, and
    u and v are bilinear in the coordinates s, t of the Gauss points, ∂v/∂s = 0 in the middle by the
    choice of the frame: p along both directions of a rectangle, 2p along t where t leans, as on
    other parallelograms, and 2p + 1 where the term s t counts, also in the area factor. A triangle
    is bilinear with two corners in one, and its area factor linear in t.

    On curved panels the basis is of degree p in the coordinates of the Gauss points themselves.

    Returns
    -------
    degree : (n, 2) int array
    """
    polygon, order = panels.polygon, panels.order
    if isinstance(panels, CurvedPanels):
        return np.tile(
            [order + CURVED, order + CURVED + (panels.n_corners == 3)], (len(polygon), 1)
        )
    if panels.n_corners == 3:
        return np.tile([order, order + 1], (len(polygon), 1))
    a, b, c, d = polygon.transpose(1, 0, 2)
    least = SOLVED * (polygon.max(axis=1) - polygon.min(axis=1))
    twisted = np.abs(a - b + c - d) > least
    leaning = twisted[:, 0] | (np.abs(c + d - a - b)[:, 0] > least[:, 0])
    return np.stack(
        [
            order + (order + 1) * twisted[:, 1],
            order + order * leaning + twisted.any(axis=1),
        ],
        axis=1,
    )


@functools.cache
def least_log_rho(degree: int, tolerance: float) -> Array:
    """Return the least ln ρ for which each of `COUNTS` meets the tolerance at some degree. It
    decreases; it is inf where none does.

    n points integrate polynomials of degree 2n-1 and the basis and the area take m of these
    (`degrees`): with k = 2n - m the rest is less than SAFETY k² ρ^-k of the largest integral, k²
    for the cubed distance of the traction (found for squares and for panels of 1:5, all orders,
    from two half-lengths on).
    """
    k = 2.0 * np.array(COUNTS) - degree
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(k > 0.0, (np.log(SAFETY * k * k) - math.log(tolerance)) / k, np.inf)


def fewest(panels: CurvedPanels, tolerance: float) -> Index:
    """Return the places in `COUNTS` (n,) of the least numbers of points, along both directions,
    that suffice for far targets.

    There nothing but the basis times the area factor, and times the normal and that factor, is left
    to integrate: no polynomials of a low degree on warped panels. It is found once for panels and a
    tolerance: that costs as much as a field at some 200 points.
    """
    name = f"fewest at {tolerance:g}"
    if name not in panels.found:
        panels.found[name] = _least_places(panels, tolerance)
    return np.asarray(panels.found[name])


def _least_places(panels: CurvedPanels, tolerance: float) -> Index:
    """Return `fewest` for panels that were not met before."""
    exact, result = _moments(panels, EXACT), np.full(len(panels.index), COUNTS.index(EXACT))
    allowed = tolerance * (AFAR if tolerance >= TOLERANCE[CurvedPanels] else 1.0)
    size, left = np.abs(exact).max(axis=(1, 2)), np.arange(len(panels.index))
    for index, count in enumerate(COUNTS[: COUNTS.index(EXACT)]):
        apart = np.abs(_moments(panels.take(left), count) - exact[left]).max(axis=(1, 2))
        holds = apart <= allowed * size[left]
        result[left[holds]], left = index, left[~holds]
        if not len(left):
            return result
    # more points than a rule for afar has: such panels are near everywhere
    apart = np.abs(_moments(panels.take(left), COUNTS[-1]) - exact[left]).max(axis=(1, 2))
    result[left[apart > allowed * size[left]]] = COUNTS.index(EXACT) + 1
    return result


def _moments(panels: CurvedPanels, count: int) -> Array:
    """Integrals of the basis times area factor and normal by so many points along both directions,
    (n, 4, k) [length²]."""
    local, weight = reference_rule(panels.n_corners, (count, count))
    _, along = panels.at(panels.each(local))
    normal = np.cross(along[:, :, 0], along[:, :, 1])
    both = np.concatenate([normal, np.linalg.norm(normal, axis=2, keepdims=True)], axis=2)
    return np.asarray(
        np.einsum(
            "nqc,qk->nck", both, weight[:, None] * panels.basis(local[None])[0], optimize=True
        )
    )


def digits(tolerance: float) -> float:
    """Return D, the natural digits that the rules of a flat panel have."""
    tighter = max(math.log(TOLERANCE[CurvedPanels] / tolerance), 0.0)
    return math.log(1.0 / tolerance) + MARGIN + TIGHTER * tighter


def warp(panels: CurvedPanels) -> Array:
    """Return the factor (n,) by which curved panels are integrated to more digits than flat ones
    [-].

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


def gauss_table(counts: Sequence[int]) -> Array:
    """Gauss points and weights on [-1, 1], a row for each number of them and zero beyond it, (2,
    counts, points)."""
    result = np.zeros((2, len(counts), max(counts)))
    for row, count in enumerate(counts):
        result[:, row, :count] = gauss(count - 1)
    return result
