"""What part of each element of a contact is closed, and what part slips; edges lie inside elements.

Along curves they are those of `refinement.contact_edges`. On surfaces p² falls and gap^(2/3) grows
in proportion to the distance from the edge, with one factor for both. It follows from how far the
closed and the open nodes of a panel are apart.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask, largest_by, scattered, smallest_by
from ..contact.friction_law import lengths, main_direction, signed
from ..contact.law_protocol import OPEN, SLIP, STICK
from ..fields.boundary.maxima import between_nodes
from ..fields.boundary.places import sizes
from ..linalg.nearest import within
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.surface_mesh import SurfaceMesh
from ..record import record, replace
from ..refinement.contact_edges import SPECK, Edge, edges
from ..round_off import HALF, TINY
from .records import PairResult

ENDS = np.array([0.0, 1.0])
"""Places along each direction of an element at which it is looked whether p vanishes there."""
MIDDLES = (np.arange(16) + 0.5) / 16
"""Places along each direction of an element at which is looked: an edge along a side of it is known
to 1/32 of the element."""


def pair_edges(pair: PairResult, smallest: float = SPECK, finest: float = 0.0) -> list[Edge]:
    """Edges of contact and of stick along a curve, of what faces something: where the other part
    ends is known; arguments as of `edges`."""
    order = np.argsort(pair.arc_length)
    order = order[np.isfinite(pair.gap[order])]
    order, s, period = _from_an_open_place(pair, order)
    way = main_direction(pair.sigma_t)
    all_edges = edges(
        s,
        pair.pressure[order],
        signed(pair.sigma_t[order], way),
        pair.bound[order],
        pair.gap[order],
        signed(pair.slip_increment[order], way),
        pair.state[order].astype(np.int64),
        smallest,
        finest,
    )
    back = [replace(edge, s=edge.s - period) if edge.s >= period else edge for edge in all_edges]
    return sorted(back, key=lambda edge: edge.s)


def _from_an_open_place(pair: PairResult, order: Index) -> tuple[Index, Array, float]:
    """Nodes in order along a curve and their arc lengths, and that all around; where the curve
    runs on from its end to its start it begins where contact is open, as farther from closed nodes
    than anywhere: a contact that lies across the start is one."""
    s, closed = pair.arc_length[order], np.flatnonzero(pair.state[order] != OPEN)
    opened = np.flatnonzero(pair.state[order] == OPEN)
    if len(closed) * len(opened) == 0:
        return order, s, np.inf
    around = float(np.linalg.norm(pair.x[order[-1]] - pair.x[order[0]]))
    if around > s[1] - s[0] + s[-1] - s[-2]:  # no nearer than neighbours are
        return order, s, np.inf
    cut = opened[np.argmax(np.abs(opened[:, None] - closed).min(axis=1))]
    period = float(s[-1] - s[0]) + around
    return np.roll(order, -cut), np.append(s[cut:], s[:cut] + period), period


def areas(
    mesh: BoundaryMesh,
    nodes: Index,
    pair: PairResult,
    compliance: float,
    elements: Sequence[int] = (),
) -> Iterator[tuple[float, float]]:
    """Areas, in the plane lengths, of what is closed and of what slips, each with how far it may be
    off on this mesh: what the elements of its edges hold between two nodes [area].

    Parameters
    ----------
    mesh : BoundaryMesh
        Of the secondary.
    nodes : (m,) array
        Of the contact.
    pair : PairResult
    compliance : float
        2/E* of the pair [1/stress].
    elements : sequence of int, optional
        Those at places where stress has no bound. An edge in them does not follow from tractions.
    """
    numbers, row = np.unique(mesh.element[nodes], return_inverse=True)
    contact = _Contact(nodes, pair, numbers, row, compliance, np.isin(numbers, elements))
    area = np.bincount(row, pair.weight)
    pressed = _pressed(mesh, contact)
    for inside in (pair.state != OPEN, pair.state == SLIP):
        share = np.bincount(row, pair.weight * inside) / area
        mixed = at_edge = (share > 0.0) & (share < 1.0)
        if mixed.any() or not inside.all():
            share, at_edge = _shares(mesh, contact, inside, share)
            mixed = mixed | at_edge & (share > 0.0)
        off = float((area / np.bincount(row))[mixed].sum())
        # where p would pull beyond an edge of a panel its share has left that out
        yield float(area @ (share * np.where(at_edge, 1.0, pressed))), off


def in_doubt(
    mesh: BoundaryMesh, nodes: Index, pair: PairResult, inside: Mask, change: Array
) -> float:
    """Return the area that may be open though all nodes of its elements are inside: p is less at an
    end of an element than its change (m,). As in `areas`, each holds it between two nodes [area].
    """
    element, row = np.unique(mesh.element[nodes], return_inverse=True)
    p = scattered(pair.pressure, nodes, mesh.n_nodes)
    least = between_nodes(mesh, element, ENDS, p)[2].reshape(len(element), -1).min(axis=1)
    off = largest_by(row, change, len(element))
    doubted = (np.bincount(row, ~inside) == 0) & (least < off)
    return float((np.bincount(row, pair.weight) / np.bincount(row))[doubted].sum())


def hidden_slip(
    mesh: BoundaryMesh, nodes: Index, pair: PairResult, compliance: float, elements: Sequence[int]
) -> tuple[float, float, float, float]:
    """The area that may slip at ends of stick though no node slips, how far it slips, the energy
    that it takes, and what q reaches there: g where stress has no bound.

    Stick ends at such places, in elements in or beside which contact ends, and where q, as a
    function, is more than g at an end of an element.

    Beside an end at which q = K/√(2πs) shear up to g slips over a length of π K²/(8 g²), by 2/π
    times that length, g and the compliance (D. S. Dugdale, Yielding of steel sheets containing
    slits, J. Mech. Phys. Solids 8 (1960) 100-104). K is that of the largest q of the element, taken
    for the mean over it. Twice the length is returned, and slip of twice what these make. In two
    problems of `scripts/verify_random` the true slip was 0.26 and 1.06 times the returned one, the
    energy 0.03 and 0.8 times.

    Parameters
    ----------
    mesh, nodes, pair, compliance
        As of `areas`.
    elements : sequence of int
        Those at places where stress has no bound.
    """
    area, most = np.bincount(mesh.element, mesh.measure), [0.0, 0.0, 0.0, 0.0]
    for each, q, g, freed in _ends_of_stick(mesh, nodes, pair, elements):
        share = 2.0 * (0.25 * math.pi * q / g) ** 2
        wide = area[each] / (2.0 * sizes(mesh)[each]) ** (mesh.dim - 2)
        slip = 2.0 * compliance * freed * share * float(wide)
        most[0] += share * area[each]
        most[1] = max(most[1], slip)
        most[2] += g * slip * share * area[each]
        most[3] = max(most[3], g if each in elements else q)
    return most[0], most[1], most[2], most[3]


def _ends_of_stick(
    mesh: BoundaryMesh, nodes: Index, pair: PairResult, elements: Sequence[int]
) -> Iterator[tuple[int, float, float, float]]:
    """Yield elements in which stick ends though no node slips: the largest q there, g, and the
    shear that slip takes away.

    It is g, or the part of q by which the least g is less than g. In a drawn punch (seed 61 of
    `scripts/verify_space`) slip was half of what this makes, an eighth of what g makes.
    """
    closed, (numbers, row) = pair.state != OPEN, np.unique(mesh.element[nodes], return_inverse=True)
    q, g = _shear_at_ends(mesh, nodes, pair, numbers)
    ends = _at_ends(mesh, numbers, np.bincount(row, closed) / np.bincount(row))
    endless = np.isin(numbers, elements) | ends
    for k in np.flatnonzero(endless | (q > g).any(axis=0)).tolist():
        rows = np.flatnonzero((row == k) & closed)
        bound = pair.bound[rows]
        if np.all(pair.state[rows] == STICK) and 0.0 < bound.min(initial=np.inf) < np.inf:
            most = max(float(q[:, k].max()), float(lengths(pair.sigma_t[rows]).max()))
            mean, least = float(bound.mean()), max(float(g[:, k].min()), 0.0)
            freed = mean if endless[k] else most * max(1.0 - least / mean, 0.0)
            yield int(numbers[k]), most, mean, freed


def _shear_at_ends(
    mesh: BoundaryMesh, nodes: Index, pair: PairResult, numbers: Index
) -> tuple[Array, Array]:
    """Return q and g at the ends of elements, (ends, elements) each."""
    shear = lengths(pair.sigma_t)
    # without a bound q does not reach it
    both = np.column_stack([shear, np.where(np.isfinite(pair.bound), pair.bound, shear)])
    whole = scattered(both, nodes, mesh.n_nodes)
    q, g = between_nodes(mesh, numbers, ENDS, whole)[2].reshape(len(numbers), -1, 2).T
    return q, g


@record
class _Contact:
    """The nodes of a pair, the numbers of their elements and which of these each node has, the
    compliance of `areas`, and which elements are at places where stress has no bound."""

    nodes: Index
    pair: PairResult
    numbers: Index
    row: Index
    compliance: float
    endless: Mask


def _pressed(mesh: BoundaryMesh, contact: _Contact) -> Array:
    """The share of each element in which p, as a function, is not negative; 1 where it may pull."""
    nodes, pair, numbers = contact.nodes, contact.pair, contact.numbers
    whole = scattered(pair.pressure, nodes, mesh.n_nodes)
    pressed = np.where(pair.state != OPEN, pair.pressure, -np.inf)
    least = smallest_by(mesh.element[nodes], pressed, mesh.n_elements)
    asked, share = np.flatnonzero(least[numbers] > 0.0), np.ones(len(numbers))
    if len(asked) and not np.any(pair.pressure < 0.0):
        values = between_nodes(mesh, numbers[asked], MIDDLES, whole)[2]
        share[asked] = (values >= 0.0).reshape(len(asked), -1).mean(axis=1)
    return share


@functools.singledispatch
def _at_ends(mesh: Any, numbers: Index, of_closed: Array) -> Mask:
    """Which elements have closed and open nodes, or have one kind and adjoin elements of the other:
    contact may reach into an element of which no node is closed."""
    every = np.full(mesh.n_elements, np.nan)
    every[numbers] = of_closed
    near = [every[each[numbers]] for each in mesh.neighbours()]
    differ = [np.abs(each - of_closed) == 1.0 for each in near]
    return np.asarray((of_closed % 1.0 > 0.0) | np.any(differ, axis=0))


@functools.singledispatch
def _shares(mesh: Any, contact: _Contact, inside: Mask, share: Array) -> tuple[Array, Mask]:
    """Return the share of each element that is inside, and in which it is known to a node only."""
    numbers = contact.numbers
    faced = np.isfinite(contact.pair.gap)
    borders = np.sort([edge.s for edge in pair_edges(contact.pair)])
    zone = np.searchsorted(borders, contact.pair.arc_length)
    sums = [
        np.bincount(zone[faced], w[faced], len(borders) + 1)
        for w in (inside * 1.0, contact.pair.weight**0)
    ]
    is_inside = sums[0] > 0.5 * np.maximum(sums[1], 1.0)
    cut = np.r_[-np.inf, borders, np.inf]
    start = mesh.side_start[numbers]
    end = start + mesh.length[numbers]
    found = np.zeros(len(numbers))
    for low, high in zip(cut[:-1][is_inside], cut[1:][is_inside], strict=True):
        found += np.maximum(np.minimum(end, high) - np.maximum(start, low), 0.0)
    whole = ~np.isin(np.arange(len(numbers)), contact.row[~faced])
    return np.where(whole, found / mesh.length[numbers], share), _at_end(mesh, contact, share)


def _at_end(mesh: CurveMesh, contact: _Contact, share: Array) -> Mask:
    """Which elements end at an edge that is known to a node only.

    An edge in an element of one state follows from its tractions, as well as these are known, but
    where they have no bound, there or in the element beyond the edge."""
    every, endless = np.zeros(mesh.n_elements), np.zeros(mesh.n_elements, dtype=bool)
    every[contact.numbers], endless[contact.numbers] = share - 1.0, contact.endless
    near = [each[contact.numbers] for each in mesh.neighbours()]
    beside = [(every[each] == -1.0) & (contact.endless | endless[each]) for each in near]
    return np.asarray((share == 1.0) & np.any(beside, axis=0))


@_shares.register
def _(mesh: SurfaceMesh, contact: _Contact, inside: Mask, share: Array) -> tuple[Array, Mask]:
    """By the distance from the edge of contact, in panels with open and closed nodes, and in those
    of one kind that adjoin the other: edges lie between nodes of two panels, too. What slips is a
    share of what is closed."""
    pair, numbers, row = contact.pair, contact.numbers, contact.row
    closed = pair.state != OPEN
    parts = [np.bincount(row, pair.weight * each, len(numbers)) for each in (closed, inside)]
    share_inside = np.divide(parts[1], parts[0], out=np.zeros(len(numbers)), where=parts[0] > 0.0)
    of_closed = parts[0] / np.bincount(row, pair.weight)
    at_edge = _at_ends(mesh, numbers, of_closed)
    mixed = np.flatnonzero(at_edge)
    if len(mixed):
        values = scattered(_distance(contact, closed), contact.nodes, mesh.n_nodes)
        between = between_nodes(mesh, numbers[mixed], MIDDLES, values)[2]
        of_closed[mixed] = (between > 0.0).reshape(len(mixed), -1).mean(axis=1)
    return np.asarray(of_closed * share_inside), at_edge


@_at_ends.register
def _(mesh: SurfaceMesh, numbers: Index, of_closed: Array) -> Mask:
    result = (of_closed > 0.0) & (of_closed < 1.0)
    whole, none = np.flatnonzero(of_closed == 1.0), np.flatnonzero(of_closed == 0.0)
    if not (len(whole) and len(none)):
        return result
    low, high = (corner[numbers] for corner in mesh.boxes)
    near = HALF * sizes(mesh)[numbers]
    middle, reach = 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1) + 2.0 * near
    a, b = within(middle[none], middle[whole], reach[whole] + reach[none].max())
    a, b = whole[a], none[b]
    apart = np.maximum(low[a] - high[b], low[b] - high[a]).max(axis=1)
    meets = apart <= near[a] + near[b]
    result[a[meets]] = result[b[meets]] = True
    return result


def _distance(contact: _Contact, closed: Mask) -> Array:
    """Signed distances (m,) of nodes from the edge of contact in their elements, up to a factor: K²
    (compliance p)² inside, -K^(2/3) (3/2 gap)^(2/3) outside, which together bridge the distance of
    the middles of closed and open nodes."""
    pair, row, count = contact.pair, contact.row, len(contact.numbers)
    deep = np.where(closed, (contact.compliance * np.maximum(pair.pressure, 0.0)) ** 2, 0.0)
    gap = np.where(np.isfinite(pair.gap), np.maximum(pair.gap, 0.0), 0.0)
    far = np.where(closed, 0.0, (1.5 * gap) ** (2.0 / 3.0))

    def middle(values: Array, mask: Mask) -> Array:
        number = np.maximum(np.bincount(row, mask, count), 1.0)
        return np.asarray(np.bincount(row, values * mask, count) / number)

    apart = np.sqrt(sum((middle(x, closed) - middle(x, ~closed)) ** 2 for x in pair.x.T))
    inner, outer = middle(deep, closed), middle(far, ~closed)
    # t of inner t³ + outer t = apart, t = K^(-2/3), by Newton from above
    t = np.minimum(
        np.cbrt(np.divide(apart, inner, out=np.full(count, np.inf), where=inner > 0.0)),
        np.divide(apart, outer, out=np.full(count, np.inf), where=outer > 0.0),
    )
    t = np.where(np.isfinite(t), t, 1.0)
    for _ in range(6):
        slope = np.maximum(3.0 * inner * t**2 + outer, TINY)
        t = t - (inner * t**3 + outer * t - apart) / slope
    return np.asarray(deep * t[row] ** 3 - far * t[row])
