"""Intersections of rays with flat or curved panels, and the polygons in which panels face one
another."""

from __future__ import annotations

import functools

import numpy as np

from ... import native
from ...arrays import Array, Index, largest_by, smallest_by
from ...geometry.arcs import cross
from ...record import record, replace
from ...round_off import SINGLE, SUMMED, WRITTEN
from .clipping import area, fan_rule, shared
from .panel_shapes import PanelShapes
from .ray_casting import TOGETHER, FacingSegments, Hits, along, line_rows

BENT = 1e-2
"""Distance over the size of a curved panel up to which two coincide; shadows have straight sides
[-]."""
PIECES, THIN = 6, 3
"""`PIECES` is the number of straight pieces of a curved side. `THIN` is the number of points, along
each direction, of the rule between a side and its chord."""
STEPS, BEYOND = 20, 0.5
"""`STEPS` is the number of Newton's steps to a line's intersection with a curved panel. `BEYOND` is
how far they may leave the panel, in local coordinates."""
_meet = native.function("petcontact_space_meet", "iNDDDDDidddDD")


@record
class PanelFaces(PanelShapes):
    """Convex panels that are met by lines and face other panels."""

    def _cast(self, x: Array, direction: Array) -> Hits:
        """See `Faces.cast`."""
        i, j = self._near_lines(x, direction, np.zeros(len(x)))
        place, distance = self._met(j, x[i], direction[i])
        polygon = self.polygon[j]
        edge = np.roll(polygon, -1, axis=1) - polygon
        length = np.linalg.norm(edge, axis=2)
        # distance (k, 4) inside of each edge; a doubled corner has none
        none = np.full(length.shape, np.inf)
        depth = np.divide(
            cross(edge, place[:, None] - polygon), length, out=none, where=length > 0.0
        ).min(axis=1)
        # the same point on the edge of two panels belongs to the one that holds it better
        rank = np.abs(distance) - 1e-12 * self.size[j] * np.minimum(depth, 1.0)
        best = np.flatnonzero(depth >= -WRITTEN)
        best = best[np.lexsort((rank[best], i[best]))]
        best = best[np.append(True, np.diff(i[best]) > 0)[: len(best)]]
        face, places, far = np.full(len(x), -1), np.zeros((len(x), 2)), np.full(len(x), np.inf)
        face[i[best]], places[i[best]], far[i[best]] = j[best], place[best], distance[best]
        return Hits(face, places, far)

    def segments(
        self, other: PanelFaces, order: Index, opposite: Index, direction: Array | None
    ) -> FacingSegments:
        """See `Faces.segments`: opposite panels, projected onto the plane of each panel, clip
        it."""
        (own, whole), (seen, behind) = self.cut(), other.cut()
        found = own._facing(seen, order[whole], opposite[behind], direction)
        return replace(found, face=whole[found.face], other=behind[found.other])

    def _facing(
        self, other: PanelFaces, order: Index, opposite: Index, direction: Array | None
    ) -> FacingSegments:
        """Return `segments` of panels whose sides are nearly straight."""
        segments = self._clipped(other, order, opposite, direction)
        segments = self._nearest_only(
            other, segments, along(direction, self.frame[:, 2]), direction
        )
        x, normal = self.at(segments.face, segments.place)
        normal = along(direction, normal)
        distance = np.sum((other.at(segments.other, segments.opposite)[0] - x) * normal, axis=1)
        # no other face lies between, up to an overlap of a twentieth of a panel
        kept = distance >= -0.05 * self.size[segments.face]
        kept[~kept] = ~other.beyond(x[~kept], normal[~kept], distance[~kept])
        return segments.take(kept)

    def _clipped(
        self, other: PanelFaces, order: Index, opposite: Index, direction: Array | None
    ) -> FacingSegments:
        """Return `segments` of panels, also where other panels lie between."""
        normal = along(direction, self.frame[:, 2])
        i, j = self._ahead(other, normal)
        pieces = PIECES if self.bent.any() or other.bent.any() else 1
        rim = self._projected(
            np.arange(len(self))[:, None, None], self._rim(pieces), self.frame[:, None, None, 2]
        )
        shadow = self._projected(i[:, None, None], other._rim(pieces)[j], normal[i, None, None])[
            :, ::-1, ::-1
        ]
        i, j, sides, shadow = self._one_to_one(i, j, rim[i], shadow)
        # the rule with q points is exact to 2q - 2, of products with positions and with the panel's
        # own polynomials, too
        own = self._degree(order)[i]
        count = (own + np.maximum(other._degree(opposite)[j], np.maximum(own, 1)) + 1) // 2 + 1
        # the area factor of curved panels
        count = count + (self.bent[i] | other.bent[j])
        parts = [FacingSegments(i[:0], np.empty((0, 2)), j[:0], np.empty((0, 2)), np.empty(0))]
        for number, polygon, sign in shared(sides, shadow):
            rule = count[number] if len(parts) == 1 else np.full(len(number), THIN)
            for points in np.unique(rule).tolist():
                rows = np.flatnonzero(rule == points)
                pair = i[number[rows]], j[number[rows]]
                local, weight = fan_rule(polygon[rows], points)
                weight = sign[rows, None] * np.maximum(weight, 0.0)
                parts.append(self._met_at(other, pair, local, weight, direction))
        return FacingSegments.joined(parts)

    def _ahead(self, other: PanelFaces, normal: Array) -> tuple[Index, Index]:
        """Return pairs of panels that lie near a line along the normal and face each other."""
        i, j = other._near_lines(self.centre, normal, self.size)
        outward = np.sum(normal[i] * self.frame[i, 2], axis=1)
        against = np.sum(normal[i] * other.frame[j, 2], axis=1)
        ahead = (outward > WRITTEN) & (against < -WRITTEN)
        return i[ahead], j[ahead]

    def _met_at(
        self,
        other: PanelFaces,
        pair: tuple[Index, Index],
        local: Array,
        weight: Array,
        direction: Array | None,
    ) -> FacingSegments:
        """Return the segments of quadrature points (n, q) of pairs of panels (n,), where they meet
        the other panel."""
        chosen = weight != 0.0
        face, seen = (np.broadcast_to(k[:, None], weight.shape)[chosen] for k in pair)
        place, weights = self._lifted(face, local[chosen], weight[chosen])
        x, outward = self.at(face, place)
        opposite = other._met(seen, x, along(direction, outward))[0]
        met = np.all(np.isfinite(opposite), axis=1)
        return FacingSegments(face, place, seen, opposite, weights).take(met)

    def _rim(self, pieces: int) -> Array:
        """Return points (n, 4, pieces + 1, 3) along the sides.

        Pieces of a curved side enclose the same area with its chord as the curve.
        """
        share, x = self.at_rims(pieces)
        chord = x[:, :, :1] + share * (x[:, :, -1:] - x[:, :, :1])
        chord[:, :, -1] = x[:, :, -1]
        # of a parabola, inscribed lines leave out 1/pieces²
        return x if pieces == 1 else np.asarray(chord + (x - chord) / (1.0 - pieces**-2))

    def _one_to_one(
        self, i: Index, j: Index, rim: Array, shadow: Array
    ) -> tuple[Index, Index, Array, Array]:
        """Return couples with their sides and shadows.

        Curved panels that match face one another completely, and no other panel.
        """
        middle = rim.shape[2] // 2
        if middle == 0:
            return i, j, rim, shadow
        marks, others = (
            np.concatenate([lines[:, :, 0], lines[:, :, middle]], axis=1) for lines in (rim, shadow)
        )
        apart = np.abs(marks[:, :, None] - others[:, None]).max(axis=3)
        alike = np.all(apart.min(axis=2) < SINGLE, axis=1)
        kept = alike | ~(np.isin(i, i[alike]) | np.isin(j, j[alike]))
        shadow = np.where(alike[:, None, None, None], rim, shadow)
        return i[kept], j[kept], rim[kept], shadow[kept]

    def _degree(self, order: Index) -> Index:
        """Return the total degree of the basis: the order on triangles, twice that on
        quadrilaterals."""
        return np.where(np.all(self.polygon[:, 2] == self.polygon[:, 3], axis=1), order, 2 * order)

    def _met(self, number: Index, x: Array, direction: Array) -> tuple[Array, Array]:
        """Return the local coordinates (k, 2) where lines through points (k, 3) meet panels or
        their continuation, and distances (k,).

        NaN and infinity where they do not, or meet a curved panel from behind.
        """
        plane = self.frame[number, 2]
        with np.errstate(divide="ignore", invalid="ignore"):  # lines along the plane
            distance = np.sum((self.centre[number] - x) * plane, axis=1) / np.sum(
                direction * plane, axis=1
            )
        place, bent = self._projected(number, x, direction), np.flatnonzero(self.bent[number])
        if len(bent):
            place[bent], distance[bent] = self._pierced(number[bent], x[bent], direction[bent])
        return place, distance

    def _pierced(self, number: Index, x: Array, direction: Array) -> tuple[Array, Array]:
        """Return `_met` of curved panels."""
        place, distance = np.empty((len(x), 2)), np.empty(len(x))
        arrays = [native.contiguous(a) for a in (self.shape, self.polygon, self.size, x, direction)]
        number = native.contiguous(number, np.int64)
        _meet(len(x), number, *arrays, STEPS, SUMMED, WRITTEN, BEYOND, place, distance)
        return place, distance

    def _lifted(self, number: Index, local: Array, weight: Array) -> tuple[Array, Array]:
        """Return local coordinates (k, 2) and areas (k,) of points and weights in the planes of
        panels' corners."""
        weight, place = weight * self.size[number] ** 2, np.array(local)
        bent = np.flatnonzero(self.bent[number])
        if len(bent):
            some = number[bent]
            x = self.centre[some] + self.size[some, None] * np.einsum(
                "kc,kcd->kd", local[bent], self.frame[some, :2]
            )
            place[bent] = self._pierced(some, x, -self.frame[some, 2])[0]
            lean = np.sum(self.at(some, place[bent])[1] * self.frame[some, 2], axis=1)
            weight[bent] = np.where(
                lean > WRITTEN, weight[bent] / np.where(lean > WRITTEN, lean, 1.0), 0.0
            )
        kept = np.all(np.isfinite(place), axis=1)
        return np.where(kept[:, None], place, 0.0), np.where(kept, weight, 0.0)

    def _near_lines(self, x: Array, direction: Array, radius: Array) -> tuple[Index, Index]:
        """Return pairs of lines and panels that may meet from outside, (k,) and (k,).

        The lines pass through points (m, 3) and have a thickness, with radii (m,).
        """
        pairs = [(np.empty(0, dtype=np.int64),) * 2]
        step = max(1, TOGETHER // max(1, len(self)))
        middle = self.centre.mean(axis=0)
        c, x = self.centre - middle, x - middle
        # squared distance of line and centre less the squared reach, as one product of what lines
        # and panels have
        square, reach = np.sum(c**2, axis=1), np.sqrt(1.0 + WRITTEN) * self._reach
        a, b = np.triu_indices(3)
        panels = np.vstack([c.T, square - reach**2, reach, np.ones(len(c)), c[:, a].T * c[:, b].T])
        for k in range(0, len(x), step):
            way, point = direction[k : k + step], x[k : k + step]
            lines, far = line_rows(way, point, np.sqrt(1.0 + WRITTEN) * radius[k : k + step])
            # the squares cancel to round-off of the farthest
            i, j = np.nonzero(lines @ panels <= 1e-14 * (far.max() + square.max()))
            outside = self.bent[j] | (np.sum(way[i] * self.frame[j, 2], axis=1) < -WRITTEN)
            pairs.append((k + i[outside], j[outside]))
        i, j = (np.concatenate(values) for values in zip(*pairs, strict=True))
        return i, j

    @functools.cached_property
    def _reach(self) -> Array:
        """Radius of the panels about their centres, (n,)."""
        # five points along each direction show the size of a curved panel
        t = np.linspace(0.0, 1.0, 5)
        share = np.stack(np.meshgrid(t, t), axis=-1).reshape(-1, 2)
        number = np.repeat(np.arange(len(self)), len(share))
        x = self.at(number, self.spread(number, np.tile(share, (len(self), 1))))[0]
        away = np.linalg.norm(x - self.centre[number], axis=1).reshape(-1, len(share))
        return np.where(self.bent, away.max(axis=1), self.size)

    def _projected(self, number: Index, x: Array, direction: Array) -> Array:
        """Return the local coordinates (..., 2) where lines through points (..., 3) meet planes of
        panels, not finite if parallel."""
        plane, away = self.frame[number, 2], x - self.centre[number]
        with np.errstate(divide="ignore", invalid="ignore"):
            away = (
                away
                - (np.sum(away * plane, axis=-1) / np.sum(direction * plane, axis=-1))[..., None]
                * direction
            )
            return np.asarray(
                np.einsum("...cd,...d->...c", self.frame[number, :2], away)
                / self.size[number][..., None]
            )

    def _nearest_only(
        self, other: PanelFaces, found: FacingSegments, normal: Array, direction: Array | None
    ) -> FacingSegments:
        """Return the segments without points behind other panels of the part, seen from the
        panel."""
        x, y = self.at(found.face, found.place)[0], other.at(found.other, found.opposite)[0]
        distance = np.linalg.norm(y - x, axis=1)
        own = area(self.outline) * self.size**2
        slack = np.where(self.bent, BENT, WRITTEN)
        covered = np.bincount(found.face, found.weight, len(self))
        far = largest_by(found.face, distance, len(self))
        near = smallest_by(found.face, distance, len(self))
        stacked = (covered > (1.0 + 10.0 * slack) * own) | (far - near > 0.5 * self.size)
        asked = np.flatnonzero(stacked[found.face])
        if not len(asked):
            return found
        outward = self.at(found.face[asked], found.place[asked])[1]
        first = other.cast(x[asked], outward if direction is None else normal[found.face[asked]])
        kept = np.ones(len(x), dtype=bool)
        slack = np.maximum(
            slack[found.face[asked]], np.where(other.bent[found.other[asked]], BENT, WRITTEN)
        )
        kept[asked] = (
            distance[asked] <= np.abs(first.distance) + slack * self.size[found.face[asked]]
        )
        return found.take(kept)
