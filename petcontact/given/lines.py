"""Given data along the sides of outlines: where they are rough, and how they are integrated."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence

import numpy as np

from ..arrays import Array
from ..geometry.outline import Outline, Side
from ..record import Keeping, record
from .features import SAMPLES, SMOOTH, kinks
from .sites import Sites
from .values import Given

OWN_SAMPLES = 16
"""Least number of samples of a side. An expression that may be narrow has more."""
Values = Callable[[Array], Array]
"""Function from fractions (n,) of a side to values (n, c)."""


@record
class Line(Keeping):
    """A side of an outline, along which data are given.

    Attributes
    ----------
    side : Side
    offset : float
        Arc length along the part at the start of the side [length].

    Examples
    --------
    The load p = x on the piece from 2 to 4 of a side, none of whose ends an element needs to see:

    >>> from petcontact.given.values import as_given
    >>> line = Line(Side(np.zeros(2), np.array([8.0, 0.0]), "bottom"), 0.0)
    >>> load = as_given("where((x > 2) * (x < 4), x, 0)", "boundary[0] (bottom).pressure")
    >>> at, weight = line.quadrature([load], np.array([0.0, 1.0]))
    >>> round(float(weight @ load.at(line.sites(at))), 9)
    6.0
    >>> [ends.round(6).tolist() for ends in line.switches(load)]
    [[], [0.25, 0.5]]
    """

    side: Side
    offset: float

    def sites(self, fractions: Array) -> Sites:
        """Return the sites at fractions (n,) of the side."""
        s = self.offset + self.side.length * fractions
        return Sites(self.side.point(fractions), self.normals(fractions), s)

    def normals(self, fractions: Array) -> Array:
        """Return the outward unit normals at fractions (n,) of the side, (n, 2)."""
        along = self.side.tangents(fractions)
        return np.column_stack([along[:, 1], -along[:, 0]])

    def degree(self, data: Sequence[Given]) -> float:
        """Return the degree of data as polynomials of the fraction, infinite if they are none."""
        if self.side.curvature:
            return math.inf
        return max((datum.degree for datum in data), default=0.0)

    def features(self, data: Sequence[Given], values: Values) -> tuple[Array, Array, Array]:
        """Return where functions of given data are rough, and samples that resolve them.

        A polynomial has no kinks, and by Markov's inequality its slope is at most 2 degree² times
        its largest value.

        Returns
        -------
        switches : (2, k) array
            Fractions at which the values have a kink or a jump, and their powers, see `kinks`.
        samples, sampled : (n,) and (n, c) arrays
            Increasing fractions that resolve the values, and the values there.
        """
        if (enough := 4.0 * self.degree(data) ** 2) <= SAMPLES:
            fractions = np.linspace(0.0, 1.0, max(OWN_SAMPLES, int(enough)))
            return np.empty((2, 0)), fractions, values(fractions)
        values(np.array([0.0, 1.0]))  # what cannot be read is refused by its key
        samples = [datum.features(self.sites)[1] for datum in data if datum.varies]
        fractions = np.unique(np.concatenate([np.linspace(0.0, 1.0, OWN_SAMPLES), *samples]))
        sampled, switches = values(fractions), [np.empty((2, 0))]
        far = float(np.abs([self.side.start, self.side.end]).max()) / self.side.length
        if any(datum.varies and datum.rough for datum in data):
            for c, column in enumerate(sampled.T):

                def component(at: Array, c: int = c) -> Array:
                    return np.asarray(values(at)[:, c])

                switches.append(np.stack(kinks(component, fractions, column, far)))
        return np.concatenate(switches, axis=1), fractions, sampled

    def switches(self, datum: Given | None) -> tuple[Array, Array]:
        """Return the fractions inside the side at which a datum has a kink, and at which it
        jumps."""
        if datum is None or not (datum.varies and datum.everywhere):
            return np.empty(0), np.empty(0)
        column = functools.partial(self._column, datum)
        (fraction, power), *_ = self.once(datum, lambda: self.features([datum], column))
        return fraction[power >= -SMOOTH], fraction[power < -SMOOTH]

    def slope(self, datum: Given, fraction: float, way: float) -> float:
        """Return the slope of a datum from a fraction of the side on, forwards (1) or backwards
        (-1), over the largest value per length.

        It is that of a parabola through three points, which is exact to fourth order for even
        data.
        """
        # with this distance, errors by round-off and by the fourth-order term are 1e-9
        step = 1e-3
        ahead = fraction + way * step * np.arange(3)
        values = datum.near(self.sites(np.concatenate([ahead, np.linspace(0.0, 1.0, 17)])))
        slope = (-3.0 * values[0] + 4.0 * values[1] - values[2]) / (2.0 * step)
        return float(slope / (np.abs(values).max() or 1.0))

    def quadrature(self, data: Sequence[Given], ends: Array) -> tuple[Array, Array]:
        """Return points and weights that integrate given data over elements of the side.

        Polynomials are exact. Other data are integrated between the samples that resolve them and
        the places where they are rough.

        Parameters
        ----------
        data : sequence of Given
            Data that are integrated, or whose products with smooth functions are.
        ends : (k + 1,) array
            Ends of the elements as increasing fractions of the side.

        Returns
        -------
        fractions : (q,) array
            Increasing points, none of which is an end of an element.
        weights : (q,) array
            [length]
        """
        power = self.degree(data)
        cuts = [ends]
        if math.isfinite(power):
            xi, weight = np.polynomial.legendre.leggauss(int(power) // 2 + 2)
        else:
            xi, weight = np.polynomial.legendre.leggauss(4)
            for datum in data:
                switches, samples, _ = self.features(
                    [datum], functools.partial(self._column, datum)
                )
                cuts += [switches[0], samples]
        inner = np.unique(np.concatenate(cuts))
        inner = inner[(inner >= ends[0]) & (inner <= ends[-1])]
        half = 0.5 * np.diff(inner)[:, None]
        fractions = inner[:-1, None] + half * (1.0 + xi)
        return fractions.ravel(), (self.side.length * half * weight).ravel()

    def _column(self, datum: Given, fractions: Array) -> Array:
        return datum.near(self.sites(fractions))[:, None]


def lines_of(outline: Outline) -> list[Line]:
    """Return the lines of all sides of an outline, the same ones each time."""
    return outline.once(lines_of, lambda: list(map(Line, outline.sides, outline.offsets)))
