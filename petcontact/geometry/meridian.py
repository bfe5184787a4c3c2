"""Bodies of revolution by half of their section through the axis: x is r >= 0, y is z."""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array, Index, shown
from ..errors import InputError
from ..record import field, record, replace
from ..round_off import WRITTEN
from .outline import Outline, Side


@record
class Meridian(Outline):
    """The outline of a body of revolution without what lies on the axis: chains of sides.

    A chain is a whole loop, or it begins and ends on the axis. What asks for the shape of the body
    is answered by its section.

    Attributes
    ----------
    section : Outline
        The closed half section, sides on the axis among its own.
    """

    section: Outline = field(kw_only=True)

    def __post_init__(self) -> None:
        """The section has been checked."""

    @property
    def around(self) -> tuple[tuple[Side, ...], ...]:
        """The loops of the section."""
        return self.section.loops

    @functools.cached_property
    def neighbours(self) -> tuple[Index, Index]:
        """As of `Outline`; a side that begins or ends on the axis is its own neighbour there."""
        before, after = (numbers.copy() for numbers in super().neighbours)
        ends = np.cumsum([len(loop) for loop in self.loops])
        for loop, end in zip(self.loops, ends.tolist(), strict=True):
            if not np.array_equal(loop[-1].end, loop[0].start):
                before[end - len(loop)], after[end - 1] = end - len(loop), end - 1
        return before, after

    @property
    def axis_ends(self) -> list[tuple[int, int]]:
        """Ends of its sides on the axis, see `Outline.axis_ends`."""
        own = np.arange(len(self.sides))
        return [
            (k, end)
            for end, beside in enumerate(self.neighbours)
            for k in np.flatnonzero(beside == own).tolist()
        ]

    def beyond(self, loop: tuple[Side, ...]) -> tuple[Side, Side]:
        """As of `Outline`; the images of the sides that begin and end on the axis."""
        if np.array_equal(loop[-1].end, loop[0].start):
            return super().beyond(loop)
        return _image(loop[0]), _image(loop[-1])


@record
class TwistedMeridian(Meridian):
    """The half section of a body that also turns about its axis."""

    components = 3


def meridian(section: Outline, *, twisted: bool = False) -> Meridian:
    """The outline of the body of revolution that half of a section, in r >= 0, stands for, with
    torsion or without.

    Raises
    ------
    InputError
        If a side crosses the axis, touches it between its ends, or nothing of the outline lies off
        the axis.
    """
    least = WRITTEN * section.diameter
    loops = tuple(
        tuple(
            replace(side, start=_snapped(side.start, least), end=_snapped(side.end, least))
            for side in loop
        )
        for loop in section.loops
    )
    chains = [chain for loop in loops for chain in _chains(loop, least)]
    kind = TwistedMeridian if twisted else Meridian
    return kind(tuple(chains), section.exterior, section=replace(section, loops=loops))


def _snapped(point: Array, least: float) -> Array:
    return np.array([0.0, point[1]]) if abs(point[0]) <= least else point


def _chains(loop: tuple[Side, ...], least: float) -> list[tuple[Side, ...]]:
    """The sides of a loop off the axis, cut where it runs along the axis."""
    on_axis = [side.curvature == 0.0 and side.start[0] == side.end[0] == 0.0 for side in loop]
    for side, on in zip(loop, on_axis, strict=True):
        points = side.point(np.linspace(0.0, 1.0, 129)[1:-1])
        nearest = points[np.argmin(points[:, 0])]
        worst = min((side.start, side.end, nearest), key=lambda point: float(point[0]))
        if not on and (worst[0] < 0.0 or nearest[0] <= least):
            what = "has r < 0" if worst[0] < 0.0 else "touches the axis between its ends"
            raise InputError(
                f"geometry: side {side.part!r} {what} at {shown(worst)}; with symmetry = "
                f'"axial" x is the distance r >= 0 from the axis x = 0'
            )
    if not any(on_axis):
        return [loop]
    first = on_axis.index(True)
    chains: list[list[Side]] = []
    for side, on in zip(
        loop[first:] + loop[:first], on_axis[first:] + on_axis[:first], strict=True
    ):
        if on:
            chains.append([])
        else:
            chains[-1].append(side)
    return [tuple(chain) for chain in chains if chain]


def _image(side: Side) -> Side:
    """The side beyond the axis, the body on its left."""
    start, end = (np.array([-1.0, 1.0]) * point for point in (side.end, side.start))
    return Side(start, end, side.part, side.curvature)
