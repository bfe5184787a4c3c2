"""Shapes of rigid tools, and the distance to them along rays as one kind of `Given`.

A line crosses a convex set on one interval, whose ends are known in closed form. Of other shapes it
is the interval that counts for a body beside it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..geometry.noise import Noise
from ..record import record
from .features import where_zero
from .sites import Sites, Way
from .values import Given, as_given

Crossing = tuple[Array, Array, Array]
"""Of m lines, the distances at which they enter and leave a shape, and those at which they are
closest to its middle, (m,) each [length]. A line that misses enters after it leaves."""


class Shape(ABC):
    """A set of points in d dimensions."""

    @property
    @abstractmethod
    def dim(self) -> int:
        """Number of dimensions."""

    @property
    def degree(self) -> float:
        """Degree of the distance along equal directions, as of `Given`."""
        return math.inf

    @abstractmethod
    def crossing(self, x: Array, ray: Array) -> Crossing:
        """Return where lines through points (m, d) along unit vectors (m, d) cross the set."""

    def beside(self, x: Array, ray: Array) -> Array:
        """Return how far corners lie to one side of lines (k, m), where the distance is rough."""
        return np.empty((0, len(x)))

    def noise_at(self, x: Array, reach: float) -> Noise:
        """Return what the noise of measured points does to the mean curvature so far on either
        side of a place (d,)."""
        return Noise()


@record
class Ball(Shape):
    """A disc in the plane, a ball in space."""

    centre: tuple[float, ...]
    radius: float

    @property
    def dim(self) -> int:
        return len(self.centre)

    def crossing(self, x: Array, ray: Array) -> Crossing:
        to_centre = np.array(self.centre) - x
        middle = np.einsum("md,md->m", to_centre, ray)
        off = np.linalg.norm(to_centre - middle[:, None] * ray, axis=1)
        return _around(middle, off, self.radius)


@record
class HalfSpace(Shape):
    """All points behind a plane, in the plane behind a straight line; the normal points out."""

    point: tuple[float, ...]
    normal: tuple[float, ...]

    @property
    def dim(self) -> int:
        return len(self.normal)

    degree = 1.0

    def crossing(self, x: Array, ray: Array) -> Crossing:
        normal = np.array(self.normal) / np.linalg.norm(self.normal)
        approach, apart = -ray @ normal, (x - np.array(self.point)) @ normal
        meets = approach > 0.0
        enter = np.where(meets, apart / np.where(meets, approach, 1.0), np.inf)
        return enter, np.where(meets, np.inf, -np.inf), np.zeros(len(x))


@record
class Rod(Shape):
    """A cylinder in space between two flat ends, or a bore, which is open at its ends."""

    start: tuple[float, ...]
    end: tuple[float, ...]
    radius: float
    is_bore: bool = False

    dim = 3

    def crossing(self, x: Array, ray: Array) -> Crossing:
        length = math.dist(self.start, self.end)
        axis = np.subtract(self.end, self.start) / length
        height, along = (x - np.array(self.start)) @ axis, ray @ axis
        enter, leave, middle = self._curved(x - height[:, None] * axis, ray - np.outer(along, axis))
        if self.is_bore:
            crossed = np.isfinite(leave)
            at = height + along * np.where(crossed, leave, 0.0)
            met = crossed & (at >= 0.0) & (at <= length)
            return np.where(met, enter, np.inf), np.where(met, leave, -np.inf), middle
        first, last = between(height, along, length)
        return np.maximum(enter, first), np.minimum(leave, last), middle

    def _curved(self, x: Array, across: Array) -> Crossing:
        """Return where lines cross the cylinder without ends; `across` (m, 3) is the part of the
        rays across its axis. A line along the axis is inside everywhere or nowhere."""
        speed = np.linalg.norm(across, axis=1)
        turned = speed > 0.0
        speed = np.where(turned, speed, 1.0)
        to_axis, way = np.array(self.start) - x, across / speed[:, None]
        middle = np.einsum("md,md->m", to_axis, way)
        off = np.linalg.norm(to_axis - middle[:, None] * way, axis=1)
        enter, leave, middle = (each / speed for each in _around(middle, off, self.radius))
        within = ~turned & (off <= self.radius)
        return np.where(within, -np.inf, enter), np.where(within, np.inf, leave), middle


def between(height: Array, along: Array, length: float) -> tuple[Array, Array]:
    """Return where lines enter and leave the layer of heights from 0 to `length`."""
    level = along == 0.0
    slope = np.where(level, 1.0, along)
    first, last = np.sort([-height / slope, (length - height) / slope], axis=0)
    outside = np.where((height >= 0.0) & (height <= length), -np.inf, np.inf)
    return np.where(level, outside, first), np.where(level, -outside, last)


def _around(middle: Array, off: Array, radius: float) -> Crossing:
    """Return the crossing of lines that pass a centre at distances `off` (m,)."""
    half = np.sqrt(np.maximum((radius - off) * (radius + off), 0.0))
    missed = off > radius
    enter, leave = np.where(missed, np.inf, middle - half), np.where(missed, -np.inf, middle + half)
    return enter, leave, middle


@record
class Aimed:
    """A shape as the nodes of a contact see it.

    Attributes
    ----------
    name, word : str
        Name of the obstacle, and the word for its shape, for errors.
    shape : Shape
    direction : tuple of float, optional
        Unit vector of all rays; the outward normals by default [-].
    hollow : bool
        Whether the body lies inside.
    """

    name: str
    word: str
    shape: Shape
    direction: tuple[float, ...] | None = None
    hollow: bool = False

    def __str__(self) -> str:
        return f"distance to the {self.word} {self.name!r}"


class Distance(Given):
    """The distance to a shape along rays, negative where the point overlaps it [length].

    It is infinite where the ray misses, or where the shape lies behind the point.

    Examples
    --------
    >>> import numpy as np
    >>> ground = Sites(np.array([[0.0, 0.0], [0.6, 0.0], [2.0, 0.0]]), np.array(3 * [[0.0, 1.0]]))
    >>> roller = Distance("gap", Aimed("roller", "circle", Ball((0.0, 1.5), 1.0)))
    >>> roller.at(ground).round(6).tolist()
    [0.5, 0.7, inf]
    """

    source: Aimed

    def values(self, sites: Sites) -> Array:
        distance, _ = self._distances(sites)
        return distance

    def at(self, sites: Sites) -> Array:
        """Return the values (n,), which may be infinite: such a point faces nothing."""
        return self.values(sites)

    def near(self, sites: Sites, otherwise: float = 0.0) -> Array:
        """Return the values (n,).

        Where the ray misses they are infinite if `otherwise` is. Else they go on as the distance
        to the middle of the shape, which joins a round one without a jump.
        """
        distance, beyond = self._distances(sites)
        return distance if np.isinf(otherwise) else np.where(np.isinf(distance), beyond, distance)

    @property
    def degree(self) -> float:
        return self.source.shape.degree

    def noise_at(self, x: Array, reach: float) -> Noise:
        return self.source.shape.noise_at(x, reach)

    def features(self, way: Way) -> tuple[Array, Array]:
        def beside(fractions: Array) -> Array:
            sites = way(fractions)
            return self.source.shape.beside(sites.x, self._rays(sites))

        return where_zero(beside)

    @property
    def words(self) -> str:
        return f"{self.key}: {self.source}"

    def _rays(self, sites: Sites) -> Array:
        """Return the unit vectors (n, d) along which sites look at the shape."""
        aimed, d = self.source, sites.x.shape[1]
        if aimed.shape.dim != d:
            flat = d == 3 and aimed.word in ("polygon", "points")
            hint = "; along says in which direction it is the same" if flat else ""
            raise InputError(
                f"{self.key}: obstacle {aimed.name!r} has the shape {aimed.word!r} in "
                f"{aimed.shape.dim} dimensions; the body has {d}{hint}"
            )
        ray = sites.normal if aimed.direction is None else np.array([aimed.direction])
        if ray is None:
            raise InputError(f"{self.words} is known on the surface only")
        return np.broadcast_to(ray, sites.x.shape)

    def _distances(self, sites: Sites) -> tuple[Array, Array]:
        """Return the distances, and those to the middle of the shape."""
        aimed = self.source
        enter, leave, middle = aimed.shape.crossing(sites.x, self._rays(sites))
        met = (enter <= leave) & ((enter <= 0.0) if aimed.hollow else (leave > 0.0))
        return np.where(met, leave if aimed.hollow else enter, np.inf), middle


as_given.register(Aimed, lambda source, key: Distance(key, source))
