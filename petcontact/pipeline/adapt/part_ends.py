"""Points of contact parts at which tractions may be singular.

There the part ends or has a corner, a corner of the other part presses on it, or the gap has a jump
or a kink.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ...arrays import Array, Index
from ...geometry.outline import Outline, Side
from ...geometry.same_place import TOLERANCE, inside
from ...given.interface_data import PosedInterface
from ...given.lines import lines_of
from ...given.values import Given
from ...mesh.grading import at_ends, singular_ends, turn
from ...mesh.pairs.curve_sides import CurveProjection, curve_projection
from ...mesh.pairs.ray_casting import along
from ...record import field, record
from ...refinement.known_data import SideData
from ...round_off import SINGLE


@record
class PressedSides:
    """Singular points of one body's sides that its contacts cause.

    Attributes
    ----------
    inner : dict of lists by side
        Arc lengths on a side where a corner of another body presses, or the gap jumps [length].
    kinks : dict of lists by side
        Arc lengths where the gap has a kink; tractions have a logarithm there [length].
    pressing : set of (side, end)
        Starts (0) and ends (1) of sides that press on a side of another body. Ends on the axis of
        revolution belong here if the gap has a slope, since its mirror image makes a kink.
    gaps : dict of lists by side
        Distances along a side from the other body of a pair.
    """

    inner: dict[int, list[float]] = field(default_factory=dict)
    kinks: dict[int, list[float]] = field(default_factory=dict)
    pressing: set[tuple[int, int]] = field(default_factory=set)
    gaps: dict[int, list[SideData]] = field(default_factory=dict)


def pressed_sides(
    outlines: Sequence[Outline], sides: Sequence[PosedInterface]
) -> list[PressedSides]:
    """Return the singular points that corners of other parts and rough gaps cause, for each
    body."""
    pressed = [PressedSides() for _ in outlines]
    for side in sides:
        law, own = side.law, (pressed[side.body], outlines[side.body], side.part)
        if law.normal == "unilateral":
            _add_switches(*own, law.gap)
            _add_switches(*own, law.wear_coefficient)
        _add_apex(pressed, outlines, side)
        if side.primary is None or side.periodic:
            continue
        _add_corners(pressed, outlines, side)
    return pressed


def _add_corners(
    pressed: Sequence[PressedSides], outlines: Sequence[Outline], side: PosedInterface
) -> None:
    (a, part), (b, other_part) = side.ends
    pair = curve_projection((a, outlines[a], part), (b, outlines[b], other_part), side.direction)
    for (one, own), (partner, faced), project in (
        (pair.secondary, pair.primary, pair.to_primary),
        (pair.primary, pair.secondary, pair.to_secondary),
    ):
        for number, end, met, fraction in _meeting(outlines[one], own, project):
            if arcs := _inner(outlines[partner], int(faced[met]), fraction):
                pressed[partner].inner.setdefault(int(faced[met]), []).extend(arcs)
                pressed[one].pressing.add((number, end))
    if side.law.normal == "unilateral" and side.law.gap is None:
        _add_distances(pressed[a], outlines[a].sides, pair)


def _add_distances(pressed: PressedSides, sides: Sequence[Side], pair: CurveProjection) -> None:
    """Add the distances along each side of a secondary, with samples on both parts."""
    line, numbers = np.linspace(0.0, 1.0, pair.own.SAMPLES), range(len(pair.other))
    met, fractions = np.hstack([pair.to_secondary(k, line) for k in numbers])
    for k, number in enumerate(pair.secondary[1].tolist()):
        samples = np.union1d(line, fractions[met == k])
        values = functools.partial(_distance, pair, k)
        shown = np.empty((2, 0)), samples, values(samples)
        gap = SideData("distance", values, *shown, 1.0, sides[number].length)
        pressed.gaps.setdefault(number, []).append(gap)


def _distance(pair: CurveProjection, side: int, fractions: Array) -> Array:
    """Return the distance from the primary at fractions of a side, nan for none, (n, 1)
    [length]."""
    x, normal = pair.own.at(np.full(len(fractions), side), fractions)
    distance = pair.other.cast(x, along(pair.direction, normal)).distance
    return np.where(np.isfinite(distance), distance, np.nan)[:, None]


def _meeting(
    outline: Outline, own: Index, project: Callable[[int, Array], tuple[Index, Array]]
) -> Iterator[tuple[int, int, int, Array]]:
    """Yield the corners of a part that meet the other part: side, end, the side there, and the
    fraction."""
    corners = singular_ends(outline)
    for k, number in enumerate(own.tolist()):
        met, fraction = project(k, np.array([0.0, 1.0]))
        for end in np.flatnonzero((met >= 0) & corners[number]).tolist():
            yield number, end, int(met[end]), fraction[end : end + 1]


def _inner(outline: Outline, side: int, fractions: Array) -> list[float]:
    """Return the arc lengths of fractions of a side that do not coincide with its ends [length]."""
    length = outline.sides[side].length
    return list(inside(fractions * length, TOLERANCE * outline.diameter, length).tolist())


def _add_apex(
    pressed: Sequence[PressedSides], outlines: Sequence[Outline], side: PosedInterface
) -> None:
    """Add the ends of both parts on the axis of revolution if the gap has a slope there."""
    ends = [
        (b, k, end)
        for b, part in side.ends
        for k, end in outlines[b].axis_ends
        if outlines[b].sides[k].part == part
    ]
    if side.law.gap is None:
        slopes = [abs(at_ends(outlines[b], turn)[k][end]) for b, k, end in ends]
    else:
        slopes = [
            abs(lines_of(outlines[b])[k].slope(side.law.gap, end, 1 - 2 * end))
            for b, k, end in ends
            if b == side.body
        ]
    if max(slopes, default=0.0) > SINGLE:
        for b, k, end in ends:
            pressed[b].pressing.add((k, end))


def _add_switches(pressed: PressedSides, outline: Outline, part: str, datum: Given | None) -> None:
    """Add where a gap, or the wear that opens it, has kinks and jumps along a part."""
    for k, line in enumerate(lines_of(outline)):
        if line.side.part == part:
            rough = line.switches(datum)
            for arcs, fractions in zip((pressed.kinks, pressed.inner), rough, strict=True):
                arcs.setdefault(k, []).extend(_inner(outline, k, fractions))


def singular_places(outline: Outline, part: str, pressed: PressedSides) -> Array:
    """Return the arc lengths along a part at its ends, its corners and corners that press on it
    [length].

    They increase.
    """
    arcs = []
    for k, (side, start, ends) in enumerate(
        zip(outline.sides, outline.offsets, singular_ends(outline), strict=True)
    ):
        if side.part == part:
            arcs += [
                start + s for s, corner in zip((0.0, side.length), ends, strict=True) if corner
            ]
            arcs += [start + s for s in pressed.inner.get(k, [])]
    return np.unique(arcs)
