"""Common joints of two facing parts.

The primary takes the joints of the secondary, and gives its corners to the secondary. A side is
whatever is cut into elements along a line: a side of an outline, or a direction of a box's face.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...arrays import Array, Index, Mask
from ...geometry.same_place import distinct

GROWTH = 2.5
"""Ratio of neighbouring elements of the primary beyond the end of the secondary [-]."""


@dataclass
class SideMesh:
    """Joints of one side while meshes are being matched.

    Attributes
    ----------
    breaks : (n + 1,) array
        Fractions of the side, from 0 to 1.
    order : (n,) array
        Orders of its elements.
    within : float
        Distance within which joints count as one, as a fraction of the side.
    """

    breaks: Array
    order: Index
    within: float


class PartProjection(Protocol):
    """Projection of joints between the two parts of a pair.

    Attributes
    ----------
    secondary, primary : (int, array)
        Number of the body, and numbers of its sides that belong to the part.
    """

    @property
    def secondary(self) -> tuple[int, Index]: ...
    @property
    def primary(self) -> tuple[int, Index]: ...

    def to_primary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Return the primary's sides and fractions that joints of a side of the secondary meet, -1
        for none."""
        ...

    def to_secondary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Return the secondary's sides and fractions from which joints of the primary come."""
        ...


Imposed = dict[tuple[int, int], Array]
"""Fractions that a side must have, by the numbers of its body and of the side."""


def match(
    meshes: list[list[SideMesh]], pairs: list[PartProjection], imposed: Imposed | None = None
) -> None:
    """Give the primaries the joints of their secondaries, in place.

    Joints that a primary needs, and those imposed on it, are given to the secondary.
    """
    imposed = {} if imposed is None else imposed
    for _ in range(4):
        before = [side for sides in meshes for side in sides]
        for pair in pairs:
            _carry_back(meshes, pair, imposed)
            _carry_over(meshes, pair, imposed)
        after = (side for sides in meshes for side in sides)
        if all(
            a.breaks.shape == b.breaks.shape and np.abs(a.breaks - b.breaks).max() <= b.within
            for a, b in zip(before, after, strict=True)
        ):
            break
    for pair in pairs:
        _take_orders(meshes, pair)


def joints_within(body: int, own: list[SideMesh], cut: list[SideMesh], chosen: Mask) -> Imposed:
    """Return a body's own joints inside the chosen elements of all its sides, which are cut
    otherwise."""
    kept_joints, first = dict[tuple[int, int], Array](), 0
    for side, (old, new) in enumerate(zip(own, cut, strict=True)):
        on_side = chosen[first : first + len(new.order)]
        first += len(new.order)
        inside = np.searchsorted(new.breaks, old.breaks[1:-1]) - 1
        if (kept := old.breaks[1:-1][on_side[inside]]).size:
            kept_joints[body, side] = kept
    return kept_joints


def _carry_back(meshes: list[list[SideMesh]], pair: PartProjection, imposed: Imposed) -> None:
    """Add corners of the primary, and joints imposed on it, to the secondary."""
    (a, a_sides), (b, b_sides) = pair.secondary, pair.primary
    for k, side in enumerate(b_sides):
        needed = np.union1d([0.0, 1.0], imposed.get((b, int(side)), np.empty(0)))
        met, fractions = pair.to_secondary(k, needed)
        for number in np.unique(met[met >= 0]):
            target = int(a_sides[number])
            key = (a, target)
            imposed[key] = distinct(
                np.concatenate([imposed.get(key, np.empty(0)), fractions[met == number]]),
                meshes[a][target].within,
                1.0,
            )
            meshes[a][target] = with_joints(meshes[a][target], imposed[key])


def _carry_over(meshes: list[list[SideMesh]], pair: PartProjection, imposed: Imposed) -> None:
    """Add the joints of the secondary to the primary where they face one another."""
    (a, a_sides), (b, b_sides) = pair.secondary, pair.primary
    hits = [pair.to_primary(j, meshes[a][side].breaks) for j, side in enumerate(a_sides)]
    met, fractions = (np.concatenate(values) for values in zip(*hits, strict=True))
    for k, side in enumerate(b_sides):
        key = (b, int(side))
        old = meshes[b][side]
        given = distinct(
            np.concatenate([imposed.get(key, np.empty(0)), fractions[met == k]]), old.within, 1.0
        )
        if len(given) == 0:
            continue
        imposed[key] = given

        def faced(fraction: Array, k: int = k) -> Mask:
            return np.asarray(pair.to_secondary(k, fraction)[0] >= 0)

        breaks = np.union1d([0.0, 1.0], given)
        kept = old.breaks[1:-1][~faced(old.breaks[1:-1])]
        breaks = _filled(breaks, kept, faced(0.5 * (breaks[1:] + breaks[:-1])), old.within)
        meshes[b][side] = _recut(old, breaks)


def _filled(breaks: Array, own: Array, faced: Mask, within: float) -> Array:
    """Return joints in which intervals without an opposite side keep their own ones.

    These are graded from the size of the neighbouring matched element.
    """
    size = np.where(faced, np.diff(breaks), np.inf)
    pieces = [breaks]
    for k in np.flatnonzero(~faced):
        low, high = float(breaks[k]), float(breaks[k + 1])
        inner = own[(own > low) & (own < high)]
        largest = float(np.diff(np.concatenate([[low], inner, [high]])).max())
        up = _growing(float(size[k - 1]) if k > 0 else np.inf, high - low, largest)
        down = _growing(float(size[k + 1]) if k + 1 < len(size) else np.inf, high - low, largest)
        # own joints begin where elements are as large as theirs
        first = low + (1.5 * up[-1] if len(up) else 0.0)
        last = high - (1.5 * down[-1] if len(down) else 0.0)
        pieces += [low + up, high - down, inner[(inner > first) & (inner < last)]]
    return distinct(np.concatenate(pieces), within, 1.0)


def _growing(first: float, length: float, largest: float) -> Array:
    """Return distances from an end to the ends of elements that grow from the size `first`.

    They fill the nearer half of `length`.
    """
    steps, size, reach = list[float](), GROWTH * first, 0.0
    while size < 0.7 * largest and reach + size < 0.5 * length:
        reach += size
        steps.append(reach)
        size *= GROWTH
    return np.array(steps)


def _take_orders(meshes: list[list[SideMesh]], pair: PartProjection) -> None:
    """Give elements of the primary the order of the opposite element."""
    (a, a_sides), (b, b_sides) = pair.secondary, pair.primary
    for k, side in enumerate(b_sides):
        mesh = meshes[b][side]
        met, fractions = pair.to_secondary(k, 0.5 * (mesh.breaks[1:] + mesh.breaks[:-1]))
        order = mesh.order.copy()
        for number in np.unique(met[met >= 0]):
            facing = met == number
            order[facing] = _orders_at(meshes[a][a_sides[number]], fractions[facing])
        meshes[b][side] = SideMesh(mesh.breaks, order, mesh.within)


def with_joints(side: SideMesh, needed: Array) -> SideMesh:
    """Return a side with further joints; its own ones, except its ends, give way if they are
    close."""
    old = side.breaks
    size = np.minimum(np.append(np.diff(old), np.inf), np.insert(np.diff(old), 0, np.inf))
    around = np.concatenate([[-np.inf], np.sort(needed), [np.inf]])
    place = np.searchsorted(around, old)
    apart = np.minimum(old - around[place - 1], around[place] - old)
    # a joint that is closer to one that the primary needs gives way
    kept = old[(apart > 0.3 * size) | (old == 0.0) | (old == 1.0)]
    return _recut(side, np.union1d(kept, needed))


def _recut(side: SideMesh, breaks: Array) -> SideMesh:
    """Return the side with other joints and its orders there."""
    return SideMesh(breaks, _orders_at(side, 0.5 * (breaks[1:] + breaks[:-1])), side.within)


def _orders_at(side: SideMesh, middle: Array) -> Index:
    """Return the orders (n,) of a side's elements at given positions (n,)."""
    return np.asarray(
        side.order[np.clip(np.searchsorted(side.breaks, middle) - 1, 0, len(side.order) - 1)]
    )
