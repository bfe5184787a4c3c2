"""Meshes of several bodies whose elements match on facing parts, by the kind of their
boundaries."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...arrays import Mask
from ...geometry.meridian import Meridian, TwistedMeridian
from ...geometry.outline import Outline, as_outline
from ...geometry.surface import Boundary, BoxSurface
from ...given.interface_data import PosedInterface
from ..boundary_mesh import BoundaryMesh
from ..curve_mesh import CurveMesh
from .box_faces import face_projection, grid_lines, mesh_of_lines
from .common_breakpoints import Imposed, PartProjection, SideMesh, joints_within, match
from .curve_sides import as_meshed, mesh_of_sides, near_projection, side_meshes
from .periodic import translated_sides

KINDS: dict[
    type,
    tuple[
        Callable[..., list[SideMesh]],
        Callable[..., BoundaryMesh],
        Callable[..., PartProjection | None],
    ],
] = {
    Outline: (side_meshes, mesh_of_sides, near_projection),
    Meridian: (side_meshes, mesh_of_sides, near_projection),
    TwistedMeridian: (side_meshes, mesh_of_sides, near_projection),
    BoxSurface: (grid_lines, mesh_of_lines, face_projection),
}
"""Functions for the joints of a mesh, the mesh with given joints, and the projection of a pair.
Other boundaries keep their elements."""


def matched(
    boundaries: Sequence[Boundary],
    meshes: Sequence[BoundaryMesh],
    pairs: Sequence[PosedInterface],
    too_long: Callable[[BoundaryMesh], Mask] | None = None,
) -> list[BoundaryMesh]:
    """Return the meshes with matching joints, if the boundaries can be cut again.

    Each pair has a primary that is a part of a body.

    A primary takes the joints of the secondary. If its elements would be `too_long`, it keeps its
    own joints and gives them to the secondary. An example is a thin ring on a massive core.

    Raises
    ------
    InputError
        If periodic parts are not translations of one another.
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

    agreeing = agreed({})
    primaries = {projection.primary[0] for projection in projections}
    imposed = _kept(boundaries, agreeing, joints, primaries, too_long) if too_long else {}
    return agreed(imposed) if imposed else agreeing


def _kept(
    boundaries: Sequence[Boundary],
    meshes: Sequence[BoundaryMesh],
    joints: Sequence[list[SideMesh]],
    primaries: set[int],
    too_long: Callable[[BoundaryMesh], Mask],
) -> Imposed:
    """Return the own joints that primaries need where their elements would be too long."""
    imposed: Imposed = {}
    for b in primaries:
        if isinstance(mesh := meshes[b], CurveMesh) and (over := too_long(mesh)).any():
            imposed |= joints_within(
                b, joints[b], side_meshes(as_outline(boundaries[b], "curves"), mesh), over
            )
    return imposed


def _projections(
    boundaries: Sequence[Boundary],
    joints: Sequence[list[SideMesh]],
    pairs: Sequence[PosedInterface],
) -> list[PartProjection]:
    """Return the projections of the pairs both of whose sides can be cut again."""
    kinds = [KINDS.get(type(boundary)) for boundary in boundaries]
    projections = list[PartProjection | None]()
    for pair in pairs:
        (a, part), (b, partner) = pair.ends
        kind = kinds[a]
        if pair.periodic:
            projections.append(
                translated_sides(a, as_outline(boundaries[a], "periodic"), part, partner)
            )
        elif kind is not None and kind is kinds[b] and joints[a] and joints[b]:
            projections.append(
                kind[2]((a, boundaries[a], part), (b, boundaries[b], partner), pair.direction)
            )
    return [projection for projection in projections if projection is not None]
