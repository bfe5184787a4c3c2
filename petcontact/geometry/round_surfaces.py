"""Spheres and cylinders: curved panels of grids of points on their parts, which are twice as
fine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Array, Index, Mask
from ..record import record
from .arcs import check_digits
from .surface import BOX_PARTS, SolidSurface, face_axes

CORE = 0.6
"""Half the width of the square in the middle of a disc over its radius."""
RIM = 0.02
"""Distance from a rim, over the size of a panel, within which its points may belong on it."""


def at_rim(distance: Array, points: Array) -> Mask:
    """Return which points (n, k, 3) of panels belong on a rim, (n, k).

    They are close to it, compared with the panel's size and with its width across the rim. Pieces
    of a panel at the rim have points at a quarter of its width; these stay off the rim.

    Parameters
    ----------
    distance : (n, k) array
        Distance of the points from the rim, NaN where there is no point [length].
    points : (n, k, 3) array
        [length]
    """
    size = np.linalg.norm(np.nanmax(points, axis=1) - np.nanmin(points, axis=1), axis=1)
    across = np.nanmax(distance, axis=1)
    return np.asarray(distance < np.minimum(RIM * size, across / 8.0)[:, None])


class RoundSurface(SolidSurface):
    """A surface of curved panels.

    Attributes
    ----------
    area : float
        About [length²].
    usual_size : float
        Of panels, where none is given [length].
    cells : callable
        Of a size: pairs of the number of a part and points (n, 9, 3) of panels, corners, middles of
        the sides, middle; NaN where triangles have none [length].
    """

    known = exact = True
    if TYPE_CHECKING:

        @property
        def area(self) -> float: ...
        @property
        def usual_size(self) -> float: ...
        def cells(self, size: float) -> Iterator[tuple[int, Array]]: ...


@record
class SphereSurface(RoundSurface):
    """A sphere in six parts, named like the faces of the box around it [length]."""

    centre: Array
    radius: float
    parts: tuple[str, ...] = tuple(BOX_PARTS)

    def __post_init__(self) -> None:
        check_digits(self.radius, [self.centre], "sphere")

    @property
    def usual_size(self) -> float:
        """Size of panels where none is given [length]."""
        return 0.5 * self.radius

    @property
    def diameter(self) -> float:
        """Length of the diagonal of the bounding box [length]."""
        return float(np.sqrt(12.0) * self.radius)

    @property
    def area(self) -> float:
        """[length²]."""
        return float(4.0 * np.pi * self.radius**2)

    def cells(self, size: float) -> Iterator[tuple[int, Array]]:
        """Equal angles, projected from the face of a cube."""
        slope = np.tan(_angles(self.radius, size))
        for part, (axis, side) in enumerate(BOX_PARTS.values()):
            u, v = face_axes(axis, side)
            x = np.empty((len(slope), len(slope), 3))
            x[..., u], x[..., v] = np.meshgrid(slope, slope, indexing="ij")
            x[..., axis] = 2 * side - 1
            yield part, _quadrilaterals(self.onto(np.array([part]), self.centre + x))

    def onto(self, part: Index, points: Array) -> Array:
        """The nearest points of the surface, along the radius, (n, 3) [length]."""
        away = points - self.centre
        return np.asarray(
            self.centre + self.radius * away / np.linalg.norm(away, axis=-1, keepdims=True)
        )


@record
class CylinderSurface(RoundSurface):
    """A cylinder between the centres of two discs, `bottom` and `top`, with its `side` [length]."""

    start: Array
    end: Array
    radius: float
    parts: tuple[str, ...] = ("bottom", "top", "side")

    def __post_init__(self) -> None:
        check_digits(min(self.radius, self.height), [self.start, self.end], "cylinder")

    @property
    def usual_size(self) -> float:
        """Size of panels where none is given [length]."""
        return 0.5 * self.radius

    @property
    def height(self) -> float:
        """Between the discs [length]."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def diameter(self) -> float:
        """Length of the diagonal of the box around it [length]."""
        return float(np.hypot(self.height, np.sqrt(8.0) * self.radius))

    @property
    def area(self) -> float:
        """[length²]."""
        return float(2.0 * np.pi * self.radius * (self.radius + self.height))

    def cells(self, size: float) -> Iterator[tuple[int, Array]]:
        """Discs of a square and four blocks around it, and four blocks of the side."""
        angle = _angles(self.radius, size)
        rings = max(1, round((1.0 - CORE) * self.radius / size))
        layers = max(1, round(self.height / size))
        flat = np.tan(angle)
        square = np.stack(np.meshgrid(flat, flat, indexing="ij"), axis=2)
        # the corners of the square are drawn in, so that panels beside them are no wedges
        square *= CORE * self.radius * (1.0 - 0.15 * np.prod(square**2, axis=2, keepdims=True))
        inner = square[-1]
        outer = self.radius * np.column_stack([np.cos(angle), np.sin(angle)])
        away, up = np.linspace(0.0, 1.0, 2 * rings + 1), np.linspace(0.0, 1.0, 2 * layers + 1)
        block = inner + away[:, None, None] * (outer - inner)
        turns = [np.array([[c, s], [-s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        discs = [square, *(block @ turn for turn in turns)]
        across = self.frame[:2]
        for disc in discs:
            yield 1, _quadrilaterals(self.end + disc @ across)
            yield 0, _quadrilaterals(self.start + (disc @ across).transpose(1, 0, 2))
        for turn in turns:
            yield (
                2,
                _quadrilaterals(
                    self.start
                    + (outer @ turn @ across)[:, None]
                    + up[:, None] * (self.end - self.start)
                ),
            )

    def onto(self, part: Index, points: Array) -> Array:
        """Away from the axis, all points of the side and those on the rims of the discs; along it,
        those of the discs."""
        axis = (self.end - self.start) / self.height
        along = (points - self.start) @ axis
        away = points - self.start - along[..., None] * axis
        distance = np.linalg.norm(away, axis=-1, keepdims=True)
        face = part[:, None, None]
        on_rim = at_rim(np.abs(distance[..., 0] - self.radius), points)[..., None]
        outside = (face == 2) | on_rim
        height = np.choose(
            face, [np.zeros_like(distance), np.full_like(distance, self.height), along[..., None]]
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(outside, self.radius / distance, 1.0)
        return np.asarray(
            self.start + np.where(np.isnan(away), np.nan, height * axis) + share * away
        )

    @property
    def frame(self) -> Array:
        """Two unit vectors across the axis, and that along it, right-handed (3, 3)."""
        axis = (self.end - self.start) / self.height
        first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        first /= np.linalg.norm(first)
        return np.array([first, np.cross(axis, first), axis])


GRID = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1))
"""Points of a 9-node quadrilateral in a grid twice as fine: corners, middles of the sides,
middle."""


def _quadrilaterals(x: Array) -> Array:
    """Nine points (n, 9, 3) of the panels of a grid (2n+1, 2m+1, 3)."""
    nine = [x[i : len(x) - 2 + i : 2, j : len(x[0]) - 2 + j : 2] for i, j in GRID]
    return np.asarray(np.stack(nine, axis=2).reshape(-1, 9, 3))


def _angles(radius: float, size: float) -> Array:
    """From -π/4 to π/4, twice as many as a quarter of a circle has panels of a size."""
    # two panels along a quarter of a circle: the area factor varies by less than 2
    count = max(2, round(0.5 * np.pi * radius / size))
    return np.asarray(0.25 * np.pi * np.linspace(-1.0, 1.0, 2 * count + 1))
