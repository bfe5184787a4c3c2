"""Where parts in contact end or turn a corner, and where the corners of the other part of a pair
press on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np

from ...arrays import Array
from ...frozen import frozen
from ...geometry.outline import Outline
from ...mesh.grading import singular_ends
from ...mesh.pairs.curve_sides import curve_projection
from ...model.interfaces import PosedInterface

AT_END = 1e-6
"""Distance from the ends of a side, relative to it, below which a corner faces that end and not the
side."""


@frozen
class PressedSides:
    """Of one body.

    Attributes
    ----------
    inner : dict of lists by side
        Arc lengths along a side at which a corner of another body presses on it [length].
    pressing : set of (side, end)
        Starts (0) and ends (1) of sides that press on a side of another body.
    """

    inner: dict[int, list[float]] = field(default_factory=dict)
    pressing: set[tuple[int, int]] = field(default_factory=set)


def pressed_sides(
    outlines: Sequence[Outline], sides: Sequence[PosedInterface]
) -> list[PressedSides]:
    """Of each body, where the corners of parts meet the sides of the other part of their pair."""
    found = [PressedSides() for _ in outlines]
    for side in sides:
        if side.primary is None or side.periodic:
            continue
        a, (b, other) = side.body, side.primary
        pair = curve_projection(
            (a, outlines[a], side.part), (b, outlines[b], other), side.direction
        )
        ways = (
            (pair.secondary, pair.primary, pair.to_primary),
            (pair.primary, pair.secondary, pair.to_secondary),
        )
        for (one, own), (partner, faced), project in ways:
            corners = singular_ends(outlines[one])
            for k, number in enumerate(own.tolist()):
                met, place = project(k, np.array([0.0, 1.0]))
                for end in (0, 1):
                    if (
                        corners[number][end]
                        and met[end] >= 0
                        and AT_END < place[end] < 1.0 - AT_END
                    ):
                        target = int(faced[met[end]])
                        at = float(place[end]) * outlines[partner].sides[target].length
                        found[partner].inner.setdefault(target, []).append(at)
                        found[one].pressing.add((number, end))
    return found


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
