"""G and H from the moments of elements: a multiple of I, a deviator turned into the global frame, a
rotation."""

from __future__ import annotations

import itertools

import numpy as np

from ...arrays import Array, Complex, Index
from ...frozen import frozen
from .moments import Moments


@frozen
class Result:
    """The arrays (2, 2, n, p+1, m) that take G and H, and the constants of the kernels."""

    kernel_g: Array
    kernel_h: Array
    poisson_ratio: float
    length: float

    def write(self, rows: slice, part: Moments, half: Array, turn: Complex, weight: Array) -> None:
        """Moments (k, p+1, m) of elements `rows`; half and turn (k,), see `_combine_g`."""
        half, turn = half[:, None, None], turn[:, None, None]
        _combine_g(
            self.kernel_g[:, :, rows],
            part,
            self.poisson_ratio,
            half,
            turn,
            weight,
            np.log(half / self.length),
        )
        _combine_h(self.kernel_h[:, :, rows], part, self.poisson_ratio, turn)

    def scatter(
        self,
        element: Index,
        column: Index,
        part: Moments,
        half: Array,
        turn: Complex,
        weight: Array,
    ) -> None:
        """Moments (p+1, k) of k pairs of an element and a target; half and turn (k,)."""
        g, h = np.empty((2, 2, 2, *part.log.shape))
        _combine_g(g, part, self.poisson_ratio, half, turn, weight, np.log(half / self.length))
        _combine_h(h, part, self.poisson_ratio, turn)
        nodes, m = self.kernel_g.shape[-2:]
        place = (element * nodes + np.arange(nodes)[:, None]) * m + column
        for whole, values in ((self.kernel_g, g), (self.kernel_h, h)):
            for i, j in itertools.product(range(2), repeat=2):
                whole[i, j].reshape(-1)[place] = values[i, j]


def _combine_g(
    out: Array,
    part: Moments,
    poisson_ratio: float,
    half: Array,
    turn: Complex,
    weight: Array,
    log_unit: Array,
) -> None:
    """G (2, 2, ...) from moments (...): half the length, squared complex tangent of the moments'
    frame, ∫ L_b, and what has to be added to the logarithm."""
    scale = half / (4.0 * np.pi * (1.0 - poisson_ratio))
    factor = 3.0 - 4.0 * poisson_ratio
    turn_re, turn_im = scale * turn.real, scale * turn.imag
    work = part.shear_im * turn_im
    deviator = part.shear_re * turn_re
    deviator -= work
    off = out[0, 1]
    np.multiply(part.shear_re, turn_im, out=off)
    np.multiply(part.shear_im, turn_re, out=work)
    off += work
    out[1, 0] = off
    np.multiply(part.log, -factor * scale, out=work)
    work += scale * (0.5 - factor * log_unit) * weight
    np.add(work, deviator, out=out[0, 0])
    np.subtract(work, deviator, out=out[1, 1])


def _combine_h(out: Array, part: Moments, poisson_ratio: float, turn: Complex) -> None:
    """H (2, 2, ...) from moments (...)."""
    scale = -1.0 / (4.0 * np.pi * (1.0 - poisson_ratio))
    turn_re, turn_im = scale * turn.real, scale * turn.imag
    work = part.dipole_im * turn_im
    deviator = part.dipole_re * turn_re
    deviator -= work
    off = part.dipole_re * turn_im
    np.multiply(part.dipole_im, turn_re, out=work)
    off += work
    np.multiply(part.tangential, scale * (1.0 - 2.0 * poisson_ratio), out=work)
    np.add(off, work, out=out[0, 1])
    np.subtract(off, work, out=out[1, 0])
    np.multiply(part.normal, scale * (2.0 - 2.0 * poisson_ratio), out=work)
    np.add(work, deviator, out=out[0, 0])
    np.subtract(work, deviator, out=out[1, 1])
