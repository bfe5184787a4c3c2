"""Surfaces from Gmsh meshes: triangles and quadrilaterals of the physical surfaces, orders 1 and 2, as flat facets."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..errors import InputError
from .surface import FacetSurface, checked_surface

FLAT = 1e-9
"""Quadrilaterals whose corners lie in one plane but for this fraction of their size stay whole, others become triangles."""
_CUTS: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1, 2),),
    "triangle6": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    "quad": ((0, 1, 2, 3),),
    "quad8": ((0, 4, 7), (4, 1, 5), (5, 2, 6), (7, 6, 3), (4, 5, 6, 7)),
    "quad9": ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)),
}
"""Flat facets that a cell becomes, by its nodes in Gmsh's order."""


def gmsh_surface(mesh: Any, file: str) -> FacetSurface:
    """The closed surface of a mesh as meshio has it, its normals outward.

    Raises
    ------
    InputError
        If no physical surface holds a cell, or the surface is none of a body (see `checked_surface`).
    """
    names = {int(tag): str(name) for name, (tag, dimension) in mesh.field_data.items() if dimension == 2}
    tags = mesh.cell_data.get("gmsh:physical", [None] * len(mesh.cells))
    facets, parts = [], []
    for block, physical in zip(mesh.cells, tags, strict=True):
        if block.type not in _CUTS:
            if block.type.startswith(("triangle", "quad")):
                raise InputError(f"{file}: cells of type {block.type}; surface cells of first or second order are read")
            continue
        tag = np.zeros(len(block.data), dtype=np.int64) if physical is None else np.asarray(physical, dtype=np.int64)
        for cut in _CUTS[block.type]:
            piece = np.full((len(block.data), 4), -1, dtype=np.int64)
            piece[:, : len(cut)] = np.asarray(block.data, dtype=np.int64)[:, cut]
            facets.append(piece[tag != 0])
            parts.append(tag[tag != 0])
    if not sum(map(len, facets)):
        raise InputError(f"{file}: the mesh does not lie in a plane z = const, and no triangle or quadrilateral is in a "
                         "physical surface; in space those are the parts of the boundary")  # fmt: skip
    points = np.asarray(mesh.points, dtype=float)
    corners, owner = _flattened(points, np.vstack(facets))
    tag = np.concatenate(parts)[owner]
    numbers, part = np.unique(tag, return_inverse=True)
    return checked_surface(FacetSurface(points, corners, part, tuple(names.get(int(n), str(n)) for n in numbers)), file)


def _flattened(points: Array, facets: Index) -> tuple[Index, Index]:
    """Facets with crooked quadrilaterals cut along their shorter diagonal, and where each came from."""
    quads = np.flatnonzero(facets[:, 3] >= 0)
    a, b, c, d = points[facets[quads]].transpose(1, 0, 2)
    normal = np.cross(c - a, d - b)
    reach = np.linalg.norm(c - a, axis=1) + np.linalg.norm(d - b, axis=1)
    crooked = np.abs(np.sum(normal * (b - a), axis=1)) > FLAT * reach * np.linalg.norm(normal, axis=1)
    short = np.linalg.norm(c - a, axis=1) <= np.linalg.norm(d - b, axis=1)
    cut, keep = quads[crooked], np.setdiff1d(np.arange(len(facets)), quads[crooked])
    way = np.where(short[crooked][:, None], [0, 1, 2, 0, 2, 3], [0, 1, 3, 1, 2, 3])
    halves = np.take_along_axis(facets[cut], way, axis=1).reshape(-1, 3)
    halves = np.column_stack([halves, np.full(len(halves), -1)])
    owner = np.concatenate([keep, np.repeat(cut, 2)])
    order = np.argsort(owner, kind="stable")
    return np.vstack([facets[keep], halves])[order], owner[order]


def is_surface(mesh: Any) -> bool:
    """Whether a mesh, as meshio has it, is the surface of a body in space and not a plane one."""
    points = np.asarray(mesh.points, dtype=float)
    in_space = points.shape[1] == 3 and len(points) > 0 and bool(np.all(np.isfinite(points)))
    return in_space and bool(np.ptp(points[:, 2]) > 1e-9 * max(float(np.ptp(points[:, 0])), 1e-300))

