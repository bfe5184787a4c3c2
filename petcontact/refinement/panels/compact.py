"""Forecast of a compact contact before it is solved: the ellipse of least approach.

Of all zones that may carry a force, contact is the one with the least approach (J. R. Barber,
Determining the contact area in elastic indentation problems, J. Strain Analysis 9 (1974) 230-232).
An ellipse carries a force F like a flat punch: the approach is F K(m)/(π E* b) and the mean of the
gap under its pressure. The least one among ellipses is exact for Hertz' gaps and for every gap that
grows away from an axis, like Galin's rⁿ.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from ...arrays import Array
from ...geometry.chart import Chart
from ...record import replace
from ...round_off import SINGLE, TINY
from .forecast import PARABOLIC, hertz_ellipse
from .ridge import SAMPLES, Gap
from .zone import ELONGATED, ContactEllipse, principal_axes

STEPS, KNOWN = 40, 1e-3
"""Most steps to an ellipse, and the relative change of its axes with which it is known [-]."""
STENCIL = 1.0 / 32.0
"""Step of difference quotients over an axis [-]. Those of a fourth power are off by 1e-3."""
TURNS = np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False)
CIRCLE = np.column_stack([np.cos(TURNS), np.sin(TURNS)])
"""Points of a unit circle."""
HEIGHTS, WEIGHTS = np.polynomial.legendre.leggauss(8) * np.array([[0.5], [1.0 / 32.0]])
DISC = (np.sqrt(1.0 - (0.5 + HEIGHTS) ** 2)[:, None, None] * CIRCLE).reshape(-1, 2)
WEIGHT = np.repeat(WEIGHTS, len(CIRCLE))
"""Points and weights of a mean over the unit disc under the pressure of a flat punch,
1/(2π√(1 - r²)): its mean over √(1 - r²) is even."""


def ellipse_of(
    gap: Gap, chart: Chart, start: Array, force: float, modulus: float
) -> tuple[ContactEllipse, float, float] | None:
    """Return the ellipse with the least approach, the least gap, and this approach; or None if it
    is elongated or not on the face, or if contact is no ellipse.

    Parameters
    ----------
    gap : callable
    chart : Chart
    start : (2,) array
        A place near the least gap [length].
    force, modulus : float
        As of `hertz_ellipse`.
    """
    size = float((chart.high - chart.low).min()) / SAMPLES
    zone = ContactEllipse(start, size * np.eye(2))
    for _ in range(STEPS):
        found = _next(gap, chart, zone, force, modulus)
        if found is None:
            return None
        zone, approach, moved = found
        if moved < KNOWN:
            break
    else:
        return None
    values, axes = principal_axes(zone.axes @ zone.axes.T)
    if values[1] > ELONGATED**2 * values[0]:
        return None
    zone = replace(zone, axes=axes * np.sqrt(values))
    least = float(gap(zone.centre[None])[0])
    fits = np.all((zone.corners > chart.low) & (zone.corners < chart.high))
    # at the edge of an ellipse gaps of Hertz and of powers of r have harmonics up to the second
    more = np.abs(np.fft.rfft(gap(zone.at(CIRCLE)))[3:]).max() / len(CIRCLE)
    is_least = least < float(gap(zone.at(0.5 * CIRCLE)).min()) + PARABOLIC * approach
    good = fits and is_least and 2.0 * more <= PARABOLIC * approach
    return (zone, least, approach - least) if good else None


def _next(
    gap: Gap, chart: Chart, zone: ContactEllipse, force: float, modulus: float
) -> tuple[ContactEllipse, float, float] | None:
    """Return the next ellipse, the approach of the one before, over no gap, and how far its axes
    and its centre have moved over it; None where the gap is not known or not convex.

    The approach is least on Hertz' ellipse of the paraboloid whose slopes have the same moments
    under the pressure of a flat punch. With a gap like rⁿ the curvatures of this paraboloid grow
    like r^(n - 2), and half-widths fall with their cube root: the share 3/(n + 1) of the change of
    the logarithms leads to the root, and so does that of the shift. No axis becomes more than twice
    as long.
    """
    pull, bent, mean, power = _moments(gap, zone)
    if not np.all(np.isfinite(bent)):
        return None
    slopes = chart.slopes(zone.centre[None])[:, 0]
    axes = np.linalg.cholesky(slopes @ slopes.T).T @ zone.axes
    if (hertz := _hertz_squares(bent, axes, force, modulus)) is None:
        return None
    square, turn = hertz
    share = 3.0 / (power + 1.0)
    change = np.minimum(0.5 * share * np.log(square), math.log(2.0))
    shift = -share * np.linalg.solve(bent, pull)
    shift /= max(1.0, float(np.linalg.norm(shift)))
    return (
        replace(zone, centre=zone.at(shift), axes=zone.axes @ turn * np.exp(change)),
        mean + _approach(axes, force, modulus),
        float(max(np.abs(change).max(), np.linalg.norm(shift))),
    )


def _moments(gap: Gap, zone: ContactEllipse) -> tuple[Array, Array, float, float]:
    """Return means of a gap on a zone: of its slopes (2,), the curvatures (2, 2) of the paraboloid
    with as large moments of slopes, the mean gap, and the power n with which the gap grows."""
    steps = STENCIL * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.0, 0.0]])
    points = np.concatenate([(DISC + steps[:, None]).reshape(-1, 2), np.zeros((1, 2))])
    *values, least = gap(zone.at(points)).tolist()
    heights = np.reshape(values, (5, -1))
    slopes = (heights[:2] - heights[2:4]) / (2.0 * STENCIL) * WEIGHT
    bent, mean = 3.0 * slopes @ DISC, float(heights[4] @ WEIGHT)
    power = max(float(np.sum(slopes * DISC.T)) / max(mean - least, TINY), 1.0)
    return slopes.sum(axis=1), 0.5 * (bent + bent.T), mean, power


def _hertz_squares(
    bent: Array, axes: Array, force: float, modulus: float
) -> tuple[Array, Array] | None:
    """Return the squared semi-axes of Hertz' ellipse of a paraboloid, and their directions (as
    columns), in the coordinates of a zone with axes (2, 2); None if the paraboloid is not convex
    both ways."""
    back = np.linalg.inv(axes)
    curvatures, ways = principal_axes(back.T @ bent @ back)
    if not curvatures[0] > SINGLE * curvatures[1] > 0.0:
        return None
    across, along, _ = hertz_ellipse((curvatures[1], curvatures[0]), force, modulus)
    target = back @ ways * [along, across]
    square, turn = np.linalg.eigh(target @ target.T)
    return square, turn


def _approach(axes: Array, force: float, modulus: float) -> float:
    """Return the approach of a flat punch with axes (2, 2) [length]. Source: Johnson,
    Contact Mechanics, 1985, chapter 3."""
    long, short = map(float, np.linalg.svd(axes, compute_uv=False))
    integral = float(scipy.special.ellipk(1.0 - (short / long) ** 2))
    return force * integral / (math.pi * modulus * long)
