"""The gap of a contact at any points of its secondary's face, from the shapes of both faces."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...geometry.chart import Chart
from ...given.sites import Sites
from ...given.values import Given
from ...round_off import SINGLE, SUMMED
from .ridge import Gap, samples

STEPS = 30
"""Steps of Newton's method to the point of a face that lies on a line."""


def face_gap(
    chart: Chart, given: Given | None, direction: Array | None, primary: Chart | None = None
) -> Gap:
    """Return the gap as a function of places (n, 2) of the secondary's chart [length].

    It is infinite where nothing is opposite.

    Parameters
    ----------
    chart : Chart
        Of the secondary's face.
    given : Given, optional
        The gap of the config; without it the gap is the distance of the faces.
    direction : (3,) array, optional
        Unit vector of the distance; by default the outward normal.
    primary : Chart, optional
        Of the primary's face; without it the primary is an obstacle.
    """

    def gap(place: Array) -> Array:
        x, normal = chart.at(place), chart.normal(place)
        value = np.zeros(len(place))
        if given is not None:
            value = given.near(Sites(x, normal), np.inf)
        if primary is not None:
            distance = opposite(primary, x, normal, direction)[1]
            value = np.where(
                np.isfinite(distance), value + (distance if given is None else 0.0), np.inf
            )
        return value

    return gap


def touching(gap: Gap, chart: Chart, way: Array) -> Gap:
    """Return the gap that is left when a face has moved along a way, a unit vector, until it
    touches. A pin in a bore has one gap all around, which is least somewhere when it has moved."""
    place = samples(chart)
    value, along = gap(place), chart.normal(place) @ way
    meets = np.isfinite(value) & (along > SINGLE)
    moved = float(min(value[meets] / along[meets], default=0.0)) * way
    return lambda place: gap(place) - chart.normal(place) @ moved


def opposite(
    primary: Chart, x: Array, normal: Array, direction: Array | None
) -> tuple[Array, Array]:
    """Return the points of a face on lines from points (n, 3), as places (n, 2) of its chart, and
    their distances (n,) [length].

    The distance is infinite where a line does not meet the face from outside.
    """
    way = normal if direction is None else np.broadcast_to(direction, normal.shape)
    distance, size = np.zeros(len(x)), float((primary.high - primary.low).max())
    for _ in range(STEPS):
        y = x + distance[:, None] * way
        place = primary.local(y)
        outward = primary.normal(place)
        against = np.sum(outward * way, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.sum((primary.at(place) - y) * outward, axis=1) / against
        distance = distance + np.where(np.isfinite(move), move, 0.0)
        if not np.any(np.abs(move[np.isfinite(move)]) > SUMMED * size):
            break
    slack = SINGLE * size
    met = (
        primary.holds(place, slack) & (against < -SINGLE) & (np.sum(way * normal, axis=1) > SINGLE)
    )
    met &= np.linalg.norm(primary.at(place) - y, axis=1) < slack  # charts may end in their rims
    return place, np.where(met, distance, np.inf)
