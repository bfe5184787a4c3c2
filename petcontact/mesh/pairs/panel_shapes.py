"""Shapes of flat and curved panels, and pieces of curved ones whose sides are nearly straight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np

from ...arrays import Array, Index, Mask, Rows
from ...geometry.quadratic import position
from ...record import record
from ..curved.curved_panels import CurvedPanels
from ..panels import Panels, make_panels
from .ray_casting import Faces

SAG = 0.1
"""Height of a side over the distance of the sides beside it, up to which a curved panel is clipped
as a whole [-]. The straight panel between its corners lies off it by as much of its width, and what
is integrated there has to cancel. Around an O-ring, where it was 0.4, 0.6 and 0.9, areas were
wrong by 0.9, 7 and 5 %; in pieces up to 0.2, 0.1 and 0.05 by 1e-4, 5e-4 and 1e-4."""


@record
class PanelShapes(Rows, Faces):
    """Convex panels with the body behind them; arrays over n of them.

    Attributes
    ----------
    centre : (n, 3) array
        Of the corners [length].
    frame : (n, 3, 3) array
        Rows: two directions in the plane of the corners and the outward normal.
    size : (n,) array
        Unit of coordinates in that plane [length].
    outline : (n, 4, 2) array
        Corners in that plane, the last one of triangles twice [-].
    polygon : (n, 4, 2) array
        The same in the panels' own local coordinates [-].
    shape : (n, 9, 3) array
        Coefficients of ξ^i η^j of local coordinates, number 3i + j [length].
    bent : (n,) bool array
        Whether it is curved.
    """

    centre: Array
    frame: Array
    size: Array
    outline: Array
    polygon: Array
    shape: Array
    bent: Mask
    SAMPLES: ClassVar[int] = 3

    @classmethod
    def from_groups(cls, groups: Sequence[Panels | CurvedPanels], numbers: Index) -> Self:
        """Return some panels of a mesh, in the order of their numbers, from its groups of one
        kind."""
        index = np.concatenate([group.index for group in groups])
        order = np.argsort(index)
        chosen = order[np.searchsorted(index[order], numbers)]
        chords = [group.chord for group in groups]
        arrays = [[getattr(chord, key) for chord in chords] for key in ("centre", "frame", "size")]
        arrays += [[_four(group.polygon) for group in some] for some in (chords, groups)]
        arrays += [[group.shape for group in groups]]
        centre, frame, size, outline, polygon, shape = (
            np.concatenate(parts)[chosen] for parts in arrays
        )
        bent = np.concatenate(
            [np.full(len(group.index), isinstance(group, CurvedPanels)) for group in groups]
        )[chosen]
        return cls(centre, frame, size, outline, polygon, shape, bent)

    def at(self, number: Index, place: Array) -> tuple[Array, Array]:
        """Return points (k, 3) and outward normals (k, 3) at local coordinates (k, 2) of some
        panels."""
        x = self.centre[number] + self.size[number, None] * np.einsum(
            "kc,kcd->kd", place, self.frame[number, :2]
        )
        normal, bent = np.array(self.frame[number, 2]), np.flatnonzero(self.bent[number])
        if len(bent):
            x[bent], along = position(self.shape, place[bent], number[bent])
            area = np.cross(along[:, 0], along[:, 1])
            normal[bent] = area / np.linalg.norm(area, axis=1, keepdims=True)
        return x, normal

    def spread(self, number: Index, share: Array) -> Array:
        """See `Faces.spread`: bilinear between the corners."""
        a, b = share.T
        corners = np.stack([(1.0 - a) * (1.0 - b), a * (1.0 - b), a * b, (1.0 - a) * b], axis=1)
        return np.asarray(np.einsum("kc,kcd->kd", corners, self.polygon[number]))

    def area(self, number: Index, share: Array) -> Array:
        """See `Faces.area`."""
        (a, b), polygon = share.T, self.polygon[number]
        slopes = np.stack([[b - 1.0, 1.0 - b, b, -b], [a - 1.0, -a, a, 1.0 - a]])
        along = np.einsum("sck,kcd->skd", slopes, polygon)
        area = np.cross(along[0], along[1]) * self.size[number] ** 2
        if len(bent := np.flatnonzero(self.bent[number])):
            panel = number[bent]
            _, tangents = position(self.shape, self.spread(number, share)[bent], panel)
            local = np.linalg.norm(np.cross(tangents[:, 0], tangents[:, 1]), axis=1)
            area[bent] *= local / self.size[panel] ** 2
        return np.asarray(np.abs(area))

    def __len__(self) -> int:
        return len(self.size)

    def rims(self) -> tuple[Index, Array, Array]:
        """See `Faces.rims`; the doubled corner of a triangle has no side."""
        following = np.roll(self.polygon, -1, axis=1)
        number, side = np.nonzero(np.any(following != self.polygon, axis=2))
        return number, self.polygon[number, side], following[number, side]

    def cut(self) -> tuple[Self, Index]:
        """Return pieces of panels whose sides bend by no more than `SAG` of what they are apart,
        and the panels that they are pieces of."""
        count = self._pieces()
        number = np.repeat(np.arange(len(self)), count.prod(axis=1))
        if len(number) == len(self):
            return self, number
        of, k = count[number], np.arange(len(number)) - np.searchsorted(number, number)
        first = np.stack([k % of[:, 0], k // of[:, 0]], axis=1)
        share = (first[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]) / of[:, None]
        result, cut = self.take(number), np.flatnonzero(of.prod(axis=1) > 1)
        place = self.spread(np.repeat(number[cut], 4), share[cut].reshape(-1, 2))
        corners = self.at(np.repeat(number[cut], 4), place)[0].reshape(-1, 4, 3)
        chord = make_panels(corners, 0, cut)[0]
        for name in ("centre", "frame", "size"):
            getattr(result, name)[cut] = getattr(chord, name)
        result.outline[cut], result.polygon[cut] = chord.polygon, place.reshape(-1, 4, 2)
        return result, number

    def _pieces(self) -> Index:
        """Return the numbers of pieces (n, 2) along both directions of panels, seen from above;
        triangles stay whole."""
        x = np.einsum("nscd,ned->nsce", self.at_rims(2)[1], self.frame[:, :2])
        length = np.linalg.norm(x[:, :, 2] - x[:, :, 0], axis=2)
        height = np.linalg.norm(x[:, :, 1] - 0.5 * (x[:, :, 0] + x[:, :, 2]), axis=2)
        apart = SAG * np.minimum(np.roll(length, 1, axis=1), np.roll(length, -1, axis=1))
        some = self.bent & apart.all(axis=1)
        ratio = np.divide(height, apart, out=np.zeros_like(height), where=some[:, None])
        ratio = np.maximum(ratio[:, :2], ratio[:, 2:])
        return np.asarray(np.maximum(np.ceil(np.sqrt(ratio)), 1.0), dtype=np.int64)

    def at_rims(self, pieces: int) -> tuple[Array, Array]:
        """Return shares (pieces + 1, 1) of the sides and points (n, 4, pieces + 1, 3) there."""
        start, end = (
            corners[:, :, None] for corners in (self.polygon, np.roll(self.polygon, -1, axis=1))
        )
        share = np.linspace(0.0, 1.0, pieces + 1)[:, None]
        # ends to the last digit: a side between two places that are one has no direction
        place = start + share * (end - start)
        place[:, :, -1:] = end
        number = np.broadcast_to(np.arange(len(self))[:, None, None], place.shape[:-1])
        x = self.at(number.ravel(), place.reshape(-1, 2))[0]
        return share, x.reshape(*place.shape[:-1], 3)


def _four(polygon: Array) -> Array:
    """Return corners (n, 4, 2), the last one of triangles twice."""
    return np.pad(polygon, ((0, 0), (0, 4 - polygon.shape[1]), (0, 0)), mode="edge")
