"""Stress inside the body next to flat panels, in closed form: the derivative of (4.9) with respect
to the point.

Everywhere else native/space/field.c integrates the same kernels by Gauss points.

With r = y - x, C = 1/(8π(1-ν)), n the outward normal at y and w = n·r (Brebbia, Telles and Wrobel,
1984, section 5.6):

    D_kij = C [(1-2ν)(δ_ki r_j + δ_kj r_i - δ_ij r_k)/r³ + 3 r_i r_j r_k/r⁵]
    S_kij = -C [3w ((1-2ν) δ_ij r_k + ν(δ_ik r_j + δ_jk r_i))/r⁵ - 15 w r_i r_j r_k/r⁷ + 3ν(n_i r_j
    + n_j r_i) r_k/r⁵
               + 3(1-2ν) n_k r_i r_j/r⁵ + ((1-2ν)(n_j δ_ik + n_i δ_jk) - (1-4ν) n_k δ_ij)/r³]
"""

from __future__ import annotations

import functools
import math

import numpy as np

from ...arrays import AnyArray, Array, Index
from ...mesh.panels import Panels
from ...round_off import SOLVED
from ..kernel import COMPONENTS
from .moments import Edges, Table, solid_angle

NEAR_CHUNK = 4096
"""Number of pairs of a panel and a target whose closed forms are evaluated at once."""
LOW = 0.3
"""Below this fraction of the distance the height over the plane is small, and the recursion for [0,
0] runs backward."""


def near_stress(
    points: Array, panels: Panels, element: Index, column: Index, poisson_ratio: float, data: Array
) -> Array:
    """Return the stress (m, 6) from near pairs of a panel and a point in closed form.
    `compiled.compiled_field` leaves these pairs out."""
    result, data = np.zeros((len(points), 6)), data.reshape(len(panels.index), panels.n_nodes, 2, 3)
    for first in range(0, len(element), NEAR_CHUNK):
        some = slice(first, first + NEAR_CHUNK)
        chosen = element[some]
        moments, basis, w = _near_moments(points[column[some]], panels, chosen)
        frame = panels.frame[chosen]
        scale = np.array([np.ones(len(chosen)), 1.0 / panels.size[chosen]])
        # tractions and displacements along the panel's axes, as coefficients of the monomials
        both = np.einsum("nbq,nbsi,nai,sn->sqan", basis, data[chosen], frame, scale, optimize=True)
        local = _contracted(moments, panels.exponents, w, both, poisson_ratio)
        turned = np.einsum("nai,nbj,abn->ijn", frame, frame, local, optimize=True)
        np.add.at(result, column[some], np.array([turned[i, j] for i, j in COMPONENTS[3]]).T)
    return result


def _contracted(
    moments: dict[int, Table], exponents: AnyArray, w: Array, data: Array, poisson_ratio: float
) -> Array:
    """Stress (3, 3, n) along the axes of panels by traction and displacement: coefficients (2, q,
    3, n) of the monomials."""
    nu, one_2nu = poisson_ratio, 1.0 - 2.0 * poisson_ratio
    axes, result = range(3), np.empty((3, 3, len(w)))

    @functools.cache
    def planar(which: int, k: int, first: int, second: int) -> Array:
        """∫ x^first y^second/r^k times the three components, (3, n)."""
        table = np.array([moments[k][a + first, b + second] for a, b in exponents.tolist()])
        return np.asarray(np.einsum("qan,qn->an", data[which], table))

    def moment(which: int, component: int, k: int, *indices: int) -> Array:
        values = planar(which, k, indices.count(0), indices.count(1))[component]
        return np.asarray(values * w ** indices.count(2))

    force, jump = functools.partial(moment, 0), functools.partial(moment, 1)
    bulk_force = sum(force(k, 3, k) for k in axes)
    bulk_jump = sum(jump(k, 5, k, 2) for k in axes)
    bend = [sum(jump(k, 5, j, k) for k in axes) for j in axes]
    for i, j in COMPONENTS[3]:
        pushed = one_2nu * (force(i, 3, j) + force(j, 3, i)) + 3.0 * sum(
            force(k, 5, i, j, k) for k in axes
        )
        moved = 3.0 * one_2nu * jump(2, 5, i, j) + 3.0 * nu * (jump(i, 5, j, 2) + jump(j, 5, i, 2))
        moved = moved - 15.0 * sum(jump(k, 7, i, j, k, 2) for k in axes)
        for row, column in ((i, j), (j, i)):
            if row == 2:  # along the normal
                moved = moved + 3.0 * nu * bend[column] + one_2nu * jump(column, 3)
        if i == j:
            pushed = pushed - one_2nu * bulk_force
            moved = moved + 3.0 * one_2nu * bulk_jump - (1.0 - 4.0 * nu) * jump(2, 3)
        result[i, j] = result[j, i] = pushed - moved
    return result * (1.0 / (8.0 * np.pi * (1.0 - nu)))


def _near_moments(
    x: Array, panels: Panels, element: Index
) -> tuple[dict[int, Table], Array, Array]:
    """Moments of pairs of a panel and a point, its basis in their monomials (n, k, q), and the
    height of its plane (n,)."""
    local, w = _local_targets(x, panels, element)
    highest = int(panels.exponents.sum(axis=1).max()) + 4
    return (
        _moments(panels.polygon[element], local[:2].T, w, panels.order + 4, highest),
        # coefficients of the basis by monomials about the target's foot
        np.einsum(
            "nbm,mqn->nbq", panels.coefficients[element], _shift(panels.exponents, local[:2])
        ),
        w,
    )


def _local_targets(x: Array, panels: Panels, element: Index) -> tuple[Array, Array]:
    """Targets x (n, 3) in the coordinates of a panel each, (3, n), and the height of the panel's
    plane over them, (n,)."""
    local = (
        np.einsum("nij,nj->in", panels.frame[element], x - panels.centre[element])
        / panels.size[element]
    )
    return local, np.where(np.abs(local[2]) <= SOLVED, 0.0, -local[2])


def _shift(exponents: Array, origin: Array) -> Array:
    """ξ^a η^b of the panel's coordinates by monomials about the origin (2, n): shift[m, q] the
    factor of monomial q in m."""
    highest = int(exponents.max(initial=0))
    x, y = (np.array([c**k for k in range(highest + 1)]) for c in origin)
    shift = np.zeros((len(exponents), len(exponents), origin.shape[1]))
    for m, (a, b) in enumerate(exponents.tolist()):
        for q, (i, j) in enumerate(exponents.tolist()):
            if i <= a and j <= b:
                shift[m, q] = math.comb(a, i) * math.comb(b, j) * x[a - i] * y[b - j]
    return shift


def _moments(
    polygon: Array, origin: Array, w: Array, highest: int, degree: int
) -> dict[int, Table]:
    """Return M_3, M_5 and M_7 off the polygons, for a, b <= highest and a + b <= degree."""
    edges = Edges.from_polygon(polygon, origin, w)
    powers = edges.powers((1, 3, 5, 7), degree)
    tables = {
        k: edges.tables(power, highest, degree) for k, power in zip((1, 3, 5), powers, strict=False)
    }
    result: dict[int, Table] = {1: {}, **_bases(edges, powers)}
    for total in range(degree + 1):
        for a in range(max(0, total - highest), min(total, highest) + 1):
            b = total - a
            for k in (1, 3, 5):
                u, v, _ = tables[k]
                if total and a:
                    result[k + 2][a, b] = (
                        -u[a - 1, b] + ((a - 1) * result[k][a - 2, b] if a > 1 else 0.0)
                    ) / k
                elif total:
                    result[k + 2][a, b] = (
                        -v[a, b - 1] + ((b - 1) * result[k][a, b - 2] if b > 1 else 0.0)
                    ) / k
            result[1][a, b] = (tables[1][2][a, b] - w * w * result[3][a, b]) / (total + 1)
    return result


def _bases(edges: Edges, powers: list[Array]) -> dict[int, Table]:
    """M_k[0, 0], k = 3, 5, 7: k w² M_{k+2} = Σ s I_k - (2-k) M_k, forward from the solid angle or
    backward from M_k = 0."""
    w, s = edges.w, edges.distance
    t_1, t_2, square = edges.start, edges.end, s**2 + edges.w**2
    r_1, r_2 = np.sqrt(square + t_1**2), np.sqrt(square + t_2**2)
    inside = np.min(s, axis=0) > 0.0
    reach = np.minimum(
        r_1.min(axis=0), np.min(np.where(t_1 * t_2 < 0.0, np.sqrt(square), np.inf), axis=0)
    )
    low = ~inside & (np.abs(w) < LOW * reach)
    outer = [np.sum(s * power[0], axis=0) for power in powers]
    safe = np.where(low, 1.0, w)
    forward = [np.where(low, 0.0, solid_angle(edges) / safe)]
    for k in (3, 5):
        forward.append((outer[(k - 1) // 2] - (2 - k) * forward[-1]) / (k * safe**2))
    if low.any():
        ring, value, outers = 7, powers[3][0], {3: outer[1], 5: outer[2], 7: outer[3]}
        for k in range(7, 35, 2):
            with np.errstate(divide="ignore", invalid="ignore"):
                value = ((t_2 / r_2**k - t_1 / r_1**k) + (k - 1) * value) / (k * square)
            outers[k + 2] = np.sum(np.where(s == 0.0, 0.0, s * value), axis=0)
            ring = k + 2
        moment = outers[ring] / (2 - ring)
        for k in range(ring - 2, 2, -2):
            moment = (outers[k] - k * w * w * moment) / (2 - k)
            if k <= 7:
                forward[(k - 3) // 2] = np.where(low, moment, forward[(k - 3) // 2])
    return {k: {(0, 0): forward[(k - 3) // 2]} for k in (3, 5, 7)}
