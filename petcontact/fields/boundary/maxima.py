"""Values of a function of the boundary between its nodes, and where it is largest."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, largest_by, scattered, smallest_by
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import first_largest, largest_first
from .places import spread_places

ACROSS, LOOKED_AT = (9, 33), (8, 1)
"""Places along each direction of an element at which a maximum is looked for between the nodes,
first in the elements with the largest values at nodes, then in the best of them. A maximum is flat:
a place that is 1/64 of an element away leaves 0.1 % of what the function varies by in it."""
HALVES = np.linspace(0.0, 1.0, 3)
"""Places along each direction of an element, besides its nodes, at which its displacement is looked
at first: it is largest at corners, where no node lies."""


def between_nodes(
    mesh: BoundaryMesh, elements: Index, along: Array, nodal: Array
) -> tuple[Index, Array, Array]:
    """Places that are spread over elements by those along each direction, (q,) elements and local
    coordinates, and the values there (q,) of a function that has nodal values (n,)."""
    places = spread_places(mesh, elements, along)
    element, place = np.repeat(elements, places.shape[1]), places.reshape(-1, *places.shape[2:])
    return element, place, mesh.basis_at(element, place) @ nodal


def maximum(
    mesh: BoundaryMesh, nodes: Index, values: Array, bound: Array | float = np.inf
) -> tuple[float, Array, int]:
    """Return the largest value of a function that is given at nodes, its place and its element.

    Elements with nodes at which it is 0 or less are seen at their nodes only: there it has a kink.
    It is no larger than another one, between nodes, too, where that is finite.
    """
    values = np.minimum(values, bound)
    k = first_largest(values)
    best = max(float(values[k]), 0.0), mesh.x[nodes[k]], int(mesh.element[nodes[k]])
    if best[0] == 0.0:
        return best
    positive = np.maximum(values, 0.0)
    both = np.column_stack([positive, np.where(np.isfinite(bound), bound, positive)])
    whole = scattered(both, nodes, mesh.n_nodes)
    element, row = np.unique(mesh.element[nodes], return_inverse=True)
    least, most = smallest_by(row, values, len(element)), largest_by(row, values, len(element))
    usable = (least > 0.0) & (np.diff(mesh.first_node)[element] > 1)
    element, most = element[usable], most[usable]
    for across, count in zip(ACROSS, LOOKED_AT, strict=True):
        element = element[largest_first(most)[:count]]
        if len(element):
            most, location = _between(mesh, element, whole, across)
            best = (best, location)[first_largest(np.array([best[0], location[0]]))]
    return best


def smallest_gap(mesh: BoundaryMesh, nodes: Index, gap: Array) -> float:
    """Return the smallest value of a gap (m,) on elements; infinite nodes face nothing [length].

    It is no overlap where no node overlaps. A polynomial through gaps that grow steeply may be
    negative between them.
    """
    faced = np.isfinite(gap)
    if not faced.any():
        return np.inf
    above = float(gap[faced].max() + np.ptp(gap[faced]))
    least = above - maximum(mesh, nodes, np.where(faced, above - gap, 0.0))[0]
    return max(least, min(float(gap[faced].min()), 0.0))


def _between(
    mesh: BoundaryMesh, element: Index, whole: Array, across: int
) -> tuple[Array, tuple[float, Array, int]]:
    """Return the largest values on elements (k,), and the largest of all as `maximum` does."""
    number, at, both = between_nodes(mesh, element, np.linspace(0.0, 1.0, across), whole)
    values = both.min(axis=1)
    j = first_largest(values)
    place = mesh.at(number[j : j + 1], at[j : j + 1])[0][0]
    return values.reshape(len(element), -1).max(axis=1), (float(values[j]), place, int(number[j]))


def largest_length(mesh: BoundaryMesh, vectors: Array) -> tuple[float, Array, int]:
    """Return the largest length of vectors that are given at all nodes (n, c), its place and its
    element."""
    number, _, u = between_nodes(mesh, np.arange(mesh.n_elements), HALVES, vectors)
    size = np.linalg.norm(np.vstack([vectors, u]), axis=1)
    most = largest_by(np.append(mesh.element, number), size, mesh.n_elements)
    best = largest_first(most)[: LOOKED_AT[0]]
    number, at, u = between_nodes(mesh, best, np.linspace(0.0, 1.0, ACROSS[1]), vectors)
    size = np.linalg.norm(np.vstack([vectors, u]), axis=1)
    k = first_largest(size)
    x = mesh.x[k] if k < mesh.n_nodes else mesh.at(number, at)[0][k - mesh.n_nodes]
    return float(size[k]), x, int(np.append(mesh.element, number)[k])
