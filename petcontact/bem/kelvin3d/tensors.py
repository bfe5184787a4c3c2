"""Kelvin's kernels at points, and the arrays that integrals of them go into."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...frozen import frozen


@frozen
class Result:
    """The arrays (3, 3, n, k, m) that take G and H, and ν."""

    kernel_g: Array
    kernel_h: Array
    poisson_ratio: float

    def write(self, element: Index | int, target: Index, g: Array, h: Array) -> None:
        """Values (3, 3, pairs, k), or (3, 3, k, targets) of one element."""
        axes = (3, 0, 1, 2) if isinstance(element, int) else (2, 0, 1, 3)
        for whole, part in ((self.kernel_g, g), (self.kernel_h, h)):
            whole[:, :, element, :, target] = part.transpose(axes)


def kernels(r: Array, normal: Array, poisson_ratio: float) -> tuple[Array, Array]:
    """2µU [1/length] and T [1/length²], (3, 3, ...), for vectors r (..., 3) from targets to sources
    and the normal (3,) or normals (..., 3) there."""
    inverse = 1.0 / np.sqrt(np.sum(r * r, axis=-1))
    e = np.moveaxis(r, -1, 0) * inverse
    n = np.moveaxis(np.broadcast_to(normal, r.shape), -1, 0)
    w = np.sum(n * e, axis=0)
    dyad, identity = e[:, None] * e[None], np.eye(3).reshape(3, 3, *([1] * inverse.ndim))
    skew = e[:, None] * n
    twist, one_2nu = skew - skew.swapaxes(0, 1), 1.0 - 2.0 * poisson_ratio
    scale = inverse / (8.0 * np.pi * (1.0 - poisson_ratio))
    g = scale * ((3.0 - 4.0 * poisson_ratio) * identity + dyad)
    return g, scale * inverse * (one_2nu * (twist - w * identity) - 3.0 * w * dyad)
