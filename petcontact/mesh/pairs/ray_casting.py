"""Intersections of rays with the faces of a part, and segments in which two parts face one
another."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from typing import ClassVar, Self

import numpy as np

from ...arrays import Array, Index, Mask, Rows
from ...record import record
from ...round_off import WRITTEN

TOGETHER = 1 << 18
"""Number of pairs of a point and a face that are examined at once."""


def along(direction: Array | None, normal: Array) -> Array:
    """Return the directions at points with outward normals (m, d): the normals, or the given
    one."""
    return (
        normal
        if direction is None
        else np.broadcast_to(direction / np.linalg.norm(direction), normal.shape)
    )


@record
class Hits:
    """Intersections of lines through m points with the faces of a part.

    Attributes
    ----------
    face : (m,) array
        Number of the face, -1 for none.
    place : (m,) or (m, 2) array
        Fraction of the arc length of a curve, or local coordinates of a panel.
    distance : (m,) array
        Distance along the direction, negative behind the point, infinite for none [length].
    """

    face: Index
    place: Array
    distance: Array


@record
class FacingSegments(Rows):
    """Quadrature points on a part where it faces another one.

    A segment lies on one face of each part.

    Attributes
    ----------
    face, other : (q,) arrays
        Number of the face with the point, and of the opposite face.
    place, opposite : (q,) or (q, 2) arrays
        Positions of the point and of the opposite point, as in `Hits`.
    weight : (q,) array
        Weight on the first part [length, in space area].
    """

    face: Index
    place: Array
    other: Index
    opposite: Array
    weight: Array


class Faces(ABC):
    """Curves or panels of a part that points of another part face, with the body behind them."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def at(self, number: Index, place: Array) -> tuple[Array, Array]:
        """Return points (k, d) and outward normals (k, d) at positions on faces."""

    SAMPLES: ClassVar[int]
    """Points along each direction of a face at which it is examined between its nodes."""

    @abstractmethod
    def spread(self, number: Index, share: Array) -> Array:
        """Return positions, as in `Hits`, on faces (k,) at shares (k, d-1) from 0 to 1 of their
        directions."""

    @abstractmethod
    def area(self, number: Index, share: Array) -> Array:
        """Return the area, on curves the length, of a unit of shares, (k,)."""

    @abstractmethod
    def rims(self) -> tuple[Index, Array, Array]:
        """Return the numbers of faces, and the positions at which their sides begin and end.

        Curves have their ends, twice each.
        """

    @abstractmethod
    def segments(
        self, other: Self, order: Index, opposite: Index, direction: Array | None
    ) -> FacingSegments:
        """Return where these faces, of orders (n,), face those of another part, of orders
        `opposite`.

        Both parts are of one kind. They are seen along the outward normals, or along a direction.
        Products of the two polynomials are integrated exactly if the faces are straight or flat.
        """

    def cast(self, x: Array, direction: Array) -> Hits:
        """Return the nearest intersection of lines x + t·direction with faces whose normals point
        against them.

        An intersection behind a point counts only if the body overlaps the point there, and not on
        the far side of a body.

        Parameters
        ----------
        x, direction : (m, d) arrays
            Points [length] and unit vectors.
        """
        hits = self._cast(x, direction)
        beyond = self.beyond(x, direction, hits.distance)
        if len(deep := np.flatnonzero((hits.distance < 0.0) & ~beyond)):
            beyond[deep] = self._goes_round(hits.face[deep], direction[deep], -hits.distance[deep])
        return (
            Hits(
                np.where(beyond, -1, hits.face), hits.place, np.where(beyond, np.inf, hits.distance)
            )
            if beyond.any()
            else hits
        )

    def beyond(self, x: Array, direction: Array, distance: Array) -> Mask:
        """Return which intersections at distances (m,) lie behind a point and beyond another face.

        That face looks towards the point.
        """
        result = distance < 0.0
        behind = np.flatnonzero(result)
        half = 0.5 * distance[behind, None] * direction[behind]
        between = self._cast(x[behind] + half, -direction[behind]).distance
        result[behind] = np.abs(between) < (0.5 - WRITTEN) * -distance[behind]
        return result

    def _goes_round(self, number: Index, direction: Array, depth: Array) -> Mask:
        """Return which faces turn along a direction somewhere, or nearly, and are smaller than a
        depth.

        A line that enters and leaves such a face, or touches it, has only one recorded
        intersection.
        """
        d = direction.shape[1]
        corners = np.array(list(itertools.product((0.0, 1.0), repeat=d - 1)))
        place = self.spread(np.repeat(number, len(corners)), np.tile(corners, (len(number), 1)))
        x, normal = (
            each.reshape(len(number), -1, d)
            for each in self.at(np.repeat(number, len(corners)), place)
        )
        turned = np.einsum("kcd,kd->kc", normal, direction).max(axis=1, initial=-1.0) > -0.05
        return np.asarray(turned & (depth > np.linalg.norm(np.ptp(x, axis=1), axis=1)))

    @abstractmethod
    def _cast(self, x: Array, direction: Array) -> Hits:
        """Return the nearest intersection in either direction."""


def line_rows(way: Array, point: Array, thick: Array) -> tuple[Array, Array]:
    """What lines have in the product of `PanelFaces._near_lines`, (k, 12), and the squared
    distances of their points from the origin, (k,)."""
    a, b = np.triu_indices(3)
    past, far = np.sum(way * point, axis=1), np.sum(point**2, axis=1)
    shifted = 2.0 * (past[:, None] * way - point)
    pairs = np.where(a == b, 1.0, 2.0) * way[:, a] * way[:, b]
    rest = far - past**2 - thick**2
    return np.column_stack([shifted, np.ones(len(way)), -2.0 * thick, rest, -pairs]), far
