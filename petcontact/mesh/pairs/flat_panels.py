"""Where rays and perpendiculars from points meet flat panels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index
from ..panels import Panels
from .hits import SLACK, Faces, Hits

SAMPLES = 3
"""Points along each direction at which a panel is looked at between its nodes."""


@dataclass(frozen=True)
class FlatPanels(Faces):
    """Flat convex panels with the body behind them; arrays over n of them.

    Attributes
    ----------
    centre : (n, 3) array
        [length]
    frame : (n, 3, 3) array
        Rows: two directions in the plane and the outward normal.
    size : (n,) array
        Unit of local coordinates [length].
    polygon : (n, 4, 2) array
        Corners in local coordinates, the last one of triangles twice [-].
    """

    centre: Array
    frame: Array
    size: Array
    polygon: Array

    @staticmethod
    def of(groups: Sequence[Panels], numbers: Index) -> FlatPanels:
        """Some panels of a mesh, in the order of their numbers, from its groups of one kind."""
        index = np.concatenate([group.index for group in groups])
        four = [np.pad(group.polygon, ((0, 0), (0, 4 - group.polygon.shape[1]), (0, 0)), mode="edge") for group in groups]
        order = np.argsort(index)
        chosen = order[np.searchsorted(index[order], numbers)]
        arrays = [np.concatenate([getattr(group, key) for group in groups]) for key in ("centre", "frame", "size")]
        return FlatPanels(*(values[chosen] for values in (*arrays, np.concatenate(four))))

    def at(self, number: Index, place: Array) -> tuple[Array, Array]:
        """Points (k, 3) and outward normals (k, 3) at local coordinates (k, 2) of some panels."""
        x = self.centre[number] + self.size[number, None] * np.einsum("kc,kcd->kd", place, self.frame[number, :2])
        return x, self.frame[number, 2]

    def samples(self) -> tuple[Index, Array]:
        """Corners, midpoints and centre of every panel: what two planes have between them is least at a corner."""
        a, b = (values.ravel() for values in np.meshgrid(*[np.linspace(0.0, 1.0, SAMPLES)] * 2))
        corners = np.stack([(1.0 - a) * (1.0 - b), a * (1.0 - b), a * b, (1.0 - a) * b], axis=1)
        places = np.einsum("qc,ncd->nqd", corners, self.polygon)
        return np.repeat(np.arange(len(self)), len(a)), places.reshape(-1, 2)

    def stretch(self, number: Index, distance: Array) -> Array:
        """1: normals of a flat panel do not part."""
        return np.ones(len(number))

    def __len__(self) -> int:
        return len(self.size)

    def _cast(self, x: Array, direction: Array) -> Hits:
        normal = self.frame[:, 2]
        height = np.sum(self.centre * normal, axis=1) - x @ normal.T
        into = direction @ normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(into < -SLACK, height / into, np.nan)
        return self._nearest(t, self._local(x, direction, t))

    def _foot(self, x: Array, normal: Array) -> Hits:
        away = x @ self.frame[:, 2].T - np.sum(self.centre * self.frame[:, 2], axis=1)
        distance = np.where(normal @ self.frame[:, 2].T < -SLACK, away, np.nan)
        return self._nearest(distance, self._local(x, np.zeros_like(x), np.zeros_like(distance)))

    def _local(self, x: Array, direction: Array, t: Array) -> Array:
        """Local coordinates (m, n, 2) of x + t·direction in every panel, whatever their height."""
        axes = self.frame[:, :2]
        start = np.einsum("md,ncd->mnc", x, axes) - np.einsum("nd,ncd->nc", self.centre, axes)
        return np.asarray((start + t[..., None] * np.einsum("md,ncd->mnc", direction, axes)) / self.size[:, None])

    def _nearest(self, distance: Array, place: Array) -> Hits:
        """Of all meetings within the panels the one with the smallest distance, either way."""
        edge = np.roll(self.polygon, -1, axis=1) - self.polygon
        length = np.linalg.norm(edge, axis=2)
        with np.errstate(invalid="ignore", divide="ignore"):
            # distance (m, n, 4) inside of each edge; a doubled corner has none
            off = place[:, :, None] - self.polygon
            inside = (edge[..., 0] * off[..., 1] - edge[..., 1] * off[..., 0]) / length
            depth = np.where(length > 0.0, inside, np.inf).min(axis=2)
        met = (depth >= -SLACK) & np.isfinite(distance)
        # the same point on the edge of two panels belongs to the one that holds it better
        rank = np.where(met, np.abs(distance) - 1e-12 * self.size * np.minimum(depth, 1.0), np.inf)
        best = np.argmin(rank, axis=1)
        row = np.arange(len(best))
        none = ~met[row, best]
        return Hits(
            np.where(none, -1, best), np.where(none[:, None], 0.0, place[row, best]),
            np.where(none, np.inf, distance[row, best]),
        )  # fmt: skip
