"""Surfaces from Gmsh meshes: triangles and quadrilaterals of the physical surfaces, orders 1 and 2,
as facets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Array, Index, Mask
from ..errors import InputError
from ..round_off import TINY, WRITTEN
from ..untyped import Mesh
from .gmsh import UNNAMED
from .surface import FacetSurface, checked_surface

_CELLS = {"triangle": (3, 0), "triangle6": (3, 3), "quad": (4, 0), "quad8": (4, 4), "quad9": (4, 5)}
"""Corners and further nodes of the cells that are read, which are in Gmsh's order."""
OTHER_SOLIDS = ("wedge", "pyramid")
FACETS: dict[str, list[tuple[int, ...]]] = {
    "tetra": [
        (0, 2, 1, -1, 6, 5, 4),
        (0, 1, 3, -1, 4, 8, 7),
        (1, 2, 3, -1, 5, 9, 8),
        (2, 0, 3, -1, 6, 7, 9),
    ],
    "hexahedron": [
        (0, 3, 2, 1, 11, 10, 9, 8),
        (4, 5, 6, 7, 12, 13, 14, 15),
        (0, 1, 5, 4, 8, 17, 12, 16),
        (1, 2, 6, 5, 9, 18, 13, 17),
        (2, 3, 7, 6, 10, 19, 14, 18),
        (3, 0, 4, 7, 11, 16, 15, 19),
    ],
}
"""Corners of the facets of solid cells and middles of their sides, in meshio's order of nodes."""


def gmsh_surface(mesh: Mesh, file: str) -> FacetSurface:
    """The closed surface of a mesh as meshio has it, its normals outward.

    If there are tetrahedra or hexahedra, only facets of exactly one of them count, and those in no
    group are the part `UNNAMED`.

    Raises
    ------
    InputError
        If no physical surface holds a cell, or the surface is none of a body (see
        `checked_surface`).
    """
    names = {
        int(tag): str(name) for name, (tag, dimension) in mesh.field_data.items() if dimension == 2
    }
    cells, tags = _surface_cells(mesh, file)
    named, rim = tags != 0, solid_rim(mesh)
    nameless = len(tags) - int(named.sum()) if rim is None else 0
    cells, tags = cells[named], tags[named]
    if not len(cells):
        raise InputError(
            f"{file}: the mesh does not lie in a plane z = const, and no triangle or "
            "quadrilateral is in a physical surface; in space those are the parts of the boundary"
        )
    if rim is not None:
        cells, tags = _on_rim(cells, tags, rim)
    points, cells = _with_centres(np.asarray(mesh.points, dtype=float), cells)
    facets, owner = _divided(points, cells)
    numbers, part = np.unique(tags[owner], return_inverse=True)
    whole = FacetSurface(
        points,
        facets[:, :4],
        part,
        tuple(names.get(tag, str(tag) if tag else UNNAMED) for tag in numbers.tolist()),
        facets[:, 4:],
    )
    try:
        whole = checked_surface(whole, file)
    except InputError as error:
        if nameless:
            raise InputError(
                f"{error}; {nameless} triangles and quadrilaterals are in no physical surface, and "
                "left out"
            ) from None
        if rim is None and "is open" in str(error):
            raise InputError(
                f"{error}; sides in no group are free where the volume is in a physical group, too"
            ) from None
        raise
    points, facets = whole.points, np.column_stack([whole.facets, whole.middles])
    curved = (_bent(points, facets) | _crooked(points, facets))[:, None]
    return replace(whole, middles=np.where(curved, whole.middles, -1))


def _surface_cells(mesh: Mesh, file: str) -> tuple[Index, Index]:
    """Return triangles and quadrilaterals, (n, 9) corners, middles and centre or -1, and the number
    of the physical surface of each, or 0.

    Raises
    ------
    InputError
        If there are cells of an order that is not read.
    """
    cells, tags = [np.empty((0, 9), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    physical = mesh.cell_data.get("gmsh:physical", [None] * len(mesh.cells))
    for block, own in zip(mesh.cells, physical, strict=True):
        if block.type not in _CELLS:
            if block.type.startswith(("triangle", "quad")):
                raise InputError(
                    f"{file}: cells of type {block.type}; surface cells of first or second order "
                    "are read"
                )
            continue
        corners, more = _CELLS[block.type]
        piece = np.full((len(block.data), 9), -1, dtype=np.int64)
        piece[:, :corners] = block.data[:, :corners]
        piece[:, 4 : 4 + more] = block.data[:, corners:]
        cells.append(piece)
        tags.append(np.zeros(len(piece), dtype=np.int64) if own is None else np.asarray(own))
    return np.vstack(cells), np.concatenate(tags).astype(np.int64)


def solid_rim(mesh: Mesh) -> Index | None:
    """Return the facets (n, 9) of exactly one tetrahedron or hexahedron, as of `_surface_cells`.

    The result is None if there are no such cells, or other solid ones.
    """
    facets = [np.empty((0, 9), dtype=np.int64)]
    for block in mesh.cells:
        kind = block.type.rstrip("0123456789")
        if kind in OTHER_SOLIDS:
            return None
        for nodes in FACETS.get(kind, ()):
            piece = np.full((len(block.data), 9), -1, dtype=np.int64)
            known = [k for k, node in enumerate(nodes) if -1 < node < block.data.shape[1]]
            piece[:, known] = block.data[:, [nodes[k] for k in known]]
            facets.append(piece)
    every = np.vstack(facets)
    _, first, count = np.unique(
        np.sort(every[:, :4], axis=1), axis=0, return_index=True, return_counts=True
    )
    return every[first[count == 1]] if len(every) else None


def _on_rim(cells: Index, tags: Index, rim: Index) -> tuple[Index, Index]:
    """Return the cells that lie on the rim of solids, with what of it has no group as 0."""
    keys = np.sort(np.vstack([cells[:, :4], rim[:, :4]]), axis=1)
    _, which = np.unique(keys, axis=0, return_inverse=True)
    own, others = np.split(which.ravel(), [len(cells)])
    on, left = np.isin(own, others), ~np.isin(others, own)
    return (
        np.vstack([cells[on], rim[left]]),
        np.concatenate([tags[on], np.zeros(left.sum(), dtype=np.int64)]),
    )


def _with_centres(points: Array, cells: Index) -> tuple[Array, Index]:
    """Return points and cells with centres of quadrilaterals that have middles but no centre."""
    bare = (cells[:, 3] >= 0) & (cells[:, 4] >= 0) & (cells[:, 8] < 0)
    corners, middles = points[cells[bare, :4]], points[cells[bare, 4:8]]
    cells[bare, 8] = len(points) + np.arange(bare.sum())
    return np.vstack([points, 0.5 * middles.sum(axis=1) - 0.25 * corners.sum(axis=1)]), cells


def _crooked(points: Array, cells: Index) -> Mask:
    """Which quadrilaterals have corners in no plane."""
    result, quads = np.zeros(len(cells), dtype=bool), np.flatnonzero(cells[:, 3] >= 0)
    a, b, c, d = points[cells[quads, :4]].transpose(1, 0, 2)
    normal = np.cross(c - a, d - b)
    reach = np.linalg.norm(c - a, axis=1) + np.linalg.norm(d - b, axis=1)
    result[quads] = np.abs(np.sum(normal * (b - a), axis=1)) > WRITTEN * reach * np.linalg.norm(
        normal, axis=1
    )
    return result


def _divided(points: Array, cells: Index) -> tuple[Index, Index]:
    """Mesh with crooked ones of first order cut along their shorter diagonal, and where each came
    from."""
    divided = _crooked(points, cells) & (cells[:, 4] < 0)
    cut, keep = np.flatnonzero(divided), np.flatnonzero(~divided)
    a, b, c, d = points[cells[cut, :4]].transpose(1, 0, 2)
    short = np.linalg.norm(c - a, axis=1) <= np.linalg.norm(d - b, axis=1)
    way = np.where(short[:, None], [0, 1, 2, 0, 2, 3], [0, 1, 3, 1, 2, 3])
    halves = np.take_along_axis(cells[cut], way, axis=1).reshape(-1, 3)
    halves = np.pad(halves, ((0, 0), (0, 6)), constant_values=-1)
    owner = np.concatenate([keep, np.repeat(cut, 2)])
    order = np.argsort(owner, kind="stable")
    return np.vstack([cells[keep], halves])[order], owner[order]


def _bent(points: Array, cells: Index) -> Mask:
    """Which cells have middles that lie off those of the corners."""
    corners = points[np.where(cells[:, :4] >= 0, cells[:, :4], cells[:, :1])]
    following = np.where(
        np.arange(4) == np.sum(cells[:, :4] >= 0, axis=1)[:, None] - 1, 0, np.arange(1, 5) % 4
    )
    usual = 0.5 * (corners + np.take_along_axis(corners, following[..., None], axis=1))
    usual = np.concatenate([usual, corners.mean(axis=1, keepdims=True)], axis=1)
    away = np.where(cells[:, 4:, None] >= 0, points[cells[:, 4:]] - usual, 0.0)
    size = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    return np.asarray(np.linalg.norm(away, axis=2).max(axis=1) > WRITTEN * size)


def is_surface(mesh: Mesh) -> bool:
    """Whether a mesh, as meshio has it, is the surface of a body in space and not a plane one."""
    points = np.asarray(mesh.points, dtype=float)
    in_space = points.shape[1] == 3 and len(points) > 0 and bool(np.all(np.isfinite(points)))
    return in_space and bool(
        np.ptp(points[:, 2]) > WRITTEN * max(float(np.ptp(points[:, 0])), TINY)
    )
