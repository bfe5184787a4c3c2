"""How large the elements of a boundary are, next to the thickness of the body behind them."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...linalg.nearest import within
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.hp_grading import OPPOSITE

BESIDE = 0.75
"""Sizes of an element by which nodes behind it may lie beside its centre."""
DEEPEST = 1.0
"""Sizes of an element beyond which the other side is not looked for."""
SHARE = 0.1
"""Of the boundary, that elements which are large beside the thickness may be: those next to an
acute corner always are."""
BENDING = 5e-3
"""Error of forces and pressure over the squared size of panels over the thickness: spherical shells
of thickness .2 and .15 of their radius, pressed on a plane, were .8 and 1.8 % too stiff with 1.4
and 1.9 (of order 1)."""


def slenderness(mesh: BoundaryMesh) -> Array:
    """Size of each element over the thickness of the body behind it, (n_elements,) [-].

    The size is the length, in space the root of the area. 0 where the other side lies further than
    `DEEPEST` sizes behind, or the two sides meet at an angle.
    """
    count, d = mesh.n_elements, mesh.dim
    area = np.bincount(mesh.element, mesh.measure, minlength=count)
    size = area ** (1.0 / (d - 1))
    middle = np.add.reduceat(mesh.measure[:, None] * mesh.x, mesh.first_node[:-1]) / area[:, None]
    # the node nearest to the middle: the middle of a curved element may lie deeper than a shell is
    # thick
    away = np.linalg.norm(mesh.x - middle[mesh.element], axis=1)
    nearest = np.lexsort((away, mesh.element))[mesh.first_node[:-1]]
    centre, normal = mesh.x[nearest], mesh.normal[nearest]
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


def bending_error(mesh: BoundaryMesh) -> float:
    """What forces and pressure may be off by, relative, for what elements are too large beside the
    thickness to bend."""
    ratio, area = slenderness(mesh), np.bincount(mesh.element, mesh.measure)
    order = np.argsort(-ratio)
    beyond = np.searchsorted(np.cumsum(area[order]), SHARE * area.sum())
    return BENDING * float(ratio[order[beyond]]) ** 2
