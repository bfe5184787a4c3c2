"""Circular arcs by their end points and half the angle through which they turn: lengths, points,
normals, subdivision.

Straight lines are the arcs of angle 0. The body lies on the left, so that an arc of positive angle
bulges out of it. And whether 16 digits tell the places of a body from one another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays import LARGEST_COORDINATE, Array
from ..errors import InputError
from ..round_off import WRITTEN, least_pieces


def half_angles(chord: Array, curvature: Array | float) -> Array:
    """α, half the angle through which arcs turn, from the lengths of their chords; at most half a
    circle, signed [rad]."""
    if not np.any(curvature):
        return np.zeros(np.shape(chord))
    return np.asarray(np.arcsin(np.clip(0.5 * curvature * chord, -1.0, 1.0)))


def arc_lengths(chord: Array, alpha: Array | float) -> Array:
    """Lengths of arcs from those of their chords [length]."""
    return np.asarray(chord / np.sinc(alpha / np.pi)) if np.any(alpha) else np.asarray(chord)


def on_arcs(
    start: Array, end: Array, alpha: Array | float, xi: Array, tangent: Array | None = None
) -> tuple[Array, Array]:
    """Points on arcs and outward unit normals there.

    Parameters
    ----------
    start, end : (n, 2) or (2,) arrays
        End points [length].
    alpha : (n,) array or float
        Half the angle through which each arc turns, |α| < π [rad].
    xi : (n,) array
        Places in [-1, 1], in proportion to arc length.
    tangent : (n, 2) array, optional
        Unit vectors along the chords, where they are known better than from end points that lie
        close to one another.

    Returns
    -------
    points, normals : (n, 2) arrays
    """
    chord = end - start
    size = np.hypot(chord[..., 0], chord[..., 1])[..., None]
    tangent = chord / size if tangent is None else tangent
    if not np.any(alpha):  # straight ones: most bodies have no others
        right = np.empty((len(xi), 2))
        right[:, 0], right[:, 1] = tangent[..., 1] + 0.0, 0.0 - tangent[..., 0]
        return 0.5 * (start + end) + (0.5 * size[..., 0] * xi)[:, None] * tangent, right
    left = np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1)
    half, turn = 0.5 * arc_lengths(size[..., 0], alpha), alpha * xi
    along = half * xi * np.sinc(turn / np.pi)
    # (cos αξ - cos α) a/α, to the right of the chord where the arc turns left
    level = 2.0 * np.sin(0.5 * (alpha + turn)) * np.sin(0.5 * (alpha - turn))
    rise = half * level / np.where(np.equal(alpha, 0.0), 1.0, alpha)
    points = 0.5 * (start + end) + along[:, None] * tangent - rise[:, None] * left
    return points, np.sin(turn)[:, None] * tangent - np.cos(turn)[:, None] * left


def feet_on_arcs(
    x: Array,
    start: Array,
    end: Array,
    curvature: Array | float,
    alpha: Array | float,
    tangent: Array | None = None,
) -> tuple[Array, Array]:
    """Places on arcs nearest to points (n, 2), and the distances from the whole circles or lines.

    The places are fractions (n,) of the arc lengths, beyond [0, 1] off the ends. Other arguments
    are those of `on_arcs`.
    """
    chord = end - start
    if tangent is None:
        tangent = chord / np.hypot(chord[..., 0], chord[..., 1])[..., None]
    away = x - 0.5 * (start + end)
    t = away[..., 0] * tangent[..., 0] + away[..., 1] * tangent[..., 1]
    rise = away[..., 1] * tangent[..., 0] - away[..., 0] * tangent[..., 1]
    straight = np.equal(curvature, 0.0)
    radius = 1.0 / np.where(straight, 1.0, curvature)
    # from the centre of the arc, which is at radius·cos α to the left of the chord's middle
    across = radius * np.cos(alpha) - rise
    angle = np.arctan2(np.sign(radius) * t, np.sign(radius) * across)
    along = ((x - start) * chord).sum(axis=-1) / (chord * chord).sum(axis=-1)
    place = np.where(straight, along, 0.5 + 0.5 * angle / np.where(straight, 1.0, alpha))
    return place, np.abs(np.where(straight, rise, np.hypot(t, across) - np.abs(radius)))


def end_tangents(start: Array, end: Array, alpha: Array) -> tuple[Array, Array]:
    """Unit tangents (n, 2) at the start and at the end of arcs."""
    before, after = (on_arcs(start, end, alpha, np.full(len(start), xi))[1] for xi in (-1.0, 1.0))
    return np.column_stack([-before[:, 1], before[:, 0]]), np.column_stack(
        [-after[:, 1], after[:, 0]]
    )


def turn_of_radius(start: Array, end: Array, radius: float) -> float:
    """Half the angle of the smaller arc of a radius between two points, positive (to the left) for
    a positive radius.

    Raises
    ------
    InputError
        If the points lie further apart than two radii.
    """
    chord = float(np.hypot(*(end - start)))
    ratio = chord / (2.0 * abs(radius))
    if ratio > 1.0 + WRITTEN:
        raise InputError(f"radius {radius:g} is less than half the distance {chord:g} of its ends")
    return math.copysign(math.asin(min(1.0, ratio)), radius)


def turn_through(start: Array, middle: Array, end: Array) -> float:
    """Half the angle of the arc from start to end through a point, any below π; 0 if the three lie
    on a line in order.

    Raises
    ------
    InputError
        If the points lie on a line with `middle` outside.
    """
    a, b = middle - start, end - middle
    cross, dot = float(a[0] * b[1] - a[1] * b[0]), float(a @ b)
    if abs(cross) <= 1e-13 * (float(a @ a) + float(b @ b)):
        if dot <= 0.0:
            raise InputError(f"through = [{middle[0]:g}, {middle[1]:g}] makes no arc")
        return 0.0
    # inscribed angle: the tangent turns by twice the angle between the two chords
    return math.atan2(cross, dot)


def divided(start: Array, end: Array, alpha: float) -> Array:
    """Points (n + 1, 2) that cut an arc into n >= 1 equal pieces which turn by no more than
    LARGEST_TURN."""
    count = int(least_pieces(2.0 * abs(alpha) / (0.5 * math.pi)))
    points = on_arcs(start, end, alpha, np.linspace(-1.0, 1.0, count + 1))[0]
    points[0], points[-1] = start, end
    return points


def perimeter(ring: Array) -> float:
    """Return the perimeter of the polygon with corners (n, 2) [length]."""
    return float(np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum())


def cross(a: Array, b: Array) -> Array:
    """Return a_1 b_2 - a_2 b_1 of vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def turn_between(a: Array, b: Array) -> Array:
    """Return the angle from vectors (n, 2) to others, left turns positive, (n,) [rad]."""
    return np.asarray(np.arctan2(cross(a, b), np.einsum("ij,ij->i", a, b)))


def signed_area(ring: Array) -> float:
    """Return the area of the polygon with corners (n, 2), positive where it runs counter-clockwise
    [length²]."""
    x, y = (ring - ring[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def turns_left_once(ring: Array) -> bool:
    """Whether the polygon with these corners (n, 2) is convex and runs counter-clockwise.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> twice = np.vstack([square, square])
    >>> turns_left_once(square), turns_left_once(square[::-1]), turns_left_once(twice)
    (True, False, False)
    """
    edge = np.roll(ring, -1, axis=0) - ring
    before = np.roll(edge, 1, axis=0)
    turn = turn_between(before, edge)
    return bool(turn.min() >= 0.0 and turn.max() < 3.0 and turn.sum() < 7.0)


def check_digits(size: float, points: Sequence[Array], what: str) -> None:
    """Refuse a body that is much smaller than it is far from the origin, or whose squared size
    vanishes.

    Parameters
    ----------
    size : float
        Of the body [length].
    points : sequence of (d,) arrays
        Where it is [length].
    what : str
        What the message calls it.

    Raises
    ------
    InputError
    """
    farthest = max(float(np.abs(point).max()) for point in points)
    if not size > max(WRITTEN * farthest, 1.0 / LARGEST_COORDINATE):
        raise InputError(
            f"geometry: the {what} is {size:.3g} wide at {farthest:.3g} from the origin: too "
            "little for 16 digits, choose another origin or unit of length"
        )
