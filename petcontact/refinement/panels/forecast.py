"""Forecast of a long contact before it is solved: Hertz' ellipse, or slices along its ridge."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from ...arrays import Array
from ...geometry.chart import Chart
from ...linalg.root import root_between
from ...record import record, replace
from .ridge import Gap, Ridge, samples
from .zone import ContactBand, ContactEllipse

WIDER = 1.04
"""Width and length of a band over those that are expected [-]. With bands 5 % too wide errors of p
were as with right ones, with bands 5 % too narrow they were 2.5 times as large."""
CENTRED = 0.5 / math.sqrt(math.e)
"""Distance from its own axis at which Hertz' pressure acts like a line load, over its half-width
[-]: the mean logarithm of the distance over the pressure is ln a - ln 2 - 1/2."""
GROWTH = 2.5
"""Length of a cell over that of its neighbour nearer to an end [-]."""
LONGEST, SHORTEST = 0.03, 1e-3
"""Lengths of cells over that of a ridge, in its middle and at its ends [-]."""
IMAGES = 12
"""Largest number of images that begin with one plane of symmetry."""
PARABOLIC = 0.02
"""Largest difference of the gap along a ridge from a parabola, over the approach, with which a
contact is Hertz' ellipse [-]."""


def hertz_ellipse(
    curvatures: tuple[float, float], force: float, modulus: float
) -> tuple[float, float, float]:
    """Return the half-widths across and along, and the approach, of Hertz' ellipse.

    For t = a/b and m = 1 - t² the ratio of the curvatures is t² (K - E)/(E - t² K) with complete
    elliptic integrals K, E of parameter m. Source: Johnson, Contact Mechanics, 1985, 4.2.

    Parameters
    ----------
    curvatures : (float, float)
        Of the gap across and along, k_1 >= k_2 > 0 [1/length].
    force : float
        [force]
    modulus : float
        E* [stress].

    Examples
    --------
    >>> a, b, _ = hertz_ellipse((1.0, 1.0), 1.0, 1.0)
    >>> round(a, 4), round(b, 4)
    (0.9086, 0.9086)
    """
    k_1, k_2 = curvatures

    def integrals(t: float) -> tuple[float, float, float]:
        m = 1.0 - t * t
        return m, float(scipy.special.ellipk(m)), float(scipy.special.ellipe(m))

    def ratio(logarithm: float) -> float:
        t = math.exp(logarithm)
        _, K, E = integrals(t)
        return t * t * (K - E) / (E - t * t * K) - k_2 / k_1

    if k_1 - k_2 < 1e-6 * k_1:
        a = math.cbrt(0.75 * force / (modulus * k_1))
        return a, a, a * a * k_1
    t = math.exp(root_between(ratio, math.log(1e-8), math.log(1.0 - 1e-8)))
    m, K, E = integrals(t)
    a = math.cbrt(3.0 * force * t * (E - t * t * K) / (math.pi * modulus * k_1 * m))
    return a, a / t, 1.5 * force * t * K / (math.pi * modulus * a)


def is_alone(gap: Gap, chart: Chart, zone: ContactEllipse, level: float) -> bool:
    """Return whether the gap is less than a level about a zone only."""
    place = samples(chart)
    beside = np.sum(zone.local(place) ** 2, axis=1) > 4.0  # the parabola is the approach at 2
    return bool(gap(place[beside]).min(initial=np.inf) > level)


@record
class Forecast:
    """What is expected along a ridge.

    Attributes
    ----------
    s, half, load : (n,) arrays
        Places along the ridge [length], half-widths [length] and loads per length [force/length].
    ends : (float, float)
        Where contact begins and ends along the ridge [length].
    sharp : (bool, bool)
        Whether it ends there at a rim or a jump of the gap, where p is infinite.
    approach : float
        [length]
    elliptic : bool
        Whether contact is Hertz' ellipse.
    """

    s: Array
    half: Array
    load: Array
    ends: tuple[float, float]
    sharp: tuple[bool, bool]
    approach: float
    elliptic: bool = False

    @property
    def usual(self) -> float:
        """The half-width that is usual where the load is [length]."""
        force = self.load * np.gradient(self.s)
        return float(self.half @ force / force.sum())


@record
class Line:
    """Where a ridge lies in space, and where contact goes on beyond planes of symmetry.

    Attributes
    ----------
    points : (k, 3) array
        The points of the ridge [length].
    planes : list of (3,) arrays in pairs
        Points at which planes of symmetry end the ridge [length], and vectors normal to them.
    """

    points: Array
    planes: Sequence[tuple[Array, Array]] = ()

    def images(self, x: Array) -> Array:
        """Return points (n, 3) and their images in the planes of symmetry, (c, n, 3)."""
        result, near = [x], 0.1 * float(np.linalg.norm(x[-1] - x[0]))
        for first in range(len(self.planes)):
            image = x
            for k in range(first, first + IMAGES):
                place, way = self.planes[k % len(self.planes)]
                image = image - 2.0 * np.outer((image - place) @ way, way) / (way @ way)
                apart = [
                    np.linalg.norm(image.mean(axis=0) - there.mean(axis=0)) for there in result
                ]
                if min(apart) < near:  # an image of images in two planes may be there already
                    break
                result.append(image)
        return np.array(result)


def forecast_of(ridge: Ridge, line: Line, force: float, modulus: float) -> Forecast:
    """Return the forecast for a force.

    Parameters
    ----------
    ridge : Ridge
    line : Line
        Where it is in space.
    force : float
        [force]
    modulus : float
        E* of both bodies [stress].
    """
    ellipse = None if ridge.closed else _ellipse(ridge, force, modulus)
    return ellipse or _sliced(ridge, line, force, modulus)


def forecast_across(gap: Gap, ridge: Ridge, line: Line, force: float, modulus: float) -> Forecast:
    """Return the forecast for a force on a gap that need not be parabolic across its ridge.

    The curvature is that of the parabola through the ridge and the edges of contact, unless the gap
    jumps there. That of a gap x^2n grows like a^(2n - 2), and a falls with its root: the geometric
    mean of the two halves the error of its logarithm up to x⁶, and 16 steps leave 1e-5 of it.
    """
    first = found = forecast_of(ridge, line, force, modulus)
    for _ in range(16):
        half, inside = found.usual, np.interp(ridge.s, found.s, found.load) > 0.0
        edges = [ridge.points + side * half * ridge.across for side in (-1.0, 1.0)]
        sides = gap(np.concatenate(edges)).reshape(2, -1).sum(axis=0)
        fitted = (sides - 2.0 * ridge.gap) / half**2
        known = inside & np.isfinite(fitted) & (fitted > 0.0)
        share = np.where(known, fitted, ridge.curvature) / ridge.curvature
        if np.abs(share - 1.0).max() <= PARABOLIC:
            return found
        ridge = replace(ridge, curvature=np.sqrt(share) * ridge.curvature)
        found = forecast_of(ridge, line, force, modulus)
    return first


def force_at(ridge: Ridge, line: Line, approach: float, modulus: float, deep: float) -> float:
    """Return the force of an approach of points `deep` below the surfaces [length], by
    `forecast_of`: half spaces give far below the surface what bodies do not.

    Below point forces F_j there is left ΣF_j/(π E* r_j), with their distances r_j from there. The
    approach grows with a power of the force between 2/3, of balls, and 1, of lines. Each step
    leaves at most a third of the error of the logarithm: six leave a hundredth of it.
    """
    force = modulus * approach * float(ridge.s[-1] - ridge.s[0])
    at, least = scipy.interpolate.interp1d(ridge.s, line.points, axis=0), int(ridge.gap.argmin())
    for _ in range(6):
        found = forecast_of(ridge, line, force, modulus)
        away = line.images(at(found.s)) - line.points[least]
        nearness = np.sum((np.sum(away**2, axis=2) + deep**2) ** -0.5, axis=0)
        share = found.load * np.gradient(found.s)
        left = force / (math.pi * modulus) * float(share @ nearness / share.sum())
        force *= approach / max(found.approach - left, 0.1 * found.approach)
    return force


def _ellipse(ridge: Ridge, force: float, modulus: float) -> Forecast | None:
    """Return the forecast of Hertz' ellipse, if it fits on the ridge and the gap is parabolic."""
    least = int(ridge.gap.argmin())
    k_1, k_2 = float(ridge.curvature[least]), ridge.slope
    if not k_2 > 1e-9 * k_1:
        return None
    a, b, approach = hertz_ellipse((k_1, min(k_2, k_1)), force, modulus)
    s = ridge.s - ridge.s[least]
    inside = np.abs(s) <= b
    off = np.abs(ridge.gap - ridge.gap[least] - 0.5 * k_2 * s**2)
    fits = s[0] < -b and s[-1] > b and np.count_nonzero(inside) > 2
    if not fits or off[inside].max() > PARABOLIC * approach:
        return None
    at = b * np.sin(np.linspace(-0.5, 0.5, 81) * math.pi)
    half = a * np.sqrt(np.maximum(1.0 - (at / b) ** 2, 0.0))
    load = 0.75 * force / b * np.maximum(1.0 - (at / b) ** 2, 0.0)
    middle = float(ridge.s[least])
    ends = middle - b, middle + b
    return Forecast(middle + at, half, load, ends, (False, False), approach, elliptic=True)


def _sliced(ridge: Ridge, line: Line, force: float, modulus: float) -> Forecast:
    """Return the forecast of slices that move one another like a line of loads.

    A slice of load q per length has a² = 4 q/(π E* k). The slices are solved again on the part of
    the ridge that they load until this part stays.
    """
    whole = (float(ridge.s[0]), float(ridge.s[-1]))
    part = whole
    for _ in range(8):
        found = _on_cells(ridge, line, part, force, modulus)
        (low, high), reach = found.ends, 0.3 * (found.ends[1] - found.ends[0])
        near = max(low - reach, whole[0]), min(high + reach, whole[1])
        if ridge.closed or near[1] - near[0] > 0.7 * (part[1] - part[0]):
            return found
        part = near
    return found


def _on_cells(
    ridge: Ridge, line: Line, part: tuple[float, float], force: float, modulus: float
) -> Forecast:
    """Return the forecast of slices on a part of the ridge."""
    edges = _edges(ridge, part, force, modulus)
    s, h = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    gap, *x = scipy.interpolate.PchipInterpolator(
        ridge.s, np.column_stack([ridge.gap, line.points])
    )(s).T
    x = np.array(x).T
    apart = np.linalg.norm(x[:, None] - line.images(x)[:, None], axis=3)
    k = np.interp(s, ridge.s, ridge.curvature)
    load, approach = _loads(apart, h, (gap - ridge.gap.min(), k), force, modulus)
    first, last = np.flatnonzero(load > 0.0)[[0, -1]].tolist()
    sharp = (
        first == 0 and part[0] == ridge.s[0],
        last == len(s) - 1 and part[1] == ridge.s[-1],
    )
    half = np.sqrt(4.0 * load / (math.pi * modulus * k))
    return Forecast(s, half, load, (float(edges[first]), float(edges[last + 1])), sharp, approach)


def _edges(ridge: Ridge, part: tuple[float, float], force: float, modulus: float) -> Array:
    """Return the ends of cells on a part of the ridge, which are not shorter than they are wide."""
    length, middle = part[1] - part[0], 0.5 * (part[0] + part[1])
    k = float(np.interp(middle, ridge.s, ridge.curvature))
    wide = math.sqrt(4.0 * force / (length * math.pi * modulus * k))
    if ridge.closed:
        return np.linspace(*part, 1 + int(min(200, max(24, length / wide))))
    first = max(wide, SHORTEST * length)
    ends = from_end(0.5 * length, first, max(first, LONGEST * length))
    return np.concatenate([part[0] + ends, (part[1] - ends)[-2::-1]])


def _loads(
    apart: Array, h: Array, shape: tuple[Array, Array], force: float, modulus: float
) -> tuple[Array, float]:
    """Return the loads (n,) of cells with half-lengths h, and the approach, by an active set.

    `apart` (c, n, n) are distances of cells from all cells and from their images.
    """
    gap, k = shape
    stiff = math.pi * modulus
    load, on = np.full(len(h), force / (2.0 * h.sum())), np.ones(len(h), dtype=bool)
    approach = 0.0
    for _ in range(80):
        c = np.sqrt(4.0 * np.maximum(load, 1e-4 * load.max()) / (stiff * k))
        c = CENTRED * np.minimum(c, 2.0 * h.sum())  # where the gap is flat there is no width
        moved = np.sum(np.arcsinh((apart + h) / c) - np.arcsinh((apart - h) / c), axis=0) / stiff
        i, new = np.flatnonzero(on), np.zeros(len(h))
        both = np.linalg.solve(moved[np.ix_(i, i)], np.column_stack([np.ones(len(i)), gap[i]]))
        width = 2.0 * h[i]
        approach = float((force + width @ both[:, 1]) / (width @ both[:, 0]))
        new[i] = approach * both[:, 0] - both[:, 1]
        pressed = np.maximum(new, 0.0)
        later = (on & (new > 0.0)) | (~on & (moved @ pressed < approach - gap))
        if np.array_equal(later, on) and np.allclose(new, load, rtol=1e-3, atol=1e-3 * load.max()):
            return pressed, approach
        on, load = later, 0.5 * (load + pressed)
    return pressed, approach


def from_end(length: float, first: float, most: float, growth: float = GROWTH) -> Array:
    """Return distances from an end, 0 to length; the first is about `first`, each next longer by
    a factor, none longer than `most`."""
    ends = [0.0, min(first, length)]
    while ends[-1] < length:
        ends.append(ends[-1] + min(growth * (ends[-1] - ends[-2]), most))
    at = np.array(ends)
    return np.asarray(at * (length / at[-1]) ** (np.arange(len(at)) / (len(at) - 1)))


def band_of(ridge: Ridge, forecast: Forecast) -> ContactBand:
    """Return the band of a forecast, slightly wider and, towards ends that are roots, longer."""
    middle = 0.5 * (forecast.ends[0] + forecast.ends[1])
    longer = [1.0 if sharp else WIDER for sharp in forecast.sharp]
    low, high = (
        float(np.clip(middle + factor * (end - middle), ridge.s[0], ridge.s[-1]))
        for factor, end in zip(longer, forecast.ends, strict=True)
    )
    at = middle + np.where(forecast.s < middle, longer[0], longer[1]) * (forecast.s - middle)
    s = np.unique(np.clip(np.concatenate([at, [low, high]]), ridge.s[0], ridge.s[-1]))
    half, load = (
        np.sqrt(np.interp(s, at, values**2)) for values in (WIDER * forecast.half, forecast.load)
    )
    return ContactBand(*ridge.at(s), s, half, load, (low, high), forecast.sharp)
