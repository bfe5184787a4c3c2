"""The first meshes of bodies in space.

They have the user's options, or panels that are small enough for contact and for bending.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Mask, marked
from ...geometry.cad.part import CadSurface
from ...geometry.surface import BOX_PARTS, Boundary, BoxSurface
from ...given.body_data import Body
from ...given.conditions import Contact
from ...given.posed import Posed
from ...given.tables.solver_options import MeshOptions
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...record import record, replace
from ...refinement.body_meshes import mesh_of
from ...refinement.panels.cut_directions import sides
from ...refinement.panels.data_lines import with_data_lines
from ...refinement.panels.panel_cuts import LONGER, facing
from ...refinement.panels.quartering import cut
from ...untyped import Keyed
from ..judge.meshes import stiff_size
from ..judge.thickness import SHARE, held_nodes, slenderness
from ..pose.body_parts import body_alone

FIRST = 36
"""Approximate number of panels on a contact face of the first mesh; other faces have a quarter."""
ROUND = 16
"""Approximate number of panels on a contact part of a round body, all of one size."""
FIRST_SHARE = 0.5
"""Share of the nodes of the budget that the first mesh of a thin body may have."""
MULTIPLES = (1.0, 1.5, 2.0, 2.5)
"""Allowed panel sizes over `stiff_size` times the thickness [-]. At 1, bending is wrong by a tenth;
beyond the last one, bending is not solved at all."""


class _First(NamedTuple):
    """The first mesh of a body, the one before thin panels are cut, and the entry of `MULTIPLES`
    that limits its panels; 0 for none."""

    mesh: SurfaceMesh
    plain: SurfaceMesh
    thin: float = 0.0


@record
class FirstMeshes:
    """The first meshes of the bodies of a problem.

    Attributes
    ----------
    posed : Posed
    nodes : float
        About how many nodes a thin body may have.
    """

    posed: Posed
    nodes: float

    @functools.cached_property
    def meshes(self) -> list[SurfaceMesh]:
        """The first meshes, with soft primaries refined for their stiff secondaries."""
        meshes = [own.mesh for own in self._own]
        for side in self.posed.interfaces:
            if side.primary is None or not self._presses(side.body, side.primary[0]):
                continue
            (b, part), outlines = side.primary, self.posed.boundaries
            if outlines[b].has_inside:
                meshes[b] = fine_enough(
                    (meshes[side.body], side.part), (meshes[b], part), side.direction, outlines[b]
                )
        return meshes

    @property
    def plain(self) -> list[SurfaceMesh]:
        """The meshes from the options of the bodies, before panels are cut."""
        return [own.plain for own in self._own]

    @property
    def thin(self) -> dict[int, float]:
        """The entry of `MULTIPLES` of each body whose panels are limited by its thickness
        (`slender`)."""
        return {b: own.thin for b, own in enumerate(self._own) if own.thin}

    @functools.cached_property
    def _own(self) -> list[_First]:
        return list(map(self._first, range(len(self.posed.bodies))))

    def _first(self, number: int) -> _First:
        boundary = self.posed.boundaries[number]
        given = body_alone(self.posed, number, boundary)
        body = first_options(given, boundary, bilateral=self.posed.holds_normals)
        mesh = as_surface(mesh_of(body, boundary))
        if not given.mesh.automatic:
            return _First(mesh, mesh)
        if bends(mesh, given):
            body = replace(body, mesh=body.mesh.model_copy(update={"order": 2}))
            mesh = as_surface(mesh_of(body, boundary))
        mesh = with_data_lines(boundary, given, mesh)
        if not (boundary.exact and boundary.known):
            return _First(mesh, mesh)
        thick, multiple = thick_enough(body, boundary, mesh, self.nodes)
        while (few := _few_on_contact(thick, given)).any():
            thick = cut(thick, few, boundary)
        return _First(thick, mesh, multiple)

    def _presses(self, secondary: int, primary: int) -> bool:
        """Return whether a secondary presses on a softer primary whose mesh the user did not
        choose.

        The primary's panels are then at most `LONGER` times as long as the opposite ones.
        """
        stiff, soft = (self.posed.bodies[b] for b in (secondary, primary))
        return stiff.material.young_modulus > soft.material.young_modulus and soft.mesh.automatic


def first_options(body: Body, boundary: Boundary, *, bilateral: bool) -> Body:
    """Return the body with the options of its first mesh.

    The order is 2 for u_t, which is smooth, and for bodies that bend (see `bends`). Otherwise it
    is 1, which is as accurate for the same number of nodes and cheaper.
    """
    if not body.mesh.automatic:
        return body
    options: Keyed = {"order": 2 if bilateral else 1}
    touching = [c.part for c in body.boundary if isinstance(c, Contact)]
    options |= _first_sizes(boundary, body, touching)
    return replace(body, mesh=MeshOptions(**options))


def _few_on_contact(mesh: SurfaceMesh, body: Body) -> Mask:
    """Return panels that are twice as large as `ROUND` panels on their contact part would be,
    (n_elements, 2)."""
    area, result = np.bincount(mesh.element, mesh.weight), np.zeros((mesh.n_elements, 2), bool)
    for part in (c.part for c in body.boundary if isinstance(c, Contact)):
        own = mesh.elements_of(part)
        result[own] = (area[own] > 2.0 / ROUND * area[own].sum())[:, None]
    return result


@functools.singledispatch
def _first_sizes(boundary: Boundary, body: Body, touching: list[str]) -> Keyed:
    """Return the options for the size of the first panels."""
    if not boundary.known:
        return {}
    usual = mesh_of(replace(body, mesh=MeshOptions(order=0)), boundary)
    areas = [usual.weight[usual.nodes_of(part)].sum() for part in touching]
    return {"element_size": math.sqrt(min(areas) / ROUND)}


@_first_sizes.register
def _(boundary: CadSurface, body: Body, touching: list[str]) -> Keyed:
    usual = boundary.usual_size
    areas = [boundary.area_of(part) for part in touching]
    return {"element_size": max(usual, math.sqrt(min(areas) / ROUND))}


@_first_sizes.register
def _(boundary: BoxSurface, body: Body, touching: list[str]) -> Keyed:
    extent = boundary.upper - boundary.lower
    longest = float(stiff_size(1) * extent.min())
    area = {part: float(np.delete(extent, axis).prod()) for part, (axis, _) in BOX_PARTS.items()}
    sizes = {part: min(longest, math.sqrt(area[part] / FIRST)) for part in touching}
    size = min(longest, 2.0 * min(sizes.values()))
    return {"element_size": size, "element_sizes": sizes, "exponent": 1.0}


def thick_enough(
    body: Body, boundary: Boundary, mesh: SurfaceMesh, nodes: float
) -> tuple[SurfaceMesh, float]:
    """Return the first mesh with panels that are small next to the thickness, and their entry of
    MULTIPLES.

    Parameters
    ----------
    body : Body
        The body with the options of its first mesh.
    boundary : Boundary
        The surface onto which cut panels are projected.
    mesh : SurfaceMesh
        The mesh from the options.
    nodes : float
        Nodes of the budget. The mesh takes the smallest entry of MULTIPLES that needs at most the
        share `FIRST_SHARE` of them. If the largest one needs more than all nodes, the mesh is left
        as it is.
    """
    ratio, count = slenderness(mesh) / stiff_size(mesh.order), np.bincount(mesh.element)
    needed = [float(count @ np.maximum(1.0, ratio / m) ** 2) for m in MULTIPLES]
    multiple = next(
        (m for m, number in zip(MULTIPLES, needed, strict=True) if number <= FIRST_SHARE * nodes),
        MULTIPLES[-1],
    )
    if needed[-1] > nodes or not slender(mesh, multiple).any():
        return mesh, multiple
    # choose the first size such that repeated halving ends just below the limit
    worst, size = float(ratio.max()) / multiple, body.mesh.element_size
    assert size is not None
    options = body.mesh.model_copy(
        update={"element_size": size / (worst / 2.0 ** math.floor(math.log2(worst)))}
    )
    mesh = as_surface(mesh_of(replace(body, mesh=options), boundary))
    while (over := slender(mesh, multiple)).any():
        mesh = cut(mesh, over, boundary)
    return mesh, multiple


def multiple_of(mesh: SurfaceMesh) -> float:
    """Return the least entry of `MULTIPLES` that no large part of a mesh exceeds, or the last."""
    return next((m for m in MULTIPLES if not slender(mesh, m).any()), MULTIPLES[-1])


def bends(mesh: SurfaceMesh, body: Body) -> bool:
    """Return whether most of a body's surface has another side within the size of a panel, both
    not held.

    Linear panels as large as the thickness bend 15 % too little, those of order 2 by 3 %.
    """
    area = np.bincount(mesh.element, mesh.weight)
    thin = slenderness(mesh, held_nodes(mesh, body)) > 0.0
    return bool(area[thin].sum() > 0.5 * area.sum())


def slender(mesh: SurfaceMesh, multiple: float) -> Mask:
    """Return along which coordinates panels are too long next to the thickness behind them,
    (n_elements, 2).

    These are panels whose areas are too large. None is marked where they are a small share of the
    body's surface.
    """
    over = (ratio := slenderness(mesh) / (multiple * stiff_size(mesh.order))) > 1.0
    area, length = np.bincount(mesh.element, mesh.weight), np.linalg.norm(sides(mesh), axis=2)
    if not area[over].sum() > SHARE * area.sum():
        return np.zeros((mesh.n_elements, 2), dtype=bool)
    most = np.minimum(np.sqrt(area) / np.maximum(ratio, 1.0), length.max(axis=1))
    return np.asarray(over[:, None] & (length >= most[:, None]))


def fine_enough(
    secondary: tuple[SurfaceMesh, str],
    primary: tuple[SurfaceMesh, str],
    direction: Array | None,
    surface: Boundary,
) -> SurfaceMesh:
    """Return the mesh of a soft primary, cut until its panels are as short as those of a stiff
    secondary.

    Small panels of a stiff body have tractions that larger panels of a soft body cannot follow.
    They are as large as between rigid bodies, and the sets of contact cycle.
    """
    mesh, part = primary
    length = np.linalg.norm(sides(secondary[0]), axis=2).max(axis=1)
    while True:
        own, opposite = facing(secondary, (mesh, part), direction)
        long = np.linalg.norm(sides(mesh), axis=2)[opposite].max(axis=1) > LONGER * length[own]
        if not long.any():
            return mesh
        over = np.repeat(marked(opposite[long], mesh.n_elements)[:, None], 2, axis=1)
        mesh = cut(mesh, over, surface)
