"""How large the elements of a boundary are, next to the thickness of the body behind them."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...linalg.nearest import within
from ...mesh.boundary_mesh import BoundaryMesh

OPPOSITE = -0.9
"""Cosine of the normals of two sides of a body below which one lies behind the other."""
BESIDE = 0.75
"""Sizes of an element by which nodes behind it may lie beside its centre."""
DEEPEST = 1.0
"""Sizes of an element beyond which the other side is not looked for."""


def slenderness(mesh: BoundaryMesh) -> Array:
    """Size of each element over the thickness of the body behind it, (n_elements,) [-].

    The size is the length, in space the root of the area. 0 where the other side lies further than `DEEPEST` sizes behind,
    or the two sides meet at an angle.
    """
    count, d = mesh.n_elements, mesh.dim
    area = np.bincount(mesh.element, mesh.weight, minlength=count)
    size = area ** (1.0 / (d - 1))
    centre, normal = (
        np.add.reduceat(mesh.weight[:, None] * values, mesh.first_node[:-1]) / area[:, None]
        for values in (mesh.x, mesh.normal)
    )
    element, node = within(mesh.x, centre, np.hypot(BESIDE, DEEPEST) * size)
    facing = np.einsum("qd,qd->q", mesh.normal[node], normal[element]) < OPPOSITE
    if not facing.any():
        return np.zeros(count)
    element, node = element[facing], node[facing]
    away = mesh.x[node] - centre[element]
    depth = -np.sum(away * normal[element], axis=1)
    beside = np.linalg.norm(away + depth[:, None] * normal[element], axis=1)
    behind = (depth > 0.0) & (beside < BESIDE * size[element])
    thickness = np.full(count, np.inf)
    np.minimum.at(thickness, element[behind], depth[behind])
    return np.asarray(size / thickness)
