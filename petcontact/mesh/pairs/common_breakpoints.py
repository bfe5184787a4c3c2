"""Joints that two facing parts have in common: the primary takes those of the secondary, and gives
back its corners.

Whatever is cut into elements along a line is a side: the sides of an outline, the two directions of
a box's face.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...arrays import Array, Index, Mask
from ...geometry.same_place import distinct

GROWTH = 2.5
"""Ratio of neighbouring elements of the primary from where the secondary ends."""


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
        Distance within which joints are one, as a fraction of the side.
    """

    breaks: Array
    order: Index
    within: float


class Projection(Protocol):
    """Which joints of the two parts of a pair face one another.

    Attributes
    ----------
    secondary, primary : (int, array)
        Number of the body, and of those of its sides that belong to the part.
    """

    @property
    def secondary(self) -> tuple[int, Index]: ...
    @property
    def primary(self) -> tuple[int, Index]: ...

    def to_primary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Which of the primary's sides joints of one of the secondary's meet, -1 for none, and at
        which fractions."""
        ...

    def to_secondary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """From which of the secondary's sides joints of one of the primary's come."""
        ...


Imposed = dict[tuple[int, int], Array]
"""Fractions that a side, by the numbers of body and side, has to have."""


def match(
    meshes: list[list[SideMesh]], pairs: list[Projection], imposed: Imposed | None = None
) -> None:
    """Give the primaries the joints of their secondaries, in place; joints that a primary cannot do
    without, and those imposed on it, go back."""
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
    """Joints that a body's sides have of their own inside the chosen elements of all sides that are
    cut in another way."""
    found, first = dict[tuple[int, int], Array](), 0
    for side, (old, new) in enumerate(zip(own, cut, strict=True)):
        mine = chosen[first : first + len(new.order)]
        first += len(new.order)
        inside = np.searchsorted(new.breaks, old.breaks[1:-1]) - 1
        if (kept := old.breaks[1:-1][mine[inside]]).size:
            found[body, side] = kept
    return found


def _carry_back(meshes: list[list[SideMesh]], pair: Projection, imposed: Imposed) -> None:
    """Corners of the primary, and what other pairs impose on it, become joints of the secondary."""
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


def _carry_over(meshes: list[list[SideMesh]], pair: Projection, imposed: Imposed) -> None:
    """The joints of the secondary become those of the primary where they face one another."""
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
    """Stretches that nothing faces keep their own joints, graded from the size of the faced element
    beside them."""
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
    """Distances from an end at which elements that grow from the size `first` meet, in the nearer
    half of `length`."""
    steps, size, reach = list[float](), GROWTH * first, 0.0
    while size < 0.7 * largest and reach + size < 0.5 * length:
        reach += size
        steps.append(reach)
        size *= GROWTH
    return np.array(steps)


def _take_orders(meshes: list[list[SideMesh]], pair: Projection) -> None:
    """Elements of the primary take the order of the one that they face."""
    (a, a_sides), (b, b_sides) = pair.secondary, pair.primary
    for k, side in enumerate(b_sides):
        mesh = meshes[b][side]
        met, fractions = pair.to_secondary(k, 0.5 * (mesh.breaks[1:] + mesh.breaks[:-1]))
        order = mesh.order.copy()
        for number in np.unique(met[met >= 0]):
            mine = met == number
            order[mine] = _orders_at(meshes[a][a_sides[number]], fractions[mine])
        meshes[b][side] = SideMesh(mesh.breaks, order, mesh.within)


def with_joints(side: SideMesh, needed: Array) -> SideMesh:
    """A side with further joints; its own give way where they are close, but not its ends."""
    old = side.breaks
    size = np.minimum(np.append(np.diff(old), np.inf), np.insert(np.diff(old), 0, np.inf))
    around = np.concatenate([[-np.inf], np.sort(needed), [np.inf]])
    place = np.searchsorted(around, old)
    apart = np.minimum(old - around[place - 1], around[place] - old)
    # a joint that is closer to one that the primary needs gives way
    kept = old[(apart > 0.3 * size) | (old == 0.0) | (old == 1.0)]
    return _recut(side, np.union1d(kept, needed))


def _recut(side: SideMesh, breaks: Array) -> SideMesh:
    """The side with other joints, and the orders that it had there."""
    return SideMesh(breaks, _orders_at(side, 0.5 * (breaks[1:] + breaks[:-1])), side.within)


def _orders_at(side: SideMesh, middle: Array) -> Index:
    """Orders (n,) of a side's elements at the middles of others (n,)."""
    return np.asarray(
        side.order[np.clip(np.searchsorted(side.breaks, middle) - 1, 0, len(side.order) - 1)]
    )
