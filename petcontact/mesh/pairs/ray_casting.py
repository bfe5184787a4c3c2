"""Where rays from points meet the faces of a part, and segments: what curves and panels have in
common."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np

from ...arrays import Array, Index, Mask
from ...frozen import frozen
from ...round_off import WRITTEN

TOGETHER = 1 << 18
"""Pairs of a point and a face that are looked at together."""


def along(direction: Array | None, normal: Array) -> Array:
    """The direction at points with outward normals (m, d): these, or the one that is given."""
    return (
        normal
        if direction is None
        else np.broadcast_to(direction / np.linalg.norm(direction), normal.shape)
    )


@frozen
class Hits:
    """Where m points meet the faces of a part.

    Attributes
    ----------
    face : (m,) array
        Number of the face, -1 where none is met.
    place : (m,) or (m, 2) array
        Fraction of the arc length of a curve, or local coordinates of a panel.
    distance : (m,) array
        Along the direction, negative behind the point; infinite where none is met [length].
    """

    face: Index
    place: Array
    distance: Array


@frozen
class Segments:
    """Quadrature points on a part where it faces another one; each segment lies on one face of
    either.

    Attributes
    ----------
    face, other : (q,) arrays
        Numbers of the face that a point lies on, and of the one of the other part that it faces.
    place, opposite : (q,) or (q, 2) arrays
        Places of the point, and of the one that is faced, as in `Hits`.
    weight : (q,) array
        On the part that faces the other [length, in space area].
    """

    face: Index
    place: Array
    other: Index
    opposite: Array
    weight: Array

    def take(self, chosen: Mask) -> Segments:
        """The points with these numbers."""
        return Segments(*(getattr(self, key)[chosen] for key in Segments.__annotations__))

    @staticmethod
    def joined(parts: list[Segments]) -> Segments:
        """All points of some lists, at least one."""
        return Segments(
            *(
                np.concatenate([getattr(part, key) for part in parts])
                for key in Segments.__annotations__
            )
        )


class Faces(ABC):
    """Curves or panels of a part that points of another one face, with the body behind them."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def at(self, number: Index, place: Array) -> tuple[Array, Array]:
        """Points (k, d) and outward normals (k, d) at places of some faces."""

    SAMPLES: ClassVar[int]
    """Points along each direction at which a face is looked at between its nodes."""

    @abstractmethod
    def spread(self, number: Index, share: Array) -> Array:
        """Places, as in `Hits`, of some faces (k,) at shares (k, d-1) of their directions, from 0
        to 1 of each."""

    @abstractmethod
    def rims(self) -> tuple[Index, Array, Array]:
        """Numbers of the faces and places where the sides of panels begin and end; the ends of
        curves, twice."""

    @abstractmethod
    def segments(
        self, other: Any, order: Index, opposite: Index, direction: Array | None
    ) -> Segments:
        """Where these faces, of orders (n,), face those of another part of the same kind, of orders
        `opposite`.

        Along the outward normals, or a direction; products of the two polynomials are integrated
        exactly where the faces are straight or flat.
        """

    def cast(self, x: Array, direction: Array) -> Hits:
        """The nearest meeting of the lines x + t·direction with faces whose outward normal points
        against it.

        It lies behind a point only where the body overlaps it: the far side of a body is no face
        that meets it.

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
        """Which of the meetings at some distances (m,) lie behind a point and beyond another face,
        which looks its way."""
        result = distance < 0.0
        behind = np.flatnonzero(result)
        half = 0.5 * distance[behind, None] * direction[behind]
        between = self._cast(x[behind] + half, -direction[behind]).distance
        result[behind] = np.abs(between) < (0.5 - WRITTEN) * -distance[behind]
        return result

    def _goes_round(self, number: Index, direction: Array, depth: Array) -> Mask:
        """Which of some faces are turned along a direction somewhere, or nearly so, and are smaller
        than some depth: of a line that meets one twice, outward and inward, or touches it, only one
        meeting is found."""
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
        """The nearest meeting, wherever it is."""
