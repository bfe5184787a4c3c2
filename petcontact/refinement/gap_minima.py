"""First points of contact: the smallest values of a gap along a side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..geometry.outline import Outline
from ..geometry.same_place import distinct
from ..round_off import HALF
from .expression_features import SAMPLES

MOST_MINIMA = 4
"""Largest number of minima on one part to which meshes are graded; the lowest ones are taken."""


@dataclass(frozen=True)
class SideGap:
    """A gap along one side.

    Attributes
    ----------
    values : callable
        Function from fractions (n,) of the side to the gap (n,), not a number where nothing is
        opposite [length].
    samples : (n,) array
        Increasing fractions between which the gap has one minimum at most.
    noise : float
        Round-off of the gap [length].
    """

    values: Callable[[Array], Array]
    samples: Array
    noise: float = 0.0


def lowest_minima(
    outline: Outline,
    gaps: Sequence[Sequence[SideGap]],
    corners: Sequence[tuple[bool, bool]],
    within: float,
) -> list[list[float]]:
    """Return the arc lengths of the `MOST_MINIMA` lowest minima on each part, by side [length].

    An end of a side is one where both sides that meet there, or one and its image on the axis, have
    a minimum and no corner.

    Parameters
    ----------
    outline : Outline
    gaps : sequences of SideGap, one a side
    corners : sequence of pairs of bool
        Whether the start and the end of each side are corners.
    within : float
        Distance over the side within which places are one [-].
    """
    minima = list[tuple[float, int, float]]()
    for number, row in enumerate(gaps):
        for gap in row:
            places = distinct(gap_minima(gap), within, 1.0)
            minima += [
                (value, number, place)
                for value, place in zip(gap.values(places).tolist(), places.tolist(), strict=True)
            ]
    seen = {(number, place) for _, number, place in minima}
    result, left = [list[float]() for _ in gaps], dict.fromkeys(outline.parts, MOST_MINIMA)
    for _, number, place in sorted(minima):
        side, is_end = outline.sides[number], place in (0.0, 1.0)
        beside = int(outline.neighbours[int(place)][number])
        opposite = (beside, place if beside == number else 1.0 - place)
        if left[side.part] and not (
            is_end and (corners[number][int(place)] or opposite not in seen)
        ):
            result[number].append(side.length * place)
            left[side.part] -= 1
    return result


def gap_minima(field: SideGap) -> Array:
    """Return the `MOST_MINIMA` lowest minima of a gap along a side, as increasing fractions.

    An end is one where the gap rises from it. Samples of the interval around each minimum leave two
    of its parts, until these are as short as a minimum is known (`HALF`). All minima are evaluated
    together.
    """
    fractions, gap = field.samples, field.values(field.samples)
    rise, least = np.pad(np.diff(gap), 1), field.noise
    falls, rises = rise[:-1] < -least, rise[1:] > least
    # the ends of an interval of equal values are minima, too; comparisons with nan are false
    flat = (rise[:-1] <= least) & (rise[1:] >= -least)
    minima = np.flatnonzero(flat & (falls | rises))
    minima = minima[np.argsort(gap[minima], kind="stable")][:MOST_MINIMA]
    low, high = fractions[np.maximum(minima - 1, 0)], np.append(fractions, 1.0)[minima + 1]
    share = np.arange(1, SAMPLES)[:, None] / SAMPLES
    while (high - low).max(initial=0.0) > HALF:
        width = high - low
        inside = field.values((low + share * width).ravel()).reshape(SAMPLES - 1, -1)
        best = np.nan_to_num(inside, nan=np.inf).argmin(axis=0)
        low, high = low + best * width / SAMPLES, low + (best + 2) * width / SAMPLES
    return np.asarray(np.unique(0.5 * (low + high)))
