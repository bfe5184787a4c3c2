"""Size of the elements of a boundary over the thickness of the body behind them."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Mask, smallest_by
from ...bem.boundary_data import half_extent, unit_motions
from ...given.body_data import Body
from ...given.conditions import Displacement
from ...linalg.nearest import within
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.hp_grading import OPPOSITE
from ...results.solution import Solution
from ...round_off import largest_first

ASIDE = 0.75
"""Largest distance of an opposite node from the normal line through the centre, in element
sizes."""
SHARE = 0.1
"""Share of the boundary next to corners, which judgements of a body leave out: next to acute ones
elements always are too large, and next to singular ones strains have no bound."""
BENDING = 5e-3
"""Relative error of forces and pressure over (size / thickness)². Spherical shells of order 1 with
a thickness of 0.2 and 0.15 radii, pressed on a plane, were 0.8 and 1.8 % too stiff at ratios of 1.4
and 1.9."""


def slenderness(mesh: BoundaryMesh, held: Mask | None = None) -> Array:
    """Return the size of each element over the thickness of the body behind it, (n_elements,) [-].

    The size is the length, in space the square root of the area. The value is 0 where no opposite
    side lies within one size, or where the two sides meet at an angle. With `held` (n_nodes,) it is
    0, too, where one of the sides is held and the body cannot bend.
    """
    count = mesh.n_elements
    area = np.bincount(mesh.element, mesh.measure, minlength=count)
    size = area ** (1.0 / (mesh.dim - 1))
    middle = np.add.reduceat(mesh.measure[:, None] * mesh.x, mesh.first_node[:-1]) / area[:, None]
    # take the node nearest to the middle: the middle itself may lie below a thin curved shell
    away = np.linalg.norm(mesh.x - middle[mesh.element], axis=1)
    nearest = np.lexsort((away, mesh.element))[mesh.first_node[:-1]]
    centre, normal = mesh.x[nearest], mesh.normal[nearest]
    element, node = within(mesh.x, centre, np.hypot(ASIDE, 1.0) * size)
    facing = np.einsum("qd,qd->q", mesh.normal[node], normal[element]) < OPPOSITE
    if held is not None:
        facing &= ~(held[node] | held[nearest[element]])
    if not facing.any():
        return np.zeros(count)
    element, node = element[facing], node[facing]
    away = mesh.x[node] - centre[element]
    depth = -np.sum(away * normal[element], axis=1)
    aside = np.linalg.norm(away + depth[:, None] * normal[element], axis=1)
    behind = (depth > 0.0) & (aside < ASIDE * size[element])
    return np.asarray(size / smallest_by(element[behind], depth[behind], count))


def held_nodes(mesh: BoundaryMesh, body: Body) -> Mask:
    """Return which nodes lie on parts of a body with a given displacement, (n_nodes,)."""
    conditions = [c for c in body.boundary if isinstance(c, Displacement) and not any(c.free)]
    return np.isin(mesh.node_part, [mesh.part_names.index(c.part) for c in conditions])


def bending_error(mesh: BoundaryMesh, held: Mask | None = None) -> float:
    """Return the relative error of forces and pressure from elements that are too large to bend
    [-].

    It is `BENDING` times the square of the size over the thickness that the share `SHARE` of the
    boundary exceeds.
    """
    ratio, area = slenderness(mesh, held), np.bincount(mesh.element, mesh.measure)
    order = largest_first(ratio)
    beyond = np.searchsorted(np.cumsum(area[order]), SHARE * area.sum())
    return BENDING * float(ratio[order[beyond]]) ** 2


def compactness(solution: Solution) -> float:
    """Return how far tractions move a compact body over how far the bodies are strained, at most 1
    [-].

    Tractions t strain a compact body of half the extent a by about t a/E. What bends moves much
    farther under them: errors of its displacement, relative to itself, are larger errors of t.
    """
    least = 1.0
    for body in solution.posed.bodies:
        mesh = solution.meshes[body.name]
        results = [step.bodies[body.name] for step in solution.tried]
        root = np.sqrt(np.repeat(mesh.weight, mesh.components))
        motions = np.linalg.qr(root[:, None] * unit_motions(mesh).reshape(len(root), -1))[0]
        moved = root[:, None] * np.column_stack([result.u.ravel() for result in results])
        strained = np.linalg.norm(moved - motions @ (motions.T @ moved), axis=0).max()
        acting = max(float(np.linalg.norm(root * result.traction.ravel())) for result in results)
        if strained > 0.0:
            least = min(least, acting * half_extent(mesh) / body.material.young_modulus / strained)
    return least
