"""Kelvin's solution of a ring at a point of the half plane: integrals over the angle.

With d = (R-r)² + (Z-z)², b = 2rR and q = 1 - cos θ, the square of the distance is d + b q, and all
vectors are polynomials in q, half of them times sin θ. What is left are the moments
∫ qⁿ (d + b q)^(-k/2) dθ, complete elliptic integrals. In powers of cos θ near rings would lose
their digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.special

from ...arrays import Array

ANGLES = 24
Poly = tuple[list[Any], bool]
"""Coefficients of powers of q, and whether sin θ is a factor."""


def moments(d: Array, b: Array, highest: int) -> dict[tuple[int, int], Array]:
    """∫ qⁿ (d + b q)^(-k/2) dθ over a turn, by (n, k): k = 1, 3 ... highest, n <= (k+1)/2."""
    s = d + 2.0 * b
    small = b < 0.25 * s
    d_, b_ = np.where(small, 1.0, d), np.where(small, 1.0, b)
    s_ = d_ + 2.0 * b_
    m1 = d_ / s_
    first, second, root = scipy.special.ellipkm1(m1), scipy.special.ellipe(1.0 - m1), np.sqrt(s_)
    m = {(0, -1): 4.0 * root * second, (0, 1): 4.0 * first / root}
    m[0, 3] = 4.0 * second / (d_ * root)
    for k in range(5, highest + 1, 2):
        # d/dθ of sin θ w^(1-k/2) integrates to zero
        m[0, k] = (2.0 * (k - 3) * (d_ + b_) * m[0, k - 2] - (k - 4) * m[0, k - 4]) / (
            (k - 2) * s_ * d_
        )
    for k in range(1, highest + 1, 2):
        for n in range(1, (k + 1) // 2 + 1):
            m[n, k] = (m[n - 1, k - 2] - d_ * m[n - 1, k]) / b_
    q = 1.0 - np.cos(2.0 * np.pi * np.arange(ANGLES) / ANGLES)
    w = d[small][:, None] + b[small][:, None] * q
    for n, k in m:
        m[n, k][small] = (q**n * w ** (-0.5 * k)).sum(axis=1) * (2.0 * np.pi / ANGLES)
    return m


def _times(*factors: Poly) -> Poly:
    result: Poly = ([np.float64(1.0)], False)
    for coefficients, odd in factors:
        both, parts = odd and result[1], [result[0], coefficients]
        parts += [[np.float64(0.0), np.float64(2.0), np.float64(-1.0)]] * both
        product = parts[0]
        for part in parts[1:]:
            longer: list[Any] = [np.float64(0.0)] * (len(product) + len(part) - 1)
            for i, x in enumerate(product):
                for j, y in enumerate(part):
                    longer[i + j] = longer[i + j] + x * y
            product = longer
        result = (product, odd != result[1])
    return result


class Ring:
    """Rings at (R, Z) with normals as seen from points (r, z) at distances (dr, dz) = (R-r, Z-z);
    arrays of one shape."""

    def __init__(self, r: Array, R: Array, dr: Array, dz: Array, nr: Array, nz: Array) -> None:
        one, nothing = np.ones_like(dr), np.zeros_like(dr)
        cos, sin, none = ([one, -one], False), ([one], True), ([nothing], False)
        self.m = moments(dr * dr + dz * dz, 2.0 * r * R, 7)
        self.R = R
        self.d = [([dr, -R], False), ([dz], False), ([R], True)]
        self.to = [([dr, r], False), ([dz], False), ([r], True)]
        minus = ([-one], True)
        self.e = [[cos, none, sin], [none, ([one], False), none], [minus, none, cos]]
        self.n = [([nr, -nr], False), ([nz], False), ([nr], True)]
        self.n_to = [([nr], False), ([nz], False), none]
        self.dn = ([nr * dr + nz * dz, nr * r], False)

    def over(self, k: int, *factors: Poly) -> Array:
        """∫ of a product over |x-y|^k."""
        coefficients, odd = _times(*factors)
        if odd:
            return np.zeros_like(self.R)
        return np.asarray(sum(c * self.m[n, k] for n, c in enumerate(coefficients)))

    def displacement(self, i: int, a: int, nu: float) -> Array:
        """2µ R ∫ U: component i at the point by a load along a at the ring."""
        found = (3.0 - 4.0 * nu) * self.over(1, self.e[a][i]) + self.over(3, self.d[i], self.to[a])
        return self.R * found / (8.0 * np.pi * (1.0 - nu))

    def traction(self, i: int, a: int, nu: float) -> Array:
        """R ∫ T."""
        k = 1.0 - 2.0 * nu
        found = k * self.over(3, self.dn, self.e[a][i])
        found += 3.0 * self.over(5, self.dn, self.d[i], self.to[a])
        found -= k * (self.over(3, self.d[i], self.n_to[a]) - self.over(3, self.to[a], self.n[i]))
        return -self.R * found / (8.0 * np.pi * (1.0 - nu))

    def stress(self, i: int, j: int, a: int, nu: float) -> tuple[Array, Array]:
        """R ∫ D and R ∫ S/2µ: stress ij at the point by a traction, and by a displacement, a."""
        k, same = 1.0 - 2.0 * nu, float(i == j)
        d, e, n, to, n_to, dn = self.d, self.e[a], self.n, self.to[a], self.n_to[a], self.dn
        by_t = 3.0 * self.over(5, d[i], d[j], to)
        by_t += k * (self.over(3, e[i], d[j]) + self.over(3, e[j], d[i]) - same * self.over(3, to))
        by_u = 3.0 * k * same * self.over(5, dn, to) - 15.0 * self.over(7, dn, d[i], d[j], to)
        by_u += 3.0 * nu * (self.over(5, dn, e[i], d[j]) + self.over(5, dn, e[j], d[i]))
        by_u += 3.0 * nu * (self.over(5, n[i], d[j], to) + self.over(5, n[j], d[i], to))
        by_u += 3.0 * k * self.over(5, n_to, d[i], d[j])
        by_u += k * (self.over(3, n[j], e[i]) + self.over(3, n[i], e[j]))
        by_u -= (1.0 - 4.0 * nu) * same * self.over(3, n_to)
        scale = self.R / (8.0 * np.pi * (1.0 - nu))
        return scale * by_t, -scale * by_u
