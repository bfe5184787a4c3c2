"""Cutting of panels into two or four.

Nodes lie inside panels, so that corners may hang on the sides of neighbours.
"""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Index, Mask
from ...geometry.quadratic import REFERENCE, reference_points
from ...geometry.surface import Boundary
from ...mesh.panels import monomials, reference_nodes
from ...mesh.surface_mesh import SurfaceMesh
from .hanging import apart, closed, with_half_way_middles


def cut(mesh: SurfaceMesh, along: Mask, surface: Boundary | None = None) -> SurfaceMesh:
    """Return the mesh in which marked panels are replaced by two or four pieces.

    The pieces are equal in the reference coordinates and keep the panel's place in the order.

    Parameters
    ----------
    mesh : SurfaceMesh
    along : (n_elements, 2) bool array
        Which reference coordinates of a panel are halved. A triangle is cut into four if one is.
    surface : Boundary, optional
        The exact surface. The points of all panels are projected onto it, except those of `hanging`
        sides.
    """
    marked = along.any(axis=1)
    exact = surface if surface is not None and surface.exact else None
    if exact is not None:
        mesh = apart(mesh, exact)
    kept = np.concatenate([mesh.corners, mesh.middles], axis=1)[~marked]
    parent = [np.flatnonzero(~marked)]
    points = [kept if surface is None or not len(kept) else surface.onto(mesh.part[~marked], kept)]
    triangle, curved = np.isnan(mesh.corners[:, 3, 0]), ~np.isnan(mesh.middles[:, 0, 0])
    kinds = np.column_stack([triangle, curved, along | triangle[:, None]])
    for three, bent, *halved in np.unique(kinds[marked], axis=0).tolist():
        panels = np.flatnonzero(marked & np.all(kinds == (three, bent, *halved), axis=1))
        piece = _cut_alike(mesh, panels, 3 if three else 4, bent, halved)
        if surface is not None:
            piece = surface.onto(mesh.part[panels], piece.reshape(len(panels), -1, 3)).reshape(
                piece.shape
            )
        points.append(piece.reshape(-1, 9, 3))
        parent.append(np.repeat(panels, piece.shape[1]))
    numbers = np.concatenate(parent)
    order = np.argsort(numbers, kind="stable")
    old, new = numbers[order], np.concatenate(points)[order]
    finer = SurfaceMesh(new[:, :4], mesh.order[old], mesh.part[old], mesh.part_names, new[:, 4:])
    return closed(finer if exact is None else with_half_way_middles(finer, exact))


def _cut_alike(
    mesh: SurfaceMesh, panels: Index, corners: int, bent: bool, halved: list[bool]
) -> Array:
    """Return the points of the pieces of panels of one kind, (n, 2 or 4, 9, 3) [length]."""
    given = [
        mesh.corners[panels, :corners],
        *([mesh.middles[panels, : 2 * corners - 3]] if bent else []),
    ]
    pieces = np.einsum(
        "pqk,nkd->npqd", _pieces(corners, bent, *halved), np.concatenate(given, axis=1)
    )
    result = np.full((*pieces.shape[:2], 9, 3), np.nan)
    result[:, :, :corners] = pieces[:, :, :corners]
    result[:, :, 4 : 4 + pieces.shape[2] - corners] = pieces[:, :, corners:]
    return result


def parents(mesh: SurfaceMesh, along: Mask) -> Index:
    """Return the number of the panel of which each panel of `cut` is a piece."""
    marked = along.any(axis=1)
    counts = np.where(np.isnan(mesh.corners[:, 3, 0]), 1 + 3 * marked, np.prod(1 + along, axis=1))
    return np.repeat(np.arange(mesh.n_elements), counts)


@functools.cache
def _pieces(corners: int, curved: bool, *halved: bool) -> Array:
    """Return matrices (2 or 4, k, k) from the k points of a panel to those of its pieces."""
    points = reference_points(corners) if curved else REFERENCE[corners]
    if corners == 4:
        a, b = (((-1, 0), (0, 1)) if half else ((-1, 1),) for half in halved)
        ends = REFERENCE[4] > 0.0
        pieces = [
            np.column_stack(
                [np.where(end, pair[1], pair[0]) for end, pair in zip(ends.T, (i, j), strict=True)]
            )
            for i in a
            for j in b
        ]
    else:
        middle = reference_points(3)[3:]
        pieces = [np.array([points[k], middle[k], middle[k - 1]]) for k in range(3)] + [middle]
    linear, exponents = (reference_nodes(corners, degree)[1] for degree in (1, 2 if curved else 1))
    shape = monomials(points, linear) @ np.linalg.inv(monomials(REFERENCE[corners], linear))
    inverse = np.linalg.inv(monomials(points, exponents))
    return np.stack([monomials(shape @ piece, exponents) @ inverse for piece in pieces])
