"""Which panels of surfaces are cut into four: those with the largest errors, those that face them,
and those too large."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.surface_mesh import SurfaceMesh
from .axes import matched, sides

GROWTH = 2.0
"""Largest ratio of a panel to the nearest one in contact, beyond its distance from it."""
FINER = 0.6
"""Size of a panel over that of one that faces it from which on it is as large."""
TIED = 0.8
"""Squared error of an element over that of another from which on both are cut or none is."""


def element_sizes(mesh: BoundaryMesh) -> Array:
    """Lengths of elements, in space of the side of a square as large, (n_elements,) [length]."""
    return np.asarray(np.bincount(mesh.element, mesh.weight) ** (1.0 / (mesh.dim - 1)))


def largest(square: Array, share: float) -> Mask:
    """The fewest elements whose squared errors (n,) have a share of their sum, and those that are
    as good as tied with the last of them, so that symmetric meshes stay so; none where there is no
    error."""
    ordered = np.sort(square)[::-1]
    total = np.cumsum(ordered)
    if not len(square) or not total[-1] > 0.0:
        return np.zeros(len(square), dtype=bool)
    return np.asarray(square >= TIED * ordered[np.searchsorted(total, share * total[-1])])


Part = tuple[BoundaryMesh, str]
"""A mesh and the name of one of its parts."""


def facing(secondary: Part, primary: Part, direction: Array | None) -> tuple[Index, Index]:
    """Numbers of elements of two parts that face one another, (k,) and (k,)."""
    (one, part), (two, other) = secondary, primary
    (elements, own), (others, opposite) = one.faces(part), two.faces(other)
    # one point a piece tells
    found = own.segments(opposite, np.zeros_like(elements), np.zeros_like(others), direction)
    couples = np.unique(np.column_stack([elements[found.face], others[found.other]]), axis=0)
    return couples[:, 0], couples[:, 1]


def too_large(mesh: SurfaceMesh, contact: Mask) -> Mask:
    """Along which coordinates panels off the contact (of which `contact` says which are on it) are
    too long for those of it nearby, (n_elements, 2)."""
    nodes = np.flatnonzero(contact[mesh.element])
    if not len(nodes):
        return np.zeros((mesh.n_elements, 2), dtype=bool)
    vectors = sides(mesh)
    length = np.linalg.norm(vectors, axis=2)
    distance, nearest = scipy.spatial.cKDTree(mesh.x[nodes]).query(mesh.x)
    beside = mesh.element[nodes[nearest]]
    other = np.take_along_axis(
        length[beside], matched(vectors[mesh.element], vectors[beside]), axis=1
    )
    allowed = np.full((mesh.n_elements, 2), np.inf)
    np.minimum.at(allowed, mesh.element, distance[:, None] + GROWTH * other)
    return np.asarray(~contact[:, None] & (length > allowed))


def wider_than(mesh: SurfaceMesh, spots: Sequence[tuple[Array, float]]) -> Mask:
    """Which panels have points (k, 3) in their boxes, of spots that are narrower than they are
    [length], along both coordinates (n_elements, 2)."""
    low, high = mesh.boxes
    length, result = np.linalg.norm(sides(mesh), axis=2), np.zeros((mesh.n_elements, 2), dtype=bool)
    for x, width in spots:
        here = [
            bool(np.any(np.all((x >= a) & (x <= b), axis=1)))
            for a, b in zip(low, high, strict=True)
        ]
        result |= np.array(here)[:, None] & (length > width)
    return result


def faded(mesh: BoundaryMesh, contact: Mask) -> Array:
    """How much squared errors on elements matter on the contact, (n_elements,): 1 there, off it by
    size h and distance r (h/(r+h))⁶, as fast as the stress under a load without resultant falls."""
    nodes = np.flatnonzero(contact[mesh.element])
    if not len(nodes):
        return np.zeros(mesh.n_elements)
    distance = np.full(mesh.n_elements, np.inf)
    np.minimum.at(distance, mesh.element, scipy.spatial.cKDTree(mesh.x[nodes]).query(mesh.x)[0])
    size = element_sizes(mesh)
    return np.where(contact, 1.0, (size / (distance + size)) ** 6)
