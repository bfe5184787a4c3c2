"""First points of contact: the smallest values of a gap along a side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..arrays import Array
from ..geometry.outline import Outline
from ..geometry.same_place import distinct
from ..given.features import SAMPLES
from ..round_off import HALF, ROUNDED
from .known_data import SideData

MOST_MINIMA = 4
"""Largest number of minima on one part to which meshes are graded; the lowest ones are taken."""


def lowest_minima(
    outline: Outline,
    gaps: Sequence[Sequence[SideData]],
    corners: Sequence[tuple[bool, bool]],
    within: float,
) -> list[list[float]]:
    """Return the arc lengths of the `MOST_MINIMA` lowest minima on each part, by side [length].

    An end of a side is one where both sides that meet there, or one and its image on the axis, have
    a minimum and no corner.

    Parameters
    ----------
    outline : Outline
    gaps : sequences of SideData, one a side
    corners : sequence of pairs of bool
        Whether the start and the end of each side are corners.
    within : float
        Distance over the side within which places are one [-].
    """
    noise = ROUNDED * max(float(np.abs(side.start).max()) for side in outline.sides)
    minima = sorted(_minima(gaps, within, noise))
    seen = {(number, place) for _, place, number in minima}
    result, left = [list[float]() for _ in gaps], dict.fromkeys(outline.parts, MOST_MINIMA)
    for _, place, number in minima:
        beside, part = int(outline.neighbours[int(place)][number]), outline.sides[number].part
        opposite = (beside, place if beside == number else 1.0 - place)
        corner = corners[number][int(place)] or opposite not in seen
        if left[part] and not (corner and place in (0.0, 1.0)):
            result[number].append(outline.sides[number].length * place)
            left[part] -= 1
    return result


def _minima(
    gaps: Sequence[Sequence[SideData]], within: float, noise: float
) -> Iterator[tuple[float, float, int]]:
    """Yield the gap, the fraction and the number of the side of each minimum of `gap_minima`."""
    for number, row in enumerate(gaps):
        for gap in row:
            places = distinct(gap_minima(gap, noise), within, 1.0)
            values = gap.values(places)[:, 0].tolist()
            yield from zip(values, places.tolist(), [number] * len(values), strict=True)


def gap_minima(field: SideData, noise: float) -> Array:
    """Return the `MOST_MINIMA` lowest minima of a gap along a side, as increasing fractions.

    An end is one where the gap rises from it. Samples of the interval around each minimum leave two
    of its parts, until these are as short as a minimum is known (`HALF`). All minima are evaluated
    together.

    Parameters
    ----------
    field : SideData
        The gap along the side, nan where nothing is opposite. Its samples resolve every minimum.
    noise : float
        Round-off of the gap [length].
    """
    fractions, gap = field.samples, field.sampled[:, 0]
    rise = np.pad(np.diff(gap), 1)
    falls, rises = rise[:-1] < -noise, rise[1:] > noise
    # the ends of an interval of equal values are minima, too; comparisons with nan are false
    flat = (rise[:-1] <= noise) & (rise[1:] >= -noise)
    minima = np.flatnonzero(flat & (falls | rises))
    minima = minima[np.argsort(gap[minima], kind="stable")][:MOST_MINIMA]
    low, high = fractions[np.maximum(minima - 1, 0)], np.append(fractions, 1.0)[minima + 1]
    share = np.arange(1, SAMPLES)[:, None] / SAMPLES
    while (high - low).max(initial=0.0) > HALF:
        width = high - low
        inside = field.values((low + share * width).ravel())[:, 0].reshape(SAMPLES - 1, -1)
        best = np.nan_to_num(inside, nan=np.inf).argmin(axis=0)
        low, high = low + best * width / SAMPLES, low + (best + 2) * width / SAMPLES
    return np.asarray(np.unique(0.5 * (low + high)))
