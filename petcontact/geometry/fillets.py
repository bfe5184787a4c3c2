"""Polygons with rounded corners."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array, shown
from ..errors import InputError
from ..round_off import WRITTEN
from .arcs import signed_area, turn_between
from .outline import Side


def rounded(vertices: Array, fillet: float = 0.0) -> list[Side]:
    """The sides of a polygon, counter-clockwise, whose corners are arcs.

    An arc that turns by θ begins r tan(θ/2) before the vertex.

    Parameters
    ----------
    vertices : (n, 2) array
        In either direction [length].
    fillet : float
        Radius r of all corners, convex ones and others [length].

    Raises
    ------
    InputError
        If the polygon crosses or touches itself, or a side is too short for its two arcs.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> sides = rounded(square, 0.25)
    >>> len(sides), round(sum(side.length for side in sides), 6)
    (8, 3.570796)
    """
    corners = _checked(vertices)
    length, along, before, turn = _turns(corners)
    cut = fillet * np.tan(0.5 * np.abs(turn))
    left = length - cut - np.roll(cut, -1)
    if left[worst := int(left.argmin())] < -WRITTEN * length[worst]:
        most = fillet * length[worst] / (length[worst] - left[worst])
        ends = " to ".join(shown(np.roll(corners, -worst, axis=0)[k]) for k in (0, 1))
        raise InputError(
            f"fillet: must be at most {most:.6g} for the side from {ends}, got {fillet:g}"
        )
    first, last = corners + cut[:, None] * along, corners - cut[:, None] * before
    sides = list[Side]()
    for k in range(len(corners)):
        if fillet * turn[k] != 0.0:
            sides.append(Side(last[k], first[k], "", math.copysign(1.0 / fillet, turn[k])))
        if left[k] > WRITTEN * length[k]:
            sides.append(Side(first[k], np.roll(last, -1, axis=0)[k], ""))
    return sides


def _checked(vertices: Array) -> Array:
    """The vertices of a simple polygon (n, 2), counter-clockwise."""
    import shapely

    if not (moves := (np.roll(vertices, -1, axis=0) != vertices).any(axis=1)).all():
        point = shown(vertices[moves.argmin()])
        raise InputError(f"vertices: {point} is given twice one after another")
    if not (ring := shapely.Polygon(vertices)).is_valid or ring.area == 0.0:
        raise InputError("vertices: the polygon crosses or touches itself, or encloses nothing")
    return vertices if signed_area(vertices) > 0.0 else vertices[::-1]


def _turns(corners: Array) -> tuple[Array, Array, Array, Array]:
    """Lengths (n,) and directions (n, 2) of the sides that begin at corners, directions of those
    that end there, and the turns between, left ones positive [rad]."""
    edge = np.roll(corners, -1, axis=0) - corners
    length = np.hypot(*edge.T)
    along = edge / length[:, None]
    before = np.roll(along, 1, axis=0)
    turn = turn_between(before, along)
    return length, along, before, np.where(np.abs(turn) < WRITTEN, 0.0, turn)
