"""Edges of narrow contacts from the force that they carry, which coarse meshes have right."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array, Mask
from ..record import record, replace
from .contact_edges import Edge

ROUNDS = 3
"""Times that the curvature of the gap is looked at, each at the half-width that the last has
given."""


@record
class NarrowContact:
    """Hertz' contact of two bodies, each much larger than it.

    Attributes
    ----------
    gap : callable
        Function from arc lengths (n,) to the initial gap (n,) [length].
    compliance : float
        1/E* [1/stress].
    """

    gap: Callable[[Array], Array]
    compliance: float

    def edges(self, seen: list[Edge], s: Array, load: Array, closed: Mask) -> list[Edge]:
        """Return the edges, moved to where Hertz' contact under the same force has them.

        A mesh that is graded to the first point of contact only has elements as long as the
        contact at its edges, and its edges are half a width off. Its force is right to 1e-3. Hertz'
        half-width replaces that of the edges if it is nearer to the one that the second moment of
        the pressure gives. Edges of stick keep their share of the width.

        Parameters
        ----------
        seen : list of Edge
        s, load : (m,) arrays
            Arc lengths, increasing [length], and what the nodes carry [force/length].
        closed : (m,) array of bool
        """
        ends = np.flatnonzero(np.diff(closed, prepend=False, append=False))
        zones = ends.reshape(-1, 2)
        if not len(zones):
            return seen
        middles = s[zones[:, 0]] + s[zones[:, 1] - 1]
        nearest = [int(np.abs(middles - 2.0 * edge.s).argmin()) for edge in seen]
        result = list[Edge]()
        for zone in dict.fromkeys(nearest):
            own = [edge for edge, number in zip(seen, nearest, strict=True) if number == zone]
            nodes = slice(*zones[zone])
            whole = nodes.start > 0 and nodes.stop < len(s)
            result += self._moved(own, s[nodes], load[nodes]) if whole else own
        return result

    def _moved(self, seen: list[Edge], s: Array, load: Array) -> list[Edge]:
        low, high, force = seen[0].s, seen[-1].s, float(load.sum())
        if low == high or not force > 0.0 or np.count_nonzero(load) < 2:  # no second moment
            return seen
        centre = float(load @ s) / force
        spread = 2.0 * math.sqrt(float(load @ (s - centre) ** 2) / force)
        half = self._half_width(centre, spread, force)
        if not abs(half - spread) < abs(0.5 * (high - low) - spread):
            return seen
        share = 2.0 * half / (high - low)
        return [replace(e, s=centre - half + share * (e.s - low), width=half) for e in seen]

    def _half_width(self, centre: float, half: float, force: float) -> float:
        """Return Hertz' half-width with the curvature of the gap over it, nan for none [length]."""
        for _ in range(ROUNDS):
            before, least, after = self.gap(centre + half * np.array([-1.0, 0.0, 1.0]))
            curvature = float(before - 2.0 * least + after) / half**2
            if not curvature > 0.0:
                return math.nan
            half = math.sqrt(4.0 * force * self.compliance / (math.pi * curvature))
        return half
