"""Stations along the sides of a section in (r, z): where panels of a revolved surface begin, and
how many go round there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index, shown, smallest_by
from ...errors import InputError
from ...record import record
from ...round_off import WRITTEN, least_pieces, whole
from ..outline import Outline, Side

TURN = 0.25 * math.pi
"""Largest angle of a panel, around the axis or along an arc: its area factor varies by less than 2
[rad]."""


@record
class Stations:
    """The pieces of all loops of a section, in order, and the sectors of a revolved surface.

    Attributes
    ----------
    at : (n, 3, 2) array
        (r, z) at the start, in the middle and at the end of each piece [length].
    part : tuple of str
        Of each piece; "" on the axis.
    following : (n,) int array
        The next piece of the loop.
    sectors : (n,) int array
        Around the axis at the start of each piece; 0 on the axis.
    """

    at: Array
    part: tuple[str, ...]
    following: Index
    sectors: Index


def stations(section: Outline, angle: float, size: float) -> Stations:
    """Pieces of about a size.

    Parameters
    ----------
    section : Outline
        See `checked_section`.
    angle : float
        By which it is turned [rad].
    size : float
        [length]
    """
    points, part, following = [], list[str](), list[int]()
    for loop in section.loops:
        first = len(part)
        for side in loop:
            count = max(
                1, whole(side.length / size), int(least_pieces(2.0 * abs(side.half_angle) / TURN))
            )
            x = side.point(_fractions(side, count, WRITTEN * section.diameter))
            x[:, 0] = np.where(x[:, 0] < WRITTEN * section.diameter, 0.0, x[:, 0])
            points.append(np.stack([x[:-1:2], x[1::2], x[2::2]], axis=1))
            part += ["" if on_axis(side, section) else side.part] * count
        following += [*range(first + 1, len(part)), first]
    pieces, after = np.concatenate(points), np.array(following)
    return Stations(pieces, tuple(part), after, _sectors(pieces[:, 0, 0], after, angle, size))


def _fractions(side: Side, count: int, small: float) -> Array:
    """Ends and middles of pieces (2 count + 1,); those that begin or end on the axis are longer."""
    share = np.ones(count)
    for end, (piece, place) in enumerate(((0, side.start), (-1, side.end))):
        # pieces that begin on the axis are longer, so that those after them do not double their
        # radius
        share[piece] *= (
            1.5 if place[0] <= small and (side.start, side.end)[1 - end][0] > small else 1.0
        )
    ends = np.concatenate([[0.0], np.cumsum(share) / share.sum()])
    ends[-1] = 1.0
    return np.interp(np.arange(2 * count + 1) / 2.0, np.arange(count + 1), ends)


def _sectors(r: Array, following: Index, angle: float, size: float) -> Index:
    """The fewest sectors times powers of two, twice as many at most from one station to the
    next."""
    fewest = int(least_pieces(angle / TURN))
    most = max(fewest, round(angle * float(r.max()) / size))
    base = round(most / 2 ** int(math.log2(most / fewest)))
    wanted = angle * r / (size * base)
    level = np.where(r > 0.0, np.rint(np.log2(np.maximum(wanted, 1.0))), -1.0)
    while True:
        beside = smallest_by(following, level, len(level)), level[following]
        lower = np.minimum(level, np.minimum(*beside) + 1.0)
        lower = np.where(r > 0.0, np.maximum(lower, 0.0), -1.0)
        if np.array_equal(lower, level):
            return np.where(r > 0.0, base * 2 ** np.maximum(level, 0.0), 0).astype(np.int64)
        level = lower


def on_axis(side: Side, section: Outline) -> bool:
    """Whether a side lies on the axis."""
    return (
        side.curvature == 0.0
        and max(abs(side.start[0]), abs(side.end[0])) <= WRITTEN * section.diameter
    )


def checked_section(section: Outline) -> Outline:
    """The section, if it can be turned about the axis.

    Raises
    ------
    InputError
        If it lies on both sides of the axis, or touches it in a point.
    """
    small = WRITTEN * section.diameter
    for loop in section.loops:
        for side, following in zip(loop, (*loop[1:], loop[0]), strict=True):
            lowest = _nearest_to_axis(side)
            if lowest[0] < -small:
                raise InputError(
                    f"geometry: side {side.part!r} passes the axis at (r, z) = {shown(lowest)}; r "
                    f">= 0 is needed"
                )
            inside = min(np.hypot(*(lowest - end)) for end in (side.start, side.end)) > small
            ends_there = side.end[0] <= small and not (
                on_axis(side, section) or on_axis(following, section)
            )
            if (inside and lowest[0] <= small and not on_axis(side, section)) or ends_there:
                place = side.end if ends_there else lowest
                raise InputError(
                    f"geometry: the section touches the axis in the point (r, z) = {shown(place)} "
                    "only; a body that holds together there has a side on the axis"
                )
    return section


def _nearest_to_axis(side: Side) -> Array:
    """The point of least r of a side."""
    along = side.tangents(np.zeros(1))[0]
    fractions = [0.0, 1.0]
    if side.half_angle:
        # where the tangent is parallel to the axis
        start = math.atan2(along[1], along[0])
        turned = [
            (quarter * math.pi - start) / (2.0 * side.half_angle)
            for quarter in (-1.5, -0.5, 0.5, 1.5)
        ]
        fractions += [t for t in turned if 0.0 < t < 1.0]
    points = side.point(np.array(fractions))
    return np.asarray(points[points[:, 0].argmin()])


def parts_of(sides: Sequence[Side], section: Outline) -> tuple[str, ...]:
    """Names of the parts that do not lie on the axis, in order of appearance."""
    return tuple(dict.fromkeys(side.part for side in sides if not on_axis(side, section)))
