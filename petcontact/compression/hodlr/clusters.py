"""Contiguous clusters of the nodes of an outline, and distances of other points from them."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...record import record

PIECES = 16  # boxes by which the place of one cluster is known


def halved(start: int, stop: int, leaf: int) -> Index:
    """Return the bounds (2^d + 1,) of equal ranges of start..stop. Ranges are halved until none has
    more than `leaf` nodes."""
    depth = 0
    while (stop - start) > leaf << depth:
        depth += 1
    return start + ((stop - start) * np.arange((1 << depth) + 1, dtype=np.int64)) // (1 << depth)


@record
class Boxes:
    """Boxes that cover each of c clusters: corners low and high (c, b, 2), and diameters of the
    clusters (c,) [length]."""

    low: Array
    high: Array
    diameter: Array

    def least(self, owner: Index, *targets: tuple[Array, Array]) -> Array:
        """Return the least sum of the distances (k,) from a box of cluster owner[i] to the i-th box
        of several lists [length]."""
        total = np.zeros((len(owner), self.low.shape[1]))
        for low, high in targets:
            gap = np.maximum(low[:, None] - self.high[owner], self.low[owner] - high[:, None])
            np.maximum(gap, 0.0, out=gap)
            total += np.sqrt(gap[..., 0] ** 2 + gap[..., 1] ** 2)
        return np.asarray(total.min(axis=1))


class NodeCurves:
    """Nodes that are numbered along one closed curve, or along several curves one after another.

    A curve is taken to end where the step to the next node is more than three times the steps on
    both of its sides. Missing such a jump, or seeing one too many, costs samples and never
    accuracy: it only widens or splits the boxes by which distances are judged.

    Parameters
    ----------
    points : (n, 2) array
        Coordinates of the nodes [length].

    Attributes
    ----------
    spacing : (n,) array
        Mean distance of a node to its two neighbours [length].
    """

    def __init__(self, points: Array) -> None:
        self.points = np.ascontiguousarray(points, dtype=np.float64)
        n = len(self.points)
        steps = np.hypot(*np.diff(self.points, axis=0).T)
        around = np.concatenate([[0.0], steps, [0.0]])
        self._jumps = (
            np.flatnonzero(steps > 3.0 * np.maximum(around[:-2], around[2:])).astype(np.int64) + 1
        )
        starts, stops = np.append(0, self._jumps), np.append(self._jumps, n)
        previous, following = np.arange(n) - 1, np.arange(n) + 1
        previous[starts], following[stops - 1] = stops - 1, starts
        after = np.hypot(*(self.points[following] - self.points).T)
        self.spacing = np.maximum(0.5 * (after + after[previous]), np.finfo(np.float64).tiny)
        # A node's box reaches to both neighbours: elements that meet are at distance zero whatever
        # their sizes.
        neighbourhood = np.stack([self.points, self.points[previous], self.points[following]])
        self._low, self._high = neighbourhood.min(axis=0), neighbourhood.max(axis=0)

    def boxes(self, start: Index, stop: Index) -> Boxes:
        """Return the boxes of clusters start..stop.

        Parameters
        ----------
        start, stop : (c,) arrays
            Node ranges, increasing and adjacent (stop[i] = start[i+1]).
        """
        pieces = []
        for first, last in zip(start, stop, strict=True):
            cuts = first + (last - first) * np.arange(PIECES) // PIECES
            jumps = self._jumps[
                np.searchsorted(self._jumps, first) : np.searchsorted(self._jumps, last)
            ]
            pieces.append(np.unique(np.concatenate([cuts, jumps])))
        begin = np.concatenate(pieces) - start[0]
        low = np.minimum.reduceat(self._low[start[0] : stop[-1]], begin, axis=0)
        high = np.maximum.reduceat(self._high[start[0] : stop[-1]], begin, axis=0)
        offsets = np.cumsum([0, *(len(piece) for piece in pieces)])
        width = int(np.diff(offsets).max())
        # Short lists are padded with copies of their last box, which change no minimum.
        pick = np.minimum(offsets[:-1, None] + np.arange(width), offsets[1:, None] - 1)
        low, high = low[pick], high[pick]
        # Bent outlines count as long as they are, almost: a circle is no shorter than its chord
        # suggests.
        diameter = np.hypot(*(high.max(axis=1) - low.min(axis=1)).T)
        length = np.add.reduceat(self.spacing[start[0] : stop[-1]], start - start[0])
        return Boxes(low, high, np.maximum(diameter, 0.7 * length))
