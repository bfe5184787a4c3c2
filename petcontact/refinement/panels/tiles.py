"""Pieces of a face with several zones, one zone on each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...geometry.chart import Chart
from ...round_off import SINGLE
from .zone import Zone


def tiles(charts: Sequence[Chart], zones: Sequence[Zone]) -> list[Chart]:
    """Return the charts of zones, each cut half-way to the other zones.

    There are none where zones meet, or where the pieces do not cover the face once.

    Parameters
    ----------
    charts : sequence of Chart
        Of one face, each for one zone.
    zones : sequence of ContactEllipse or ContactBand
    """
    if len(zones) > 1 and charts[0].round:
        return _of_disc(charts[0], zones) if charts[0].flat else []
    result, corners = list[Chart](), [zone.corners for zone in zones]
    for k, chart in enumerate(charts):
        others = [charts[j].at(corners[j]) for j in range(len(zones)) if j != k]
        sides = _cut(chart, corners[k], [there for x in others for there in _seen(chart, x)])
        if sides is None:
            return []
        result.append(replace(chart.part(sides), wraps=chart.wraps and len(zones) == 1))
    whole, *area = (float(np.prod(np.ptp(each.sides, axis=0))) for each in (charts[0], *result))
    return result if abs(sum(area) - whole) < SINGLE * whole else []


def _of_disc(chart: Chart, zones: Sequence[Zone]) -> list[Chart]:
    """Return the pieces of a plane disc between lines from which tangents to circles around two
    zones have one length: three of these meet in a point."""
    corners = np.array([zone.corners for zone in zones])
    centre, radius = corners.mean(axis=1), 0.5 * np.linalg.norm(np.ptp(corners, axis=1), axis=1)
    result = list[Chart]()
    for k in range(len(zones)):
        ways, sizes = np.delete(centre, k, axis=0) - centre[k], np.delete(radius, k)
        apart = np.linalg.norm(ways, axis=1)
        if not np.all(apart > radius[k] + sizes):
            return []
        ways /= apart[:, None]
        away = 0.5 * (apart + (radius[k] ** 2 - sizes**2) / apart)
        result.append(replace(chart, cuts=np.column_stack([ways, away + ways @ centre[k]])))
    return result


def _cut(chart: Chart, own: Array, others: Sequence[Array]) -> Array | None:
    """Return the low and the high coordinates (2, 2) of a chart that is cut half-way from points to
    others (n, 2), or None where these meet."""
    box, sides = (own.min(axis=0), own.max(axis=0)), chart.sides.copy()
    for there in others:
        gaps = np.array([box[0] - there.max(axis=0), there.min(axis=0) - box[1]])
        side, axis = np.unravel_index(int(gaps.argmax()), gaps.shape)
        if not gaps[side, axis] > 0.0:
            return None
        half_way = box[side][axis] + (side - 0.5) * gaps[side, axis]
        sides[side, axis] = (max, min)[side](sides[side, axis], half_way)
    return sides


def _seen(chart: Chart, points: Array) -> list[Array]:
    """Return the coordinates of points (n, 3) that are near to one another on a chart; where it
    goes round also those before and after a turn."""
    place, turn = chart.local(points), float(chart.high[0] - chart.low[0])
    if not chart.wraps:
        return [place]
    place[:, 0] = np.unwrap(place[:, 0], period=turn)
    return [place + turns * turn * np.eye(2)[0] for turns in (-1.0, 0.0, 1.0)]
