"""Stress inside the body: the derivative of (4.9) with respect to the point, integrated over
panels.

With r = y - x, C = 1/(8π(1-ν)), n the outward normal at y and w = n·r (Brebbia, Telles and Wrobel,
1984, section 5.6):

    D_kij = C [(1-2ν)(δ_ki r_j + δ_kj r_i - δ_ij r_k)/r³ + 3 r_i r_j r_k/r⁵]
    S_kij = -C [3w ((1-2ν) δ_ij r_k + ν(δ_ik r_j + δ_jk r_i))/r⁵ - 15 w r_i r_j r_k/r⁷ + 3ν(n_i r_j
    + n_j r_i) r_k/r⁵
               + 3(1-2ν) n_k r_i r_j/r⁵ + ((1-2ν)(n_j δ_ik + n_i δ_jk) - (1-4ν) n_k δ_ij)/r³]
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import AnyArray, Array, Index
from ...mesh.curved.panels import CurvedPanels
from ...mesh.panels import Panels
from ..kelvin import COMPONENTS
from .curved import quadrature, sources
from .integrals import NEAR_CHUNK, local_targets, to_basis
from .moments import Edges, Table, solid_angle
from .rules import MOST_POINTS, point_counts, tolerance_of

TOLERANCE = 1e-10
"""Relative quadrature error of far panels."""
LOW = 0.3
"""Below this fraction of the distance the height over the plane is small, and the recursion for [0,
0] runs backward."""
BACKWARD = 14
"""Steps of that."""
Integral = Callable[[int, tuple[int, ...]], Array]
"""∫ r_i r_j .../r^k times what is to be integrated, by k and the indices."""


def stress_integrals(
    points: Array, panels: Panels | CurvedPanels, poisson_ratio: float
) -> tuple[Array, Array]:
    """Stress at points inside the body from boundary tractions and displacements: σ = Σ D t + 2µ Σ
    S u.

    Parameters
    ----------
    points : (m, 3) array
        Points off the boundary [length].
    panels : Panels or CurvedPanels
        n panels of k nodes.
    poisson_ratio : float

    Returns
    -------
    D : (6, 3, n k, m) array
        [-], xx, yy, zz, xy, xz, yz of the stress at the point first, then the component of the
        traction.
    S : (6, 3, n k, m) array
        [1/length], the component of the displacement second.
    """
    shape = (6, 3, len(panels.index), panels.n_nodes, len(points))
    kernel_d, kernel_s = np.empty(shape), np.empty(shape)
    BY_NUMPY[type(panels)](points, panels, poisson_ratio, kernel_d, kernel_s)
    flat = (6, 3, shape[2] * shape[3], shape[4])
    return kernel_d.reshape(flat), kernel_s.reshape(flat)


def _fill_curved(
    points: Array, panels: CurvedPanels, poisson_ratio: float, kernel_d: Array, kernel_s: Array
) -> None:
    """Pairs of a curved panel and a point."""
    for number, rows, rule in quadrature(points, panels, tolerance_of(panels, None)):
        y, normal, weight = sources(panels, number, rule)
        d, s = _tensors(_at_points(y[:, None] - points[rows]), normal.T[..., None], poisson_ratio)
        for kernel, part in ((kernel_d, d), (kernel_s, s)):
            kernel[:, :, number, :, rows] = np.einsum("bq,ckqm->mckb", weight, part, optimize=True)


def _fill(
    points: Array, panels: Panels, poisson_ratio: float, kernel_d: Array, kernel_s: Array
) -> None:
    """Pairs of a flat panel and a point."""
    elements, columns = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for element in range(len(panels.index) if len(points) else 0):
        counts = point_counts(points, panels, element, TOLERANCE)
        close = counts[:, 0] * counts[:, 1] > MOST_POINTS[type(panels)][panels.order]
        columns.append(np.flatnonzero(close))
        elements.append(np.full(len(columns[-1]), element))
        for count in np.unique(counts[~close], axis=0).tolist():
            rows = np.flatnonzero(~close & np.all(counts == count, axis=1))
            x, weight = panels.take(slice(element, element + 1)).rule((count[0], count[1]))
            d, s = _tensors(
                _at_points(x[0][:, None] - points[rows]), panels.frame[element, 2], poisson_ratio
            )
            for kernel, part in ((kernel_d, d), (kernel_s, s)):
                kernel[:, :, element, :, rows] = np.einsum(
                    "bq,ckqm->mckb", weight[0], part, optimize=True
                )
    owner, column = np.concatenate(elements), np.concatenate(columns)
    for first in range(0, len(owner), NEAR_CHUNK):
        some = slice(first, first + NEAR_CHUNK)
        d, s = _near(points[column[some]], panels, owner[some], poisson_ratio)
        kernel_d[:, :, owner[some], :, column[some]] = d
        kernel_s[:, :, owner[some], :, column[some]] = s


BY_NUMPY: dict[type, Callable[[Array, Any, float, Array, Array], None]] = {
    Panels: _fill,
    CurvedPanels: _fill_curved,
}
"""What fills D and S, by the kind of panel."""


def near_stress(
    points: Array, panels: Panels, element: Index, column: Index, poisson_ratio: float, data: Array
) -> Array:
    """What is missing of the stress of `compiled.compiled_field`, (m, 6): pairs of a panel and a
    point in closed form."""
    result, data = np.zeros((len(points), 6)), data.reshape(len(panels.index), panels.n_nodes, 2, 3)
    for first in range(0, len(element), NEAR_CHUNK):
        some = slice(first, first + NEAR_CHUNK)
        chosen = element[some]
        moments, basis, w = _near_moments(points[column[some]], panels, chosen)
        frame, scale = (
            panels.frame[chosen],
            np.array([np.ones(len(chosen)), 1.0 / panels.size[chosen]]),
        )
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
    nu, scale, one_2nu = (
        poisson_ratio,
        1.0 / (8.0 * np.pi * (1.0 - poisson_ratio)),
        1.0 - 2.0 * poisson_ratio,
    )
    axes, result = range(3), np.empty((3, 3, len(w)))

    @functools.cache
    def planar(which: int, k: int, first: int, second: int) -> Array:
        """∫ x^first y^second/r^k times the three components, (3, n)."""
        table = np.array([moments[k][a + first, b + second] for a, b in exponents.tolist()])
        return np.asarray(np.einsum("qan,qn->an", data[which], table))

    def of(which: int, component: int, k: int, *indices: int) -> Array:
        values = planar(which, k, indices.count(0), indices.count(1))[component]
        return np.asarray(values * w ** indices.count(2))

    force, jump = functools.partial(of, 0), functools.partial(of, 1)
    bulk_force, bulk_jump = (
        sum(some(k, power, k, *more) for k in axes)
        for some, power, more in ((force, 3, ()), (jump, 5, (2,)))
    )
    bend = [sum(jump(k, 5, j, k) for k in axes) for j in axes]
    for i, j in COMPONENTS[3]:
        pushed = one_2nu * (force(i, 3, j) + force(j, 3, i)) + 3.0 * sum(
            force(k, 5, i, j, k) for k in axes
        )
        moved = 3.0 * one_2nu * jump(2, 5, i, j) + 3.0 * nu * (jump(i, 5, j, 2) + jump(j, 5, i, 2))
        moved = moved - 15.0 * sum(jump(k, 7, i, j, k, 2) for k in axes)
        for one, other in ((i, j), (j, i)):
            if one == 2:  # along the normal
                moved = moved + 3.0 * nu * bend[other] + one_2nu * jump(other, 3)
        if i == j:
            pushed = pushed - one_2nu * bulk_force
            moved = moved + 3.0 * one_2nu * bulk_jump - (1.0 - 4.0 * nu) * jump(2, 3)
        result[i, j] = result[j, i] = scale * (pushed - moved)
    return result


def _tensors(integral: Integral, normal: Array, poisson_ratio: float) -> tuple[Array, Array]:
    """D and S (6, 3, ...) from integrals of products of r over powers of r, and normals (3, ...),
    all in one frame."""
    nu, scale = poisson_ratio, 1.0 / (8.0 * np.pi * (1.0 - poisson_ratio))
    one_2nu = 1.0 - 2.0 * nu
    axes = [c for c in range(3) if np.any(normal[c] != 0.0)]
    d, s = [], []
    for (i, j), k in itertools.product(COMPONENTS[3], range(3)):
        d_ki, d_kj, d_ij = float(k == i), float(k == j), float(i == j)
        d.append(
            scale
            * (
                one_2nu
                * (d_ki * integral(3, (j,)) + d_kj * integral(3, (i,)) - d_ij * integral(3, (k,)))
                + 3.0 * integral(5, (i, j, k))
            )
        )
        n_i, n_j, n_k = normal[i], normal[j], normal[k]
        value = (
            3.0 * nu * (n_i * integral(5, (j, k)) + n_j * integral(5, (i, k)))
            + 3.0 * one_2nu * n_k * integral(5, (i, j))
            + (one_2nu * (n_j * d_ki + n_i * d_kj) - (1.0 - 4.0 * nu) * n_k * d_ij)
            * integral(3, ())
        )
        for c in axes:
            near = one_2nu * d_ij * integral(5, (k, c))
            near = near + nu * (d_ki * integral(5, (j, c)) + d_kj * integral(5, (i, c)))
            value = value + 3.0 * normal[c] * (near - 5.0 * integral(7, (i, j, k, c)))
        s.append(-scale * value)
    shape = (6, 3, *np.shape(d[0]))
    return np.array(d).reshape(shape), np.array(s).reshape(shape)


def _at_points(r: Array) -> Integral:
    """The integrands themselves for vectors r (..., 3)."""
    component = np.moveaxis(r, -1, 0)
    inverse = 1.0 / np.sqrt(np.sum(r * r, axis=-1))
    powers = {k: inverse**k for k in (3, 5, 7)}

    def integral(k: int, indices: tuple[int, ...]) -> Array:
        value: Array = powers[k]
        for index in indices:
            value = np.asarray(value * component[index])
        return value

    return integral


def _near(x: Array, panels: Panels, element: Index, poisson_ratio: float) -> tuple[Array, Array]:
    """D and S (pairs, 6, 3, k) of pairs of a panel and a point in closed form."""
    exponents, frame, size = panels.exponents, panels.frame[element], panels.size[element]
    moments, basis, w = _near_moments(x, panels, element)
    parts = []
    for a, b in exponents.tolist():

        def integral(k: int, indices: tuple[int, ...], a: int = a, b: int = b) -> Array:
            table = moments[k][a + indices.count(0), b + indices.count(1)]
            return np.asarray(table * w ** indices.count(2))

        parts.append(_tensors(integral, np.array([0.0, 0.0, 1.0]), poisson_ratio))
    values = [
        np.einsum("nbq,qckn->ckbn", basis, np.array(part), optimize=True)
        for part in zip(*parts, strict=True)
    ]
    full = [np.empty((3, 3, 3, *value.shape[2:])) for value in values]
    for whole, value in zip(full, values, strict=True):
        for c, (i, j) in enumerate(COMPONENTS[3]):
            whole[i, j] = whole[j, i] = value[c]
    rotated = [
        np.einsum("nai,nbj,nck,abcmn->ijknm", frame, frame, frame, whole, optimize=True)
        for whole in full
    ]
    d, s = (
        np.array([whole[i, j] for i, j in COMPONENTS[3]]).transpose(2, 0, 1, 3) for whole in rotated
    )
    return d, s / size[:, None, None, None]


def _near_moments(
    x: Array, panels: Panels, element: Index
) -> tuple[dict[int, Table], Array, Array]:
    """Moments of pairs of a panel and a point, its basis in their monomials (n, k, q), and the
    height of its plane (n,)."""
    local, w = local_targets(x, panels, element)
    highest = int(panels.exponents.sum(axis=1).max()) + 4
    return (
        _moments(panels.polygon[element], local[:2].T, w, panels.order + 4, highest),
        to_basis(panels, element, local[:2]),
        w,
    )


def _moments(
    polygon: Array, origin: Array, w: Array, highest: int, degree: int
) -> dict[int, Table]:
    """M_3, M_5 and M_7 off the polygons, a, b <= highest, a + b <= degree."""
    edges = Edges.of(polygon, origin, w)
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
        for k in range(7, 7 + 2 * BACKWARD, 2):
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
