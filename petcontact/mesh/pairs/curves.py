"""Where rays and perpendiculars from points meet straight sides and arcs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index
from ...geometry.arcs import half_angles, on_arcs
from .hits import SLACK, Faces, Hits

SAMPLES = 17
"""Points at which a curve is looked at between its nodes."""


@dataclass(frozen=True)
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

    def at(self, number: Index, fraction: Array) -> tuple[Array, Array]:
        """Points (k, 2) and outward normals (k, 2) at fractions of the arc length of some curves."""
        start, end, bend = self.start[number], self.end[number], self.curvature[number]
        return on_arcs(start, end, half_angles(np.hypot(*(end - start).T), bend), 2.0 * fraction - 1.0)

    def samples(self) -> tuple[Index, Array]:
        """`SAMPLES` fractions of every curve."""
        return np.repeat(np.arange(len(self)), SAMPLES), np.tile(np.linspace(0.0, 1.0, SAMPLES), len(self))

    @property
    def centre(self) -> Array:
        """Centres of the arcs (n, 2); not a number for straight lines."""
        chord = self.end - self.start
        size = np.hypot(*chord.T)
        alpha = half_angles(size, self.curvature)
        left = np.column_stack([-chord[:, 1], chord[:, 0]]) / size[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            rise = np.where(self.curvature == 0.0, np.nan, np.cos(alpha) / self.curvature)
        return np.asarray(0.5 * (self.start + self.end) + rise[:, None] * left)

    def stretch(self, number: Index, distance: Array) -> Array:
        """Arc length at a distance along the normals over that of the curves themselves."""
        return np.asarray(1.0 + self.curvature[number] * distance)

    def __len__(self) -> int:
        return len(self.start)

    def _cast(self, x: Array, direction: Array) -> Hits:
        return _cast(x, direction, self)

    def _foot(self, x: Array, normal: Array) -> Hits:
        return _foot(x, normal, self)


def _cast(x: Array, direction: Array, curves: Curves) -> Hits:
    chord = curves.end - curves.start
    away = curves.start[None] - x[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = direction[:, None, 0] * chord[:, 1] - direction[:, None, 1] * chord[:, 0]
        t = (away[..., 0] * chord[:, 1] - away[..., 1] * chord[:, 0]) / across
        fraction = (away[..., 0] * direction[:, None, 1] - away[..., 1] * direction[:, None, 0]) / across
    # the normal of a straight line is its chord turned by -90°
    facing = direction[:, None, 0] * chord[:, 1] - direction[:, None, 1] * chord[:, 0] < 0.0
    t, fraction = (np.where(facing, values, np.nan) for values in (t, fraction))
    bent = np.flatnonzero(curves.curvature)
    if len(bent):
        t[:, bent], fraction[:, bent] = _cast_on_arcs(x, direction, curves, bent)
    return _nearest(t, fraction)


def _cast_on_arcs(x: Array, direction: Array, curves: Curves, bent: Index) -> tuple[Array, Array]:
    centre, bend = curves.centre[bent], curves.curvature[bent]
    offset = x[:, None] - centre
    along = np.einsum("mkc,mc->mk", offset, direction)
    square = along**2 - np.einsum("mkc,mkc->mk", offset, offset) + 1.0 / bend**2
    root = np.sqrt(np.where(square >= 0.0, square, np.nan))
    # the normal points away from the centre where the arc turns left: the line enters that circle, and leaves the other
    t = -along - np.sign(bend) * root
    return t, _fraction_on_arc(x[:, None] + t[..., None] * direction[:, None] - centre, curves, bent)


def _fraction_on_arc(offset: Array, curves: Curves, bent: Index) -> Array:
    """Fractions of points given by their offsets (m, k, 2) from the centres."""
    first = (curves.start - curves.centre)[bent]
    size = np.hypot(*(curves.end - curves.start)[bent].T)
    whole = 2.0 * half_angles(size, curves.curvature[bent])
    angle = np.arctan2(
        first[:, 0] * offset[..., 1] - first[:, 1] * offset[..., 0], np.einsum("kc,mkc->mk", first, offset)
    )
    fraction: Array = angle / whole
    return fraction


def _foot(x: Array, normal: Array, curves: Curves) -> Hits:
    chord = curves.end - curves.start
    length = np.hypot(*chord.T)
    away = x[:, None] - curves.start[None]
    fraction = np.einsum("mkc,kc->mk", away, chord) / length**2
    distance = (away[..., 0] * chord[:, 1] - away[..., 1] * chord[:, 0]) / length
    against = normal[:, None, 0] * chord[:, 1] - normal[:, None, 1] * chord[:, 0] < 0.0
    bent = np.flatnonzero(curves.curvature)
    if len(bent):
        offset, bend = x[:, None] - curves.centre[bent], curves.curvature[bent]
        radius = np.hypot(offset[..., 0], offset[..., 1])
        fraction[:, bent] = _fraction_on_arc(offset, curves, bent)
        distance[:, bent] = np.sign(bend) * (radius - 1.0 / np.abs(bend))
        against[:, bent] = np.sign(bend) * np.einsum("mkc,mc->mk", offset, normal) < 0.0
    return _nearest(np.where(against, distance, np.nan), fraction)


def _nearest(distance: Array, fraction: Array) -> Hits:
    """Of all meetings within the curves the one with the smallest distance, either way."""
    met = (fraction >= -SLACK) & (fraction <= 1.0 + SLACK) & np.isfinite(distance)
    size = np.where(met, np.abs(distance), np.inf)
    # the same point at the end of two curves belongs to the one that holds it better
    best = np.argmin(np.where(met, size + 1e-14 * np.abs(fraction - 0.5), np.inf), axis=1)
    row = np.arange(len(best))
    none = ~met[row, best]
    return Hits(
        np.where(none, -1, best), np.where(none, 0.0, np.clip(fraction[row, best], 0.0, 1.0)),
        np.where(none, np.inf, distance[row, best]),
    )  # fmt: skip
