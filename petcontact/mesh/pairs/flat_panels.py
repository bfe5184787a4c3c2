"""Where rays from points meet flat panels, and the polygons in which panels face one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...arrays import Array, Index
from ..panels import Panels
from .clipping import area, clip, cross, fan_rule
from .ray_casting import SLACK, TOGETHER, Faces, Hits, Segments, along

SLIVER = 1e-14
"""Segments smaller than this share of the panel's square are round-off."""


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
    SAMPLES: ClassVar[int] = 3

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

    def spread(self, number: Index, share: Array) -> Array:
        """See `Faces.spread`: bilinear between the corners."""
        a, b = share.T
        corners = np.stack([(1.0 - a) * (1.0 - b), a * (1.0 - b), a * b, (1.0 - a) * b], axis=1)
        return np.asarray(np.einsum("kc,kcd->kd", corners, self.polygon[number]))

    def __len__(self) -> int:
        return len(self.size)

    def rims(self) -> tuple[Index, Array]:
        """See `Faces.rims`; the doubled corner of a triangle has no side."""
        following = np.roll(self.polygon, -1, axis=1)
        number, side = np.nonzero(np.any(following != self.polygon, axis=2))
        return number, 0.5 * (self.polygon + following)[number, side]

    def cast(self, x: Array, direction: Array) -> Hits:
        """See `Faces.cast`."""
        i, j = self._near_lines(x, direction, np.zeros(len(x)))
        plane = self.frame[j, 2]
        distance = np.sum((self.centre[j] - x[i]) * plane, axis=1) / np.sum(direction[i] * plane, axis=1)
        place = self._projected(j, x[i], direction[i])
        polygon = self.polygon[j]
        edge = np.roll(polygon, -1, axis=1) - polygon
        length = np.linalg.norm(edge, axis=2)
        # distance (k, 4) inside of each edge; a doubled corner has none
        none = np.full(length.shape, np.inf)
        depth = np.divide(cross(edge, place[:, None] - polygon), length, out=none, where=length > 0.0).min(axis=1)
        # the same point on the edge of two panels belongs to the one that holds it better
        rank = np.abs(distance) - 1e-12 * self.size[j] * np.minimum(depth, 1.0)
        best = np.flatnonzero(depth >= -SLACK)
        best = best[np.lexsort((rank[best], i[best]))]
        best = best[np.append(True, np.diff(i[best]) > 0)[: len(best)]]
        face, places, far = np.full(len(x), -1), np.zeros((len(x), 2)), np.full(len(x), np.inf)
        face[i[best]], places[i[best]], far[i[best]] = j[best], place[best], distance[best]
        return Hits(face, places, far)

    def segments(self, other: FlatPanels, order: Index, opposite: Index, direction: Array | None) -> Segments:
        """See `Faces.segments`: the others, projected onto the plane of each panel, clip it."""
        normal = along(direction, self.frame[:, 2])
        i, j = other._near_lines(self.centre, normal, self.size)
        outward = np.sum(normal[i] * self.frame[i, 2], axis=1) > SLACK
        i, j = i[outward], j[outward]
        corners = other.centre[j, None] + other.size[j, None, None] * (other.polygon[j] @ other.frame[j, :2])
        shadow = self._projected(i[:, None], corners, normal[i, None])[..., ::-1, :]
        shared = clip(self.polygon[i], shadow)
        kept = area(shared) > SLIVER
        i, j, shared = i[kept], j[kept], shared[kept]
        # the rule with q points is exact to 2q - 2, of products with positions and with the panel's own polynomials, too
        own = self._degree(order)[i]
        count = (own + np.maximum(other._degree(opposite)[j], np.maximum(own, 1)) + 1) // 2 + 1
        parts = [Segments(i[:0], np.empty((0, 2)), j[:0], np.empty((0, 2)), np.empty(0))]
        for points in np.unique(count).tolist():
            mine = np.flatnonzero(count == points)
            local, weight = fan_rule(shared[mine], points)
            chosen = weight > 0.0
            face, seen = (np.broadcast_to(k[mine, None], weight.shape)[chosen] for k in (i, j))
            place, weights = local[chosen], weight[chosen] * self.size[face] ** 2
            opposite_place = other._projected(seen, self.at(face, place)[0], normal[face])
            parts.append(Segments(face, place, seen, opposite_place, weights))
        return self._nearest_only(other, Segments.joined(parts), normal)

    def _degree(self, order: Index) -> Index:
        """Total degree of the basis: of triangles the order, of quadrilaterals twice that."""
        return np.where(np.all(self.polygon[:, 2] == self.polygon[:, 3], axis=1), order, 2 * order)

    def _near_lines(self, x: Array, direction: Array, radius: Array) -> tuple[Index, Index]:
        """Lines through points (m, 3), thick by radii (m,), and panels that they may meet from outside, (k,) and (k,)."""
        found = [(np.empty(0, dtype=np.int64),) * 2]
        step = max(1, TOGETHER // max(1, len(self)))
        middle = self.centre.mean(axis=0)
        centre, x = self.centre - middle, x - middle
        square = np.sum(centre**2, axis=1)
        for k in range(0, len(x), step):
            way, point = direction[k : k + step], x[k : k + step]
            ahead = way @ centre.T - np.sum(way * point, axis=1)[:, None]
            apart = np.sum(point**2, axis=1)[:, None] + square - 2.0 * (point @ centre.T)
            reach = radius[k : k + step, None] + self.size
            # the squares cancel to round-off of the farthest
            near = apart - ahead**2 <= (1.0 + SLACK) * reach**2 + 1e-14 * apart.max()
            i, j = np.nonzero(near & (way @ self.frame[:, 2].T < -SLACK))
            found.append((k + i, j))
        i, j = (np.concatenate(values) for values in zip(*found, strict=True))
        return i, j

    def _projected(self, number: Index, x: Array, direction: Array) -> Array:
        """Local coordinates (..., 2) where lines through points (..., 3) meet the planes of some panels."""
        plane = self.frame[number, 2]
        away = x - self.centre[number]
        away = away - (np.sum(away * plane, axis=-1) / np.sum(direction * plane, axis=-1))[..., None] * direction
        return np.asarray(np.einsum("...cd,...d->...c", self.frame[number, :2], away) / self.size[number][..., None])

    def _nearest_only(self, other: FlatPanels, found: Segments, normal: Array) -> Segments:
        """Without the points that lie behind other panels of the part, seen from the panel."""
        x, y = self.at(found.face, found.place)[0], other.at(found.other, found.opposite)[0]
        distance = np.abs(np.sum((y - x) * normal[found.face], axis=1))
        own = area(self.polygon) * self.size**2
        covered = np.bincount(found.face, found.weight, len(self))
        far, near = np.zeros(len(self)), np.full(len(self), np.inf)
        np.maximum.at(far, found.face, distance)
        np.minimum.at(near, found.face, distance)
        stacked = (covered > (1.0 + SLACK) * own) | (far - near > 0.5 * self.size)
        asked = np.flatnonzero(stacked[found.face])
        if not len(asked):
            return found
        first = other.cast(x[asked], normal[found.face[asked]])
        kept = np.ones(len(x), dtype=bool)
        kept[asked] = distance[asked] <= np.abs(first.distance) + SLACK * self.size[found.face[asked]]
        return found.take(kept)
