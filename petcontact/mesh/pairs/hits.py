"""Where rays and perpendiculars from points meet the faces of a part: what curves and panels have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index, Mask

SLACK = 1e-9
"""Fractions beyond an end by less still meet it."""
TOGETHER = 1 << 18
"""Pairs of a point and a face that are looked at together."""


def along(direction: Array | None, normal: Array) -> Array:
    """The direction at points with outward normals (m, d): these, or the one that is given."""
    return normal if direction is None else np.broadcast_to(direction / np.linalg.norm(direction), normal.shape)


@dataclass(frozen=True)
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

    def where(self, seen: Mask) -> Hits:
        """The same for some of the points (m,), none for the others."""
        return Hits(np.where(seen, self.face, -1), self.place, np.where(seen, self.distance, np.inf))


class Faces(ABC):
    """Curves or panels of a part that points of another one face, with the body behind them."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def at(self, number: Index, place: Array) -> tuple[Array, Array]:
        """Points (k, d) and outward normals (k, d) at places of some faces."""

    @abstractmethod
    def samples(self) -> tuple[Index, Array]:
        """Numbers and places of points spread evenly over every face, its ends or corners among them."""

    @abstractmethod
    def stretch(self, number: Index, distance: Array) -> Array:
        """Length or area at a distance along the normals over that of the faces themselves, (k,)."""

    @abstractmethod
    def _cast(self, x: Array, direction: Array) -> Hits: ...

    @abstractmethod
    def _foot(self, x: Array, normal: Array) -> Hits: ...

    def comes_from(self, x: Array, normal: Array, direction: Array | None) -> Hits:
        """From where on the faces points with outward normals (m, d) are met, by perpendiculars or against a direction."""
        if direction is None:
            return self.foot(x, normal)
        # what looks away is met through the body
        return self.cast(x, -along(direction, normal)).where(normal @ direction < 0.0)

    def cast(self, x: Array, direction: Array) -> Hits:
        """The nearest meeting of the lines x + t·direction with faces whose outward normal points against it.

        Parameters
        ----------
        x, direction : (m, d) arrays
            Points [length] and unit vectors.
        """
        return self._in_turns(x, direction, self._cast)

    def foot(self, x: Array, normal: Array) -> Hits:
        """The nearest foot of a perpendicular from points x, whose normals (m, d) point against that of the face.

        The distance is along the face's outward normal.
        """
        return self._in_turns(x, normal, self._foot)

    def _in_turns(self, x: Array, vector: Array, meet: Callable[[Array, Array], Hits]) -> Hits:
        """What `meet` finds, some points at a time: its temporaries have an entry for each point and face."""
        step = max(1, TOGETHER // max(1, len(self)))
        parts = [meet(x[k : k + step], vector[k : k + step]) for k in range(0, max(1, len(x)), step)]
        return Hits(*(np.concatenate([getattr(part, key) for part in parts]) for key in ("face", "place", "distance")))
