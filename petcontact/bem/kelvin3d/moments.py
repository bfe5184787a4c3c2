"""Moments ∫ u^a v^b / r^k over flat polygons in closed form, by recursion from integrals along
edges.

Origin of u, v: the projection of the target on the plane of the polygon, over the target by w; r² =
u² + v² + w². On an edge with outward normal ν, at distance s from the origin: c² = s² + w², I_k[a,
b] = ∮ u^a v^b / r^k. With M_k the moments, div(u^a v^b (1, 0)/r^k) and div(u^a v^b (u, v)/r^k) give

    k M_{k+2}[a, b] = -Σ ν_u I_k[a-1, b] + (a-1) M_k[a-2, b]          (and alike in v)
    (a+b+1) M_1[a, b] = Σ s I_1[a, b] - w P[a, b],                    P = w M_3
    3w³ M_5[0, 0] = P[0, 0] + w Σ s I_3[0, 0]

P[0, 0] is the solid angle, in the plane its principal value 0. All digits are there near the
polygon; far from it they are lost like (distance/shortest height)^(a+b).
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Mask
from ...record import record

Table = dict[tuple[int, int], Array]


@record
class Edges:
    """Edges of polygons as their targets see them, arrays (c, n)."""

    normal_u: Array
    normal_v: Array
    distance: Array
    start: Array
    end: Array
    w: Array

    @classmethod
    def from_polygon(cls, polygon: Array, origin: Array, w: Array) -> Edges:
        """Return the edges of counter-clockwise polygons (n, c, 2) as origins (n, 2) at heights w
        (n,) see them."""
        corner = (polygon - origin[:, None]).transpose(1, 2, 0)
        side = np.roll(corner, -1, axis=0) - corner
        side /= np.hypot(side[:, 0], side[:, 1])[:, None]
        start = np.sum(side * corner, axis=1)
        end = np.sum(side * np.roll(corner, -1, axis=0), axis=1)
        distance = side[:, 1] * corner[:, 0] - side[:, 0] * corner[:, 1]
        return cls(side[:, 1], -side[:, 0], distance, start, end, w)

    def powers(self, exponents: tuple[int, ...], degree: int) -> list[Array]:
        """∫ t^j / r^k along the edges for odd k = 1, 3, ... and j = 0 ... degree, each (degree + 1,
        c, n)."""
        t_1, t_2, square = self.start, self.end, self.distance**2 + self.w**2
        r_1, r_2 = np.sqrt(square + t_1**2), np.sqrt(square + t_2**2)
        same = t_1 * t_2 > 0.0
        # where t keeps its sign, ln(t + r) and t/r from the side where nothing cancels
        with np.errstate(
            divide="ignore"
        ):  # on the line of an edge the side that is not taken has ln 0
            log = np.where(
                t_1 + t_2 > 0.0,
                np.log((t_2 + r_2) / np.where(same & (t_1 < 0.0), 1.0, t_1 + r_1)),
                np.log((r_1 - t_1) / np.where(same & (t_2 > 0.0), 1.0, r_2 - t_2)),
            )
        first: Array = np.empty((degree + 1, *square.shape))
        first[0] = log
        if degree:
            first[1] = np.asarray((t_2 - t_1) * (t_2 + t_1) / (r_2 + r_1))
        top_1, top_2 = r_1.copy(), r_2.copy()
        for j in range(2, degree + 1):
            top_1, top_2 = top_1 * t_1, top_2 * t_2
            first[j] = np.asarray((top_2 - top_1 - (j - 1) * square * first[j - 2]) / j)
        result = [first]
        for k in exponents[1:]:
            lower = result[-1]
            integrals: Array = np.empty_like(first)
            integrals[0] = _inverse_power(k, t_1, t_2, r_1, r_2, square, same)
            if degree:
                integrals[1] = np.asarray((r_1 ** (2 - k) - r_2 ** (2 - k)) / (k - 2))
            for j in range(2, degree + 1):
                integrals[j] = np.asarray(lower[j - 2] - square * integrals[j - 2])
            result.append(integrals)
        return result

    def tables(self, powers: Array, highest: int, degree: int) -> tuple[Table, Table, Table]:
        """Σ ν_u I[a, b], Σ ν_v I[a, b] and Σ s I[a, b] for a, b <= highest, a + b <= degree."""
        nu, nv, s = self.normal_u, self.normal_v, self.distance
        along_u, along_v, across_u, across_v = -nv, nu, s * nu, s * nv
        current: Table = {(0, 0): powers[: degree + 1]}
        sums: tuple[Table, Table, Table] = ({}, {}, {})
        for total in range(degree + 1):
            following: Table = {}
            for (a, b), values in current.items():
                for table, factor in zip(sums, (nu, nv, s), strict=True):
                    table[a, b] = np.sum(factor * values[0], axis=0)
                if total < degree and b < highest:
                    following[a, b + 1] = np.asarray(across_v * values[:-1] + along_v * values[1:])
                if total < degree and b == 0 and a < highest:
                    following[a + 1, b] = np.asarray(across_u * values[:-1] + along_u * values[1:])
            current = following
        return sums


def _inverse_power(
    k: int, t_1: Array, t_2: Array, r_1: Array, r_2: Array, square: Array, same: Mask
) -> Array:
    """∫ dt / r^k for k = 3, 5, 7: in x = t/r it is ∫ (1-x²)^((k-3)/2) dx / c^(k-1)."""
    x_1, x_2 = t_1 / r_1, t_2 / r_2
    # x_2 - x_1 without cancellation where t keeps its sign: (x_2² - x_1²)/(x_2 + x_1), over c²
    over = np.where(
        same,
        (t_2 - t_1) * (t_2 + t_1) / np.where(same, r_1 * r_2 * (t_2 * r_1 + t_1 * r_2), 1.0),
        (x_2 - x_1) / np.where(same | (square == 0.0), 1.0, square),
    )
    if k == 3:
        return np.asarray(over)
    mean = x_1 * x_1 + x_1 * x_2 + x_2 * x_2
    safe = np.where(square == 0.0, 1.0, square)
    if k == 5:
        return np.asarray(over * (1.0 - mean / 3.0) / safe)
    quartic = (x_1**5 - x_2**5) / np.where(x_1 == x_2, 1.0, x_1 - x_2)
    return np.asarray(over * (1.0 - 2.0 * mean / 3.0 + quartic / 5.0) / safe**2)


def solid_angle(edges: Edges) -> Array:
    """∫ w / r³, (n,): 0 in the plane of the polygon."""
    height, square = np.abs(edges.w), edges.distance**2 + edges.w**2
    total = np.zeros(len(edges.w))
    for t, sign in ((edges.end, 1.0), (edges.start, -1.0)):
        base = square + height * np.sqrt(square + t * t)
        total += sign * np.sum(np.arctan2(edges.distance * t, base), axis=0)
    return np.asarray(np.sign(edges.w) * total)
