"""Ridges: the lines of least gap on a face, along which a long contact lies."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...arrays import Array, Mask
from ...geometry.chart import Chart
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
    """A straight line of least gap on a chart.

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

    def at(self, s: Array) -> tuple[Array, Array]:
        """Return points and vectors across (n, 2) at lengths along the line."""
        across = np.repeat(self.across[:1], len(s), axis=0)
        way = np.array([-across[0, 1], across[0, 0]])
        return self.points[0] + (s - self.s[0])[:, None] * way, across


def ridge_of(gap: Gap, chart: Chart, start: Array | None = None) -> Ridge | None:
    """Return the ridge through the least gap of a face, or None if the gap is not convex there, or
    lowest in a corner, or if the ridge is not straight.

    It ends on both sides at the rim of the face or at a jump of the gap.

    Parameters
    ----------
    gap : callable
    chart : Chart
    start : (2,) array, optional
        A point near the ridge; by default the least gap of samples is looked for.
    """
    place = lowest_sample(gap, chart) if start is None else start
    if place is None or (first := lowest_point(gap, chart, place)) is None:
        return None
    place, curvatures, vectors, stencil = first
    line = _Line(gap, chart, place, vectors[:, 1], stencil)
    rows = np.concatenate([line.along(-1.0)[::-1], line.seen(np.zeros(1)), line.along(1.0)])
    t, value, curvature, off = rows[np.append(True, np.diff(rows[:, 0]) > SINGLE * line.step)].T
    # in a corner of the face there is one point
    if len(t) < 2 or not np.all(np.abs(off) <= SINGLE * np.maximum(np.abs(t), line.step)):
        return None
    points = line.places(t)
    ends = chart.at(points[[0, -1]])
    closed = chart.wraps and bool(np.linalg.norm(ends[1] - ends[0]) < SINGLE * (t[-1] - t[0]))
    across = np.repeat(line.across[None], len(t), axis=0)
    return Ridge(points, across, t - t[0], value, curvature, curvatures[0], closed)


def samples(chart: Chart) -> Array:
    """Return places (n, 2) all over a face."""
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
    place = chart.low + grid * (chart.high - chart.low)
    return np.asarray(place[chart.holds(place, 0.0)])


def nearly_least(values: Array, more: float = 0.0) -> Mask:
    """Return which gaps (n,) of samples may be the least one, or at most so much more."""
    faced = np.isfinite(values)
    least = float(values[faced].min(initial=np.inf))
    far = float(np.median(values[faced])) - least if faced.any() else 0.0
    return np.asarray(faced & (values <= least + NEAR * far + more))


def _lowest(gap: Gap, chart: Chart) -> Array:
    """Return the samples (n, 2) with the least gaps."""
    grid = samples(chart)
    return np.asarray(grid[nearly_least(gap(grid))])


def lowest_sample(gap: Gap, chart: Chart) -> Array | None:
    """Return the middle (2,) of the samples with the least gap, or None if nothing is opposite."""
    near = _lowest(gap, chart)
    if not len(near):
        return None
    return np.asarray(near[np.linalg.norm(near - near.mean(axis=0), axis=1).argmin()])


def is_ring(gap: Gap, chart: Chart) -> bool:
    """Return whether the gap of a disc is least all around its middle, and not there."""
    near = _lowest(gap, chart)
    quadrants = {*map(tuple, near > 0.0)}
    away = np.linalg.norm(near, axis=1).min(initial=np.inf)
    return chart.round and len(quadrants) == 4 and bool(away > 0.1 * chart.high[0])


def lowest_point(
    gap: Gap, chart: Chart, place: Array
) -> tuple[Array, tuple[float, float], Array, float] | None:
    """Return the point of the least gap near a place, or one of its line, the two curvatures there,
    the smaller one first, their directions (as columns), and the step of difference quotients."""
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
        result = (place, (float(least), float(most)), vectors, step)
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


class _Line:
    """A straight line through the least gap."""

    def __init__(self, gap: Gap, chart: Chart, place: Array, across: Array, stencil: float) -> None:
        self._gap, self._chart, self._stencil = gap, chart, stencil
        self._place, self.across = place, across
        self._way = np.array([-across[1], across[0]])
        self.step = float((chart.high - chart.low).max()) / STATIONS
        for _ in range(4):
            near = self.step * np.array([-1.0, 0.0, 1.0])
            before, here, after = np.nan_to_num(self.seen(near)[:, 3]).tolist()
            self._place = self._place + here * self.across
            self._way = self._way + (after - before) / np.ptp(near) * self.across
            self._way /= np.linalg.norm(self._way)
            self.across = np.array([self._way[1], -self._way[0]])

    def places(self, t: Array) -> Array:
        """Return the points (n, 2) at lengths along the line."""
        return np.asarray(self._place + t[:, None] * self._way)

    def seen(self, t: Array) -> Array:
        """Return lengths along the line, the gap there, its curvature across, and how far away
        across it is least, (n, 4); NaN where it is not convex across."""
        offsets = self._stencil * np.array([-1.0, 0.0, 1.0])
        x = self.places(t) + offsets[:, None, None] * self.across
        low, middle, high = self._gap(x.reshape(-1, 2)).reshape(3, -1)
        with np.errstate(divide="ignore", invalid="ignore"):
            curvature = (high - 2.0 * middle + low) / self._stencil**2
            off = -0.5 * (high - low) / self._stencil / curvature
        off[~(np.abs(off) <= 10.0 * max(self.step, self._stencil)) | ~(curvature > 0.0)] = np.nan
        return np.column_stack([t, middle, curvature, off])

    def along(self, sign: float) -> Array:
        """Return what is seen one way from the start, (n, 4), up to the rim or a jump."""
        # how far the start may go
        room = self._chart.room(self._place, sign * self._way) * (1.0 - 1e-12)
        rows = self.seen(sign * np.append(np.arange(self.step, room, self.step), room))
        t, last, curvature, _ = self.seen(np.zeros(1))[0].tolist()
        before, drop = last, NEAR * curvature * self.step**2
        for k, (there, value, _, off) in enumerate(rows.tolist()):
            change = math.inf if math.isnan(off) else abs(value - 2.0 * last + before)
            if math.isinf(change) or (change > 10.0 * drop and k > 1):
                share = self._until_jump(t, there, drop)
                if share < 1.0 or math.isinf(change):
                    return np.concatenate([rows[:k], self._before(t, t + share * (there - t))])
            drop, before, last, t = max(drop, change), last, value, there
        return rows

    def _before(self, start: float, end: float) -> Array:
        """Return what is seen just before a jump, (1, 4), or nothing."""
        back = np.array([1e-9, 1e-6, 1e-3, 0.1])
        rows = self.seen(end - back * (end - start))
        return rows[~np.isnan(rows[:, 3])][:1] if start != end else rows[:0]

    def _until_jump(self, start: float, end: float, least: float) -> float:
        """Return the share of a step at which the gap jumps by more than a least height, or 1."""
        low, high = 0.0, 1.0
        ends = self._gap(self.places(np.array([start, end])))
        whole = abs(ends[1] - ends[0])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            value = self._gap(self.places(np.array([start + middle * (end - start)])))
            if not math.isfinite(value[0]) or (
                math.isfinite(ends[1]) and abs(value[0] - ends[0]) > abs(ends[1] - value[0])
            ):
                high, ends[1] = middle, value[0]
            else:
                low, ends[0] = middle, value[0]
        jump = not math.isfinite(ends[1]) or abs(ends[1] - ends[0]) > max(0.5 * whole, least)
        return low if jump else 1.0
