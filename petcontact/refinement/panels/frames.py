"""Frames of panels around inner ones, up to the rim of a face."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...geometry.chart import Chart
from ...round_off import SINGLE
from .forecast import from_end
from .rings import FRAMES, Inner

TWICE = np.array([[8, 0, 0], [3, 6, -1], [0, 8, 0], [-1, 6, 3], [0, 0, 8]]) / 8.0
"""Values of a parabola at five points by those at three."""


def frames_around(chart: Chart, inner: Inner) -> list[Array]:
    """Return the panels of frames around inner ones up to the rim of the face.

    Each side moves outward by a width that grows, and to the rim where less than half of the width
    would be left. Sides at the rim stay. Around a slanted rectangle all sides stop together where
    the next frame would reach the rim, and the last frame leads from there to it: its panels turn
    from one direction to another, and need room for it.
    """
    if not inner.rim:
        return []
    origin, axes, width = inner.origin, inner.axes, inner.width
    rim = [(side - origin) @ axes.T for side in inner.rim]
    box = np.concatenate(rim)
    box = np.append(box.min(axis=0), box.max(axis=0))
    face, last = outermost(chart, (origin, axes), box)
    sign, result = np.array([-1.0, -1.0, 1.0, 1.0]), list[Array]()
    while True:
        done = (1.5 if face is None else 1.0 + FRAMES) * width > sign * (last - box)
        if face is not None and done.any():
            corners, done = face, done | True
        else:
            box = np.where(done, last, box + sign * width)
            corners = _box_corners(box)
        straight = [_is_parabola(chart, origin + side[[0, -1]] @ axes) for side in rim]
        made, rim = one_frame(rim, corners, width if result else 0.0, straight)
        result.append(origin + made @ axes)
        if done.all():
            return result
        width *= FRAMES


def _is_parabola(chart: Chart, ends: Array) -> bool:
    """Return whether the side between two points (2, 2) is a parabola on the face, like generators
    of cylinders and of slight crowns: panels that end anywhere on it leave no slits."""
    x = chart.at(ends[0] + np.linspace(0.0, 1.0, 5)[:, None] * (ends[1] - ends[0]))
    off = x[[1, 3]] - TWICE[[1, 3]] @ x[[0, 2, 4]]
    return bool(np.abs(off).max() <= SINGLE * np.linalg.norm(x[-1] - x[0]))


def outermost(chart: Chart, axes: tuple[Array, Array], box: Array) -> tuple[Array | None, Array]:
    """Return the corners of a slanted face (4, 2), or None, and the rectangle in which frames grow.

    They are in the band's own axes.
    """
    corners = (_box_corners(np.append(chart.low, chart.high)) - axes[0]) @ axes[1].T
    if np.abs(axes[1]).max(axis=1).min() > 1.0 - SINGLE:
        return None, np.array([*corners.min(axis=0), *corners.max(axis=0)])
    # panels between sides that are turned by more than 45 degrees to each other would fold
    along = np.roll(corners, -1, axis=0) - corners
    start = int(np.argmax(along[:, 0] / np.linalg.norm(along, axis=1)))
    face = np.roll(corners, -start, axis=0)
    return face, _room_in(face, box)


def _box_corners(box: Array) -> Array:
    """Return the corners (4, 2), counter-clockwise, of a rectangle (low x, low y, high x, high
    y)."""
    return np.asarray(box[np.array([[0, 1], [2, 1], [2, 3], [0, 3]])])


def _room_in(corners: Array, box: Array) -> Array:
    """Return the largest rectangle about as far from a box on all sides that lies in a convex
    polygon (n, 2)."""
    sign = np.array([-1.0, -1.0, 1.0, 1.0])
    along = np.roll(corners, -1, axis=0) - corners
    low, high = 0.0, float(np.ptp(corners, axis=0).max())
    for _ in range(50):
        middle = 0.5 * (low + high)
        away = _box_corners(box + sign * middle)[:, None] - corners
        inside = along[:, 0] * away[..., 1] - along[:, 1] * away[..., 0] > 0.0
        low, high = (middle, high) if inside.all() else (low, middle)
    return np.asarray(box + sign * low)


def one_frame(
    rim: list[Array],
    corners: Array,
    width: float,
    straight: list[bool],
) -> tuple[Array, list[Array]]:
    """Return the panels (n, 9, 2) between a rim, four sides of points, and the sides between
    corners (4, 2), and the new rim.

    With width 0 panels are as long as those inside. On a side that is no parabola they end where
    those inside end: there would be slits between different parabolas otherwise.
    """
    cells, outer = list[Array](), list[Array]()
    for k, side in enumerate(rim):
        length = float(np.linalg.norm(side[-1] - side[0]))
        t = (side - side[0]) @ (side[-1] - side[0]) / length**2  # a side may be a lens
        if width > 0.0:
            t = _shares_of(width / length) if straight[k] else _every_other(t, width / length)
            side = side[0] + t[:, None] * (side[-1] - side[0])
        start, end = corners[k], corners[(k + 1) % 4]
        out = start + t[:, None] * (end - start)
        quads = np.stack([out[:-1], out[1:], side[1:], side[:-1]], axis=1)
        one, other = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
        square = np.maximum(np.sum(one**2, axis=1), np.sum(other**2, axis=1))
        cells.append(nine_points(quads[np.abs(np.cross(one, other)) > SINGLE * square]))
        outer.append(out)
    return np.concatenate(cells), outer


def _shares_of(width: float) -> Array:
    """Return the shares of a side at which panels end, about as long as they are wide at both ends
    and longer in the middle."""
    ends = from_end(0.5, 1.5 * width, 0.5, FRAMES) if 3.0 * width < 1.0 else [0.0, 0.5]
    return np.asarray(np.unique(np.concatenate([ends, 1.0 - np.asarray(ends)])))


def _every_other(t: Array, width: float) -> Array:
    """Return shares of a side, every other one where panels are shorter than they are wide."""
    return t[::2] if len(t) % 2 and np.diff(t).max() < width else t


def nine_points(corners: Array) -> Array:
    """Return the nine points of panels with straight sides from their corners (n, 4, 2)."""
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    return np.concatenate([corners, middles, corners.mean(axis=1, keepdims=True)], axis=1)
