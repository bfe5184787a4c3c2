"""The discrete solution on Γ_C between its nodes: u_t, transition points, and differences.

Collocation at Gauss points is superconvergent: nodal values of u_t are far more accurate than the
polynomial of degree p through the p+1 nodes of one element. Polynomials through nodes of
neighbouring elements, too, keep that accuracy between the nodes. They must not cross a point where
the solution is not smooth.
"""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np

from ..arrays import Array, Index
from ..record import field, record
from ..round_off import HALF

NEIGHBOURS = 3
"""Nodes of neighbouring elements that a polynomial uses on either side. With 4 ten random bodies
(scripts/verify_random --seed 7 --first 100) took 1.12 times as many nodes."""


@record
class ContactLine:
    """u_t and σ_t at the nodes of one contact side, by arc length along the side.

    Attributes
    ----------
    s : (k,) array
        Arc length of the nodes, increasing [length].
    weight : (k,) array
        Quadrature weights [length].
    element : (k,) array
        Number of the element of each node, increasing.
    breaks : (e + 1,) array
        Ends of the elements [length].
    u_t, sigma_t : (k,) arrays
        [length], [stress].
    bound : (k,) array
        g [stress].
    sign : (k,) array
        0 where a node sticks, else the sign of u_t.
    kinks : (j,) array
        Ends of elements at which g has a kink or a jump; no polynomial crosses them [length].
    powers : pair of float
        λ if u_t is r^λ in the first and the last element, r being the distance to the end of the
        side, else 0.
    """

    s: Array
    weight: Array
    element: Index
    breaks: Array
    u_t: Array
    sigma_t: Array
    bound: Array
    sign: Index
    kinks: Array = field(default_factory=lambda: np.empty(0))
    powers: tuple[float, float] = (0.0, 0.0)

    @functools.cached_property
    def cuts(self) -> Index:
        """Numbers k for which the nodes k - 1 and k have different states."""
        return np.flatnonzero(np.diff(self.sign)) + 1

    @functools.cached_property
    def transitions(self) -> list[float]:
        """Estimated arc length of the exact transition point at each cut [length]."""
        return [transition(self, k) for k in self.cuts]

    def zones(self) -> list[slice]:
        """Return the runs of nodes with one state."""
        ends = [0, *self.cuts.tolist(), len(self.s)]
        return list(itertools.starmap(slice, itertools.pairwise(ends)))

    def pieces(self) -> list[slice]:
        """Return the runs of nodes on which the solution is smooth: zones cut at the kinks."""
        ends = sorted(
            {0, *self.cuts.tolist(), *np.searchsorted(self.s, self.kinks).tolist(), len(self.s)}
        )
        return list(itertools.starmap(slice, itertools.pairwise(ends)))


def displacement(line: ContactLine, s: Array) -> Array:
    """Return u_t between the nodes of a contact side.

    It is a polynomial through nodes of neighbouring elements, 0 in stick zones, and a power of the
    distance in elements at singular corners.

    Parameters
    ----------
    line : ContactLine
    s : (n,) array
        Arc lengths, increasing [length].

    Returns
    -------
    (n,) array
        [length]
    """
    pieces = line.pieces()
    borders = [_border(line, piece.start) for piece in pieces] + [float(line.breaks[-1])]
    base, breaks = int(line.element[0]), line.breaks.tolist()
    element = (line.element - base).tolist()
    first = np.searchsorted(line.element, np.arange(base, base + len(breaks))).tolist()
    # a cell is the part of an element in one piece; `low` is its start, `run` the nodes that its
    # polynomial uses
    low, run = [], []
    for piece, start in zip(pieces, borders, strict=False):
        for e in range(element[piece.start], element[piece.stop - 1] + 1):
            low.append(max(start, breaks[e]))
            inside = (
                max(piece.start, first[e] - NEIGHBOURS),
                min(piece.stop, first[e + 1] + NEIGHBOURS),
            )
            run.append(inside if line.sign[piece.start] else (inside[0], inside[0]))
    cell = np.maximum(np.searchsorted(low, s, side="right") - 1, 0)
    u = _interpolate(line.s, line.u_t, np.array(run), cell, s)
    for power, node, end, inside in (
        (line.powers[0], 0, line.breaks[0], s < line.breaks[1]),
        (line.powers[1], -1, line.breaks[-1], s > line.breaks[-2]),
    ):
        if power > 0.0:
            u[inside] = line.u_t[node] * np.abs((s[inside] - end) / (line.s[node] - end)) ** power
    return u


def _border(line: ContactLine, k: int) -> float:
    """Return the arc length between the states of nodes k - 1 and k: an element's end, or their
    middle."""
    if k == 0:
        return float(line.breaks[0])
    if line.element[k - 1] == line.element[k]:
        return 0.5 * float(line.s[k - 1] + line.s[k])
    return float(line.breaks[line.element[k] - line.element[0]])


def _interpolate(nodes: Array, values: Array, run: Index, cell: Index, points: Array) -> Array:
    """Return polynomials through runs (c, 2) of nodes at points (n,) in cells (n,), 0 for empty
    runs.

    They are evaluated in barycentric form.
    """
    count = run[:, 1] - run[:, 0]
    slot = np.arange(count.max(initial=1))
    used = slot < count[:, None]
    slot = np.minimum(run[:, :1] + slot, len(nodes) - 1)
    x, f = nodes[slot], values[slot]
    length = np.where(count > 1, nodes[np.maximum(run[:, 1] - 1, 0)] - nodes[run[:, 0]], 1.0)
    # 4/length is the reciprocal capacity of the interval: products of differences do not overflow
    # or underflow
    gaps = (x[:, :, None] - x[:, None, :]) * (4.0 / length)[:, None, None]
    distinct = used[:, None, :] & used[:, :, None] & ~np.eye(x.shape[1], dtype=bool)
    weight = np.where(used, 1.0 / np.prod(np.where(distinct, gaps, 1.0), axis=2), 0.0)
    away = points[:, None] - x[cell]
    hit = (away == 0.0) & used[cell]
    terms = weight[cell] / np.where((away == 0.0), 1.0, away)
    total = terms.sum(axis=1)
    empty = count[cell] == 0
    result = np.einsum("nk,nk->n", terms, f[cell]) / np.where(empty, 1.0, total)
    row, column = np.nonzero(hit)
    result[row] = f[cell][row, column]
    return np.asarray(np.where(empty, 0.0, result))


def difference(coarse: list[ContactLine], fine: list[ContactLine]) -> float:
    """Return ‖u_coarse - u_fine‖ in L2(Γ_C), the larger of its values at both sets of nodes
    [length^3/2].

    The coarse nodes do not show slip zones that only the fine mesh has, and the other way round.
    """
    at_fine = at_coarse = 0.0
    for rough, line in zip(coarse, fine, strict=True):
        at_fine += float(line.weight @ (displacement(rough, line.s) - line.u_t) ** 2)
        at_coarse += float(rough.weight @ (displacement(line, rough.s) - rough.u_t) ** 2)
    return float(np.sqrt(max(at_fine, at_coarse)))


def farthest_apart(coarse: list[ContactLine], fine: list[ContactLine]) -> tuple[int, float]:
    """Return the side and the arc length of the fine element with the largest L2 difference
    [length]."""
    worst, result = -1.0, (0, 0.0)
    for number, (rough, line) in enumerate(zip(coarse, fine, strict=True)):
        square = np.bincount(
            line.element - line.element[0],
            line.weight * (displacement(rough, line.s) - line.u_t) ** 2,
        )
        k = int(np.argmax(square))
        if square[k] > worst:
            worst = float(square[k])
            result = (number, 0.5 * float(line.breaks[k] + line.breaks[k + 1]))
    return result


def _fitted(x: Array, y: Array, degree: int) -> list[float]:
    """Return the coefficients of the least-squares polynomial, the highest first.

    `numpy.polyfit` spends half of its time on checks of its input.
    """
    powers = x[:, None] ** np.arange(degree, -1, -1)
    return [float(value) for value in np.linalg.lstsq(powers, y, rcond=None)[0]]


def transition(line: ContactLine, k: int) -> float:
    """Return the estimated arc length of the exact transition point between the nodes k - 1 and k
    [length].

    Let r be the distance from a transition point s*. The exact slip near s* is C r^(3/2). If the
    discrete states meet at a distance δ from s*, a term K r^(1/2) with K = 3/2 C δ appears. Away
    from both points u_t is then C (r + δ)^(3/2) again. Thus s* is the zero of the polynomial
    through |u_t|^(2/3) at nodes that are not too close. Between slips of opposite sign u_t itself
    vanishes.
    """
    border = _border(line, k)
    before, after = line.sign[k - 1], line.sign[k]
    if before != 0 and after != 0:
        a, b = line.u_t[k - 1], line.u_t[k]
        return float(line.s[k - 1] + (line.s[k] - line.s[k - 1]) * a / (a - b))
    zone = next(z for z in line.pieces() if (z.stop == k if before != 0 else z.start == k))
    nodes = np.arange(zone.start, zone.stop)[:: -1 if before != 0 else 1]
    direction = -1.0 if before != 0 else 1.0
    r = direction * (line.s[nodes] - border)
    far_end = zone.start if before != 0 else zone.stop
    reach = direction * (
        (_border(line, far_end) if far_end < len(line.s) else line.breaks[-1]) - border
    )
    chosen = (r < 0.2 * reach) & (r > min(8.0 * float(r[0]), 0.03 * reach))
    if np.count_nonzero(chosen) < 4:
        chosen = np.arange(len(r)) < 4
    degree = min(3, int(np.count_nonzero(chosen)) - 1)
    if degree < 1:
        return border
    scale = float(r[chosen].max())
    fit = _fitted(r[chosen] / scale, np.abs(line.u_t[nodes][chosen]) ** (2.0 / 3.0), degree)
    root = _root_near_zero(fit)
    # an extrapolation that contradicts the states of the nodes is not used
    return border + direction * root * scale if abs(root) < 1.0 else border


def _root_near_zero(coefficients: list[float]) -> float:
    """Return the root that Newton's method finds from 0, nan where the polynomial does not grow."""
    root = 0.0
    for _ in range(8):
        value = steepness = 0.0
        for coefficient in coefficients:
            value, steepness = value * root + coefficient, steepness * root + value
        if steepness <= 0.0:
            return math.nan
        root -= value / steepness
    return root


def grading_points(line: ContactLine) -> list[tuple[float, bool]]:
    """Return the arc lengths of the transition points, and whether slip changes its sign there
    [length].

    Between slips of opposite sign there is a stick zone, which may be narrower than any element.
    The smooth part A of du_t/ds balances that of a jump 2g of σ_t, c g ln(L/w). Its width w is
    therefore about L exp(-A/cg). Away from it the slip is not a power 3/2, and the two extrapolated
    ends come in the wrong order. They are replaced by the one point where u_t vanishes. If more
    than half of the elements have a cut, the mesh shows only its own error, and no point is
    returned.
    """
    result: list[tuple[float, bool]] = []
    if len(line.cuts) > 0.5 * (len(line.breaks) - 1):
        return result
    for point, before, k in zip(
        line.transitions, [0, *line.cuts.tolist()], line.cuts.tolist(), strict=False
    ):
        if result and line.sign[before] == 0 and point <= result[-1][0]:
            a, b = line.u_t[before - 1], line.u_t[k]
            share = a / (a - b) if a * b < 0.0 else 0.5
            result[-1] = (
                float(line.s[before - 1] + share * (line.s[k] - line.s[before - 1])),
                a * b < 0.0,
            )
        else:
            result.append((point, bool(line.sign[k - 1] * line.sign[k])))
    return result


def slip_at_end(line: ContactLine, last: bool) -> float:
    """Return the expected width of a slip zone at an end of a side that sticks, or infinity
    [length].

    At an end, σ_t of a stick zone grows like a negative power of the distance. The width is the
    distance at which the power through the nodes of the last element reaches g.
    """
    order = slice(None, None, -1) if last else slice(None)
    sign, element = line.sign[order], line.element[order]
    distance = (line.breaks[-1] - line.s if last else line.s - line.breaks[0])[order]
    near = np.flatnonzero(element == element[0])
    sigma, bound = np.abs(line.sigma_t[order][near]), line.bound[order][near]
    limited = (bound > 0.0) & (bound < np.inf)
    if len(near) < 2 or np.any(sign[near] != 0) or not np.all((sigma > 0.0) & limited):
        return np.inf
    power, level = _fitted(np.log(distance[near]), np.log(sigma / bound), 1)
    if power > -0.05:
        return np.inf
    width = np.exp(-level / power) if level < 0.0 else 0.0
    return float(width) if width > HALF * line.breaks[-1] else np.inf


def without_specks(sign: Index, element: Index) -> Index:
    """Return the signs, with a zone inside one element joined to the zone before it.

    The zone must lie between two others. Next to a singular point, single nodes of an unresolved
    element may have any state.
    """
    sign = sign.copy()
    ends = [0, *(np.flatnonzero(np.diff(sign)) + 1).tolist(), len(sign)]
    for a, b in itertools.pairwise(ends[1:-1]):
        if element[a] == element[b - 1] and element[a - 1] == element[b]:
            sign[a:b] = sign[a - 1]
    return sign
