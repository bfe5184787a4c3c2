"""Choice of the panels to cut.

They are the panels with the largest errors, those that face them, and those that are too large next
to the contact.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import scipy

from ...arrays import Array, Index, Mask, smallest_by
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.surface_mesh import SurfaceMesh
from ...record import replace
from .cut_directions import matched, sides

GROWTH = 2.0
"""Largest size of a panel, less its distance from the contact, over the size of the nearest panel
there."""
LONGER = 1.2
"""Length of a panel over that of an opposite one up to which both count as equally long [-]."""
TIED = 0.8
"""Squared error of an element over that of another from which both are treated equally [-]."""


def element_sizes(mesh: BoundaryMesh) -> Array:
    """Return the lengths of elements, in space the roots of their areas, (n_elements,) [length]."""
    return np.asarray(np.bincount(mesh.element, mesh.weight / mesh.depth) ** (1.0 / (mesh.dim - 1)))


def largest(square: Array, share: float) -> Mask:
    """Return the fewest elements whose squared errors (n,) make up a share of the sum.

    Elements that nearly tie with the last of them are included, so that symmetric meshes stay
    symmetric. None is returned if there is no error.
    """
    ordered = np.sort(square)[::-1]
    total = np.cumsum(ordered)
    if not len(square) or not total[-1] > 0.0:
        return np.zeros(len(square), dtype=bool)
    return np.asarray(square >= TIED * ordered[np.searchsorted(total, share * total[-1])])


Part = tuple[BoundaryMesh, str]
"""A mesh and the name of one of its parts."""


def facing(secondary: Part, primary: Part, direction: Array | None) -> tuple[Index, Index]:
    """Return the numbers of elements of two parts that face one another, (k,) and (k,)."""
    (mesh, part), (primary_mesh, primary_part) = secondary, primary
    (elements, own), (primaries, opposite) = mesh.faces(part), primary_mesh.faces(primary_part)
    # one point on each piece is enough
    pieces = own.segments(opposite, np.zeros_like(elements), np.zeros_like(primaries), direction)
    couples = np.unique(np.column_stack([elements[pieces.face], primaries[pieces.other]]), axis=0)
    return couples[:, 0], couples[:, 1]


def too_large(mesh: SurfaceMesh, contact: Mask) -> Mask:
    """Return along which coordinates panels off the contact are too long, (n_elements, 2).

    They are compared with all panels in contact, which `contact` marks, that are as near as they
    are long: of a narrow contact that ends at the rim of its face others may be nearer.
    """
    vectors, touching = sides(mesh), contact[mesh.element]
    length = np.linalg.norm(vectors, axis=2)
    own, nodes = mesh.element[~touching], np.flatnonzero(touching)
    near = scipy.spatial.cKDTree(mesh.x[nodes]).query_ball_point(
        x := mesh.x[~touching], length[own].max(axis=1)
    )
    row = np.repeat(np.arange(len(own)), [len(each) for each in near])
    node = nodes[np.fromiter(itertools.chain.from_iterable(near), dtype=int)]
    panel, nearby = own[row], mesh.element[node]
    axis = matched(vectors[panel], vectors[nearby])
    reference = np.take_along_axis(length[nearby], axis, axis=1)
    distance = np.linalg.norm(x[row] - mesh.x[node], axis=1)[:, None]
    return np.asarray(length > smallest_by(panel, distance + GROWTH * reference, mesh.n_elements))


def with_equal_orders(mesh: SurfaceMesh, contact: Mask, parts: Sequence[str]) -> SurfaceMesh:
    """Return a mesh whose panels of parts have at least the order of the panel in contact that is
    nearest to them, if that is nearer than they are long.

    In a plane of symmetry that cuts a contact stress varies as fast as p does. With linear panels
    there p was wrong by 28 % at nodes beside the plane.
    """
    touching = np.flatnonzero(contact[mesh.element])
    own = np.flatnonzero(np.isin(mesh.node_part, [mesh.part_names.index(each) for each in parts]))
    if not len(touching) or not len(own):
        return mesh
    away, nearest = scipy.spatial.cKDTree(mesh.x[touching]).query(mesh.x[own])
    element = mesh.element[own]
    near = away < np.linalg.norm(sides(mesh), axis=2).max(axis=1)[element]
    order = mesh.order.copy()
    np.maximum.at(order, element[near], mesh.order[mesh.element[touching[nearest[near]]]])
    return replace(mesh, order=order)


def wider_than(mesh: SurfaceMesh, spots: Sequence[tuple[Array, float]]) -> Mask:
    """Return which panels contain points of narrower spots, (n_elements, 2).

    A spot is a pair of points (k, 3) and a width [length]. Points count if they are in the panel's
    bounding box.
    """
    low, high = mesh.boxes
    length, result = np.linalg.norm(sides(mesh), axis=2), np.zeros((mesh.n_elements, 2), dtype=bool)
    for x, width in spots:
        hit = [
            bool(np.any(np.all((x >= a) & (x <= b), axis=1)))
            for a, b in zip(low, high, strict=True)
        ]
        result |= np.array(hit)[:, None] & (length > width)
    return result


def faded(mesh: BoundaryMesh, contact: Mask) -> Array:
    """Return the factor with which squared errors on elements count on the contact, (n_elements,)
    [-].

    It is 1 on the contact. At a distance r it is (h/(r+h))⁶ for the element size h, like the
    squared stress under a load without resultant.
    """
    nodes = np.flatnonzero(contact[mesh.element])
    if not len(nodes):
        return np.zeros(mesh.n_elements)
    away = scipy.spatial.cKDTree(mesh.x[nodes]).query(mesh.x)[0]
    distance, size = smallest_by(mesh.element, away, mesh.n_elements), element_sizes(mesh)
    return np.where(contact, 1.0, (size / (distance + size)) ** 6)
