"""Meshes from the options of a body, by the kind of its boundary."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..bem.compatibility import check_compatible
from ..errors import InputError
from ..geometry.cad.part import CadSurface
from ..geometry.condensed_surface import CondensedSurface
from ..geometry.round_surfaces import RoundSurface
from ..geometry.surface import Boundary, BoxSurface, FacetSurface
from ..given.body_data import Body
from ..given.tables.solver_options import MeshOptions
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.grading import LARGEST_MESH, mesh_outline
from ..mesh.panelling import box_mesh, facet_mesh, round_mesh
from ..mesh.panels import HIGHEST_ORDER
from ..mesh.ring_mesh import RingMesh
from ..mesh.surface_mesh import SurfaceMesh
from ..untyped import Keyed
from .marks import default_mesh

PANELS = 4
"""Panels on the shortest edge of a box without a given element size."""
EXPONENT = 1.4
"""Exponent of the grading of boxes [-]. Friction limits the order to 2; 1.4 is then near the best
grading for edges and corners."""
PLANE_KEYS = ("grading", "levels", "graded_points")
"""Keys of `[mesh]` that apply only in the plane."""
BOX_KEYS = ("element_sizes", "exponent")
"""Keys of `[mesh]` that apply only to boxes."""


def mesh_of(body: Body, boundary: Boundary) -> BoundaryMesh:
    """Return the mesh of a body from its options, or the default one.

    Raises
    ------
    InputError
        If the mesh options do not fit the body, or the mesh is too large.
    """
    return _mesh(boundary, body)


def resized(body: Body, boundary: Boundary, doublings: int) -> Body:
    """Return the body with options for panels that are twice as large, some times.

    A negative number makes them smaller. Of surfaces whose file has the panels it is the order that
    falls by so much.

    Raises
    ------
    InputError
        If there are no panels of that order.
    """
    size, options = _usual_size(boundary), body.mesh
    if math.isnan(size):
        order = _order(options) - doublings
        if not 0 <= order <= HIGHEST_ORDER:
            raise InputError(f"mesh.order: panels in space have order 0 to {HIGHEST_ORDER}")
        changes: Keyed = {"order": order}
    else:
        factor = 2.0**doublings
        changes = {
            "element_size": factor * (options.element_size or size),
            "element_sizes": {name: factor * h for name, h in options.element_sizes.items()},
        }
    return replace(body, mesh=MeshOptions(**options.model_dump(exclude_unset=True) | changes))


@functools.singledispatch
def _usual_size(boundary: object) -> float:
    """Return the size of panels where none is given; nan where a file has the panels [length]."""
    return math.nan


@_usual_size.register
def _(boundary: RoundSurface | CadSurface) -> float:
    return float(boundary.usual_size)


@_usual_size.register
def _(boundary: BoxSurface) -> float:
    return float((boundary.upper - boundary.lower).min()) / PANELS


@functools.singledispatch
def _mesh(boundary: Any, body: Body) -> BoundaryMesh:
    if "exponent" in body.mesh.model_fields_set:
        raise InputError("mesh.exponent: is for bodies in space; grade plane ones by mesh.grading")
    check_compatible(boundary, body)
    if body.mesh.automatic:
        return default_mesh(body, boundary.joined)
    return mesh_outline(boundary.joined if body.mesh.graded else boundary, body.mesh)


@_mesh.register
def _(boundary: BoxSurface, body: Body) -> SurfaceMesh:
    options, order = body.mesh, _order(body.mesh)
    for name in options.element_sizes:
        if name not in boundary.parts:
            raise InputError(
                f"mesh.element_sizes: no part {name!r}; parts are {', '.join(boundary.parts)}"
            )
    extent = boundary.upper - boundary.lower
    usual = options.element_size or _usual_size(boundary)
    finest = min([usual, *options.element_sizes.values()])
    pairs = (extent[0] * extent[1], extent[1] * extent[2], extent[0] * extent[2])
    _check_size(2.0 * float(sum(pairs)) / finest**2 * (order + 1) ** 2)
    exponent = EXPONENT if options.exponent is None else options.exponent
    return box_mesh(boundary, lambda part: options.element_sizes.get(part, usual), order, exponent)


@_mesh.register
def _(boundary: RoundSurface, body: Body) -> SurfaceMesh:
    order = _order(body.mesh)
    _refuse(
        body.mesh,
        BOX_KEYS,
        "is for boxes; panels of round bodies are of one size, mesh.element_size",
    )
    size = body.mesh.element_size or _usual_size(boundary)
    _check_size(boundary.area / size / size * (order + 1) ** 2)
    return round_mesh(boundary, size, order)


@_mesh.register
def _(boundary: FacetSurface, body: Body) -> SurfaceMesh:
    order = _order(body.mesh)
    _refuse(
        body.mesh,
        ("element_size", *BOX_KEYS),
        "the facets of a surface from a file are its panels; mesh it finer in Gmsh",
    )
    _check_size(
        len(boundary.facets) * (order + 1) ** 2,
        "mesh the file coarser, or choose a lower mesh.order",
    )
    return facet_mesh(boundary, order)


@_mesh.register
def _(boundary: CadSurface, body: Body) -> SurfaceMesh:
    order = _order(body.mesh)
    _refuse(
        body.mesh,
        BOX_KEYS,
        "is for boxes; panels of CAD files are of one size, mesh.element_size",
    )
    size = body.mesh.element_size or _usual_size(boundary)
    _check_size(boundary.area / size / size * (order + 1) ** 2)
    facets = boundary.facets(size)
    _check_size(len(facets.facets) * (order + 1) ** 2)
    return facet_mesh(facets, order)


@_mesh.register
def _(boundary: CondensedSurface, body: Body) -> BoundaryMesh:
    _refuse(body.mesh, MeshOptions.model_fields, "the faces of a superelement are its elements")
    return _faces(boundary)


def _faces(surface: CondensedSurface) -> BoundaryMesh:
    """Return the mesh whose elements are the faces of a superelement.

    They are linear unless the file gives another order.
    """
    points, arrays, count = surface.points[surface.elements], surface.arrays, len(surface.elements)
    if surface.dim == 3:
        corners, middles = (
            np.where(numbers[..., None] >= 0, surface.points[numbers], np.nan)
            for numbers in (surface.elements, surface.middles)
        )
        return SurfaceMesh(corners, surface.order, surface.part, surface.parts, middles)
    start, end = points[:, 0], points[:, 1]
    length, along = np.linalg.norm(end - start, axis=1), np.zeros(count)
    for part in range(len(surface.parts)):
        on_part = surface.part == part
        along[on_part] = np.cumsum(length[on_part]) - length[on_part]
    return (RingMesh if surface.axial else CurveMesh)(
        start,
        end,
        arrays.get("curvature", np.zeros(count)),
        surface.order,
        surface.part,
        surface.whole_numbers("line", np.arange(count, dtype=float)),
        arrays.get("side_start", along),
        surface.parts,
        float(arrays.get("unit_length", surface.diameter)),
    )


def _order(options: MeshOptions) -> int:
    """Return the order of panels, 2 by default."""
    _refuse(options, PLANE_KEYS, "is for plane bodies; meshes of boxes are graded by mesh.exponent")
    if options.accuracy is not None and not options.automatic:
        raise InputError(
            "mesh.accuracy: is for adaptive meshes, which name no element_size, order or grading"
        )
    if options.order is not None and options.order > HIGHEST_ORDER:
        raise InputError(
            f"mesh.order: panels in space have order 0 to {HIGHEST_ORDER}, got {options.order}"
        )
    return 2 if options.order is None else options.order


def _check_size(nodes: float, advice: str = "choose a larger mesh.element_size") -> None:
    if not nodes <= LARGEST_MESH or not np.isfinite(nodes):
        raise InputError(f"mesh: about {nodes:.3g} nodes, at most {LARGEST_MESH:.0e} fit; {advice}")


def _refuse(options: MeshOptions, keys: Iterable[str], why: str) -> None:
    """Raise InputError if a key that does not apply to the body differs from its default.

    Defaults are accepted since `Problem.toml` writes them, too.
    """
    for key in keys:
        if getattr(options, key) != MeshOptions.model_fields[key].get_default(
            call_default_factory=True
        ):
            raise InputError(f"mesh.{key}: {why}")
