"""Which parts of bodies may touch, and the gaps of round ones, from meshes of the bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.spatial

from ..arrays import Array, Index, connected
from ..geometry.cad.part import CadSurface, apart
from ..mesh.boundary_mesh import BoundaryMesh
from ..round_off import WRITTEN

NEAR = 0.3
"""Distance of two parts, over the size of the smaller one of their cells, up to which they may
touch. The chords of cells on a circle, eight around it, lie 0.1 of their size off it."""
OPPOSED = -0.7
"""Product of the normals of parts that face each other: within 45 degrees."""
FEWEST = 3
"""Nodes of a part that lie beside another one; parts that meet at a corner have fewer."""
NEIGHBOURS = 6
"""Nodes of the other body that are looked at: those of the nearest cell and of its neighbours."""
SAME_AXIS = 1e-2
"""Sine between axes, and their distance over the size of a body, that are cells' only."""
Meshes = dict[str, BoundaryMesh]
Ends = tuple[list[str], list[str]]


def touching(meshes: Meshes) -> list[Ends]:
    """Return the parts "body.part" of each two bodies that may touch, those with less area first:
    in one pair what hangs together.

    A node is near another body where one of its nearest nodes there has an opposite normal, and a
    tangent plane that is closer than `NEAR`.
    """
    names, result = list(meshes), list[Ends]()
    for a, one in enumerate(names):
        for two in names[a + 1 :]:
            found = _near(meshes[one], meshes[two])
            found |= {(part, other) for other, part in _near(meshes[two], meshes[one])}
            for group in connected({pair: [*enumerate(pair)] for pair in sorted(found)}):
                sides = [
                    (body, sorted({pair[k] for pair in group})) for k, body in enumerate((one, two))
                ]
                sides.sort(key=lambda side: sum(area(meshes[side[0]], part) for part in side[1]))
                ends = [[f"{body}.{part}" for part in own] for body, own in sides]
                result.append((ends[0], ends[1]))
    return result


def gaps_of(pairs: list[Ends], meshes: Meshes, solids: dict[str, Any]) -> dict[int, float]:
    """Return the gaps of pairs of round faces about one axis [length], which cells of the two do
    not show as exactly."""
    single = {
        k: tuple(end[0].partition(".")[::2] for end in ends)
        for k, ends in enumerate(pairs)
        if len(ends[0]) == len(ends[1]) == 1
    }
    along = {
        k: (solids[a], p, solids[b], q)
        for k, ((a, p), (b, q)) in single.items()
        if isinstance(solids[a], CadSurface) and _are_coaxial(meshes[a], p, meshes[b], q)
    }
    found = apart([*along.values()]) if along else []
    return {k: gap for k, gap in zip(along, found, strict=True) if np.isfinite(gap)}


def _are_coaxial(one: BoundaryMesh, part: str, two: BoundaryMesh, other: str) -> bool:
    """Return whether parts are round all along an axis, the same one."""
    axes = [_axis(one, part), _axis(two, other)]
    if axes[0] is None or axes[1] is None:
        return False
    off, size = centre(one, part) - centre(two, other), np.ptp(one.x, axis=0).max()
    across = [np.cross(axes[0], axes[1]), np.cross(axes[0], off) / size]
    return bool(np.abs(across).max() < SAME_AXIS)


def _axis(mesh: BoundaryMesh, part: str) -> Array | None:
    """Return the direction that all normals of a part are across, where they sum up to nothing."""
    nodes = mesh.nodes_of(part)
    normal, weight = mesh.normal[nodes], mesh.weight[nodes] / mesh.weight[nodes].sum()
    values, ways = np.linalg.eigh(normal.T @ (weight[:, None] * normal))
    turned = np.linalg.norm(weight @ normal) < SAME_AXIS
    return ways[:, 0] if mesh.dim == 3 and turned and values[0] < SAME_AXIS**2 < values[1] else None


def _near(mesh: BoundaryMesh, other: BoundaryMesh) -> set[tuple[str, str]]:
    """Return the parts of a mesh that have nodes near parts of another one, and these."""
    row, there = _beside(mesh, other)
    own, far = _sizes(mesh)[row], _sizes(other)[there]
    off, normal = other.x[there] - mesh.x[row], other.normal[there]
    met = np.abs(np.einsum("ij,ij->i", off, normal)) < NEAR * np.minimum(own, far)
    met &= np.linalg.norm(off, axis=1) < np.maximum(own, far)
    met &= np.einsum("ij,ij->i", mesh.normal[row], normal) < OPPOSED
    places = np.column_stack([mesh.node_part[row], other.node_part[there], row])[met]
    parts, count = np.unique(np.unique(places, axis=0)[:, :2], axis=0, return_counts=True)
    return {(mesh.part_names[p], other.part_names[q]) for p, q in parts[count >= FEWEST].tolist()}


def _beside(mesh: BoundaryMesh, other: BoundaryMesh) -> tuple[Index, Index]:
    """Return nodes of a mesh and nodes of another one, of which some are nearest to each."""
    reach = float(max(_sizes(mesh).max(), _sizes(other).max()))
    count = min(NEIGHBOURS, len(other.x))
    found = scipy.spatial.cKDTree(other.x).query(mesh.x, k=count, distance_upper_bound=reach)[1]
    row, column = np.nonzero(found < len(other.x))
    return row, found[row, column]


def _sizes(mesh: BoundaryMesh) -> Array:
    """Return the size of the element of each node [length]."""
    measure = np.bincount(mesh.element, mesh.weight)
    return np.asarray(measure[mesh.element] ** (1.0 / (mesh.dim - 1)))


def area(mesh: BoundaryMesh, part: str) -> float:
    """Return the area of a part; in the plane its length."""
    return float(mesh.weight[mesh.nodes_of(part)].sum())


def centre(mesh: BoundaryMesh, part: str) -> Array:
    """Return the centre of area of a part (d,), without round-off beside 0 [length]."""
    nodes = mesh.nodes_of(part)
    middle = mesh.weight[nodes] @ mesh.x[nodes] / mesh.weight[nodes].sum()
    return np.where(np.abs(middle) < WRITTEN * np.abs(mesh.x).max(), 0.0, middle)
