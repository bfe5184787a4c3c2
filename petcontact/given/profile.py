"""Plane profiles of rigid tools: closed polygons with rounded corners, and curves through points.

Lines and arcs meet a ray in closed form.
"""

from __future__ import annotations

import functools
import itertools
from abc import abstractmethod
from collections.abc import Sequence
from typing import cast

import numpy as np

from ..arrays import Array, Index, Mask
from ..geometry.arcs import cross, half_angles
from ..geometry.fillets import rounded
from ..geometry.noise import Noise
from ..geometry.outline import Side
from ..geometry.smooth_curve import SmoothCurve, SmoothSide
from ..record import field, record
from ..round_off import ROUNDED, WRITTEN
from .shapes import Crossing, Shape

TOGETHER = 1 << 18
"""Pairs of a ray and a side that are examined at once."""
CHORDS = 16
"""Chords of a side, which turns by 30 degrees at most."""
NEWTON = 10
"""Most steps of Newton's method, or halvings where it leaves its chord; mostly four are enough."""


@record
class Profile(Shape):
    """What lies to the left of a closed loop, or behind an open curve.

    Attributes
    ----------
    is_bore : bool
        Whether the body lies inside.
    """

    is_bore: bool = field(default=False, kw_only=True)

    dim = 2

    @property
    def is_open(self) -> bool:
        """Whether it is a curve with ends."""
        return False

    @property
    @abstractmethod
    def pieces(self) -> int:
        """Number of pieces that a ray may meet."""

    @abstractmethod
    def hits(self, x: Array, ray: Array) -> tuple[Array, Mask]:
        """Return the distances (m, k) at which lines meet it, else NaN, and whether they enter."""

    @abstractmethod
    def middle(self, x: Array, ray: Array) -> Array:
        """Return the distances (m,) with which gaps go on beside it."""

    def crossing(self, x: Array, ray: Array) -> Crossing:
        """Return the interval of each line that begins before the body and ends beyond it.

        A tool may have several of them. A tool beside the body is met where its first interval
        that ends beyond the point begins. A bore is left where the last one that begins before the
        point ends. An open curve is met where it is nearest to the point.
        """
        step = max(1, TOGETHER // self.pieces)
        blocks = range(0, max(1, len(x)), step)
        parts = [self._crossing(x[k : k + step], ray[k : k + step]) for k in blocks]
        enter, leave = map(np.concatenate, zip(*parts, strict=True))
        return enter, leave, self.middle(x, ray)

    def _crossing(self, x: Array, ray: Array) -> tuple[Array, Array]:
        t, enters = self.hits(x, ray)
        if self.is_open:
            t = np.where(np.isnan(t), np.inf, t)
            nearest = t[np.arange(len(t)), np.abs(t).argmin(axis=1)]
            return nearest, np.where(np.isinf(nearest), -np.inf, np.inf)
        start, end = np.where(enters, t, np.nan), np.where(enters, np.nan, t)
        if self.is_bore:
            enter = np.where(start <= 0.0, start, -np.inf).max(axis=1, initial=-np.inf)
            leave = np.where(end >= enter[:, None], end, np.inf).min(axis=1, initial=np.inf)
            return np.where(np.isinf(enter), np.inf, enter), leave
        leave = np.where(end >= 0.0, end, np.inf).min(axis=1, initial=np.inf)
        enter = np.where(start <= leave[:, None], start, -np.inf).max(axis=1, initial=-np.inf)
        met = np.isfinite(leave) & np.isfinite(enter)
        return np.where(met, enter, np.inf), np.where(met, leave, -np.inf)


@record
class RoundedPolygon(Profile):
    """A closed loop of straight sides and arcs.

    Attributes
    ----------
    vertices : tuple of points
        Corners, in either direction [length].
    fillet : float
        Radius of all corners [length].

    Raises
    ------
    InputError
        As of `rounded`, when the sides are asked for.

    Examples
    --------
    >>> block = RoundedPolygon(((0.0, 1.0), (4.0, 1.0), (4.0, 2.0), (0.0, 2.0)), 0.5)
    >>> x, up = np.array([[2.0, 0.0], [0.2, 0.0], [5.0, 0.0]]), np.array(3 * [[0.0, 1.0]])
    >>> block.crossing(x, up)[0].round(6).tolist()
    [1.0, 1.1, inf]
    """

    vertices: tuple[tuple[float, ...], ...]
    fillet: float = 0.0

    @functools.cached_property
    def sides(self) -> list[Side]:
        """Straight ones and arcs, counter-clockwise."""
        return rounded(np.array(self.vertices), self.fillet)

    @property
    def pieces(self) -> int:
        """Number of sides."""
        return len(self.sides)

    @functools.cached_property
    def corners(self) -> Array:
        """Where one side ends and the next one begins, (n, 2) [length]."""
        return np.array([side.start for side in self.sides])

    def beside(self, x: Array, ray: Array) -> Array:
        """Return how far ends of sides lie to the left of lines."""
        return cross(ray, self.corners[:, None] - x)

    def hits(self, x: Array, ray: Array) -> tuple[Array, Mask]:
        """Return where lines meet sides, in closed form."""
        t, enters = self._on_lines(x, ray)
        for way in (-1.0, 1.0):
            further = self._on_arcs(x, ray, way)
            t, enters = (np.hstack(pair) for pair in zip((t, enters), further, strict=True))
        return t, enters

    @functools.cached_property
    def _lines(self) -> tuple[Array, Array]:
        """Starts and chords of the straight sides, (k, 2)."""
        chosen = [side for side in self.sides if side.curvature == 0.0]
        start = np.reshape([side.start for side in chosen], (-1, 2))
        return start, np.reshape([side.end for side in chosen], (-1, 2)) - start

    @functools.cached_property
    def _arcs(self) -> tuple[Array, Array, Array, Array]:
        """Centres (k, 2), curvatures (k,), unit vectors to the middles, and half angles of arcs."""
        chosen = [side for side in self.sides if side.curvature]
        start, end = (
            np.reshape([getattr(s, e) for s in chosen], (-1, 2)) for e in ("start", "end")
        )
        bend, chord = np.array([side.curvature for side in chosen]), end - start
        size = np.hypot(*chord.T)
        alpha = half_angles(size, bend)
        right = np.column_stack([chord[:, 1], -chord[:, 0]]) / size[:, None]
        rise = np.cos(alpha) / np.where(bend, bend, 1.0)
        centre = 0.5 * (start + end) - rise[:, None] * right
        return centre, bend, np.sign(bend)[:, None] * right, np.abs(alpha)

    def _on_lines(self, x: Array, ray: Array) -> tuple[Array, Mask]:
        start, chord = self._lines
        away = start - x[:, None]
        across = cross(ray[:, None], chord)
        with np.errstate(divide="ignore", invalid="ignore"):
            t, fraction = cross(away, chord) / across, cross(away, ray[:, None]) / across
            inside = (fraction >= -WRITTEN) & (fraction <= 1.0 + WRITTEN) & np.isfinite(t)
        return np.where(inside, t, np.nan), across < 0.0

    def _on_arcs(self, x: Array, ray: Array, way: float) -> tuple[Array, Mask]:
        """Where lines enter (-1) or leave (1) the circles of arcs."""
        centre, bend, middle, alpha = self._arcs
        offset = x[:, None] - centre
        along = np.einsum("mkc,mc->mk", offset, ray)
        off = cross(offset, ray[:, None])
        square = np.maximum(1.0 / bend**2 - off**2, 0.0)  # of a tangent it is round-off
        half = np.sqrt(np.where(np.abs(off * bend) <= 1.0, square, np.nan))
        t = way * half - along
        at = offset + t[..., None] * ray[:, None]
        turned = np.einsum("mkc,kc->mk", at, middle) * np.abs(bend)
        inside = turned >= np.cos(alpha) - WRITTEN
        return np.where(inside, t, np.nan), np.broadcast_to(way * bend < 0.0, t.shape)

    def middle(self, x: Array, ray: Array) -> Array:
        """Where lines are closest to the rounded corner that they touch first, which joins the
        distance to it, or to the middle of a polygon with sharp corners, where it jumps."""
        centre, bend, *_ = self._arcs
        if not (convex := bend > 0.0).any():
            to_middle = self.corners.mean(axis=0) - x
            return np.asarray(np.einsum("mc,mc->m", to_middle, ray))
        offset = centre[convex] - x[:, None]
        along, off = np.einsum("mkc,mc->mk", offset, ray), np.abs(cross(offset, ray[:, None]))
        apart = off - 1.0 / bend[convex]
        least = apart.min(axis=1, keepdims=True)
        first = np.where(apart <= least + WRITTEN * (1.0 + np.abs(least)), along, np.inf)
        return np.asarray(first.min(axis=1))


@record
class CurveProfile(Profile):
    """A smooth curve, with the body on its left where it is closed.

    Attributes
    ----------
    curve : SmoothCurve

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> rail = CurveProfile(SmoothCurve(tuple(zip(x, 0.5 * x**2))))
    >>> rail.crossing(np.array([[0.2, -1.0]]), np.array([[0.0, 1.0]]))[0].round(6).tolist()
    [1.02]
    """

    curve: SmoothCurve

    @property
    def is_open(self) -> bool:
        """Whether the curve has ends."""
        return not self.curve.closed

    @property
    def pieces(self) -> int:
        """Number of chords among which those that a ray meets are looked for."""
        return len(self._chords[0]) - 1

    def noise_at(self, x: Array, reach: float) -> Noise:
        """Return that of the curve."""
        return self.curve.noise_at(x, reach)

    @functools.cached_property
    def _chords(self) -> tuple[Array, Array]:
        """Parameters (n + 1,) and points of chords along the curve, which reach a little beyond
        both ends."""
        sides = cast(list[SmoothSide], self.curve.sides(""))
        ends = [sides[0].first, *(side.last for side in sides)]
        pieces = [np.linspace(a, b, CHORDS + 1)[1:] for a, b in itertools.pairwise(ends)]
        u = np.concatenate([ends[:1], *pieces])
        u[[0, -1]] += np.array([-WRITTEN, WRITTEN]) * self.curve.length
        return u, self.curve.at(u)

    def hits(self, x: Array, ray: Array) -> tuple[Array, Mask]:
        """Return where lines meet the curve, between the ends of a chord that they cross."""
        left = cross(self._chords[1] - x[:, None], ray[:, None]) > 0.0
        row, chord = np.nonzero(left[:, 1:] != left[:, :-1])
        u = self._meeting(x[row], ray[row], chord, left[row, chord])
        at = (np.arange(len(row)) - np.searchsorted(row, row)).astype(np.int64)
        found = np.full((len(x), int(at.max(initial=0)) + 1), np.nan)
        enters = np.zeros(found.shape, dtype=bool)
        found[row, at] = np.einsum("ij,ij->i", self.curve.at(u) - x[row], ray[row])
        enters[row, at] = cross(ray[row], self.curve.at(u, 1)) < 0.0
        return found, enters

    def _meeting(self, x: Array, ray: Array, chord: Index, before: Mask) -> Array:
        """Return the parameters (n,) at which lines meet the curve by Newton's method; `before`:
        whether the curve begins to their left."""
        low, high = self._chords[0][chord], self._chords[0][chord + 1]
        u = 0.5 * (low + high)
        for _ in range(NEWTON):
            off = cross(self.curve.at(u) - x, ray)
            low, high = np.where((off > 0.0) == before, [u, high], [low, u])
            slope = cross(self.curve.at(u, 1), ray)
            step = u - off / np.where(slope == 0.0, np.inf, slope)
            last, u = u, np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
            if np.abs(u - last).max(initial=0.0) <= ROUNDED * self.curve.length:
                break
        return np.asarray(u)

    def middle(self, x: Array, ray: Array) -> Array:
        """Return where lines are closest to the nearer end of the curve, which joins the distance
        to it there."""
        away = self._chords[1][[0, -1]] - x[:, None]
        along, off = np.einsum("mkc,mc->mk", away, ray), np.abs(cross(away, ray[:, None]))
        return np.asarray(np.where(off[:, 0] < off[:, 1], along[:, 0], along[:, 1]))


@record
class Extruded(Shape):
    """A profile in space, the same all along a direction.

    Attributes
    ----------
    section : Shape
        In the plane across the direction.
    axes : ((3,), (3,)) tuples
        Unit vectors in space of the coordinates of the section [-].
    """

    section: Shape
    axes: Sequence[tuple[float, ...]]

    dim = 3

    def _across(self, x: Array, ray: Array) -> tuple[Array, Array, Array]:
        """Return points and unit vectors (m, 2) in the plane, and what these were shortened by."""
        axes = np.array(self.axes).T
        across = ray @ axes
        speed = np.hypot(*across.T)
        turned = speed[:, None] > WRITTEN
        way = np.where(turned, across / np.where(turned, speed[:, None], 1.0), [1.0, 0.0])
        return x @ axes, way, speed

    def crossing(self, x: Array, ray: Array) -> Crossing:
        """Return the crossing with the section; a line along the direction meets nothing."""
        x, way, speed = self._across(x, ray)
        meets, speed = speed > WRITTEN, np.maximum(speed, WRITTEN)
        enter, leave, middle = (each / speed for each in self.section.crossing(x, way))
        return np.where(meets, enter, np.inf), np.where(meets, leave, -np.inf), middle

    def beside(self, x: Array, ray: Array) -> Array:
        """Return those of the section."""
        return self.section.beside(*self._across(x, ray)[:2])

    def noise_at(self, x: Array, reach: float) -> Noise:
        """Return that of the section."""
        return self.section.noise_at(np.array(self.axes) @ x, reach)
