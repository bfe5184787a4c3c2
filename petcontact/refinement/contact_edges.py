"""Edges of contact and of stick along an interface, found by extrapolation.

Let d be the distance to an edge. At the edge of a contact the gap opens like d^(3/2), and p
vanishes like d^(1/2). At the edge of a stick zone |δw| and µp - |q| do the same. Powers 2/3 and 2
of these are linear and vanish at the edge. Displacements give its position ten times as accurately
as tractions, which are worst in the last element.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Index
from ..record import record

SPECK = 4e-3
"""Width over that of all contact, below which zones have no edges of their own on coarse meshes
[-]."""
SEEN = 5.0
"""Number of smallest elements in a zone from which it has edges on finer meshes. Without it true
errors of 20 random contacts (scripts/verify_random --contact --seed 7 --first 100) were up to 0.6
times the reported ones, not up to 0.45 times."""
SKIPPED, FITTED = 2, 6
"""Nodes next to an edge that are left out (`SKIPPED`), and up to which the line is fitted to the
others (`FITTED`)."""


@record
class Edge:
    """Point at which the state changes along an interface.

    Attributes
    ----------
    s : float
        Arc length along the secondary's part [length].
    width : float
        Half the length of the closed interval that it bounds [length].
    """

    s: float
    width: float


def edges(
    s: Array,
    pressure: Array,
    shear: Array,
    bound: Array,
    gap: Array,
    moved: Array,
    state: Index,
    smallest: float = SPECK,
    finest: float = 0.0,
) -> list[Edge]:
    """Return the edges between nodes of different states, or of opposite slip.

    Parameters
    ----------
    s : (m,) array
        Arc lengths, increasing [length].
    pressure, shear, bound : (m,) arrays
        p, q and the bound of |q| [stress].
    gap, moved : (m,) arrays
        g and δw [length].
    state : (m,) array
        0 stick, 1 slip, 2 open.
    smallest : float
        Size of elements at edges over half the width of the contact [-]. Zones of at least `SEEN`
        of them have edges; the limit is never above SPECK.
    finest : float
        Size of the smallest elements at edges [length].
    """
    if not len(s):  # a side that faces nothing
        return []
    # slip the other way is -1
    state = np.where((state == 1) & (shear > 0.0), -1, state)
    state = _without_specks(s, state, min(SPECK, SEEN * smallest), SEEN * finest)
    closed = state != 2
    result = []
    for k in np.flatnonzero(np.diff(state)):
        low, high = float(s[k]), float(s[k + 1])
        if {state[k], state[k + 1]} == {1, -1}:
            result.append(
                Edge(low + (high - low) * _share(moved[k], moved[k + 1]), _half_width(s, closed, k))
            )
            continue
        if 2 in (state[k], state[k + 1]):
            opening, values, inward = gap, pressure, (-1 if closed[k] else 1)
        else:
            opening, values, inward = moved, bound - np.abs(shear), (-1 if state[k] == 0 else 1)
        inner, outer = (k, k + 1) if inward < 0 else (k + 1, k)
        reach = high - low
        roots = (
            _opens(s, np.abs(opening), state, outer, -inward),
            _vanishes(s, values**2, state, inner, inward),
        )
        near = [root for root in roots if root is not None and low - reach <= root <= high + reach]
        result.append(Edge(near[0] if near else 0.5 * (low + high), _half_width(s, closed, inner)))
    return result


def _share(first: float, last: float) -> float:
    """Return the root of the line through two values on [0, 1], or 0.5 without change of sign."""
    return abs(first) / (abs(first) + abs(last)) if first * last < 0.0 else 0.5


def _without_specks(s: Array, state: Index, narrowest: float, least: float) -> Index:
    """Return the states, with zones much narrower than the contact joined to the zone before them.

    Single nodes next to a singular corner may have any state, and corners are graded in any case. A
    stick zone between two zones of opposite slip is kept.
    """
    state = state.copy()
    ends = [0, *(np.flatnonzero(np.diff(state)) + 1).tolist(), len(state)]
    total = float(s[state != 2][-1] - s[state != 2][0]) if np.any(state != 2) else 0.0
    for first, last in itertools.pairwise(ends):
        low, high = s[max(first - 1, 0)], s[min(last, len(s) - 1)]
        turns = first > 0 and last < len(s) and {state[first - 1], state[last]} == {1, -1}
        if high - low < max(narrowest * total, least) and not turns:
            state[first:last] = state[first - 1] if first > 0 else state[min(last, len(s) - 1)]
    return state


def _opens(s: Array, opening: Array, state: Index, k: int, outward: int) -> float | None:
    """Return the root of the line through opening^(2/3) in a zone, or None.

    k is the first node of the zone, `outward` the direction to its other nodes.
    """
    nodes = k + outward * np.arange(SKIPPED, FITTED)
    if nodes.min() < 0 or nodes.max() >= len(s) or np.any(state[nodes] != state[k]):
        return None
    values = opening[nodes] ** (2.0 / 3.0)
    if not np.all(np.isfinite(values)) or values[0] <= 0.0 or np.any(np.diff(values) <= 0.0):
        return None
    # fit a line with the least relative deviations
    weight, away = (values[0] / values) ** 2, s[nodes] - s[k]
    weight /= weight.sum()
    middle, mean = weight @ away, weight @ values
    slope = (weight * (away - middle)) @ (values - mean) / (weight @ (away - middle) ** 2)
    return float(s[k] + middle - mean / slope)


def _vanishes(s: Array, values: Array, state: Index, k: int, inward: int) -> float | None:
    """Return the root of the line through the last two nodes of a zone, or None.

    k is the last node, `inward` the direction to the other one.
    """
    next_node = k + inward
    if (
        not 0 <= next_node < len(s)
        or state[next_node] != state[k]
        or values[next_node] <= values[k]
    ):
        return None
    return float(s[k] - (s[next_node] - s[k]) * values[k] / (values[next_node] - values[k]))


def _half_width(s: Array, closed: Array, k: int) -> float:
    first = last = k
    while first > 0 and closed[first - 1]:
        first -= 1
    while last + 1 < len(s) and closed[last + 1]:
        last += 1
    return max(0.5 * float(s[last] - s[first]), float(np.diff(s).min()))


def merged(
    candidates: list[Edge], smallest: float, kept: Sequence[Edge] = (), finest: float = 0.0
) -> list[Edge]:
    """Return the kept edges and those of the others that are not too close, by arc length.

    An edge is dropped unless it `is_apart` from the result.
    """
    result = list(kept)
    for edge in sorted(candidates, key=lambda e: e.s):
        if is_apart(edge, result, smallest, finest):
            result.append(edge)
    return sorted(result, key=lambda e: e.s)


def is_apart(edge: Edge, others: Sequence[Edge], smallest: float, finest: float) -> bool:
    """Return whether an edge is farther from all others than three of their smallest elements."""
    return all(
        abs(edge.s - other.s) > 3.0 * max(smallest * min(edge.width, other.width), finest)
        for other in others
    )


def zone_at(old_s: Array, old: Index, zone_edges: list[Edge], new_s: Array) -> Index:
    """Return the zones' values (n,) at new positions.

    Each value is that of the nearest old node between the same edges.
    """
    borders = np.array([edge.s for edge in zone_edges])
    if len(borders) == 0:
        return np.asarray(old[np.abs(old_s[None] - new_s[:, None]).argmin(axis=1)])
    zone, asked = np.searchsorted(borders, old_s), np.searchsorted(borders, new_s)
    apart = np.abs(old_s[None] - new_s[:, None])
    apart = np.where(zone[None] == asked[:, None], apart, np.inf)
    empty = ~np.isfinite(apart).any(axis=1)
    apart[empty] = np.abs(old_s[None] - new_s[empty, None])
    return np.asarray(old[apart.argmin(axis=1)])
