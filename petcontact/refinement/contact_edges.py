"""Edges of contact and of stick along an interface, by extrapolation, and what lies between them.

Next to the edge of a contact the gap opens like d^(3/2), d the distance, and p vanishes like the
root of d; next to the edge of a stick zone |δw| and µp - |q| do the same. Those of their powers
that are linear vanish at the edge. Displacements are the smoother ones: they show it ten times
better than tractions, whose last element is the worst of all.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Index
from ..frozen import frozen

SPECK = 4e-3
"""Zones narrower than this fraction of all that is closed have no edges of their own on coarse
meshes."""
SEEN = 5.0
"""Smallest elements in a zone that has edges on finer ones."""
BACK = 3
"""State of a node that slips the other way than those of state 1."""
SKIPPED, FITTED = 2, 4
"""Nodes next to an edge that do not show it, and those after them that do."""


@frozen
class Edge:
    """Where the state changes along an interface.

    Attributes
    ----------
    s : float
        Arc length along the secondary's part [length].
    width : float
        Half the length of the closed stretch that it belongs to [length].
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
    """Edges between nodes of different states, or that slip different ways.

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
        Elements at edges, over half the width of their contact: zones of a few of them have edges,
        but none below SPECK.
    finest : float
        What no element there is smaller than [length].
    """
    if not len(s):  # a side that faces nothing
        return []
    state = np.where((state == 1) & (shear > 0.0), BACK, state)
    state = _without_specks(s, state, min(SPECK, SEEN * smallest), SEEN * finest)
    closed = state != 2
    found = []
    for k in np.flatnonzero(np.diff(state)):
        low, high = float(s[k]), float(s[k + 1])
        if {state[k], state[k + 1]} == {1, BACK}:
            found.append(
                Edge(low + (high - low) * _share(moved[k], moved[k + 1]), _half_width(s, closed, k))
            )
            continue
        if 2 in (state[k], state[k + 1]):
            opening, values, inward = gap, pressure, (-1 if closed[k] else 1)
        else:
            opening, values, inward = moved, bound - np.abs(shear), (-1 if state[k] == 0 else 1)
        inner, outer = (k, k + 1) if inward < 0 else (k + 1, k)
        reach = high - low
        places = (
            _opens(s, np.abs(opening), state, outer, -inward),
            _vanishes(s, values**2, state, inner, inward),
        )
        near = [
            place for place in places if place is not None and low - reach <= place <= high + reach
        ]
        found.append(Edge(near[0] if near else 0.5 * (low + high), _half_width(s, closed, inner)))
    return found


def _share(first: float, last: float) -> float:
    """Where between two places the line through values of different signs vanishes, from 0 to 1."""
    return abs(first) / (abs(first) + abs(last)) if first * last < 0.0 else 0.5


def _without_specks(s: Array, state: Index, narrowest: float, least: float) -> Index:
    """States in which zones much narrower than the contact have the state before them: next to a
    singular corner single nodes may have any, and corners are graded anyway. A zone that sticks
    between two that slip opposite ways is kept."""
    state = state.copy()
    ends = [0, *(np.flatnonzero(np.diff(state)) + 1).tolist(), len(state)]
    total = float(s[state != 2][-1] - s[state != 2][0]) if np.any(state != 2) else 0.0
    for first, last in itertools.pairwise(ends):
        low, high = s[max(first - 1, 0)], s[min(last, len(s) - 1)]
        turns = first > 0 and last < len(s) and {state[first - 1], state[last]} == {1, BACK}
        if high - low < max(narrowest * total, least) and not turns:
            state[first:last] = state[first - 1] if first > 0 else state[min(last, len(s) - 1)]
    return state


def _opens(s: Array, opening: Array, state: Index, k: int, outward: int) -> float | None:
    """Where the line through opening^(2/3) in a zone vanishes; k is its first node, `outward` the
    way to the others."""
    nodes = k + outward * np.arange(SKIPPED, SKIPPED + FITTED)
    if nodes.min() < 0 or nodes.max() >= len(s) or np.any(state[nodes] != state[k]):
        return None
    values = opening[nodes] ** (2.0 / 3.0)
    if not np.all(np.isfinite(values)) or values[0] <= 0.0 or np.any(np.diff(values) <= 0.0):
        return None
    # the line of least relative deviations
    weight, away = (values[0] / values) ** 2, s[nodes] - s[k]
    weight /= weight.sum()
    middle, mean = weight @ away, weight @ values
    slope = (weight * (away - middle)) @ (values - mean) / (weight @ (away - middle) ** 2)
    return float(s[k] + middle - mean / slope)


def _vanishes(s: Array, values: Array, state: Index, k: int, inward: int) -> float | None:
    """Where the line through the last two nodes of a zone vanishes; k is the last one, `inward` the
    way to the other."""
    other = k + inward
    if not 0 <= other < len(s) or state[other] != state[k] or values[other] <= values[k]:
        return None
    return float(s[k] - (s[other] - s[k]) * values[k] / (values[other] - values[k]))


def _half_width(s: Array, closed: Array, k: int) -> float:
    first = last = k
    while first > 0 and closed[first - 1]:
        first -= 1
    while last + 1 < len(s) and closed[last + 1]:
        last += 1
    return max(0.5 * float(s[last] - s[first]), float(np.diff(s).min()))


def merged(
    found: list[Edge], smallest: float, kept: Sequence[Edge] = (), finest: float = 0.0
) -> list[Edge]:
    """Edges by arc length, those that are kept and of the others all that are not closer to one
    before them than three of their smallest elements."""
    result = list(kept)
    for edge in sorted(found, key=lambda e: e.s):
        if all(
            abs(edge.s - other.s) > 3.0 * max(smallest * min(edge.width, other.width), finest)
            for other in result
        ):
            result.append(edge)
    return sorted(result, key=lambda e: e.s)


def zone_at(old_s: Array, old: Index, found: list[Edge], new_s: Array) -> Index:
    """The values (n,) of zones at other places: nodes on one side of an edge are asked on that
    side."""
    borders = np.array([edge.s for edge in found])
    if len(borders) == 0:
        return np.asarray(old[np.abs(old_s[None] - new_s[:, None]).argmin(axis=1)])
    zone, asked = np.searchsorted(borders, old_s), np.searchsorted(borders, new_s)
    apart = np.abs(old_s[None] - new_s[:, None])
    apart = np.where(zone[None] == asked[:, None], apart, np.inf)
    empty = ~np.isfinite(apart).any(axis=1)
    apart[empty] = np.abs(old_s[None] - new_s[empty, None])
    return np.asarray(old[apart.argmin(axis=1)])
