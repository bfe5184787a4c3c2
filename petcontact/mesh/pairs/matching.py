"""Meshes of several bodies whose elements match where parts face one another, by the kind of their
boundaries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ...arrays import Array, Mask
from ...frozen import frozen
from ...geometry.meridian import Meridian, TwistedMeridian
from ...geometry.outline import Outline, as_outline
from ...geometry.surface import Boundary, BoxSurface
from ..boundary_mesh import BoundaryMesh
from ..curve_mesh import CurveMesh
from .box_faces import face_projection, grid_lines, mesh_of_lines
from .common_breakpoints import Imposed, joints_within, match
from .curve_sides import as_meshed, curve_projection, mesh_of_sides, side_meshes
from .periodic import translated_sides

KINDS: dict[type, tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]] = {
    Outline: (side_meshes, mesh_of_sides, curve_projection),
    Meridian: (side_meshes, mesh_of_sides, curve_projection),
    TwistedMeridian: (side_meshes, mesh_of_sides, curve_projection),
    BoxSurface: (grid_lines, mesh_of_lines, face_projection),
}
"""Joints of a mesh, the mesh with given joints, and the projection of a pair; other boundaries keep
their elements."""


@frozen
class PairParts:
    """Two parts that face one another, (body, part) each, and the direction if it is given; or of
    which one is the other of the same body moved along."""

    secondary: tuple[int, str]
    primary: tuple[int, str]
    direction: Array | None
    periodic: bool = False


def matched(
    boundaries: Sequence[Boundary],
    meshes: Sequence[BoundaryMesh],
    pairs: Sequence[PairParts],
    too_long: Callable[[BoundaryMesh], Mask] | None = None,
) -> list[BoundaryMesh]:
    """The meshes with joints that agree, as far as the boundaries are of a kind that can be cut
    anew.

    A primary keeps its own joints, and gives them to the secondary, where that leaves it elements
    that are `too_long`: a thin ring on a massive core.

    Raises
    ------
    InputError
        If periodic parts are not one the other moved along.
    """
    boundaries = [
        as_meshed(boundary, mesh) for boundary, mesh in zip(boundaries, meshes, strict=True)
    ]
    kinds = [KINDS.get(type(boundary)) for boundary in boundaries]
    joints = [
        kind[0](*given) if kind else []
        for kind, *given in zip(kinds, boundaries, meshes, strict=True)
    ]
    projections = _projections(boundaries, joints, pairs)

    def agreed(imposed: Imposed) -> list[BoundaryMesh]:
        own = [list(sides) for sides in joints]
        match(own, projections, imposed)
        return [
            kind[1](boundary, sides) if kind and sides else mesh
            for kind, boundary, sides, mesh in zip(kinds, boundaries, own, meshes, strict=True)
        ]

    found = agreed({})
    primaries = {projection.primary[0] for projection in projections}
    imposed = _kept(boundaries, found, joints, primaries, too_long) if too_long else {}
    return agreed(imposed) if imposed else found


def _kept(
    boundaries: Sequence[Any],
    meshes: Sequence[BoundaryMesh],
    joints: Sequence[Any],
    primaries: set[int],
    too_long: Callable[[BoundaryMesh], Mask],
) -> Imposed:
    """Joints of their own that primaries need where their elements are too long."""
    imposed: Imposed = {}
    for b in primaries:
        if isinstance(mesh := meshes[b], CurveMesh) and (over := too_long(mesh)).any():
            imposed |= joints_within(b, joints[b], side_meshes(boundaries[b], mesh), over)
    return imposed


def _projections(
    boundaries: Sequence[Boundary], joints: Sequence[Any], pairs: Sequence[PairParts]
) -> list[Any]:
    """Of the pairs whose two sides can be cut anew."""
    kinds, found = [KINDS.get(type(boundary)) for boundary in boundaries], []
    for pair in pairs:
        (a, part), (b, other) = pair.secondary, pair.primary
        kind = kinds[a]
        if pair.periodic:
            found.append(translated_sides(a, as_outline(boundaries[a], "periodic"), part, other))
        elif kind is not None and kind is kinds[b] and joints[a] and joints[b]:
            found.append(
                kind[2]((a, boundaries[a], part), (b, boundaries[b], other), pair.direction)
            )
    return [projection for projection in found if projection is not None]
