"""How many Gauss points stand for a panel that is seen from afar."""

from __future__ import annotations

import functools
import math

import numpy as np

from ...arrays import Array, Index
from ...mesh.curved.panels import CurvedPanels, reference_rule
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
RECTANGULAR = 0.9
"""Panels that fill less of their frame's box have slanting lines of Gauss points: the same number
in both directions."""


CURVED = 1
"""Degree that the area factor of curved panels and their bend add: both are no polynomials, but
close to low ones."""


def tolerance_of(panels: Panels | CurvedPanels, wanted: float | None) -> float:
    """What is wanted, or what serves by default."""
    return TOLERANCE[type(panels)] if wanted is None else wanted


def degrees(panels: Panels | CurvedPanels) -> Index:
    """Degree of the basis times the area factor along both directions of a panel's Gauss points.

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
            [order + CURVED, order + CURVED + (polygon.shape[1] == 3)], (len(polygon), 1)
        )
    if polygon.shape[1] == 3:
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
    """ln ρ from which on each of `COUNTS` holds the tolerance at some degree, decreasing; inf where
    none does.

    n points integrate polynomials of degree 2n-1 and the basis and the area take m of these
    (`degrees`): with k = 2n - m the rest is less than SAFETY k² ρ^-k of the largest integral, k²
    for the cubed distance of the traction (found for squares and for panels of 1:5, all orders,
    from two half-lengths on).
    """
    k = 2.0 * np.array(COUNTS) - degree
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(k > 0.0, (np.log(SAFETY * k * k) - math.log(tolerance)) / k, np.inf)


def fewest(panels: CurvedPanels, tolerance: float) -> Index:
    """Places in `COUNTS` (n,) of the least numbers of points, along both directions, that serve
    from afar.

    There nothing but the basis times the area factor, and times the normal and that factor, is left
    to integrate: no polynomials of a low degree on warped panels. It is found once for panels and a
    tolerance: that costs as much as a field at some 200 points.
    """
    name = f"fewest at {tolerance:g}"
    if name not in panels.found:
        panels.found[name] = _least_places(panels, tolerance)
    return np.asarray(panels.found[name])


def _least_places(panels: CurvedPanels, tolerance: float) -> Index:
    """`fewest` of panels that are new."""
    exact, result = _moments(panels, EXACT), np.full(len(panels.index), COUNTS.index(EXACT))
    allowed = tolerance * (AFAR if tolerance >= TOLERANCE[CurvedPanels] else 1.0)
    size, left = np.abs(exact).max(axis=(1, 2)), np.arange(len(panels.index))
    for place, count in enumerate(COUNTS[: COUNTS.index(EXACT)]):
        apart = np.abs(_moments(panels.take(left), count) - exact[left]).max(axis=(1, 2))
        holds = apart <= allowed * size[left]
        result[left[holds]], left = place, left[~holds]
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


def point_counts(
    points: Array, panels: Panels | CurvedPanels, element: int, tolerance: float, least: int = 0
) -> Index:
    """Gauss points (m, 2) along both directions of a panel that hold the tolerance at each target,
    out of `COUNTS`, or 999.

    `least` is the place of the least number there, see `fewest`.

    Along one direction the integrand is analytic inside the Bernstein ellipse of ρ whose foci are
    the ends, r vanishing at position ± i distance: (ρ + 1/ρ)/2 is half the sum of the distances
    from both ends over half the length. Slanting lines are as long as the longest edge.
    """
    chord = panels.chord
    local = (points - chord.centre[element]) @ chord.frame[element].T / chord.size[element]
    polygon, (lowest, highest) = chord.polygon[element], panels.box[element]
    low, high = lowest[:2], highest[:2]
    half, edge = 0.5 * (high - low), np.roll(polygon, -1, axis=0) - polygon
    slanting = abs(
        polygon[:, 0] @ edge[:, 1] - polygon[:, 1] @ edge[:, 0]
    ) < 2.0 * RECTANGULAR * np.prod(high - low)
    length = np.maximum(half, 0.5 * np.hypot(*edge.T).max()) if slanting else half
    offset = np.abs(local[:, :2] - 0.5 * (high + low))
    beyond = np.maximum(offset - half, 0.0)
    above = np.maximum(
        np.abs(local[:, 2] - 0.5 * (highest[2] + lowest[2])) - 0.5 * (highest[2] - lowest[2]), 0.0
    )
    degree = degrees(panels)[element].tolist()
    counts = np.empty((len(points), 2), dtype=np.int64)
    for c in range(2):
        across = np.hypot(beyond[:, 1 - c], above)
        mean = (
            0.5
            * (np.hypot(offset[:, c] - half[c], across) + np.hypot(offset[:, c] + half[c], across))
            / length[c]
        )
        log_rho = np.arccosh(np.maximum(mean, 1.0))
        place = np.sum(log_rho[:, None] < least_log_rho(degree[c], tolerance), axis=1)
        counts[:, c] = np.append(COUNTS, 999)[np.maximum(place, least)]
    if slanting:
        counts[:] = counts.max(axis=1, keepdims=True)
    return counts
