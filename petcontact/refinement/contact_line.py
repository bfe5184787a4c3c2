"""What a discrete solution on Γ_C says beyond its nodes: u_t between them, transition points,
differences.

Collocation at Gauss points is superconvergent: nodal values of u_t are far better than the
polynomials of degree p through the p+1 nodes of one element. Polynomials through the nodes of
neighbouring elements too keep that accuracy between the nodes, as long as they do not reach over a
point where the solution is not smooth.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import field

import numpy as np

from ..arrays import Array, Index
from ..frozen import frozen
from ..round_off import HALF

PEAK_SAMPLES = 9
"""Points of an element at which the largest displacement is looked for, its ends included."""
NEIGHBOURS = 3
"""Nodes borrowed on either side of an element."""


@frozen
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
        Ends of elements at which g has a kink or a jump: no polynomial reaches over them [length].
    powers : pair of float
        λ where u_t is r^λ in the first and the last element, r being the distance to the end of the
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
        """Places k with different states at the nodes k - 1 and k."""
        return np.flatnonzero(np.diff(self.sign)) + 1

    @functools.cached_property
    def transitions(self) -> list[float]:
        """Arc length at which states meet at each cut in the exact solution, estimated [length]."""
        return [transition(self, k) for k in self.cuts]

    def zones(self) -> list[slice]:
        """Runs of nodes of one state."""
        ends = [0, *self.cuts.tolist(), len(self.s)]
        return list(itertools.starmap(slice, itertools.pairwise(ends)))

    def pieces(self) -> list[slice]:
        """Runs of nodes on which the solution is smooth: zones cut at the kinks."""
        ends = sorted(
            {0, *self.cuts.tolist(), *np.searchsorted(self.s, self.kinks).tolist(), len(self.s)}
        )
        return list(itertools.starmap(slice, itertools.pairwise(ends)))


def displacement(line: ContactLine, s: Array) -> Array:
    """u_t between the nodes of a contact side, by polynomials through those of neighbouring
    elements; 0 in stick zones, and powers of the distance where elements at corners are.

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
    # cells: what an element has of a piece, from `low`, and the run of nodes whose polynomial holds
    # there
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
    """Where the states of nodes k - 1 and k meet: between elements, or half-way inside one."""
    if k == 0:
        return float(line.breaks[0])
    if line.element[k - 1] == line.element[k]:
        return 0.5 * float(line.s[k - 1] + line.s[k])
    return float(line.breaks[line.element[k] - line.element[0]])


def _interpolate(nodes: Array, values: Array, run: Index, cell: Index, points: Array) -> Array:
    """Polynomials through runs (c, 2) of nodes, in barycentric form, at points (n,) of cells (n,);
    0 for empty runs."""
    count = run[:, 1] - run[:, 0]
    place = np.arange(count.max(initial=1))
    used = place < count[:, None]
    place = np.minimum(run[:, :1] + place, len(nodes) - 1)
    x, f = nodes[place], values[place]
    length = np.where(count > 1, nodes[np.maximum(run[:, 1] - 1, 0)] - nodes[run[:, 0]], 1.0)
    # 4/length is the reciprocal of the capacity of the interval: products of differences neither
    # over- nor underflow
    gaps = (x[:, :, None] - x[:, None, :]) * (4.0 / length)[:, None, None]
    others = used[:, None, :] & used[:, :, None] & ~np.eye(x.shape[1], dtype=bool)
    weight = np.where(used, 1.0 / np.prod(np.where(others, gaps, 1.0), axis=2), 0.0)
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
    """‖u_coarse - u_fine‖ in L2(Γ_C), the larger of what the nodes of either see, side by side
    [length^3/2].

    Either alone is blind: the coarse nodes to slip zones that only the fine mesh has, the fine ones
    to those that only the coarse mesh has.
    """
    at_fine = at_coarse = 0.0
    for one, other in zip(coarse, fine, strict=True):
        at_fine += float(other.weight @ (displacement(one, other.s) - other.u_t) ** 2)
        at_coarse += float(one.weight @ (displacement(other, one.s) - one.u_t) ** 2)
    return float(np.sqrt(max(at_fine, at_coarse)))


def farthest_apart(coarse: list[ContactLine], fine: list[ContactLine]) -> tuple[int, float]:
    """The side, and the arc length along it, of the fine element on which two solutions differ most
    in L2 [length]."""
    worst, result = -1.0, (0, 0.0)
    for number, (one, other) in enumerate(zip(coarse, fine, strict=True)):
        square = np.bincount(
            other.element - other.element[0],
            other.weight * (displacement(one, other.s) - other.u_t) ** 2,
        )
        k = int(np.argmax(square))
        if square[k] > worst:
            worst, result = (
                float(square[k]),
                (number, 0.5 * float(other.breaks[k] + other.breaks[k + 1])),
            )
    return result


def largest(lines: list[ContactLine]) -> float:
    """Largest |u_t| of the function between the nodes, ends of the sides included [length]."""
    peak = 0.0
    for line in lines:
        cuts = (
            line.breaks[:-1, None]
            + np.diff(line.breaks)[:, None] * np.linspace(0.0, 1.0, PEAK_SAMPLES)[:-1]
        )
        s = np.append(cuts.ravel(), line.breaks[-1])
        size = np.abs(displacement(line, s))
        k = int(np.argmax(size))
        peak = max(peak, float(size[k]), float(np.abs(line.u_t).max()))
        if 0 < k < len(s) - 1:
            # the vertex of the parabola through the largest sample and its neighbours
            size = size[k - 1 : k + 2]
            fit = _fitted((s[k - 1 : k + 2] - s[k]) / (s[k + 1] - s[k - 1]), size, 2)
            peak = max(peak, float(fit[2] - 0.25 * fit[1] ** 2 / fit[0])) if fit[0] < 0.0 else peak
    return peak


def _fitted(x: Array, y: Array, degree: int) -> list[float]:
    """Coefficients of the polynomial next to values, the highest first; half of `numpy.polyfit` is
    looking at its input."""
    powers = x[:, None] ** np.arange(degree, -1, -1)
    return [float(value) for value in np.linalg.lstsq(powers, y, rcond=None)[0]]


def transition(line: ContactLine, k: int) -> float:
    """Arc length at which the states of nodes k - 1 and k meet in the exact solution, estimated
    [length].

    Next to a transition point s* the slip is C r^(3/2) with r the distance from it; where the
    discrete states meet at another point a term K r^(1/2) appears, K being 3/2 C times the distance
    between the two points, so that away from them u_t is C (r + δ)^(3/2) again. So s* is where the
    polynomial through |u_t|^(2/3) vanishes, taken from nodes that are not too close. Between slip
    of opposite sign u_t itself vanishes.
    """
    border = _border(line, k)
    one, other = line.sign[k - 1], line.sign[k]
    if one != 0 and other != 0:
        a, b = line.u_t[k - 1], line.u_t[k]
        return float(line.s[k - 1] + (line.s[k] - line.s[k - 1]) * a / (a - b))
    zone = next(z for z in line.pieces() if (z.stop == k if one != 0 else z.start == k))
    places = np.arange(zone.start, zone.stop)[:: -1 if one != 0 else 1]
    direction = -1.0 if one != 0 else 1.0
    r = direction * (line.s[places] - border)
    far_end = zone.start if one != 0 else zone.stop
    reach = direction * (
        (_border(line, far_end) if far_end < len(line.s) else line.breaks[-1]) - border
    )
    nearest = float(r[0])
    chosen = (r < 0.2 * reach) & (r > min(8.0 * nearest, 0.03 * reach))
    if np.count_nonzero(chosen) < 4:
        chosen = np.arange(len(r)) < 4
    degree = min(3, int(np.count_nonzero(chosen)) - 1)
    if degree < 1:
        return border
    scale = float(r[chosen].max())
    fit = _fitted(r[chosen] / scale, np.abs(line.u_t[places][chosen]) ** (2.0 / 3.0), degree)
    root = 0.0
    for _ in range(8):
        value = steepness = 0.0
        for coefficient in fit:
            value, steepness = value * root + coefficient, steepness * root + value
        if steepness <= 0.0:
            return border
        root -= value / steepness
    # the states of the nodes say more than an extrapolation that contradicts them
    if not abs(root) < 1.0:
        return border
    return border + direction * root * scale


def grading_points(line: ContactLine) -> list[tuple[float, bool]]:
    """Arc lengths of the transition points, and whether slip changes its sign there [length].

    Between slip of opposite sign there is a stick zone, which may be narrower than any element: the
    smooth part A of du_t/ds is balanced by that of a jump 2g of σ_t, c g ln(L/w), so that its width
    w is about L exp(-A/cg). From far away the slip beside it is no power 3/2, and the ends that are
    extrapolated from its two sides come in the wrong order: it is one point then, where u_t
    vanishes. A mesh with a cut in more than every other element shows no zones but its own error.
    """
    result: list[tuple[float, bool]] = []
    if len(line.cuts) > 0.5 * (len(line.breaks) - 1):
        return result
    for place, before, k in zip(
        line.transitions, [0, *line.cuts.tolist()], line.cuts.tolist(), strict=False
    ):
        if result and line.sign[before] == 0 and place <= result[-1][0]:
            a, b = line.u_t[before - 1], line.u_t[k]
            share = a / (a - b) if a * b < 0.0 else 0.5
            result[-1] = (
                float(line.s[before - 1] + share * (line.s[k] - line.s[before - 1])),
                a * b < 0.0,
            )
        else:
            result.append((place, bool(line.sign[k - 1] * line.sign[k])))
    return result


def slip_at_end(line: ContactLine, last: bool) -> float:
    """Width of the slip zone to expect at an end of a side that sticks there, infinite where none
    is [length].

    Where the side ends σ_t of a stick zone grows like a negative power of the distance. It exceeds
    g within the distance at which the power through the nodes of the last element reaches g.
    """
    order = slice(None, None, -1) if last else slice(None)
    sign, element = line.sign[order], line.element[order]
    distance = (line.breaks[-1] - line.s if last else line.s - line.breaks[0])[order]
    near = np.flatnonzero(element == element[0])
    sigma, bound = np.abs(line.sigma_t[order][near]), line.bound[order][near]
    if len(near) < 2 or np.any(sign[near] != 0) or not np.all((sigma > 0.0) & (bound > 0.0)):
        return np.inf
    power, level = _fitted(np.log(distance[near]), np.log(sigma / bound), 1)
    if power > -0.05:
        return np.inf
    width = np.exp(-level / power) if level < 0.0 else 0.0
    return float(width) if width > HALF * line.breaks[-1] else np.inf


def without_specks(sign: Index, element: Index) -> Index:
    """Signs in which a zone inside one element, between two others, has the sign before it.

    Next to a singular point single nodes of an unresolved element may have any state.
    """
    sign = sign.copy()
    ends = [0, *(np.flatnonzero(np.diff(sign)) + 1).tolist(), len(sign)]
    for a, b in itertools.pairwise(ends[1:-1]):
        if element[a] == element[b - 1] and element[a - 1] == element[b]:
            sign[a:b] = sign[a - 1]
    return sign
