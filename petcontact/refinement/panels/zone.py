"""Zones of contact and of stick on charts of faces: ellipses and long bands."""

from __future__ import annotations

import math

import numpy as np
import scipy

from ...arrays import Array, Mask, States
from ...record import field, record, replace
from ...round_off import SINGLE, to_single

STRAY = 0.1
"""Share of a contact that differs from the ellipse outside a strip at its edge, from which on it is
none [-]."""
STRIP = 0.04
"""Half the width of this strip over the radius [-]: one row of nodes there may be open or
closed."""
OUTER, BEYOND = 0.5, 0.015
"""`OUTER` is the squared radius from which p² is taken to fall linearly to the edge [-]. On panels
that the edge cuts, nodes were closed up to a squared radius of `BEYOND` outside of it [-]."""
ELONGATED = 3.0
"""Largest ratio of the axes of an ellipse [-]."""

MOST = 1.2
"""Largest half-width of lines along a band over the usual one [-]. Hertz' slices are wider next to
sharp ends."""


@record
class ContactEllipse:
    """An ellipse on a chart: place = centre + axes z, |z| <= 1.

    Attributes
    ----------
    centre : (2,) array
        [length]
    axes : (2, 2) array
        Both semi-axes as columns, right-handed [length].
    middle, stick : (2,) array, float
        Centre z and radius |z| of the disc that sticks [-]; 1 where none is known.
    """

    centre: Array
    axes: Array
    middle: Array = field(default_factory=lambda: np.zeros(2))
    stick: float = 1.0

    def local(self, place: Array) -> Array:
        """Return z (n, 2) of places (n, 2)."""
        return np.asarray((place - self.centre) @ np.linalg.inv(self.axes).T)

    def at(self, z: Array) -> Array:
        """Return the places (..., 2) of coordinates z (..., 2)."""
        return np.asarray(self.centre + z @ self.axes.T)

    def holds(self, place: Array) -> Mask:
        """Return which places (n, 2) lie in the zone."""
        return np.asarray(np.linalg.norm(self.local(place), axis=1) <= 1.0)

    def away(self, place: Array) -> Mask:
        """Return which places (n, 2) are away from ends where p is infinite: all are."""
        return np.full(len(place), True)

    @property
    def corners(self) -> Array:
        """Corners (4, 2) of the rectangle around it [length]."""
        reach = np.linalg.norm(self.axes, axis=1)
        return np.asarray(self.centre + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * reach)

    @property
    def points(self) -> Array:
        """Its centre and the ends of both axes (3, 2) [length]."""
        return self.centre + np.vstack([np.zeros(2), self.axes.T])

    def moved_by(self, other: ContactEllipse) -> float:
        """Return how far the edges of another zone, and of what sticks in it, are from those of
        this one, over its axes [-]."""
        axes = np.linalg.solve(self.axes, other.axes)
        stretch = np.sqrt(np.linalg.eigvalsh(axes @ axes.T)) - 1.0
        contact = np.abs(stretch).max() + np.linalg.norm(self.local(other.centre[None]))
        stick = abs(other.stick - self.stick) + np.linalg.norm(other.middle - self.middle)
        return float(max(contact, stick))

    def moved(self, places: Array) -> ContactEllipse:
        """Return the zone on another chart, where its points have places (3, 2)."""
        centre, axes = places[0], (places[1:] - places[0]).T
        if np.linalg.det(axes) > 0.0:
            return replace(self, centre=centre, axes=axes)
        other = np.array([1.0, -1.0])
        return replace(self, centre=centre, axes=axes * other, middle=self.middle * other)


@record
class ContactBand:
    """A long contact on a chart: a ridge, a half-width along it, and its two ends.

    Attributes
    ----------
    points, across : (k, 2) arrays
        Points of the ridge [length], and unit vectors across it, with the ridge right-handed.
    s, half, load : (k,) arrays
        Length along the ridge [length], half-width [length], load per length [force/length].
    ends : (float, float)
        Where contact begins and ends along the ridge [length].
    sharp : (bool, bool)
        Whether contact ends there with the face; elsewhere p is a root.
    mirrored : (bool, bool)
        Whether contact goes on there: beyond a plane of symmetry, or round the face.
    """

    points: Array
    across: Array
    s: Array
    half: Array
    load: Array
    ends: tuple[float, float]
    sharp: tuple[bool, bool]
    mirrored: tuple[bool, bool] = (False, False)

    @property
    def infinite(self) -> tuple[bool, bool]:
        """Whether p is infinite at the ends."""
        return self.sharp[0] > self.mirrored[0], self.sharp[1] > self.mirrored[1]

    @property
    def straight(self) -> bool:
        """Whether the ridge has one direction."""
        return bool(np.abs(self.across - self.across[:1]).max() < SINGLE)

    @property
    def widest(self) -> float:
        """The half-width under most of the load [length]."""
        force = self.load * np.gradient(self.s)
        return float(self.half @ force / force.sum())

    def at(self, s: Array) -> tuple[Array, Array]:
        """Return points and vectors across (n, 2) at places along the ridge, also beyond its
        ends."""
        across = np.column_stack([np.interp(s, self.s, column) for column in self.across.T])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        points = np.column_stack([np.interp(s, self.s, column) for column in self.points.T])
        beyond = s - np.clip(s, self.s[0], self.s[-1])
        return points + beyond[:, None] * np.column_stack([-across[:, 1], across[:, 0]]), across

    def load_at(self, s: Array) -> Array:
        """Return the load per length, q [force/length].

        q² is interpolated: q is a root where contact ends."""
        first, last = (None if sharp else 0.0 for sharp in self.sharp)
        return np.sqrt(np.interp(s, self.s, self.load**2, left=first, right=last))

    def lines_at(self, s: Array, least: float) -> Array:
        """Return the half-widths of lines along the band (n,), at least a share of the usual one
        [length]."""
        first, last = (None if sharp else 0.0 for sharp in self.sharp)
        half = np.sqrt(np.interp(s, self.s, self.half**2, left=first, right=last))
        return np.clip(half, least * self.widest, MOST * self.widest)

    def coordinates(self, place: Array) -> tuple[Array, Array]:
        """Return the distances across and the places along the ridge of points (n, 2), (n,)
        each [length]."""
        near = scipy.spatial.cKDTree(self.points).query(place)[1]
        away, across = place - self.points[near], self.across[near]
        along = away[:, 1] * across[:, 0] - away[:, 0] * across[:, 1]
        return np.sum(away * across, axis=1), self.s[near] + along

    def moved(self, places: Array) -> ContactBand:
        """Return the band on another chart, where its points have places (k, 2)."""
        way = np.gradient(places, axis=0)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        across = np.column_stack([way[:, 1], -way[:, 0]])
        return replace(self, points=places, across=across)

    def away(self, place: Array) -> Mask:
        """Return which places (n, 2) are away from ends where p is infinite."""
        return self.is_inside(self.coordinates(place)[1])

    def is_inside(self, along: Array) -> Mask:
        """Return which places along the ridge are a half-width away from ends where p is
        infinite."""
        ends = [end for end, here in zip(self.ends, self.infinite, strict=True) if here]
        away = [np.abs(along - end) > self.widest for end in ends]
        return np.asarray(np.all(away, axis=0) if away else np.full(len(along), True))

    @property
    def corners(self) -> Array:
        """Corners (4, 2) of the band [length]."""
        points, across = self.at(np.array(self.ends))
        return np.concatenate([points - self.widest * across, points + self.widest * across])

    def holds(self, place: Array) -> Mask:
        """Return which points (n, 2) of the chart lie in the band."""
        across, along = self.coordinates(place)
        half = np.interp(along, self.s, self.half)
        inside = (along >= self.ends[0]) & (along <= self.ends[1])
        return np.asarray(inside & (np.abs(across) < half))


Zone = ContactEllipse | ContactBand


def zone_of(place: Array, weight: Array, pressure: Array, closed: Mask) -> ContactEllipse | None:
    """Return the ellipse on which Hertz' pressure has the moments of the given pressure.

    The result is None if the contact has another shape. Hertz' pressure on semi-axes a, b has ∫p
    x²/∫p = a²/5. On meshes with errors of p of a tenth, moments have errors of a few thousandths.
    Other pressures have other moments: with friction the edge lies farther out by 4 %. The edge is
    therefore the zero of the line through p² over the squared radius, near it, and lies about
    between the last closed node and the first open one.

    Parameters
    ----------
    place : (m, 2) array
        Nodes on the chart [length].
    weight : (m,) array
        [area]
    pressure : (m,) array
        [stress]
    closed : (m,) bool array
        Which nodes are in contact, in any increment.
    """
    load = weight * pressure
    if not load.sum() > 0.0:
        return None
    centre = load @ place / load.sum()
    away = place - centre
    mean, vectors = principal_axes(away.T @ (away * load[:, None]) / load.sum())
    if not 0.0 < mean[1] <= ELONGATED**2 * mean[0]:
        return None
    zone = ContactEllipse(centre, vectors * np.sqrt(5.0 * mean))
    square = np.sum(zone.local(place) ** 2, axis=1)
    zone = replace(zone, axes=math.sqrt(_edge(square, weight, pressure)) * zone.axes)
    distance = np.linalg.norm(zone.local(place), axis=1)
    stray = (closed != (distance < 1.0)) & (np.abs(distance - 1.0) > STRIP)
    fits = weight[stray].sum() < (1.0 - SINGLE) * STRAY * weight[closed].sum()
    return zone if fits else None


def principal_axes(matrix: Array) -> tuple[Array, Array]:
    """Return the eigenvalues of a symmetric matrix (2, 2), the smaller one first, and unit vectors
    as right-handed columns.

    Every direction is one of a circle's: the first axis is taken there.
    """
    values, vectors = np.linalg.eigh(matrix)
    if np.ptp(values) <= SINGLE * np.abs(values).max():
        return values, np.eye(2)
    vectors[:, 1] *= np.linalg.det(vectors)
    return values, vectors


def _edge(square: Array, weight: Array, pressure: Array) -> float:
    """Return the squared radius (n,) of the edge, over that of Hertz' pressure with the same
    moments."""
    _, (low, high) = _parted(square, pressure > 0.0, weight)
    outer = (square > OUTER) & (pressure > 0.0)
    edge = _root(square[outer], pressure[outer] ** 2, weight[outer], 2)
    if not edge > OUTER:
        return float(np.clip(1.0, low, high))
    return float(np.clip(edge, low - BEYOND, high + BEYOND))


def with_stick(
    zone: ContactEllipse, place: Array, weight: Array, state: States, slip: Array
) -> ContactEllipse:
    """Return a zone with the disc that sticks, if stick and slip meet at one.

    Stick zones are such ellipses under a tangential load (Cattaneo) and under a growing normal load
    (Spence). They are shifted if a body is also stretched. The edge lies between the last node that
    sticks and the first that slips. |Δw| grows like the power 3/2 of the distance from the edge.
    The edge is the zero of the line through its power 2/3 over the squared radius. There is none if
    the disc is narrower than the strip about its edge, or its edge as near to that of contact.

    Parameters
    ----------
    zone : ContactEllipse
        The contact.
    place : (m, 2) array
        Nodes on the chart [length].
    weight : (m,) array
        [area]
    state : (m,) array
        0 stick, 1 slip, 2 open.
    slip : (m, 2) array
        Δw of the increment [length].
    """
    closed = state != 2
    z, area, slip = zone.local(place)[closed], weight[closed], slip[closed]
    sticks = state[closed] == 0
    total = area[sticks].sum()
    if sticks.all() or not total > 0.0:
        return zone
    middle = area[sticks] @ z[sticks] / total
    square = np.sum((z - middle) ** 2, axis=1)
    last, between = _parted(square, sticks, area)
    power = np.linalg.norm(slip[~sticks], axis=1) ** (2.0 / 3.0)
    radius = float(np.sqrt(np.clip(_root(square[~sticks], power, area[~sticks]), *between)))
    inside = square <= square[last]
    stray = total - np.sum(np.where(sticks, area, -area)[inside]) > STRAY * total
    # the strip about its edge leaves a strip inside of it, and one to the edge of contact
    fits = 2.0 * STRIP < radius < 1.0 - 2.0 * STRIP - np.linalg.norm(middle)
    return zone if stray or not fits else replace(zone, middle=middle, stick=radius)


def _parted(square: Array, inner: Mask, weight: Array) -> tuple[int, tuple[float, float]]:
    """Return the last node inside the circle that best separates inner nodes from others.

    Return the squared radii (n,) of this node and of the next one, too. Nodes on one circle are on
    one side, whatever round-off says.
    """
    rounded = to_single(square)
    order = np.argsort(rounded, kind="stable")
    inside = np.cumsum(np.where(inner, weight, -weight)[order])[:-1]
    last = int(np.where(np.diff(rounded[order]) > 0.0, inside, -np.inf).argmax())
    return int(order[last]), (float(square[order[last]]), float(square[order[last + 1]]))


def _root(square: Array, values: Array, weight: Array, degree: int = 1) -> float:
    """Return where the line, or the parabola, through values over squares of the radius falls or
    rises to zero like the line; NaN if the values differ by round-off only."""
    root, middle = np.sqrt(weight), float(square.mean()) if len(square) else 0.0
    (start, slope, *bend), *_ = np.linalg.lstsq(
        root[:, None] * np.vander(square - middle, degree + 1, True), root * values, rcond=None
    )
    if not abs(slope) * square.max(initial=0.0) > SINGLE * np.abs(values).max(initial=0.0):
        return np.nan
    share = 4.0 * start * sum(bend) / slope**2
    return (
        float(middle - 2.0 * start / (slope * (1.0 + math.sqrt(1.0 - share))))
        if share < 1.0
        else np.nan
    )
