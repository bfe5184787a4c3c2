"""Kelvin's solution in space and its traction, integrated over panels (the kernels of 4.10 in three
dimensions).

With r = y - x from the target x to the source y, n the outward normal at y and w = n·r:

    U = 1/(16πµ(1-ν)) [(3-4ν) I/r + r r/r³]
    T = -1/(8π(1-ν)) [w ((1-2ν) I/r³ + 3 r r/r⁵) - (1-2ν)(r n - n r)/r³]

U[i, j] and T[i, j] take component j at the source to component i at the target. Near flat panels
are integrated in closed form (`moments`), near curved ones by polar coordinates (`curved`); from
afar Gauss points serve as sources, as many as a bound of their error asks for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...mesh.curved.panels import CurvedPanels
from ...mesh.panels import Panels
from ...round_off import SOLVED
from . import curved
from .compiled import available, compiled_integrals
from .moments import Moments
from .rules import MOST_POINTS, point_counts, tolerance_of
from .tensors import Result, kernels

NEAR_CHUNK = 4096
"""Pairs of a panel and a target whose closed forms are worked out at once."""
FAR_CHUNK = 1 << 16
"""Pairs of a source point and a target at once."""


def integrals(
    points: Array,
    panels: Panels | CurvedPanels,
    poisson_ratio: float,
    *,
    tolerance: float | None = None,
) -> tuple[Array, Array]:
    """Both kernels integrated over panels against their bases, at target points.

    Parameters
    ----------
    points : (m, 3) array
        [length]
    panels : Panels or CurvedPanels
        n panels of k nodes.
    poisson_ratio : float
    tolerance : float, optional
        Of the quadrature, of flat panels where they are far; by default `rules.TOLERANCE`.

    Returns
    -------
    G : (3, 3, n k, m) array
        2µ ∫ U_ij L_b dS [length], i the component at the target, j the component at the panel;
        panel after panel on the third axis.
    H : (3, 3, n k, m) array
        ∫ T_ij L_b dS [-]; the principal value, without the free term, at a node of the panel
        itself.
    """
    shape = (3, 3, len(panels.index), panels.n_nodes, len(points))
    kernel_g, kernel_h = (np.empty((3, 3, shape[2] * shape[3], shape[4])) for _ in range(2))
    tolerance = tolerance_of(panels, tolerance)
    if available():
        compiled_integrals(
            points, panels, poisson_ratio, tolerance, MOST_POINTS[type(panels)], kernel_g, kernel_h
        )
        return kernel_g, kernel_h
    whole = Result(kernel_g.reshape(shape), kernel_h.reshape(shape), poisson_ratio)
    BY_NUMPY[type(panels)](points, panels, tolerance, whole)
    return kernel_g, kernel_h


def _fill(points: Array, panels: Panels, tolerance: float, result: Result) -> None:
    """All pairs of a flat panel and a point."""
    near: list[tuple[Index, Index]] = [(np.empty(0, dtype=np.int64),) * 2]
    for element in range(len(panels.index) if len(points) else 0):
        counts = point_counts(points, panels, element, tolerance)
        close = counts[:, 0] * counts[:, 1] > MOST_POINTS[type(panels)][panels.order]
        column = np.flatnonzero(close)
        near.append((np.full(len(column), element), column))
        counts[close] = 0
        code = counts[:, 0] * 64 + counts[:, 1]
        for number in np.unique(code[~close]).tolist():
            _far(
                points, panels, element, np.flatnonzero(code == number), divmod(number, 64), result
            )
    elements, columns = (np.concatenate(part) for part in zip(*near, strict=True))
    for first in range(0, len(elements), NEAR_CHUNK):
        some = slice(first, first + NEAR_CHUNK)
        _near(points[columns[some]], panels, elements[some], columns[some], result)


BY_NUMPY: dict[type, Callable[[Array, Any, float, Result], None]] = {
    Panels: _fill,
    CurvedPanels: curved.fill,
}
"""What fills the results where nothing was compiled, by the kind of panel."""


def _far(
    points: Array,
    panels: Panels,
    element: int,
    target: Index,
    counts: tuple[int, int],
    result: Result,
) -> None:
    """Gauss points of one panel as sources."""
    x, weight = panels.take(slice(element, element + 1)).rule(counts)
    step = max(1, FAR_CHUNK // x.shape[1])
    for first in range(0, len(target), step):
        rows = target[first : first + step]
        g, h = kernels(x[0][:, None] - points[rows], panels.frame[element, 2], result.poisson_ratio)
        result.write(
            element,
            rows,
            *(np.einsum("bq,ijqm->ijbm", weight[0], kernel, optimize=True) for kernel in (g, h)),
        )


def _near(x: Array, panels: Panels, element: Index, target: Index, result: Result) -> None:
    """Pairs of a panel and a target in closed form."""
    frame, size = panels.frame[element], panels.size[element]
    local, w = local_targets(x, panels, element)
    degree = int(panels.exponents.sum(axis=1).max())
    moments = Moments.of(panels.polygon[element], local[:2].T, w, panels.order, degree)
    basis = to_basis(panels, element, local[:2])
    built = []
    for build, power in ((_displacement, 1), (_traction, 0)):
        values = np.array(
            [build(moments, w, int(a), int(b), result.poisson_ratio) for a, b in panels.exponents]
        )
        nodal = np.einsum("nbq,qijn->ijnb", basis, values, optimize=True) * (size**power)[:, None]
        built.append(np.einsum("nai,abnk,nbj->ijnk", frame, nodal, frame, optimize=True))
    result.write(element, target, *built)


def local_targets(x: Array, panels: Panels, element: Index) -> tuple[Array, Array]:
    """Targets x (n, 3) in the coordinates of a panel each, (3, n), and the height of the panel's
    plane over them, (n,)."""
    local = (
        np.einsum("nij,nj->in", panels.frame[element], x - panels.centre[element])
        / panels.size[element]
    )
    return local, np.where(np.abs(local[2]) <= SOLVED, 0.0, -local[2])


def to_basis(panels: Panels, element: Index, origin: Array) -> Array:
    """Coefficients (n, k, monomials) of the basis of a panel each by monomials about the origin (2,
    n)."""
    return np.asarray(
        np.einsum("nbm,mqn->nbq", panels.coefficients[element], _shift(panels.exponents, origin))
    )


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


def _displacement(moments: Moments, w: Array, a: int, b: int, poisson_ratio: float) -> Array:
    """2µ ∫ U u^a v^b in local directions, (3, 3, n)."""
    m_3, p = moments.m_3, moments.p
    part = (3.0 - 4.0 * poisson_ratio) * moments.m_1[a, b]
    uv, uw, vw = m_3[a + 1, b + 1], p[a + 1, b], p[a, b + 1]
    rows = [
        [part + m_3[a + 2, b], uv, uw],
        [uv, part + m_3[a, b + 2], vw],
        [uw, vw, part + w * p[a, b]],
    ]
    return np.array(rows) / (8.0 * np.pi * (1.0 - poisson_ratio))


def _traction(moments: Moments, w: Array, a: int, b: int, poisson_ratio: float) -> Array:
    """∫ T u^a v^b in local directions, (3, 3, n)."""
    m_3, p, q = moments.m_3, moments.p, moments.q
    one_2nu = 1.0 - 2.0 * poisson_ratio
    part, uv = one_2nu * p[a, b], q[a + 1, b + 1]
    ww = moments.w_q if a + b == 0 else w * w * q[a, b]
    uw, vw, turn_u, turn_v = (
        w * q[a + 1, b],
        w * q[a, b + 1],
        one_2nu * m_3[a + 1, b],
        one_2nu * m_3[a, b + 1],
    )
    rows = [
        [part + q[a + 2, b], uv, uw - turn_u],
        [uv, part + q[a, b + 2], vw - turn_v],
        [uw + turn_u, vw + turn_v, part + ww],
    ]
    return -np.array(rows) / (8.0 * np.pi * (1.0 - poisson_ratio))
