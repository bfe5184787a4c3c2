"""Boxes in space with rounded edges."""

from __future__ import annotations

import itertools

import numpy as np
import scipy

from ..arrays import Array
from ..record import record
from .shapes import Ball, Crossing, Rod, Shape, between


@record
class RoundedBox(Shape):
    """A box in space whose edges and corners have a radius, or are sharp.

    It is the union of three boxes, twelve rods along the edges and eight balls at the corners.

    Attributes
    ----------
    lower, upper : (3,) tuples
        Opposite corners, before it is turned [length].
    fillet : float
        Radius of edges and corners [length].
    centre : (3,) tuple
        Point about which it is turned [length].
    turn : (3,) tuple
        Vector of the rotation, counter-clockwise about its direction [rad].

    Examples
    --------
    >>> x, up = np.array([[1.0, 1.0, 0.0], [0.1, 1.0, 0.0]]), np.array(2 * [[0.0, 0.0, 1.0]])
    >>> RoundedBox((0.0, 0.0, 1.0), (2.0, 2.0, 2.0), 0.5).crossing(x, up)[0].round(6).tolist()
    [1.0, 1.2]
    """

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    fillet: float = 0.0
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    turn: tuple[float, ...] = (0.0, 0.0, 0.0)

    dim = 3

    def crossing(self, x: Array, ray: Array) -> Crossing:
        """Return where lines through points (m, 3) along unit vectors (m, 3) cross it."""
        back = scipy.spatial.transform.Rotation.from_rotvec(self.turn).inv()
        x, ray = back.apply(x - np.array(self.centre)) + np.array(self.centre), back.apply(ray)
        low, high = np.array(self.lower) + self.fillet, np.array(self.upper) - self.fillet
        parts = [
            self._in_box(x, ray, low - grown, high + grown) for grown in np.eye(3) * self.fillet
        ]
        ends = np.array([low, high])
        if self.fillet:
            for corner in itertools.product((0, 1), repeat=3):
                at = ends[list(corner), [0, 1, 2]]
                parts.append(Ball(tuple(at), self.fillet).crossing(x, ray)[:2])
                for axis in np.flatnonzero((np.array(corner) == 0) & (high > low)).tolist():
                    far = np.where(np.arange(3) == axis, high, at)
                    parts.append(Rod(tuple(at), tuple(far), self.fillet).crossing(x, ray)[:2])
        enter, leave = np.array(parts).transpose(1, 0, 2)
        missed = enter > leave
        enter, leave = np.where(missed, np.inf, enter), np.where(missed, -np.inf, leave)
        return enter.min(axis=0), leave.max(axis=0), self._middle(x, ray, ends)

    def _middle(self, x: Array, ray: Array, ends: Array) -> Array:
        """Where lines are closest to the first rounded corner, which joins the distance to it along
        an axis, or to the middle of a sharp box, where it jumps."""
        corners = np.array(list(itertools.product(*ends.T)))
        heights = corners @ ray.T - np.einsum("mc,mc->m", x, ray)
        return np.asarray(heights.min(axis=0) if self.fillet else heights.mean(axis=0))

    @staticmethod
    def _in_box(x: Array, ray: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Return where lines enter and leave a box with sharp edges."""
        size = high - low
        layers = [between(x[:, c] - low[c], ray[:, c], float(size[c])) for c in range(3)]
        enter, leave = (np.array(ends) for ends in zip(*layers, strict=True))
        return enter.max(axis=0), leave.min(axis=0)
