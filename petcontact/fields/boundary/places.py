"""The search for points on the boundary, and the places of points on elements."""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Index
from ...geometry.arcs import feet_on_arcs
from ...linalg.nearest import within as within_reach
from ...mesh.basis import best_slopes
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import as_curve
from ...mesh.panels import reference_nodes
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import SINGLE

TOGETHER = 1e-3
"""Distance of a point from elements that meet there, over their sizes: a climb along the surface
ends as near to their rims [-]."""


def located(
    mesh: BoundaryMesh, points: Array, part: str | None = None, within: Array | None = None
) -> tuple[Index, Array]:
    """Return the elements on which points lie or near which they are, and the places on them.

    Parameters
    ----------
    mesh : BoundaryMesh
    points : (m, d) array
        Points [length].
    part : str, optional
        Only elements of this part count. It tells which side of a corner is meant.
    within : (n_elements,) array, optional
        Largest distance of a point from each element [length]. By default points must lie on it.

    Returns
    -------
    element : (m,) array
        The nearest element, or -1 for points that are not on the boundary. Where elements meet, it
        is the one with the point farther inside.
    place : (m,) or (m, 2) array
        Place of the point or its foot on the element (see `Hits`).
    """
    numbers = np.arange(mesh.n_elements)
    if part is not None:
        numbers = numbers[mesh.part == mesh.part_names.index(part)]
    centre, radius = mesh.spheres
    reach = SINGLE * radius if within is None else within
    candidates, row = within_reach(
        points, centre[numbers], (1.0 + SINGLE) * radius[numbers] + reach[numbers]
    )
    element = numbers[candidates]
    place, distance, depth = _on(mesh, element, points[row], row, reach[element])
    kept = np.flatnonzero((distance < reach[element]) & (depth > -SINGLE))
    # distances on the boundary are round-off
    far = np.where(distance[kept] < SINGLE * radius[element[kept]], 0.0, distance[kept])
    kept = kept[np.lexsort((-np.minimum(depth[kept], 1e-3), far, row[kept]))]
    kept = kept[np.append(True, np.diff(row[kept]) > 0)[: len(kept)]]
    elements, places = np.full(len(points), -1), np.zeros((len(points), *place.shape[1:]))
    elements[row[kept]], places[row[kept]] = element[kept], place[kept]
    return elements, places


def all_at(mesh: BoundaryMesh, x: Array, part: str | None = None) -> tuple[Index, Array]:
    """Return all elements, or those of a part, that meet at a point (d,), and its places on
    them."""
    numbers, (centre, radius) = np.arange(mesh.n_elements), mesh.spheres
    close = np.linalg.norm(centre - x, axis=1) < (1.0 + TOGETHER) * radius
    if part is not None:
        close &= mesh.part == mesh.part_names.index(part)
    element = numbers[close]
    points, reach = np.tile(x, (len(element), 1)), TOGETHER * radius[element]
    place, distance, depth = _on(mesh, element, points, np.arange(len(element)), reach)
    # the sphere of a large panel holds places of small ones
    met = (distance < reach) & (depth > -TOGETHER)
    return element[met], place[met]


def sizes(mesh: BoundaryMesh) -> Array:
    """Return the sizes of elements, (n_elements,) [length].

    The size of a curved element is half its length. That of a panel is the distance of its corners
    from its middle.
    """
    return mesh.spheres[1]


def widths(mesh: BoundaryMesh) -> Array:
    """Return the sizes of elements, (n_elements,), of long panels those of squares as wide
    [length]."""
    size, area = sizes(mesh), np.bincount(mesh.element, mesh.measure, mesh.n_elements)
    return np.asarray(np.minimum(size, 0.5 * area / size ** (mesh.dim - 2)))


def meeting(
    mesh: BoundaryMesh, x: Array, within: float, part: str | None = None
) -> tuple[Array, Index]:
    """Return the foot of a point (d,) on the boundary, or a part, and the elements that meet there.

    The point may be up to `within` away from it [length].
    """
    element, place = located(mesh, x[None], part, np.full(mesh.n_elements, within))
    foot = mesh.at(element, place)[0][0]
    return foot, all_at(mesh, foot)[0]


@functools.singledispatch
def _on(
    mesh: BoundaryMesh, element: Index, x: Array, row: Index, reach: Array
) -> tuple[Array, Array, Array]:
    """Return the feet of points (q, d) on elements (q,): place, distance and depth.

    The depth is the foot's distance from the rim of the element over the element's size; it is
    negative outside. Points with one number `row`, increasing (q,), are one point, of which the
    nearest element within its reach (q,) is looked for; others need no feet.
    """
    mesh = as_curve(mesh)
    shapes = mesh.start, mesh.end, mesh.curvature, mesh.half_angle, mesh.direction
    place, distance = feet_on_arcs(x, *(values[element] for values in shapes))
    return np.clip(place, 0.0, 1.0), distance, np.minimum(place, 1.0 - place)


@_on.register
def _(
    mesh: SurfaceMesh, element: Index, x: Array, row: Index, reach: Array
) -> tuple[Array, Array, Array]:
    place, distance, depth = np.zeros((len(x), 2)), np.full(len(x), np.inf), np.full(len(x), -1.0)
    centre, radius = mesh.spheres
    least = np.linalg.norm(x - centre[element], axis=1) - (1.0 + SINGLE) * radius[element]
    order = np.lexsort((least, row))
    first = order[np.append(True, np.diff(row[order]) > 0)[: len(order)]]
    nearest, rest = np.full(int(row.max(initial=0)) + 1, np.inf), np.full(len(x), True)
    rest[first] = False
    # panels whose sphere is farther away than the first one's foot are not nearer
    for chosen in (first, np.flatnonzero(rest)):
        chosen = chosen[least[chosen] <= nearest[row[chosen]]]
        for rows, panels in mesh.by_kind(element[chosen]):
            some = chosen[rows]
            place[some], distance[some], depth[some] = panels.feet(x[some])
        on = chosen[(distance[chosen] < reach[chosen]) & (depth[chosen] > -SINGLE)]
        nearest[row[on]] = distance[on]
    return place, distance, depth


@functools.singledispatch
def best_places(mesh: BoundaryMesh) -> tuple[Index, Array]:
    """Return elements (q,) and the places on them where slopes of the displacement are most
    accurate.

    Each element has at least one place.
    """
    found = [
        (np.flatnonzero(mesh.order == order), best_slopes(max(order, 1)))
        for order in np.unique(mesh.order).tolist()
    ]
    return (
        np.concatenate([np.repeat(mine, len(xi)) for mine, xi in found]),
        np.concatenate([np.tile(0.5 * (1.0 + xi), len(mine)) for mine, xi in found]),
    )


@best_places.register
def _(mesh: SurfaceMesh) -> tuple[Index, Array]:
    elements, places = [], []
    for batch in mesh.batches():
        panels = batch.elements
        local = panels.mapped(best_on_panel(panels.corners.shape[1], panels.order))
        elements.append(np.repeat(panels.index, local.shape[1]))
        places.append(local.reshape(-1, 2))
    return np.concatenate(elements), np.concatenate(places)


def best_on_panel(corners: int, order: int) -> Array:
    """Return the places (q, 2) on a reference panel where slopes are most accurate.

    On the square they are products of those on a line. On the triangle they are the nodes of one
    order less.
    """
    if corners == 3:
        return reference_nodes(3, max(order - 1, 0))[0]
    xi = best_slopes(max(order, 1))
    return np.asarray(np.stack(np.meshgrid(xi, xi, indexing="ij"), axis=-1).reshape(-1, 2))


@functools.singledispatch
def spread_places(mesh: BoundaryMesh, element: Index, shares: Array) -> Array:
    """Return places on elements (k,), (k, q) or (k, q, 2).

    `shares`, from 0 to 1, are taken along each direction of an element.
    """
    return np.tile(shares, (len(element), 1))


@spread_places.register
def _(mesh: SurfaceMesh, element: Index, shares: Array) -> Array:
    one, other = (each.ravel() for each in np.meshgrid(shares, shares, indexing="ij"))
    places = np.empty((len(element), len(one), 2))
    for rows, panels in mesh.by_kind(element):
        # triangles are the square folded along its diagonal
        over = one + other > 1.0
        reference = (
            np.column_stack([np.where(over, 1.0 - one, one), np.where(over, 1.0 - other, other)])
            if panels.n_corners == 3
            else np.column_stack([2.0 * one - 1.0, 2.0 * other - 1.0])
        )
        places[rows] = panels.mapped(reference)
    return places


@functools.singledispatch
def middles(mesh: BoundaryMesh) -> tuple[Index, Array]:
    """Return the numbers of all elements and the places of their middles."""
    numbers: Index = np.arange(mesh.n_elements)
    return numbers, np.full(len(numbers), 0.5)


@middles.register
def _(mesh: SurfaceMesh) -> tuple[Index, Array]:
    numbers, place = np.arange(mesh.n_elements), np.empty((mesh.n_elements, 2))
    for batch in mesh.batches():
        reference = np.full((1, 2), 1.0 / 3.0 if batch.elements.n_corners == 3 else 0.0)
        place[batch.elements.index] = batch.elements.mapped(reference)[:, 0]
    return numbers, place
