"""Where stress inside a body is sampled before its largest values are climbed to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array
from ...contact.law_protocol import OPEN
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import first_largest
from ..evaluated import NOWHERE, Evaluated
from ..records import BodyResult, StepResult

DEPTHS = np.array([0.05, 0.1, 0.2, 0.35, 0.6, 1.0, 1.6])
"""Of samples below a contact or a load, over half its width. The largest von Mises stress of a
frictionless line contact lies at 0.70 (ν = 0.3), of a round one at 0.48; friction brings it
nearer."""
ACROSS = {2: 6, 3: 3}
"""Places of a contact below which is sampled along each of its directions, by the dimension."""
LATTICE = {2: 10, 3: 6}
"""Samples along the longest side of a body, by its dimension."""


def places_inside(solution: Evaluated, body: str, step: StepResult) -> Array:
    """Points all over a body, below its contacts and below the largest tractions of its parts after
    an increment, (k, d) [length]; some may lie outside."""
    mesh = solution.meshes[body]
    below = [*_below_contacts(solution, body, step), *_below_loads(mesh, step.bodies[body])]
    return np.vstack([_lattice(mesh), *below])


def _lattice(mesh: BoundaryMesh) -> Array:
    """Points all over the box about a body, (k, d)."""
    low, high = mesh.x.min(axis=0), mesh.x.max(axis=0)
    spacing = (high - low).max() / LATTICE[mesh.dim]
    axes = [
        a + (b - a) * (np.arange(n) + 0.5) / n
        for a, b, n in zip(low, high, np.ceil((high - low) / spacing).astype(int), strict=True)
    ]
    return np.column_stack([axis.ravel() for axis in np.meshgrid(*axes)])


def _below_contacts(solution: Evaluated, body: str, step: StepResult) -> Iterator[Array]:
    """Points below the closed part of each contact of a body."""
    dim = solution.meshes[body].dim
    for name, pair in step.pairs.items():
        secondary, owner = solution.sides[name][0], solution.primaries.get(name, NOWHERE)[0]
        closed = np.flatnonzero(pair.state != OPEN)
        if body not in (secondary, owner) or not len(closed):
            continue
        sign = -1.0 if body == secondary else 1.0
        every = max(1, len(closed) // ACROSS[dim] ** (dim - 1))
        rows = np.append(closed[::every], closed[first_largest(pair.pressure[closed])])
        yield _below(pair.x[rows], sign * pair.normal[rows], float(pair.weight[closed].sum()))


def _below_loads(mesh: BoundaryMesh, found: BodyResult) -> Iterator[Array]:
    """Points below the largest traction of each part, as deep as it is wide where it is more than
    half as large."""
    size = np.linalg.norm(found.traction, axis=1)
    for nodes in filter(len, map(mesh.nodes_of, mesh.part_names)):
        top = nodes[[first_largest(size[nodes])]]
        wide = float(mesh.weight[nodes][size[nodes] >= 0.5 * size[top]].sum())
        yield _below(mesh.x[top], -mesh.normal[top], wide)


def _below(x: Array, inward: Array, area: float) -> Array:
    """Points at all depths below some places (k, d), what presses on them having an area."""
    dim = x.shape[1]
    half = (area / {2: 2.0, 3: np.pi}[dim]) ** (1.0 / (dim - 1))
    return np.asarray(x + half * DEPTHS[:, None, None] * inward).reshape(-1, dim)
