"""Joints along the sides of outlines, and their projection from one part to another."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...geometry.outline import Outline
from ...geometry.same_place import TOLERANCE
from ...record import record, replace
from ..curve_building import build_mesh
from ..curve_mesh import CurveMesh
from .common_breakpoints import SideMesh
from .contact_search import NEAR
from .intersections import Curves
from .ray_casting import along


@functools.singledispatch
def as_meshed(boundary: object, mesh: object) -> Any:
    """Return the boundary with the sides from which a mesh was cut.

    Graded meshes join sides that continue straight or along one circle.
    """
    return boundary


@as_meshed.register
def _(boundary: Outline, mesh: CurveMesh) -> Outline:
    ends = set(map(tuple, mesh.end.tolist()))
    whole = all(tuple(side.end.tolist()) in ends for side in boundary.sides)
    return boundary if whole else boundary.joined


def side_meshes(outline: Outline, mesh: CurveMesh) -> list[SideMesh]:
    """Return the joints of each side of a mesh of the outline."""
    result, first, within = [], 0, TOLERANCE * outline.diameter
    for side in outline.sides:
        last = first + 1 + int(np.argmax((mesh.end[first:] == side.end).all(axis=1)))
        joints = np.concatenate([[0.0], np.cumsum(mesh.length[first:last])])
        joints /= joints[-1]
        result.append(SideMesh(joints, mesh.order[first:last], within / side.length))
        first = last
    return result


def mesh_of_sides(outline: Outline, sides: Sequence[SideMesh]) -> CurveMesh:
    """Return the boundary mesh with these joints."""
    return build_mesh(outline, [side.breaks for side in sides], [side.order for side in sides])


@record
class CurveProjection:
    """The `PartProjection` between the sides of two parts, with their curves and a direction, if
    given.

    Points that are farther apart than `reach` do not meet [length].
    """

    secondary: tuple[int, Index]
    primary: tuple[int, Index]
    own: Curves
    other: Curves
    direction: Array | None
    reach: float = np.inf

    def to_primary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Project along the secondary's outward normals, or along the direction."""
        x, normal = self.own.at(np.full(len(fractions), side), fractions)
        hits = self.other.cast(x, along(self.direction, normal))
        return np.where(hits.distance <= self.reach, hits.face, -1), hits.place

    def to_secondary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Project by perpendiculars, or against the direction."""
        x, normal = self.other.at(np.full(len(fractions), side), fractions)
        hits = self.own.comes_from(x, normal, self.direction)
        return np.where(hits.distance <= self.reach, hits.face, -1), hits.place

    def near(self) -> CurveProjection:
        """Return the projection between those parts of both that elements should match on.

        They are as near as the nearest ones, and `NEAR` times the size of the secondary. A roller
        does not hand the joints of the race on its far side to all other rollers.
        """
        line, sides = np.linspace(0.0, 1.0, self.own.SAMPLES), range(len(self.own))
        x, normal = self.own.at(np.repeat(sides, len(line)), np.tile(line, len(sides)))
        least = float(self.other.cast(x, along(self.direction, normal)).distance.min())
        return replace(self, reach=least + NEAR * float(np.ptp(x, axis=0).max()))


def curve_projection(
    secondary: tuple[int, Outline, str], primary: tuple[int, Outline, str], direction: Array | None
) -> CurveProjection:
    """Return the projection between two parts.

    Each part is given by the number of its body, the outline, and its name.
    """
    numbers = [
        np.array([k for k, side in enumerate(outline.sides) if side.part == part])
        for _, outline, part in (secondary, primary)
    ]
    own, opposite = (
        sides_of(outline, chosen)
        for (_, outline, _), chosen in zip((secondary, primary), numbers, strict=True)
    )
    return CurveProjection(
        (secondary[0], numbers[0]), (primary[0], numbers[1]), own, opposite, direction
    )


def near_projection(
    secondary: tuple[int, Outline, str],
    primary: tuple[int, Outline, str],
    direction: Array | None,
) -> CurveProjection:
    """Return `curve_projection` of what is near only."""
    return curve_projection(secondary, primary, direction).near()


def sides_of(outline: Outline, numbers: Index) -> Curves:
    """Return some sides of an outline as curves."""
    sides = [outline.sides[k] for k in numbers]
    return Curves(
        np.array([s.start for s in sides]),
        np.array([s.end for s in sides]),
        np.array([s.curvature for s in sides]),
    )
