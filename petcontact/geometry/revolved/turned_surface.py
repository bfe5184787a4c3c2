"""The surface of a section that is turned about an axis, as curved panels: quadrilaterals,
triangles where more go round."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Index
from ...errors import InputError
from ...record import record
from ...round_off import WRITTEN
from ..arcs import check_digits
from ..outline import Outline
from ..round_surfaces import RoundSurface, at_rim
from .runs import Run, runs_of
from .section import section_triangles
from .stations import Stations, checked_section, on_axis, parts_of, stations

FACES = ("start", "end")
"""Parts of the plane faces of a body that is turned by less than a full circle."""
ATTEMPTS, FINER = 8, 0.75
"""Sizes that are tried for the plane faces, each finer than the one before."""


def _triangle(*corners: tuple[float, float]) -> Array:
    """Corners and middles of the sides."""
    x = np.array(corners, dtype=float)
    return np.concatenate([x, 0.5 * (x + np.roll(x, -1, axis=0))])


EQUAL = np.array(
    [[(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (0.5, 0.5)]]
)
MORE = np.stack(
    [
        _triangle((0, 0), (0.5, 1), (0, 1)),
        _triangle((0, 0), (1, 0), (0.5, 1)),
        _triangle((1, 0), (1, 1), (0.5, 1)),
    ]
)
TIP = np.array([[(0.5, 0), (1, 1), (0, 1), (1, 0.5), (0.5, 1), (0, 0.5)]])
"""Panels of a sector between the start (0) and the end (1) of a piece, the angle first: as many
sectors at the end, twice as many, or the start on the axis."""


@record
class RevolvedSurface(RoundSurface):
    """A section in (r, z), the body on the left of its sides, turned about an axis [length].

    Attributes
    ----------
    section : Outline
        A side on the axis creates no surface.
    centre : (3,) array
        Where r = z = 0 [length].
    frame : (3, 3) array
        Unit vectors: of r where it starts, across it, and along the axis, right-handed.
    angle : float
        Up to 2π [rad].

    Raises
    ------
    InputError
        If the section passes the axis or touches it in a point, or has a part of the name of a
        plane face.
    """

    section: Outline
    centre: Array
    frame: Array
    angle: float

    def __post_init__(self) -> None:
        check_digits(self.section.diameter, [self.centre], "body of revolution")
        checked_section(self.section)
        taken = set(FACES) & {*self._round_parts}
        if taken and not self._is_whole:
            name = min(taken)
            raise InputError(
                f"geometry: the part {name!r} is a plane face where the section begins or ends; "
                f"choose another name"
            )

    @property
    def _is_whole(self) -> bool:
        return self.angle >= 2.0 * math.pi

    @property
    def _round_parts(self) -> tuple[str, ...]:
        return parts_of(self.section.sides, self.section)

    @functools.cached_property
    def runs(self) -> list[Run]:
        """The sides of the section off the axis; those without a corner between them are one."""
        sides = self.section.sides
        return runs_of([side for side in sides if not on_axis(side, self.section)])

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the section, and the plane faces where the angle is less than a full circle."""
        return self._round_parts + (() if self._is_whole else FACES)

    @property
    def diameter(self) -> float:
        """Length of the diagonal of the box around the body that is turned all round [length]."""
        r, z = np.vstack([side.point(np.linspace(0.0, 1.0, 9)) for side in self.section.sides]).T
        return float(np.hypot(np.sqrt(8.0) * r.max(), np.ptp(z)))

    @property
    def usual_size(self) -> float:
        """Size of panels where none is given [length]."""
        # without a size: eight panels along the diagonal of the section
        return self.section.diameter / 8

    @property
    def area(self) -> float:
        """By Pappus' rule [length²]."""
        round_ = sum(
            side.length * side.point(np.linspace(0.05, 0.95, 10))[:, 0].mean()
            for side in self.section.sides
        )
        return float(self.angle * round_ + 2.0 * (not self._is_whole) * self.section.polygon().area)

    def cells(self, size: float) -> Iterator[tuple[int, Array]]:
        """Part and points (n, 9, 3) of panels: corners, middles of the sides, middle; NaN where
        triangles have none.

        Raises
        ------
        InputError
            If no triangles of less than a tenth of the size fill the section.
        """
        filling, rows = None, stations(self.section, self.angle, size)
        for attempt in range(0 if self._is_whole else ATTEMPTS):
            finer = size * FINER**attempt
            rows = stations(self.section, self.angle, finer)
            filling = section_triangles(rows, finer)
            if filling is not None:
                break
        if filling is None and not self._is_whole:
            raise InputError(
                f"mesh.element_size: {size:g} is too coarse for the section's plane faces; give a "
                "smaller one, or a larger `smooth` to sides through points"
            )
        yield from self._round(rows)
        if filling is not None:
            for face, (six, steps) in enumerate(
                ((filling, 0), (filling[:, [0, 2, 1, 5, 4, 3]], 1))
            ):
                yield (
                    len(self._round_parts) + face,
                    self._padded(self._placed(six[..., 0], six[..., 1], steps, 1)),
                )

    def in_section(self, points: Array) -> Array:
        """Radius and height (..., 2) of points (..., 3) [length]."""
        away = (points - self.centre) @ self.frame.T
        return np.stack([np.hypot(away[..., 0], away[..., 1]), away[..., 2]], axis=-1)

    def onto(self, part: Index, points: Array) -> Array:
        """Onto the run of sides of the section that the first four points of a panel, which are
        corners, are nearest to, and onto all rims there; the axis stays."""
        away = (points - self.centre) @ self.frame.T
        section_points = self.in_section(points)
        radius = section_points[..., 0]
        nearest, least = section_points.copy(), np.full(len(section_points), np.inf)
        flat = np.flatnonzero(part >= len(self._round_parts))
        for side in self.runs:
            on_part = np.flatnonzero(part == self.parts.index(side.part))
            if not len(on_part) + len(flat):
                continue
            place = side.nearest(section_points[on_part].reshape(-1, 2)).reshape(
                -1, points.shape[1]
            )
            # what lies close to an end belongs on the rim that the end is turned into
            first, last = (
                at_rim(along, points[on_part]) & (end[0] > WRITTEN * self.section.diameter)
                for along, end in zip(
                    (place, side.length - place), side.at(side.ends[[0, -1]]), strict=True
                )
            )
            place = np.where(first, 0.0, np.where(last, side.length, np.nan_to_num(place)))
            near = side.at(place.ravel()).reshape(*place.shape, 2)
            distance = np.nansum((near - section_points[on_part])[:, :4] ** 2, axis=(1, 2))
            better = distance < least[on_part]
            nearest[on_part[better]], least[on_part[better]] = near[better], distance[better]
            place = np.nan_to_num(side.nearest(section_points[flat].reshape(-1, 2)))
            near = side.at(place).reshape(-1, *section_points.shape[1:])
            close = at_rim(np.linalg.norm(near - section_points[flat], axis=-1), points[flat])
            nearest[flat] = np.where(close[..., None], near, nearest[flat])
        on_rim = radius > WRITTEN * self.section.diameter
        away[..., :2] *= np.divide(nearest[..., 0], radius, out=np.ones_like(radius), where=on_rim)[
            ..., None
        ]
        away[..., 2] = np.where(np.isnan(radius), np.nan, nearest[..., 1])
        return np.asarray(self.centre + away @ self.frame)

    def _round(self, rows: Stations) -> Iterator[tuple[int, Array]]:
        """Panels of each piece off the axis."""
        finest = 4 * int(rows.sectors.max())
        for k, part in enumerate(rows.part):
            if not part:
                continue
            before, after = int(rows.sectors[k]), int(rows.sectors[rows.following[k]])
            if before == after:
                cells, count = EQUAL, before
            else:
                cells = TIP if 0 in (before, after) else MORE
                count = min(before, after) or max(before, after)
                # start and end of the piece change over; triangles stay counter-clockwise
                if after < before:
                    cells = (cells * [1.0, -1.0] + [0.0, 1.0])[:, [0, 2, 1, 5, 4, 3]]
            place = np.rint(2.0 * cells[..., 1]).astype(int)
            r, z = rows.at[k, place].transpose(2, 0, 1)
            steps = np.rint(
                (np.arange(count)[:, None, None] + cells[..., 0]) * (finest // count)
            ).astype(int)
            x = self._placed(
                np.broadcast_to(r, steps.shape), np.broadcast_to(z, steps.shape), steps, finest
            )
            yield self._round_parts.index(part), self._padded(x.reshape(-1, *x.shape[2:]))

    def _placed(self, r: Array, z: Array, step: Array | int, steps: int) -> Array:
        """Points at whole steps of the angle, so that those of neighbours are the same to the last
        digit."""
        angle = self.angle * (np.arange(steps + 1) / steps)
        if self._is_whole:
            angle[-1] = 0.0
        first, second, along = self.frame
        cos, sin = (
            np.broadcast_to(values[step], r.shape)[..., None]
            for values in (np.cos(angle), np.sin(angle))
        )
        return np.asarray(
            self.centre + r[..., None] * (cos * first + sin * second) + z[..., None] * along
        )

    @staticmethod
    def _padded(x: Array) -> Array:
        """Triangles (n, 6, 3) as nine points: no fourth corner, two middles fewer."""
        if x.shape[1] == 9:
            return x
        result = np.full((len(x), 9, 3), np.nan)
        result[:, :3], result[:, 4:7] = x[:, :3], x[:, 3:]
        return result
