"""T over the whole of Γ_C: products, solves, and solves on a part of the nodes.

Equal elements use Fourier transforms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from .kernel import Strip
from .strips import FourierStrip, StripOperator, strip_operator

SPREAD = 1.5
"""Largest ratio of S and T on a smooth σ, or of T and S, for which T is not scaled [-]."""


class LayerOperator:
    """T on Γ_C, one block for each contact part, times one factor that a method adapts to S.

    The weights of rings are those of curves times R = 2πr. On rings R^-½ T R^½ is used, where T is
    that of the curves. It is symmetric in these weights, and equals T if the radius hardly varies.

    Attributes
    ----------
    scale : float
        T is `scale` times the layer's operator.
    rtol : float
        Relative tolerance of iterative stick solves.
    fast : bool
        Whether products with T are very cheap, by Fourier transforms on all parts.
    """

    def __init__(
        self, strips: Sequence[Strip], weight: Array, x: Array, measure: Array | None = None
    ) -> None:
        self.scale, self.rtol, self.size, self._weight = 1.0, 1e-11, len(weight), weight
        measure = weight if measure is None else measure
        self._root = np.sqrt(weight / measure)
        self._parts: list[tuple[Index, int, StripOperator]] = []
        last: tuple[Strip, StripOperator] | None = None
        for strip in strips:
            # the directions of a stretch follow each other, and share an operator if their ends
            # agree
            if last is None or strip.component == 0 or last[0].ends != strip.ends:
                last = strip, strip_operator(strip, measure[strip.nodes], x[strip.nodes])
            self._parts.append((strip.nodes, strip.component, last[1]))
        self.fast = all(isinstance(part, FourierStrip) for *_, part in self._parts)

    def apply(self, x: Array) -> Array:
        """Return T x, (m, k) [length]."""
        return self.scale * self._by_part(x, lambda part, column, _: part.apply(column))

    def solve(self, x: Array, rho: float | Array | None = None) -> Array:
        """Return T⁻¹ x [stress], or (I + ρT)⁻¹ x if ρ is given, (m, k).

        ρ is one number, or one for each component, (k,).
        """
        if rho is None:
            return self._by_part(x, lambda part, column, _: part.solve(column) / self.scale)
        factors = np.broadcast_to(rho, x.shape[1]) * self.scale
        return self._by_part(
            x, lambda part, column, index: part.solve(column, float(factors[index[1]]))
        )

    def stick_solve(self, stick: Mask, rhs: Array, rtol: float | None = None) -> Array:
        """Return x (m, k) for which T x = rhs where `stick` (m, k) is true, and x = 0 elsewhere
        [stress]; with another tolerance than `rtol` if one is given."""
        tolerance = self.rtol if rtol is None else rtol

        def solve(part: StripOperator, column: Array, index: tuple[Index, int]) -> Array:
            held = stick[index]
            return (
                part.stick_solve(held, column, tolerance) / self.scale
                if held.any()
                else np.zeros_like(column)
            )

        return self._by_part(rhs, solve)

    def matrix(self) -> Array:
        """Return T, (m k, m k) [length/stress]."""
        k = 1 + max(component for _, component, _ in self._parts)
        result = np.zeros((k * len(self._weight), k * len(self._weight)))
        for nodes, component, part in self._parts:
            rows, root = k * nodes + component, self._root[nodes]
            result[rows[:, None], rows] = self.scale * part.matrix() * root / root[:, None]
        return result

    def _by_part(
        self, x: Array, work: Callable[[StripOperator, Array, tuple[Index, int]], Array]
    ) -> Array:
        """Return the result of `work` on each component on each part, (m, k)."""
        result = np.zeros_like(x)
        for nodes, component, part in self._parts:
            index, root = (nodes, component), self._root[nodes]
            result[index] = work(part, root * x[index], index) / root
        return result

    def fit(self, sigma: Array, displacement: Array) -> None:
        """Scale T if it differs much from S on a smooth σ, given S σ.

        On rough σ the ratio of S and T is 1 for every body, because their kernels have the same
        singularity. The factor is the geometric mean of 1 and the Rayleigh quotient on this σ.
        """
        self.scale *= fitted(self._weight, sigma, self.apply(sigma), displacement)


def fitted(weight: Array, sigma: Array, ours: Array, displacement: Array) -> float:
    """Return the factor by which T is scaled, from T σ (`ours`) and S σ (`displacement`) [-].

    It is 1 if both are close, else the geometric mean of 1 and their Rayleigh quotient.
    """
    own, given = (float(np.sum(weight @ (sigma * moved))) for moved in (ours, displacement))
    apart = own > 0.0 and given > 0.0 and not 1.0 / SPREAD < given / own < SPREAD
    return float(np.sqrt(given / own)) if apart else 1.0
