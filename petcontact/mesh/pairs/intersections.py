"""Intersections of rays and perpendiculars with straight sides and arcs, and facing segments."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from ...arrays import Array, Index, Mask
from ...geometry.arcs import arc_lengths, cross, half_angles, on_arcs
from ...record import record
from ...round_off import WRITTEN
from ..basis import gauss
from .ray_casting import TOGETHER, Faces, FacingSegments, Hits, along

BLOCK = 64
"""Points for which curves that they may meet are selected at once, and how many curves are not
selected from. Bearing of 12 rollers: 1.72 s without, .88 to .90 s from 32 to 128 curves on, and
1.17 s by 16 points."""


@record
class Curves(Faces):
    """Straight lines and arcs, the body on their left; arrays over n of them.

    Attributes
    ----------
    start, end : (n, 2) arrays
        [length]
    curvature : (n,) array
        Positive where the arc turns left [1/length].
    """

    start: Array
    end: Array
    curvature: Array
    SAMPLES: ClassVar[int] = 17

    def at(self, number: Index, fraction: Array) -> tuple[Array, Array]:
        """Return points (k, 2) and outward normals (k, 2) at fractions of the arc length of
        curves."""
        return on_arcs(
            self.start[number], self.end[number], self.alpha[number], 2.0 * fraction - 1.0
        )

    def spread(self, number: Index, share: Array) -> Array:
        """See `Faces.spread`."""
        return share[:, 0]

    def area(self, number: Index, share: Array) -> Array:
        """See `Faces.area`."""
        return np.asarray(self.length[number])

    @functools.cached_property
    def chord(self) -> Array:
        """Distance of the ends of each curve, (n,) [length]."""
        return np.asarray(np.hypot(*(self.end - self.start).T))

    @functools.cached_property
    def alpha(self) -> Array:
        """Half the angle through which each curve turns, (n,) [rad]."""
        return half_angles(self.chord, self.curvature)

    @functools.cached_property
    def length(self) -> Array:
        """Arc length of each curve, (n,) [length]."""
        return arc_lengths(self.chord, self.alpha)

    @functools.cached_property
    def centre(self) -> Array:
        """Centres of the arcs (n, 2); not a number for straight lines."""
        x, y = (self.end - self.start).T
        left = np.column_stack([-y, x]) / self.chord[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            rise = np.where(self.curvature == 0.0, np.nan, np.cos(self.alpha) / self.curvature)
        return np.asarray(0.5 * (self.start + self.end) + rise[:, None] * left)

    def __len__(self) -> int:
        return len(self.start)

    def rims(self) -> tuple[Index, Array, Array]:
        """See `Faces.rims`."""
        ends = np.repeat([0.0, 1.0], len(self))
        return np.tile(np.arange(len(self)), 2), ends, ends

    def _cast(self, x: Array, direction: Array) -> Hits:
        """See `Faces.cast`."""
        return self._nearest(_crossings, x, direction)

    def _nearest(
        self, meet: Callable[[Array, Array, Curves], tuple[Array, Array]], x: Array, vector: Array
    ) -> Hits:
        """Return the meeting within the curves with the smallest distance in either direction."""
        face, place, far = np.full(len(x), -1), np.zeros(len(x)), np.full(len(x), np.inf)
        for k, number, distance, fraction in self._met(meet, x, vector):
            if not len(number):
                continue
            met = (fraction >= -WRITTEN) & (fraction <= 1.0 + WRITTEN) & np.isfinite(distance)
            # the same point at the end of two curves belongs to the one that holds it better
            rank = np.where(met, np.abs(distance) + 1e-14 * np.abs(fraction - 0.5), np.inf)
            best, row = np.argmin(rank, axis=1), np.arange(len(distance))
            hit = met[row, best]
            face[k + row[hit]] = number[best[hit]]
            place[k + row[hit]] = np.clip(fraction[row, best][hit], 0.0, 1.0)
            far[k + row[hit]] = distance[row, best][hit]
        return Hits(face, place, far)

    def _met(
        self, meet: Callable[[Array, Array, Curves], tuple[Array, Array]], x: Array, vector: Array
    ) -> Iterator[tuple[int, Index, Array, Array]]:
        """Yield for blocks of points: the number of the first point, the curves (n,) that they may
        meet, and distances and fractions (m, n).

        The numbers of curves increase.
        """
        number, few = np.arange(len(self)), len(self) <= BLOCK
        step = max(1, TOGETHER // max(1, len(self))) if few else BLOCK
        for k in range(0, len(x), step):
            points, along = x[k : k + step], vector[k : k + step]
            if not few:
                number = np.flatnonzero(MAY_MEET[meet](points, along, self))
            yield (
                k,
                number,
                *meet(
                    points,
                    along,
                    Curves(self.start[number], self.end[number], self.curvature[number]),
                ),
            )

    def comes_from(self, x: Array, normal: Array, direction: Array | None) -> Hits:
        """Return the points of the curves that face given points x with outward normals (m, 2).

        They are the nearest feet of perpendiculars, or lie against a direction. The distance is
        along the curve's normal, or along the direction.
        """
        if direction is None:
            return self._nearest(_feet, x, normal)
        hits = self.cast(x, -along(direction, normal))
        # faces that look away would be met through the body
        seen = normal @ direction < 0.0
        return Hits(
            np.where(seen, hits.face, -1), hits.place, np.where(seen, hits.distance, np.inf)
        )

    def segments(
        self, other: Curves, order: Index, opposite: Index, direction: Array | None
    ) -> FacingSegments:
        """See `Faces.segments`: each curve is cut where an opposite one begins or ends."""
        number, low, high = self._cut(other, direction)
        middle = self.at(number, 0.5 * (low + high))
        met = other.cast(middle[0], along(direction, middle[1])).face
        beyond = np.where(met >= 0, opposite[met], opposite.max(initial=0))
        count = np.maximum(order[number], beyond) + 1
        parts = []
        for points in np.unique(count).tolist():
            pieces = np.flatnonzero(count == points)
            xi, weight = gauss(points - 1)
            width = (high - low)[pieces, None]
            place = (low[pieces, None] + 0.5 * (1.0 + xi) * width).ravel()
            face = np.repeat(number[pieces], points)
            x, normal = self.at(face, place)
            hits = other.cast(x, along(direction, normal))
            facing = (hits.face >= 0) & (
                np.sum(along(direction, normal) * normal, axis=1) > WRITTEN
            )
            weights = (0.5 * weight * width).ravel() * self.length[face]
            parts.append(FacingSegments(face, place, hits.face, hits.place, weights).take(facing))
        return FacingSegments.joined(parts)

    def _cut(self, other: Curves, direction: Array | None) -> tuple[Index, Array, Array]:
        """Return pieces of these curves between the points that face ends of the opposite curves.

        A piece has the number (k,) of its curve and the fractions (k,) at both ends.
        """
        x, normal = other.at(*other.rims()[:2])
        numbers, fractions = ([part] for part in self.rims()[:2])
        away = along(direction, normal)
        meetings = (
            self._met(_feet, x, away) if direction is None else self._met(_crossings, x, -away)
        )
        for _, number, _, fraction in meetings:
            inside = (fraction > WRITTEN) & (fraction < 1.0 - WRITTEN)
            numbers.append(number[np.nonzero(inside)[1]])
            fractions.append(fraction[inside])
        number, fraction = np.concatenate(numbers), np.concatenate(fractions)
        order = np.lexsort((fraction, number))
        number, fraction = number[order], fraction[order]
        apart = np.append(True, (np.diff(fraction) > WRITTEN) | (np.diff(number) > 0))
        number, fraction = number[apart], fraction[apart]
        piece = np.flatnonzero(np.diff(number) == 0)
        return number[piece], fraction[piece], fraction[piece + 1]


def _crossings(x: Array, direction: Array, curves: Curves) -> tuple[Array, Array]:
    """Return distances and fractions (m, n) at which lines meet curves whose normals point against
    them.

    They are NaN elsewhere.
    """
    chord = curves.end - curves.start
    away = curves.start[None] - x[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = cross(direction[:, None], chord)
        t = cross(away, chord) / across
        fraction = cross(away, direction[:, None]) / across
    # the normal of a straight line is its chord turned by -90°
    facing = across < 0.0
    t, fraction = (np.where(facing, values, np.nan) for values in (t, fraction))
    bent = np.flatnonzero(curves.curvature)
    if len(bent):
        t[:, bent], fraction[:, bent] = _cast_on_arcs(x, direction, curves, bent)
    return t, fraction


def _cast_on_arcs(x: Array, direction: Array, curves: Curves, bent: Index) -> tuple[Array, Array]:
    centre, bend = curves.centre[bent], curves.curvature[bent]
    offset = x[:, None] - centre
    along = np.einsum("mkc,mc->mk", offset, direction)
    square = along**2 - np.einsum("mkc,mkc->mk", offset, offset) + 1.0 / bend**2
    root = np.sqrt(np.where(square >= 0.0, square, np.nan))
    # the normal points away from the centre where the arc turns left: the line enters that circle,
    # and leaves the other
    t = -along - np.sign(bend) * root
    return t, _fraction_on_arc(
        x[:, None] + t[..., None] * direction[:, None] - centre, curves, bent
    )


def _fraction_on_arc(offset: Array, curves: Curves, bent: Index) -> Array:
    """Return the fractions of points with given offsets (m, k, 2) from the centres."""
    first = (curves.start - curves.centre)[bent]
    angle = np.arctan2(
        first[:, 0] * offset[..., 1] - first[:, 1] * offset[..., 0],
        np.einsum("kc,mkc->mk", first, offset),
    )
    return np.asarray(angle / (2.0 * curves.alpha[bent]))


def _feet(x: Array, normal: Array, curves: Curves) -> tuple[Array, Array]:
    """Return distances and fractions (m, n) of the feet of perpendiculars from points that face the
    curves.

    The distances are along the curves' normals.
    """
    chord, length = curves.end - curves.start, curves.chord
    away = x[:, None] - curves.start[None]
    fraction = np.einsum("mkc,kc->mk", away, chord) / length**2
    distance = cross(away, chord) / length
    # what grazes a curve does so in round-off
    against = cross(normal[:, None], chord) < -WRITTEN * length
    bent = np.flatnonzero(curves.curvature)
    if len(bent):
        offset, bend = x[:, None] - curves.centre[bent], curves.curvature[bent]
        radius = np.hypot(offset[..., 0], offset[..., 1])
        fraction[:, bent] = _fraction_on_arc(offset, curves, bent)
        distance[:, bent] = np.sign(bend) * (radius - 1.0 / np.abs(bend))
        facing = np.sign(bend) * np.einsum("mkc,mc->mk", offset, normal)
        against[:, bent] = facing < -WRITTEN * radius
    return np.where(against, distance, np.nan), np.where(against, fraction, np.nan)


def _on_lines(x: Array, direction: Array, curves: Curves) -> Mask:
    """Return the curves (n,) that lines through points may cross, with few others."""
    centre, middle, size = _around(x, curves)
    direction = direction / np.hypot(*direction.T)[:, None]
    mean = direction.mean(axis=0)
    mean /= np.linalg.norm(mean) or 1.0
    spread = float(np.abs(direction[:, 0] * mean[1] - direction[:, 1] * mean[0]).max())
    offset = middle - centre[0]
    across = np.abs(offset[:, 0] * mean[1] - offset[:, 1] * mean[0])
    return np.asarray(
        across
        <= (1.0 + WRITTEN) * (centre[1] + size + spread * (np.hypot(*offset.T) + size + centre[1]))
    )


def _under_feet(x: Array, normal: Array, curves: Curves) -> Mask:
    """Return the curves (n,) on which perpendiculars from points may stand.

    They are all arcs, and straight curves whose extent the points overlap.
    """
    centre, middle, _ = _around(x, curves)
    chord, offset = curves.end - curves.start, centre[0] - middle
    overlaps = np.abs(offset[:, 0] * chord[:, 0] + offset[:, 1] * chord[:, 1]) <= (
        1.0 + WRITTEN
    ) * curves.chord * (centre[1] + curves.length)
    return np.asarray(overlaps | (curves.curvature != 0.0))


def _around(x: Array, curves: Curves) -> tuple[tuple[Array, float], Array, Array]:
    """Return bounding circles: the centre and radius of points, and the centres (n, 2) and radii
    (n,) of curves."""
    centre = x.mean(axis=0)
    reach = float(np.hypot(*(x - centre).T).max())
    return (centre, reach), 0.5 * (curves.start + curves.end), curves.length


MAY_MEET: dict[
    Callable[[Array, Array, Curves], tuple[Array, Array]], Callable[[Array, Array, Curves], Mask]
] = {
    _crossings: _on_lines,
    _feet: _under_feet,
}
"""Function that selects curves, for each function that meets them."""
