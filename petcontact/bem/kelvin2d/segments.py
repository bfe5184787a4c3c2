"""Straight elements: geometry, local coordinates of targets, and the moments of both kernels at
every distance."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Complex, Index, Mask
from ...frozen import frozen
from ...mesh.basis import gauss
from . import moments
from .moments import RULES, Moments, Parts

Pairs = tuple[Index, Index]


@frozen
class Segments:
    """Straight elements, arrays (n,).

    Attributes
    ----------
    start, end, middle : complex arrays
        [length]
    tangent : complex array
        Unit tangent.
    half : array
        a: half the length [length].
    """

    start: Complex
    end: Complex
    middle: Complex
    tangent: Complex
    half: Array

    @staticmethod
    def through(start: Array, end: Array) -> Segments:
        """Segments with end points (n, 2)."""
        first: Complex = start[:, 0] + 1j * start[:, 1]
        last: Complex = end[:, 0] + 1j * end[:, 1]
        chord: Complex = last - first
        size = np.hypot(chord.real, chord.imag)
        return Segments(first, last, 0.5 * (first + last), chord / size, 0.5 * size)

    def take(self, index: Index | slice) -> Segments:
        """The segments with these numbers."""
        return Segments(
            self.start[index],
            self.end[index],
            self.middle[index],
            self.tangent[index],
            self.half[index],
        )

    def reach(self, radius: float) -> Array:
        """Distance from the middle beyond which |z| > radius."""
        return radius * self.half

    def nodes(self, points: int) -> tuple[Complex, Complex]:
        """Points of Gauss quadrature and dx/ds there, (q, n)."""
        step: Complex = self.tangent * self.half
        return self.middle + gauss(points - 1)[0][:, None] * step, np.broadcast_to(
            step, (points, len(step))
        )

    def far_points(self, order: int) -> int:
        """Gauss points for far targets."""
        return RULES[order].far

    def close_sum(self, order: int) -> float:
        """Targets with |z+1| + |z-1| below this are close."""
        return RULES[order].close_sum

    def far(
        self, order: int, point: Complex, off_line: Array | None
    ) -> tuple[Moments, Complex, Pairs]:
        """Moments (n, p+1, m) of all targets, the square of their frames' tangents (n,), and the
        pairs that are not far enough for them; `off_line` is 0 for pairs on one line, else 1."""
        dx, dy = point.real - self.middle.real[:, None], point.imag - self.middle.imag[:, None]
        scaled: Complex = self.tangent / self.half
        tx, ty = scaled.real[:, None], scaled.imag[:, None]
        xi, h = dx * tx, dy * tx
        dy *= ty
        xi += dy
        dx *= ty
        h -= dx
        if off_line is not None:
            h *= off_line
        rule = RULES[order]
        element, column = np.nonzero(xi * xi + h * h < rule.far_radius**2)
        # What is taken once more may be anything here but a Gauss point.
        xi[element, column] = rule.far_radius
        return moments.distant(order, rule.far, xi, h), self.tangent**2, (element, column)

    def middle_range(
        self, order: int, point: Complex, xi: Array, h: Array
    ) -> tuple[Moments, Complex]:
        """Moments (p+1, n) of one target an element that is neither far nor close, and the square
        of their frames."""
        return moments.distant(order, RULES[order].middle, xi, h), self.tangent**2

    def close(self, order: int, left: Array, right: Array, h: Array, on_line: Mask) -> Moments:
        """Moments (p+1, n) of one close target an element, in the elements' frames; see
        `moments.powers`."""
        log, (cauchy, square) = moments.powers(order, left, right, h, on_line, 2)
        square = square * h
        weight = gauss(order)[1][:, None]
        return moments.straight(
            log, (cauchy.real, cauchy.imag), (square.real, square.imag), h, weight
        )

    def powers(
        self, order: int, left: Array, right: Array, h: Array, on_line: Mask, highest: int
    ) -> Parts:
        """Integrals of the powers of 1/(s-z) for one close target an element; see
        `moments.powers`."""
        log, found = moments.powers(order, left, right, h, on_line, highest)
        weight = gauss(order)[1][:, None].astype(np.complex128)
        return Parts(log, found[0], found[1], found[2] if highest > 2 else None, weight)

    def bend(self, xi: Array, h: Array) -> tuple[Array, Complex, Complex]:
        """0, 1 and ih; see `Arcs.bend`."""
        return np.zeros(len(h)), np.ones(len(h), dtype=np.complex128), 1j * h

    def coordinates(self, point: Complex) -> tuple[Array, Array, Array]:
        """ξ+1, ξ-1 and h of one target an element, each accurate close to the end points, (n,)."""
        scaled: Complex = self.tangent.conjugate() / self.half
        from_start, from_end = (point - self.start) * scaled, (point - self.end) * scaled
        h = np.where(np.abs(from_start) < np.abs(from_end), from_start.imag, from_end.imag)
        return from_start.real, from_end.real, h
