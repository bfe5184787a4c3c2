"""Where parts in contact end or turn a corner, and where the corners of the other part of a pair
press on them, or a gap jumps or has a kink."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field

import numpy as np

from ...arrays import Array, Index
from ...frozen import frozen
from ...geometry.outline import Outline
from ...geometry.same_place import TOLERANCE, inside
from ...mesh.grading import at_ends, singular_ends, turn
from ...mesh.pairs.curve_sides import curve_projection
from ...model.interfaces import PosedInterface
from ...refinement.known_data import gap_slope, gap_switches
from ...round_off import SINGLE


@frozen
class PressedSides:
    """Of one body.

    Attributes
    ----------
    inner : dict of lists by side
        Arc lengths along a side at which a corner of another body presses on it, or the gap jumps
        [length].
    kinks : dict of lists by side
        The same where the gap has a kink: tractions have a logarithm [length].
    pressing : set of (side, end)
        Starts (0) and ends (1) of sides that press on a side of another body, or at which on the
        axis of revolution the gap has a slope: it goes on beyond as its own image, with a kink.
    """

    inner: dict[int, list[float]] = field(default_factory=dict)
    kinks: dict[int, list[float]] = field(default_factory=dict)
    pressing: set[tuple[int, int]] = field(default_factory=set)


def pressed_sides(
    outlines: Sequence[Outline], sides: Sequence[PosedInterface]
) -> list[PressedSides]:
    """Of each body, where the corners of parts meet the sides of the other part of their pair, and
    where gaps are rough."""
    found = [PressedSides() for _ in outlines]
    for side in sides:
        if side.law.normal == "unilateral" and side.law.gap != "geometry":
            _add_switches(found[side.body], outlines[side.body], side)
        _add_apex(found, outlines, side)
        if side.primary is None or side.periodic:
            continue
        _add_corners(found, outlines, side)
    return found


def _add_corners(
    found: Sequence[PressedSides], outlines: Sequence[Outline], side: PosedInterface
) -> None:
    (a, part), (b, other) = side.ends
    pair = curve_projection((a, outlines[a], part), (b, outlines[b], other), side.direction)
    for (one, own), (partner, faced), project in (
        (pair.secondary, pair.primary, pair.to_primary),
        (pair.primary, pair.secondary, pair.to_secondary),
    ):
        for number, end, met, place in _meeting(outlines[one], own, project):
            if at := _inner(outlines[partner], int(faced[met]), place):
                found[partner].inner.setdefault(int(faced[met]), []).extend(at)
                found[one].pressing.add((number, end))


def _meeting(
    outline: Outline, own: Index, project: Callable[[int, Array], tuple[Index, Array]]
) -> Iterator[tuple[int, int, int, Array]]:
    """Sides and ends at which corners meet a side of the other part, its number there, and where
    on it."""
    corners = singular_ends(outline)
    for k, number in enumerate(own.tolist()):
        met, place = project(k, np.array([0.0, 1.0]))
        for end in np.flatnonzero((met >= 0) & corners[number]).tolist():
            yield number, end, int(met[end]), place[end : end + 1]


def _inner(outline: Outline, side: int, fractions: Array) -> list[float]:
    """Arc lengths of places of a side that are not one with its ends [length]."""
    length = outline.sides[side].length
    return list(inside(fractions * length, TOLERANCE * outline.diameter, length).tolist())


def _add_apex(
    found: Sequence[PressedSides], outlines: Sequence[Outline], side: PosedInterface
) -> None:
    """Ends of both parts on the axis, if the gap has a slope there."""
    ends = [(b, k, end) for b, part in side.ends for k, end in _axis_ends(outlines[b], part)]
    if side.law.gap == "geometry":
        slopes = [abs(at_ends(outlines[b], turn)[k][end]) for b, k, end in ends]
    else:
        slopes = [
            gap_slope(side.law.gap, outlines[b].sides[k], outlines[b].offsets[k], end)
            for b, k, end in ends
            if b == side.body
        ]
    if max(slopes, default=0.0) > SINGLE:
        for b, k, end in ends:
            found[b].pressing.add((k, end))


def _axis_ends(outline: Outline, part: str) -> list[tuple[int, int]]:
    return [(k, end) for k, end in outline.axis_ends if outline.sides[k].part == part]


def _add_switches(found: PressedSides, outline: Outline, side: PosedInterface) -> None:
    for k, (each, offset) in enumerate(zip(outline.sides, outline.offsets, strict=True)):
        if each.part == side.part:
            rough = gap_switches(side.law.gap, each, offset)
            for places, at in zip((found.kinks, found.inner), rough, strict=True):
                places.setdefault(k, []).extend(_inner(outline, k, at))


def singular_places(outline: Outline, part: str, pressed: PressedSides) -> Array:
    """Arc lengths along a part at which it ends, has a corner, or a corner presses on it,
    increasing [length]."""
    places = []
    for k, (side, start, ends) in enumerate(
        zip(outline.sides, outline.offsets, singular_ends(outline), strict=True)
    ):
        if side.part == part:
            places += [
                start + at for at, corner in zip((0.0, side.length), ends, strict=True) if corner
            ]
            places += [start + at for at in pressed.inner.get(k, [])]
    return np.unique(places)
