"""Surfaces from Gmsh meshes: triangles and quadrilaterals of the physical surfaces, orders 1 and 2,
as facets."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..errors import InputError
from ..round_off import WRITTEN
from .surface import FacetSurface, checked_surface

_CELLS = {"triangle": (3, 0), "triangle6": (3, 3), "quad": (4, 0), "quad8": (4, 4), "quad9": (4, 5)}
"""Corners and further nodes of the cells that are read, which are in Gmsh's order."""


def gmsh_surface(mesh: Any, file: str) -> FacetSurface:
    """The closed surface of a mesh as meshio has it, its normals outward.

    Raises
    ------
    InputError
        If no physical surface holds a cell, or the surface is none of a body (see
        `checked_surface`).
    """
    names = {
        int(tag): str(name) for name, (tag, dimension) in mesh.field_data.items() if dimension == 2
    }
    points, cells, parts, nameless = np.asarray(mesh.points, dtype=float), [], [], 0
    for block, physical in zip(
        mesh.cells,
        mesh.cell_data.get("gmsh:physical", [None] * len(mesh.cells)),
        strict=True,
    ):
        if block.type not in _CELLS:
            if block.type.startswith(("triangle", "quad")):
                raise InputError(
                    f"{file}: cells of type {block.type}; surface cells of first or second order "
                    "are read"
                )
            continue
        tag = (
            np.zeros(len(block.data), dtype=np.int64)
            if physical is None
            else np.asarray(physical, dtype=np.int64)
        )
        nameless += int(np.count_nonzero(tag == 0))
        (corners, more), nodes = (
            _CELLS[block.type],
            np.asarray(block.data, dtype=np.int64)[tag != 0],
        )
        piece = np.full((len(nodes), 9), -1, dtype=np.int64)
        piece[:, :corners], piece[:, 4 : 4 + more] = nodes[:, :corners], nodes[:, corners:]
        if block.type == "quad8":
            piece[:, 8] = len(points) + np.arange(len(nodes))
            points = np.vstack(
                [
                    points,
                    0.5 * points[piece[:, 4:8]].sum(axis=1)
                    - 0.25 * points[piece[:, :4]].sum(axis=1),
                ]
            )
        cells.append(piece)
        parts.append(tag[tag != 0])
    if not sum(map(len, cells)):
        raise InputError(
            f"{file}: the mesh does not lie in a plane z = const, and no triangle or "
            "quadrilateral is in a physical surface; in space those are the parts of the boundary"
        )
    facets, owner = _divided(points, np.vstack(cells))
    numbers, part = np.unique(np.concatenate(parts)[owner], return_inverse=True)
    whole = FacetSurface(
        points,
        facets[:, :4],
        part,
        tuple(names.get(int(tag), str(tag)) for tag in numbers),
        facets[:, 4:],
    )
    try:
        whole = checked_surface(whole, file)
    except InputError as error:
        if not nameless:
            raise
        raise InputError(
            f"{error}; {nameless} triangles and quadrilaterals are in no physical surface, and "
            "left out"
        ) from None
    points, facets = whole.points, np.column_stack([whole.facets, whole.middles])
    curved = (_bent(points, facets) | _crooked(points, facets))[:, None]
    return replace(whole, middles=np.where(curved, whole.middles, -1))


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
    """Cells with crooked ones of first order cut along their shorter diagonal, and where each came
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


def is_surface(mesh: Any) -> bool:
    """Whether a mesh, as meshio has it, is the surface of a body in space and not a plane one."""
    points = np.asarray(mesh.points, dtype=float)
    in_space = points.shape[1] == 3 and len(points) > 0 and bool(np.all(np.isfinite(points)))
    return in_space and bool(np.ptp(points[:, 2]) > 1e-9 * max(float(np.ptp(points[:, 0])), 1e-300))
