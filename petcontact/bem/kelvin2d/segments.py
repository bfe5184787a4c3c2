"""Straight elements: geometry, local coordinates of targets, and integrals of 1/(s-z)^k."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Complex
from ...mesh.basis import gauss
from ...record import record
from . import moments
from .moments import Parts


@record
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

    def powers(self, order: int, left: Array, right: Array, h: Array) -> Parts:
        """Return the integrals of the powers of 1/(s-z) for one close target of each element; see
        `moments.powers`."""
        on_line = np.zeros(len(h), dtype=bool)
        first, second, third = moments.powers(order, left, right, h, on_line, 3)[1]
        return Parts(first, second, third, gauss(order)[1][:, None].astype(np.complex128))

    def bend(self, xi: Array, h: Array) -> tuple[Array, Complex, Complex]:
        """0, 1 and ih; see `Arcs.bend`."""
        return np.zeros(len(h)), np.ones(len(h), dtype=np.complex128), 1j * h

    def coordinates(self, point: Complex) -> tuple[Array, Array, Array]:
        """Return ξ+1, ξ-1 and h, (n,), of one target for each element. Each is accurate close to
        the end points."""
        scaled: Complex = self.tangent.conjugate() / self.half
        from_start, from_end = (point - self.start) * scaled, (point - self.end) * scaled
        h = np.where(np.abs(from_start) < np.abs(from_end), from_start.imag, from_end.imag)
        return from_start.real, from_end.real, h
