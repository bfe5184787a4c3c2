"""How far panels that are cut lie off curved faces: beside larger ones, and where no exact surface
is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...contact.law_protocol import OPEN
from ...geometry.surface import Boundary
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.sag import sag
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...model.problem import Problem
from ...refinement.panels.hanging import bent
from ...results.records import StepResult
from ...results.report import Finding
from ...results.solution import Solution
from ..pose.discretise import Discrete
from .findings import new_finding

EXPLAINED = 0.1
"""Share of an overlap between nodes by which a panel is off the surface where it explains the
overlap."""
DEEP = 2.0
"""Of such overlaps that a gap may exceed the least one by where surfaces may overlap, too."""


def missed_curves(
    discrete: Discrete, solution: Solution, first: Mapping[str, BoundaryMesh], accuracy: float
) -> list[Finding]:
    """Find panels in contact that miss the curved faces they stand for by more than a share of what
    contact closes.

    Parameters
    ----------
    discrete : Discrete
        Of the last mesh.
    solution : Solution
        On it.
    first : mapping
        Body to its first mesh.
    accuracy : float
        The share: p is about as far off.
    """
    findings = []
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        closed = np.any(
            [step.pairs[interface.name].state != OPEN for step in solution.steps], axis=0
        )
        approach = float(np.abs(interface.gap[closed]).max(initial=0.0))
        place = discrete.meshes[side.body].x[interface.nodes[closed]]
        for number, part in side.ends:
            body = discrete.problem.body[number]
            surface = body.geometry.outline()
            if surface.known or surface.exact or not (surface.has_inside and approach > 0.0):
                continue
            height = _height(first[body.name], part, place)
            if height > accuracy * approach:
                text = (
                    f"finer panels lie on those of the first mesh of {body.name!r}, which miss its "
                    f"curved faces by about {height:.2g}, next to {approach:.2g} that contact "
                    "closes: p is as rough, which the estimate does not see"
                )
                advice = "begin with a smaller mesh.element_size, or a finer file"
                where = f"pair {interface.name!r}"
                findings.append(new_finding("meshes", text, where, advice=advice, measured=height))
    return findings


def _height(mesh: BoundaryMesh, part: str, place: Array) -> float:
    """Largest height of curved faces over the panels of a part that are beside some points
    [length]."""
    numbers, faces = mesh.faces(part)
    near = np.full(mesh.n_elements, np.inf)
    np.minimum.at(near, mesh.element, scipy.spatial.cKDTree(place).query(mesh.x)[0])
    beside = near <= np.sqrt(np.bincount(mesh.element, mesh.weight))
    return float(sag(faces)[beside[numbers]].max(initial=0.0))


def bent_sides(
    problem: Problem, solution: Solution, meshes: Sequence[SurfaceMesh], accuracy: float
) -> list[Mask]:
    """Which panels of curved faces have sides that smaller ones hang on and that leave the face by
    more than a share of p allows for, along both coordinates."""
    marked = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in meshes]
    for side in [side for side in problem.interfaces if side.law.normal == "unilateral"]:
        ends, bodies = (
            [step.pairs[side.name] for step in solution.steps],
            [side.body, *(side.primary or ())[:1]],
        )
        closed = np.any([pair.pressure > 0.0 for pair in ends], axis=0)
        most = max(float(pair.pressure.max(initial=0.0)) for pair in ends)
        soft = sum(
            (1.0 - b.material.poisson_ratio**2) / b.material.young_modulus
            for b in map(problem.body.__getitem__, bodies)
        )
        strain, size = accuracy * most * soft, float(np.sqrt(ends[-1].weight[closed].sum()))
        for b in bodies:
            if surface := _curved(problem, b):
                marked[b] |= bent(meshes[b], surface, ends[-1].x[closed], strain, strain * size)
    return marked


def overlapping_sides(problem: Problem, solution: Solution, failed: StepResult) -> list[Mask]:
    """Which panels of curved faces in contact leave these by a share of what surfaces overlap
    between nodes, near where they may do so, along both coordinates."""
    meshes, depth = (
        [as_surface(mesh) for mesh in solution.meshes.values()],
        failed.residuals["between"],
    )
    marked = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in meshes]
    for side in problem.interfaces:
        element, gap = (
            meshes[side.body].element[solution.nodes[side.name]],
            failed.pairs[side.name].gap,
        )
        lowest = lowest_between(element, gap, meshes[side.body].n_elements)
        near = failed.pairs[side.name].x[lowest[element] <= gap.min() + DEEP * depth]
        for b, part in side.ends:
            if surface := _curved(problem, b):
                here = meshes[b].part == meshes[b].part_names.index(part)
                off = bent(
                    meshes[b],
                    surface,
                    near if len(near) else meshes[b].x,
                    np.inf,
                    EXPLAINED * depth,
                )
                marked[b] |= off & here[:, None]
    return marked


def lowest_between(element: Index, gap: Array, count: int) -> Array:
    """The least that gaps at nodes (m,) of some of so many elements may be between these, if they
    vary there as much as from node to node, (count,)."""
    (least, most), faced = np.full((2, count), np.inf), np.isfinite(gap)
    np.minimum.at(least, element[faced], gap[faced])
    np.minimum.at(most, element[faced], -gap[faced])
    return np.asarray(2.0 * least + most)


def unseen_panels(problem: Problem, solution: Solution, failed: StepResult) -> list[Mask]:
    """Which panels of contacts that carry nothing may be where the other body is nearest, along
    both coordinates: it may be smaller than they are, so that none of their nodes faces it."""
    meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
    marked = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in meshes]
    for side in problem.interfaces:
        if side.primary is not None and not failed.pairs[side.name].pressure.any():
            mesh, other = meshes[side.body], meshes[side.primary[0]]
            nodes, size = mesh.nodes_of(side.part), np.sqrt(np.bincount(mesh.element, mesh.weight))
            away, near = (
                np.full(mesh.n_elements, np.inf),
                scipy.spatial.cKDTree(other.x[other.nodes_of(side.primary[1])]),
            )
            np.minimum.at(away, mesh.element[nodes], near.query(mesh.x[nodes])[0])
            marked[side.body] |= (away - size <= away.min())[:, None]
    return marked


def _curved(problem: Problem, body: int) -> Boundary | None:
    """The exact surface of a body, if it is known and curved."""
    surface = problem.body[body].geometry.outline()
    return surface if surface.exact else None
