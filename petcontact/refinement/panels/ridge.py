"""Ridges: the lines of least gap on a face, along which a long contact lies."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...arrays import Array
from ...geometry.charts import Chart
from ...record import record
from ...round_off import SINGLE

Gap = Callable[[Array], Array]
"""Function from coordinates (n, 2) of a chart to gaps (n,), infinite where nothing is opposite."""
SAMPLES = 101
"""Points along each coordinate of a face among which the least gap is looked for. Contacts of
rollers that are longer than a hundredth of a face are found."""
NEAR = 1e-3
"""Gap over the median of a face up to which a sample is next to the least one [-]. It is more than
between two neighbours across a parabola in the middle of a face, 4e-4."""
STATIONS = 200
"""Steps along a ridge that crosses a face."""
STENCIL = 0.01
"""Step of difference quotients over the radius of curvature of the gap [-]. The curvature of a
circle is then off by 1e-4."""
HALVINGS = 48
"""Halvings of a step in which a gap jumps."""


@record
class Ridge:
    """A line of least gap on a chart.

    Attributes
    ----------
    points, across : (k, 2) arrays
        Points [length], and unit vectors across, with the line right-handed.
    s, gap, curvature : (k,) arrays
        Length along the line [length], gap [length], its curvature across [1/length].
    slope : float
        Curvature of the gap along the line where the gap is least [1/length].
    closed : bool
        Whether the line is a loop: its ends are one point of a face that goes round.
    """

    points: Array
    across: Array
    s: Array
    gap: Array
    curvature: Array
    slope: float
    closed: bool

    @property
    def straight(self) -> bool:
        """Whether all of the line has one direction."""
        return bool(np.abs(self.across - self.across[:1]).max() < SINGLE)

    def at(self, s: Array) -> tuple[Array, Array]:
        """Return points and vectors across (n, 2) at lengths along a straight line."""
        across = np.repeat(self.across[:1], len(s), axis=0)
        way = np.array([-across[0, 1], across[0, 0]])
        return self.points[0] + (s - self.s[0])[:, None] * way, across


def ridge_of(gap: Gap, chart: Chart, start: Array | None = None) -> Ridge | None:
    """Return the ridge through the least gap of a face, or None if the gap is not convex there, or
    lowest in a corner.

    The ridge is followed both ways from there to the rim of the face or to a jump of the gap. Each
    step goes on straight, and then across to the least gap.

    Parameters
    ----------
    gap : callable
    chart : Chart
    start : (2,) array, optional
        A point near the ridge; by default the least gap of samples is looked for.
    """
    place = lowest_sample(gap, chart) if start is None else start
    if place is None or (first := _first(gap, chart, place)) is None:
        return None
    place, across, stencil, slope = first
    walk = _Walk(gap, chart, stencil)
    middle = walk.centred(place, across)
    if middle is None:
        return None
    before = walk.along(middle, -across)[::-1]
    rows = [*((row[0], -row[1], *row[2:]) for row in before), (middle[0], across, *middle[1:])]
    rows += walk.along(middle, across)
    columns = _apart([np.array(column) for column in zip(*rows, strict=True)])
    if len(columns[0]) < 2:  # the least gap is in a corner of the face
        return None
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(columns[0], axis=0), axis=1)))
    ends = chart.at(columns[0][[0, -1]])
    closed = chart.wraps and bool(np.linalg.norm(ends[1] - ends[0]) < SINGLE * s[-1])
    return Ridge(columns[0], columns[1], s, columns[2], columns[3], slope, closed)


def _apart(columns: list[Array]) -> list[Array]:
    """Return columns without rows whose point is that of the row before: at a wall the last step
    may be none."""
    steps = np.linalg.norm(np.diff(columns[0], axis=0), axis=1)
    apart = np.append(True, steps > SINGLE * steps.max(initial=0.0))
    return [column[apart] for column in columns]


def samples(chart: Chart) -> Array:
    """Return places (n, 2) all over a face."""
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(chart.low + grid * (chart.high - chart.low))


def lowest_sample(gap: Gap, chart: Chart) -> Array | None:
    """Return the middle (2,) of the samples with the least gap, or None if nothing is opposite."""
    grid = samples(chart)
    values = gap(grid)
    faced = np.isfinite(values)
    if not faced.any():
        return None
    least = float(values[faced].min())
    far = float(np.median(values[faced])) - least
    near = faced & (values <= least + NEAR * far)
    middle = grid[near].mean(axis=0)
    return np.asarray(grid[near][np.linalg.norm(grid[near] - middle, axis=1).argmin()])


def _first(gap: Gap, chart: Chart, place: Array) -> tuple[Array, Array, float, float] | None:
    """Return a point of the ridge, the direction across it, the step of difference quotients and
    the curvature along it."""
    step, result = STENCIL * float((chart.high - chart.low).min()), None
    for _ in range(6):
        quotients = _quotients(gap, place, step)
        if quotients is None:
            step *= 0.25
            continue
        gradient, (least, most), vectors = quotients
        if not most > 0.0:
            return None
        move = -(vectors.T @ gradient) / np.array([max(least, 0.1 * most), most])
        move[0] *= least > SINGLE * most
        place = place + np.clip(move, -20.0 * step, 20.0 * step) @ vectors.T
        result = (place, vectors[:, 1], step, float(least))
        finer = min(step, STENCIL / most)
        if finer == step and np.abs(move).max() < 1e-3 * step:
            break
        step = finer
    return result


def _quotients(gap: Gap, place: Array, step: float) -> tuple[Array, Array, Array] | None:
    """Return the gradient of a gap, its two curvatures and their directions (as columns), or None
    where it is not known all around."""
    grid = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)], dtype=float)
    values = gap(place + step * grid).reshape(3, 3)
    if not np.all(np.isfinite(values)):
        return None
    first, second = values[2, 1] - values[0, 1], values[1, 2] - values[1, 0]
    mixed = 0.25 * (values[2, 2] - values[2, 0] - values[0, 2] + values[0, 0])
    across, along = (
        values[a] - 2.0 * values[1, 1] + values[b] for a, b in (((2, 1), (0, 1)), ((1, 2), (1, 0)))
    )
    curvatures, vectors = np.linalg.eigh(np.array([[across, mixed], [mixed, along]]) / step**2)
    return np.array([first, second]) / (2.0 * step), curvatures, vectors


Point = tuple[Array, float, float]
"""A point of a ridge, the gap and the curvature across it."""

Row = tuple[Array, Array, float, float]
"""The same with the direction across the ridge after the point."""


class _Walk:
    """Steps along a ridge."""

    def __init__(self, gap: Gap, chart: Chart, stencil: float) -> None:
        self._gap, self._chart, self._stencil = gap, chart, stencil
        self._step = float((chart.high - chart.low).max()) / STATIONS

    def centred(self, place: Array, across: Array) -> Point | None:
        """Return the point of least gap near a place, or None where there is none."""
        for _ in range(8):
            offsets = self._stencil * np.array([-1.0, 0.0, 1.0])
            low, middle, high = self._gap(place + offsets[:, None] * across).tolist()
            curvature = (high - 2.0 * middle + low) / self._stencil**2
            if not (math.isfinite(curvature) and curvature > 0.0):
                return None
            move = -0.5 * (high - low) / self._stencil / curvature
            if abs(move) > 10.0 * max(self._step, self._stencil):
                return None
            if abs(move) < 1e-6 * self._stencil:
                break
            place = place + move * across
        return place, middle, curvature

    def along(self, start: Point, across: Array) -> list[Row]:
        """Return the points after a first one."""
        result, way = list[Row](), np.array([-across[1], across[0]])
        last, before, drop = start, start[1], NEAR * start[2] * self._step**2
        while len(result) < 8 * STATIONS:
            room = self._room(last[0], way)
            length = min(self._step, room)
            found = self.centred(last[0] + length * way, across) if length > 0.0 else None
            change = abs(found[1] - 2.0 * last[1] + before) if found else math.inf
            if found is None or (change > 10.0 * drop and len(result) > 1):
                share = self._until_jump(last, way, length, drop)
                if share < 1.0 or found is None:
                    end = self._before(last, way, across, share * length)
                    return [*result, *([(end[0], across, *end[1:])] if end else [])]
            drop = max(drop, change)
            way = (found[0] - last[0]) / np.linalg.norm(found[0] - last[0])
            across = np.array([way[1], -way[0]])
            before, last = last[1], found
            result.append((found[0], across, *found[1:]))
            if room < self._step:
                break
        return result

    def _room(self, place: Array, way: Array) -> float:
        """Return how far a point may go along a way to the rim of the face [length]."""
        low, high = self._chart.low, self._chart.high
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(way > SINGLE, (high - place) / way, np.inf)
            room = np.minimum(room, np.where(way < -SINGLE, (low - place) / way, np.inf))
        return float(room.min()) * (1.0 - 1e-12)

    def _before(self, last: Point, way: Array, across: Array, length: float) -> Point | None:
        """Return the point just before a jump at a length, which may be none."""
        if length <= 0.0:
            return None
        for back in (1e-9, 1e-6, 1e-3, 0.1):
            found = self.centred(last[0] + (1.0 - back) * length * way, across)
            if found is not None:
                return found
        return None

    def _until_jump(self, last: Point, way: Array, length: float, least: float) -> float:
        """Return the share of a step at which the gap jumps by more than a least height, or 1."""
        low, high = 0.0, 1.0
        ends = self._gap(last[0] + length * np.array([[low], [high]]) * way)
        whole = abs(ends[1] - ends[0])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            value = self._gap(last[0] + length * middle * way[None])
            if not math.isfinite(value[0]) or (
                math.isfinite(ends[1]) and abs(value[0] - ends[0]) > abs(ends[1] - value[0])
            ):
                high, ends[1] = middle, value[0]
            else:
                low, ends[0] = middle, value[0]
        jump = not math.isfinite(ends[1]) or abs(ends[1] - ends[0]) > max(0.5 * whole, least)
        return low if jump else 1.0
