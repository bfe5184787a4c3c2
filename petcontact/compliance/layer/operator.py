"""T over all of Γ_C: products, solves, and solves on a part of the nodes; by Fourier transforms
where elements are equal."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from .kernel import Strip
from .strips import FourierStrip, StripOperator, strip_operator

SPREAD = 1.5
"""How far the quotient of S and T on a smooth σ may lie from 1 before T is scaled."""


class LayerOperator:
    """T on Γ_C, block by block over the contact parts, times an overall factor that a method adapts
    to S.

    On rings, whose weights are those of curves times R = 2πr, it is R^-½ T R^½ with T of the
    curves: symmetric in these weights, and T where the radius hardly varies.

    Attributes
    ----------
    scale : float
        T is `scale` times the layer's operator.
    rtol : float
        Relative tolerance of iterative stick solves.
    fast : bool
        Whether products with T cost next to nothing (Fourier transforms on all parts).
    """

    coupled = False

    def __init__(
        self, strips: Sequence[Strip], weight: Array, x: Array, measure: Array | None = None
    ) -> None:
        self.scale, self.rtol, self.size, self._weight = 1.0, 1e-11, len(weight), weight
        measure = weight if measure is None else measure
        self._root = np.sqrt(weight / measure)
        self._parts: list[tuple[Index, int, StripOperator]] = []
        last: tuple[Strip, StripOperator] | None = None
        for strip in strips:
            # the directions of a stretch come one after another, and share an operator where their
            # ends agree
            if last is None or strip.component == 0 or last[0].ends != strip.ends:
                last = strip, strip_operator(strip, measure[strip.nodes], x[strip.nodes])
            self._parts.append((strip.nodes, strip.component, last[1]))
        self.fast = all(isinstance(part, FourierStrip) for *_, part in self._parts)

    def apply(self, x: Array) -> Array:
        """T x, (m, k) [length]."""
        return self.scale * self._by_part(x, lambda part, column, _: part.apply(column))

    def solve(self, x: Array, rho: float | Array | None = None) -> Array:
        """T⁻¹ x [stress], or (I + ρT)⁻¹ x, (m, k); ρ may be a number for each component, (k,)."""
        if rho is None:
            return self._by_part(x, lambda part, column, _: part.solve(column) / self.scale)
        each = np.broadcast_to(rho, x.shape[1]) * self.scale
        return self._by_part(
            x, lambda part, column, place: part.solve(column, float(each[place[1]]))
        )

    def stick_solve(self, stick: Mask, rhs: Array) -> Array:
        """x with T x = rhs on the components of a mask (m, k) and x = 0 off them, (m, k)
        [stress]."""

        def solve(part: StripOperator, column: Array, place: tuple[Index, int]) -> Array:
            held = stick[place]
            return (
                part.stick_solve(held, column, self.rtol) / self.scale
                if held.any()
                else np.zeros_like(column)
            )

        return self._by_part(rhs, solve)

    def matrix(self) -> Array:
        """T, (m k, m k)."""
        k = 1 + max(component for _, component, _ in self._parts)
        result = np.zeros((k * len(self._weight), k * len(self._weight)))
        for nodes, component, part in self._parts:
            rows, root = k * nodes + component, self._root[nodes]
            result[rows[:, None], rows] = self.scale * part.matrix() * root / root[:, None]
        return result

    def _by_part(
        self, x: Array, work: Callable[[StripOperator, Array, tuple[Index, int]], Array]
    ) -> Array:
        """What `work` makes of each component on each part."""
        result = np.zeros_like(x)
        for nodes, component, part in self._parts:
            place, root = (nodes, component), self._root[nodes]
            result[place] = work(part, root * x[place], place) / root
        return result

    def fit(self, sigma: Array, displacement: Array) -> None:
        """Scale T by the Rayleigh quotient of S and T on a smooth σ, given S σ, if they are far
        apart there.

        On rough σ they agree for every body, the singularity of the kernel being the same: the
        scale is the geometric mean of that 1 and the quotient.
        """
        self.scale *= fitted(self._weight, sigma, self.apply(sigma), displacement)


def fitted(weight: Array, sigma: Array, ours: Array, displacement: Array) -> float:
    """The factor that brings Tσ to Sσ: 1 if they are alike, else the geometric mean of 1 and their
    Rayleigh quotient."""
    own, other = (float(np.sum(weight @ (sigma * moved))) for moved in (ours, displacement))
    apart = own > 0.0 and other > 0.0 and not 1.0 / SPREAD < other / own < SPREAD
    return float(np.sqrt(other / own)) if apart else 1.0
