"""Grid lines on the faces of boxes, and their projection onto a parallel face."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...geometry.same_place import TOLERANCE
from ...geometry.surface import BOX_PARTS, BoxSurface, face_axes
from ...record import record
from ...round_off import WRITTEN
from ..panelling import box_of_lines
from ..surface_mesh import SurfaceMesh
from .common_breakpoints import SideMesh


def grid_lines(box: BoxSurface, mesh: SurfaceMesh) -> list[SideMesh]:
    """Return the grid lines along both axes of each face of a box mesh, twelve sides.

    The list is empty if a face has no grid.
    """
    result: list[SideMesh] = []
    for number, face in enumerate(BOX_PARTS.values()):
        panels = np.flatnonzero(mesh.part == number)
        first = len(result)
        for axis in face_axes(*face):
            lines = np.unique(mesh.corners[panels, :, axis])
            breaks = (lines - box.lower[axis]) / (box.upper - box.lower)[axis]
            result.append(
                SideMesh(breaks, np.full(len(breaks) - 1, mesh.order[panels[0]]), TOLERANCE)
            )
        if len(result[first].order) * len(result[first + 1].order) != len(panels):
            return []
    return result


def mesh_of_lines(box: BoxSurface, sides: list[SideMesh]) -> SurfaceMesh:
    """Return the mesh of the box with these grid lines."""
    return box_of_lines(box, [side.breaks for side in sides], [side.order for side in sides])


@record
class FaceProjection:
    """The `PartProjection` between two parallel faces.

    Side k of the primary has the axis of the secondary's `partner[k]`.

    Attributes
    ----------
    start, size : two (2,) arrays each
        Starts of the axes of the secondary and of the primary, and their lengths. The primary is
        moved onto the secondary.
    """

    secondary: tuple[int, Index]
    primary: tuple[int, Index]
    partner: tuple[int, int]
    start: tuple[Array, Array]
    size: tuple[Array, Array]

    def to_primary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Return the side (-1 beyond it) and fractions on the primary of points on the
        secondary."""
        facing_side = self.partner.index(side)
        place = self.start[0][side] + self.size[0][side] * fractions
        return _within(facing_side, place, self.start[1][facing_side], self.size[1][facing_side])

    def to_secondary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Return the side (-1 beyond it) and fractions on the secondary of points on the
        primary."""
        facing_side = self.partner[side]
        place = self.start[1][side] + self.size[1][side] * fractions
        return _within(facing_side, place, self.start[0][facing_side], self.size[0][facing_side])


def _within(side: int, place: Array, start: float, size: float) -> tuple[Index, Array]:
    fraction = (place - start) / size
    met = (fraction >= -WRITTEN) & (fraction <= 1.0 + WRITTEN)
    return np.where(met, side, -1), np.clip(fraction, 0.0, 1.0)


def face_projection(
    secondary: tuple[int, BoxSurface, str],
    primary: tuple[int, BoxSurface, str],
    direction: Array | None,
) -> FaceProjection | None:
    """Return the projection between two faces, or None if they do not face one another.

    Each face is given by the number of its body, the box, and its name.
    """
    (a, one, part), (b, two, facing_part) = secondary, primary
    (axis, side), (across, opposite) = BOX_PARTS[part], BOX_PARTS[facing_part]
    own, theirs = face_axes(axis, side), face_axes(across, opposite)
    way = np.eye(3)[axis] * (2 * side - 1) if direction is None else direction
    if axis != across or side == opposite or way[axis] * (2 * side - 1) <= 0.0:
        return None
    height = (two.lower, two.upper)[opposite][axis] - (one.lower, one.upper)[side][axis]
    moved = two.lower - way * (height / way[axis])
    first, second = list(own), list(theirs)
    return FaceProjection(
        (a, 2 * list(BOX_PARTS).index(part) + np.arange(2)),
        (b, 2 * list(BOX_PARTS).index(facing_part) + np.arange(2)),
        (own.index(theirs[0]), own.index(theirs[1])),
        (one.lower[first], moved[second]),
        ((one.upper - one.lower)[first], (two.upper - two.lower)[second]),
    )
