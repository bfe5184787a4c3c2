"""Distance of cut panels from the curved faces that they stand for.

A side on which smaller panels hang does not follow the exact surface, and a mesh file has none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import scipy

from ...arrays import Array, Index, Mask, largest_by, smallest_by
from ...contact.law_protocol import OPEN
from ...geometry.surface import Boundary
from ...given.posed import Posed
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.sag import sag
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...refinement.panels.hanging import bent
from ...refinement.panels.quartering import cut
from ...results.records import StepResult
from ...results.report import Finding
from ...results.solution import Solution
from ..pose.discretise import Discrete
from .findings import limit_of, new_finding


def missed_curves(
    discrete: Discrete, solution: Solution, first: Mapping[str, BoundaryMesh], accuracy: float
) -> Iterator[Finding]:
    """Find panels in contact that miss their curved faces by a large share of the gap that contact
    closes.

    Parameters
    ----------
    discrete : Discrete
        The discrete problem on the last mesh.
    solution : Solution
        Its solution.
    first : mapping
        First mesh of each body, by its name.
    accuracy : float
        The accepted share, which is about the relative error of p.
    """
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        closed = np.any(
            [step.pairs[interface.name].state != OPEN for step in solution.steps], axis=0
        )
        approach = float(np.abs(interface.gap[closed]).max(initial=0.0))
        closed_points = discrete.meshes[side.body].x[interface.nodes[closed]]
        for number, part in side.ends:
            body, surface = discrete.posed.bodies[number], discrete.boundaries[number]
            if surface.known or surface.exact or not (surface.has_inside and approach > 0.0):
                continue
            height = _height(first[body.name], part, closed_points)
            if height > accuracy * approach:
                yield new_finding(
                    "meshes",
                    f"finer panels lie on those of the first mesh of {body.name!r}, which miss its "
                    f"curved faces by about {height:.2g}, next to {approach:.2g} that contact "
                    "closes: p is as rough, which the estimate does not see",
                    f"pair {interface.name!r}",
                    advice="begin with a smaller mesh.element_size, or a finer file",
                    measured=height,
                )


def _height(mesh: BoundaryMesh, part: str, points: Array) -> float:
    """Return the largest height of curved faces above the panels of a part near given points
    [length]."""
    numbers, faces = mesh.faces(part)
    away = scipy.spatial.cKDTree(points).query(mesh.x)[0]
    near = smallest_by(mesh.element, away, mesh.n_elements)
    near_points = near <= np.sqrt(np.bincount(mesh.element, mesh.weight))
    return float(sag(faces)[near_points[numbers]].max(initial=0.0))


def bent_sides(
    posed: Posed, solution: Solution, meshes: Sequence[SurfaceMesh], accuracy: float
) -> list[Mask]:
    """Return the panels to cut in each body (n_elements, 2), whose sides leave a curved face by too
    much.

    Smaller panels hang on these sides. The accepted distance follows from the share `accuracy` of
    the largest pressure.
    """
    marked = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in meshes]
    for side in [side for side in posed.interfaces if side.law.normal == "unilateral"]:
        ends = [step.pairs[side.name] for step in solution.steps]
        closed = np.any([pair.pressure > 0.0 for pair in ends], axis=0)
        most = max(float(pair.pressure.max(initial=0.0)) for pair in ends)
        strain = accuracy * most * posed.softness(side)
        size = float(np.sqrt(ends[-1].weight[closed].sum()))
        for b in side.bodies:
            if surface := _curved(posed, b):
                marked[b] |= bent(meshes[b], surface, ends[-1].x[closed], strain, strain * size)
    return marked


def missed_volume(posed: Posed, meshes: Sequence[SurfaceMesh]) -> float:
    """Return the largest share of the volume of a body that its panels miss of curved faces [-].

    Sections of it, and with them stresses and forces, are off by as much. Panels of half the size
    miss a sixteenth of it: quadratic ones miss the fourth power.
    """
    shares = [0.0]
    for body, mesh in zip(posed.bodies, meshes, strict=True):
        if (surface := _curved(posed, body.number)) is not None:
            finer = cut(mesh, np.ones((mesh.n_elements, 2), dtype=bool), surface)
            own, whole = (
                each.weight @ np.sum(each.x * each.normal, axis=1) for each in (mesh, finer)
            )
            shares.append(abs(1.0 - own / whole))
    return max(shares)


def overlapping_sides(posed: Posed, solution: Solution, failed: StepResult) -> list[Mask]:
    """Return the panels to cut in each body (n_elements, 2), whose sides explain an overlap between
    nodes.

    They leave the exact surface by a share of the overlap, as large as a sag may be in a gap, near
    points where surfaces may overlap.
    """
    meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
    depth = failed.residuals["between"]
    marked = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in meshes]
    for side in posed.interfaces:
        element = meshes[side.body].element[solution.nodes[side.name]]
        gap = failed.pairs[side.name].gap
        lowest = lowest_between(element, gap, meshes[side.body].n_elements)
        near = failed.pairs[side.name].x[lowest[element] <= gap.min()]
        for b, part in side.ends:
            if surface := _curved(posed, b):
                on_part = meshes[b].part == meshes[b].part_names.index(part)
                off = bent(
                    meshes[b],
                    surface,
                    near if len(near) else meshes[b].x,
                    np.inf,
                    limit_of("sag") * depth,
                )
                marked[b] |= off & on_part[:, None]
    return marked


def lowest_between(element: Index, gap: Array, count: int) -> Array:
    """Return the smallest gap that is possible between the nodes of each element, (count,).

    The gap is taken to vary between nodes as much as from node to node: the bound is 2 min - max of
    the nodal gaps (m,).
    """
    faced = np.isfinite(gap)
    least = smallest_by(element[faced], gap[faced], count)
    return np.asarray(2.0 * least - largest_by(element[faced], gap[faced], count, -np.inf))


def unseen_panels(posed: Posed, solution: Solution, failed: StepResult) -> list[Mask]:
    """Return the panels to cut in each body (n_elements, 2) where a contact without pressure may
    begin.

    They are the panels nearest to the opposite body. It may be smaller than a panel, so that no
    node faces it.
    """
    meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
    marked = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in meshes]
    for side in posed.interfaces:
        if side.primary is not None and not failed.pairs[side.name].pressure.any():
            mesh, opposite = meshes[side.body], meshes[side.primary[0]]
            nodes, size = mesh.nodes_of(side.part), np.sqrt(np.bincount(mesh.element, mesh.weight))
            near = scipy.spatial.cKDTree(opposite.x[opposite.nodes_of(side.primary[1])])
            distance = near.query(mesh.x[nodes])[0]
            away = smallest_by(mesh.element[nodes], distance, mesh.n_elements)
            marked[side.body] |= (away - size <= away.min())[:, None]
    return marked


def _curved(posed: Posed, body: int) -> Boundary | None:
    """Return the exact surface of a body, or None if it is unknown or plane."""
    surface = posed.boundaries[body]
    return surface if surface.exact else None
