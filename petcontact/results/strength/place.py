"""A place of a body where stress has no bound."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Mask
from ...fields.boundary.places import sizes
from ...mesh.boundary_mesh import BoundaryMesh
from ...refinement.corner_modes import STRONG, Expansion

SHARE = 0.1
"""Distance from a place without a bound at which the stress beside it is told, over the size of its
feature. It is a definition: stress falls from there without an end. The feature is as large as the
distance to the next corner or edge, or as the radius of a side that is an arc, if that is less."""


TOLD = 1e-4
"""Distance from a place with an exponent of nearly 1, over the size of its feature, at which stress
is meant that is told as a value. It is a definition, as in `refinement.corner_modes.STRONG`."""


@dataclass(frozen=True, eq=False)
class Place:
    """Where the stress of a body has no bound.

    Attributes
    ----------
    body : str
    ends : (2, d) array
        Of an edge; a point is both its ends [length].
    elements : tuple of int
        Elements of the body that meet there; none where a force acts inside.
    sides : str
        The parts that meet there, or what presses there.
    size : float
        Of its feature [length].
    along, inward : (d,) arrays
        Unit vectors in which the modes are given: along the side θ = 0, away from the place, and
        into the body.
    angle : float
        Of the body [rad].
    expansions : tuple of Expansion
        How stress grows towards it, in the plane across it and out of that; none where it grows
        like 1/r under a force, or like a logarithm under an apex.
    pressed : bool
        Whether the side θ = 0 is in contact that may part or slide: K is that of the pressure.
    core : float
        Distance within which contact does something else than what the modes are of [length].
    logarithmic : bool
        Whether stress grows like a logarithm of the distance, or nearly so, by what is known on
        its sides.
    """

    body: str
    ends: Array
    elements: tuple[int, ...]
    sides: str
    size: float
    along: Array
    inward: Array
    angle: float = math.pi
    expansions: tuple[Expansion, ...] = ()
    pressed: bool = False
    core: float = 0.0
    logarithmic: bool = False

    @property
    def weak(self) -> bool:
        """Whether stress grows so slowly that it is told as a value."""
        return bool(self.expansions) and not any(each.modes for each in self.expansions)

    def growth(self, mesh: BoundaryMesh) -> float:
        """How much stress changes from elements at the place to where it is told as a value [-]."""
        known = self.end_size(mesh) / (TOLD * self.size)
        return float(abs(known ** (1.0 - min(each.least for each in self.expansions)) - 1.0))

    def halvings(self, mesh: BoundaryMesh) -> float:
        """The change of stress there by all halvings of the elements at the place down to where it
        is told as a value, over that by the last one: each changes it 2^(1-λ) times as much.

        What `growth` knows, since λ is nearly 1 and nothing but itself grows, is not counted.
        """
        count = math.ceil(math.log2(max(self.end_size(mesh) / (TOLD * self.size), 1.0)))
        slowest = 1.0 if self.logarithmic else min(each.slowest for each in self.expansions)
        if not self.logarithmic and slowest < 2.0 - STRONG:
            return 1.0
        return float(np.sum(2.0 ** ((1.0 - slowest) * np.arange(1, count + 1))))

    def end_size(self, mesh: BoundaryMesh) -> float:
        """The size of the largest element that ends at it [length]."""
        return 2.0 * float(sizes(mesh)[list(self.elements)].max(initial=0.0))

    def reach(self, mesh: BoundaryMesh) -> float:
        """How far from it stress has no bound: up to where that beside it is told, and in elements
        that end there [length]."""
        return max(self.distance, self.end_size(mesh))

    @property
    def x(self) -> Array:
        """The middle (d,) [length]."""
        return np.asarray(self.ends.mean(axis=0))

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from other places of its mesh; what grows there does not count."""
        arrays = (self.ends.tobytes(), self.along.tobytes(), self.inward.tobytes())
        return *arrays, self.elements, self.size, self.angle, self.core

    @property
    def is_edge(self) -> bool:
        """Whether it is a line in space."""
        return bool(np.any(self.ends[0] != self.ends[1]))

    @property
    def width(self) -> float:
        """How far beside it in space nodes count as beside it: the length of an edge [length]."""
        length = float(np.linalg.norm(self.ends[1] - self.ends[0]))
        return length or self.distance

    @property
    def distance(self) -> float:
        """How far from it the stress beside it is told [length]."""
        return SHARE * self.size

    def around(self, theta: Array) -> Array:
        """Points (n, d) at the distance at which stress is told, at angles (n,) [length]."""
        way = np.outer(np.cos(theta), self.along) + np.outer(np.sin(theta), self.inward)
        return np.asarray(self.x + self.distance * way)

    def nearest_to(self, x: Array) -> Array:
        """The nearest points of the edge to points (n, d), (n, d) [length]."""
        start, along = self.ends[0], self.ends[1] - self.ends[0]
        share = (x - start) @ along / max(float(along @ along), np.finfo(float).tiny)
        return np.asarray(start + np.clip(share, 0.0, 1.0)[:, None] * along)

    def away(self, x: Array) -> Array:
        """The distances of points (n, d) from the edge, (n,) [length]."""
        return np.asarray(np.linalg.norm(x - self.nearest_to(x), axis=1))

    def leaves_out(self, x: Array) -> Mask:
        """Which points (n, d) are nearer than where the stress beside it is told."""
        return np.asarray(self.away(x) < self.distance)
