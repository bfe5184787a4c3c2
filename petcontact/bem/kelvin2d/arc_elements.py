"""Circular-arc elements: their geometry, the preimages of targets, and the moments of both kernels.

With half the angle α (signed like the curvature κ), half the arc length a = α/κ, and the tangent τ
at the middle of the arc (unit complex numbers), x(s) = x(0) + τ (exp(iαs) - 1)/(iκ). A target y has
the preimage z = ξ + ih, exp(iαz) = 1 + iκ (y - x(0))/τ, and the kernels are trigonometric functions
of α(s-z)/2:

    dx/(x-y) = [α/2 cot(α(s-z)/2) + iα/2] ds,  |x-y| = a |s-z| exp(-αh/2) |sin/α(s-z)/2|

so each is that of a straight element in the coordinate s, in closed form, plus a smooth remainder,
for which a few Gauss points suffice at every distance.
"""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Complex, Rows
from ...geometry.arcs import half_angles
from ...mesh.basis import product_weights
from ...record import record
from . import moments
from .moments import RULES, Parts
from .segments import Segments

MIDDLE, CLOSE_SUM = 24, 2.9
"""As in `moments.PointCounts`, for arcs of every order: what the series of close targets asks
for."""


@record
class Arcs(Segments, Rows):
    """Arcs of at most half a circle, as arrays (n,).

    Attributes
    ----------
    start, end, middle : complex arrays
        Points of the arc [length].
    tangent : complex array
        Unit tangent at the middle.
    half : array
        a: half the length [length].
    angle : array
        α: half the angle between the tangents at start and end, positive where the arc turns left.
    curvature : array
        [1/length]
    """

    angle: Array
    curvature: Array

    @staticmethod
    def bent(start: Array, end: Array, curvature: Array) -> Arcs:
        """Return the arcs with end points (n, 2) and non-zero curvature (n,)."""
        chord = Segments.through(start, end)
        angle = half_angles(2.0 * chord.half, curvature)
        rise = chord.half * np.tan(0.5 * angle)
        middle: Complex = chord.middle - 1j * chord.tangent * rise
        return Arcs(
            chord.start, chord.end, middle, chord.tangent, angle / curvature, angle, curvature
        )

    def coordinates(self, point: Complex) -> tuple[Array, Array, Array]:
        """Return ξ+1, ξ-1 and h, (n,), of one target for each arc. Each is accurate close to the
        ends of the arc."""
        xi, h = self._preimage(point, self.middle, self.tangent)
        turn = np.exp(1j * self.angle)
        from_start, h_start = self._preimage(point, self.start, self.tangent / turn)
        from_end, h_end = self._preimage(point, self.end, self.tangent * turn)
        left = np.where(xi < 0.0, from_start, xi + 1.0)
        right = np.where(xi > 0.0, from_end, xi - 1.0)
        return left, right, np.where(xi < -0.5, h_start, np.where(xi > 0.5, h_end, h))

    def _preimage(self, point: Complex, origin: Complex, tangent: Complex) -> tuple[Array, Array]:
        """Return the real and imaginary part of ln(1+u)/(iα), u = iκ (y - origin)/tangent."""
        u = 1j * self.curvature * (point - origin) / tangent
        with np.errstate(divide="ignore"):
            log_modulus = 0.5 * np.log1p(np.maximum(2.0 * u.real + u.real**2 + u.imag**2, -1.0))
        return np.arctan2(u.imag, 1.0 + u.real) / self.angle, -log_modulus / self.angle

    def reach(self, radius: float) -> Array:
        """Return the distance from the middle beyond which every preimage has |z| > radius, from
        |ln(1+u)| >= ln(1+|u|)."""
        stretched = np.minimum(radius * np.abs(self.angle), 300.0)
        return np.asarray(np.expm1(stretched) / np.abs(self.curvature))

    def powers(self, order: int, left: Array, right: Array, h: Array) -> Parts:
        """Return the integrals of the trigonometric kernels for one close target of each arc. They
        are those of a straight element in the coordinate s plus a smooth remainder by Gauss
        quadrature; see `moments.powers`."""
        _, straight = moments.powers(order, left, right, h, np.zeros(len(h), dtype=bool), 3)
        widest = float(np.max(np.abs(self.angle)))
        s, product = product_weights(order, _points(order, widest))
        z = 0.5 * (left + right) + 1j * h
        # α(s-z)/2π: the remainders are power series of its square.
        offset = (0.5 / np.pi) * self.angle * (s[:, None] - z)
        rest = np.polynomial.polynomial.polyval(offset * offset, series(_terms(widest))[:, 1:])
        half_angle = 0.5 * self.angle
        return Parts(
            first=straight[0] + half_angle * (product @ (offset * rest[0])),
            second=straight[1] + half_angle**2 * (product @ rest[1]),
            third=straight[2] + half_angle**3 * (product @ (offset * rest[2])),
            wave=product @ np.exp(-1j * np.multiply.outer(s, self.angle)),
        )

    def bend(self, xi: Array, h: Array) -> tuple[Array, Complex, Complex]:
        """Return α, exp(-iαz) and i exp(-iαξ) sinh(αh)/α. They are 0, 1 and ih for a straight
        element."""
        lift: Complex = 1j * h * _sinhc(self.angle * h) * np.exp(-1j * self.angle * xi)
        return self.angle, np.exp(-1j * self.angle * (xi + 1j * h)), lift


def _sinhc(x: Array) -> Array:
    return np.where(np.abs(x) < 1e-4, 1.0 + x * x / 6.0, np.sinh(x) / np.where(x == 0.0, 1.0, x))


@functools.cache
def resolving_points(order: int, turn: float, tolerance: float) -> int:
    """Return the number of Gauss points for a polynomial times e^(2i turn s), -1 <= s <= 1, whose
    series ends at a tolerance."""
    degree, size = 0, 1.0
    while size > tolerance:
        degree += 1
        size *= turn / degree
    return (degree + order + 1) // 2


@functools.cache
def counts(order: int, angle: float) -> tuple[int, int, int]:
    """Return the numbers for arcs of at most half that angle: Gauss points for far targets and for
    the remainders, and terms of their series."""
    far = max(RULES[order].far, resolving_points(order, 0.75 * angle, 1e-15))
    return far, _points(order, angle), _terms(angle)


def _points(order: int, angle: float) -> int:
    """Return the number of Gauss points for the remainders, whose poles are 2π/α away from z."""
    pole = 2.0 * np.pi / angle - 0.5 * CLOSE_SUM
    return int(np.ceil(0.5 * order + 18.5 / np.log(pole + np.sqrt(pole * pole - 1.0)))) + 1


def _terms(angle: float) -> int:
    """Return the number of terms that give the series for |s-z| within reach of a close target to
    1e-17."""
    return int(np.ceil(-19.5 / np.log(0.5 * angle * (1.0 + 0.5 * CLOSE_SUM) / np.pi))) + 1


def _zeta(s: Array) -> Array:
    """Riemann's ζ(s) for s >= 2 to round-off: 29 terms, and Euler and Maclaurin's for the others
    (DLMF 25.2.9)."""
    n = 30.0
    rest = (
        n / (s - 1.0)
        + 0.5
        + s
        / (12.0 * n)
        * (
            1.0
            - (s + 1.0)
            * (s + 2.0)
            / (60.0 * n**2)
            * (
                1.0
                - (s + 3.0)
                * (s + 4.0)
                / (42.0 * n**2)
                * (1.0 - (s + 5.0) * (s + 6.0) / (40.0 * n**2))
            )
        )
    )
    return np.asarray(np.power.outer(np.arange(1.0, n), -s)[::-1].sum(axis=0) + n**-s * rest)


@functools.cache
def series(terms: int) -> Array:
    """Power series in (x/π)² of ln(sin x/x), (cot x - 1/x)/(x/π), 1/sin² x - 1/x² and (cos x/sin³ x
    - 1/x³)/(x/π).

    Their coefficients are values ζ(2k) of Riemann's function (DLMF 4.19 and 25.6).
    """
    k = np.arange(1.0, terms + 1.0)
    exponent = 2.0 * k
    zeta = _zeta(exponent)
    result = np.zeros((terms + 1, 4))
    result[1:, 0] = -zeta / k
    result[:-1, 1] = -2.0 / np.pi * zeta
    result[:-1, 2] = 2.0 / np.pi**2 * (exponent - 1.0) * zeta
    result[:-2, 3] = -np.arange(1.0, terms) / np.pi * result[1:-1, 2]
    return result
