"""The first mesh of a body in space: that of its options, or one that is small enough for contact
and for bending."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Array, Mask
from ...geometry.surface import BOX_PARTS, Boundary, BoxSurface
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...model.problem import Contact, Problem
from ...model.solver_options import MeshOptions
from ...refinement.meshes import mesh_of
from ...refinement.panels.axes import sides
from ...refinement.panels.data_lines import with_data_lines
from ...refinement.panels.marks import facing
from ...refinement.panels.quartering import cut
from ..judge.meshes import STIFF
from ..judge.thickness import SHARE, slenderness
from ..pose.interfaces import as_problem

FIRST = 36
"""Panels on a face in contact of the first mesh, about; on others a quarter of them."""
ROUND = 16
"""The same on round bodies, whose panels are of one size."""
LONGEST = 1.5
"""Panels of the first mesh over the shortest edge of the box."""
STIFFER, LONGER = 10.0, 1.2
"""Young's modulus of a secondary over that of its primary from which on panels of the primary are
no longer than so many of those that they face."""
FIRST_SHARE = 0.5
"""Of the nodes of the budget, that the first mesh of a thin body may have."""
MULTIPLES = (1.0, 1.5, 2.0, 2.5)
"""Of the size over the thickness from which bending is off by a tenth; beyond the last one it is
not solved at all."""


class FirstMeshes:
    """The first meshes of the bodies of a problem.

    Attributes
    ----------
    plain : dict of SurfaceMesh by the number of a body
        As their options make them, before panels are cut.
    thin : dict of float
        Of bodies whose panels must not be too large beside their thickness, the multiple that they
        keep to (`slender`).
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._soft = [
            (side, side.primary)
            for side in problem.interfaces
            if side.primary is not None and self._presses(side.body, side.primary[0])
        ]
        self._all: list[SurfaceMesh] = []
        self.plain, self.thin = dict[int, SurfaceMesh](), dict[int, float]()

    def mesh(
        self, number: int, one: Callable[[], Problem], boundary: Boundary, nodes: float
    ) -> SurfaceMesh:
        """Of a body, which may have about so many nodes where it is thin."""
        if not self._soft:
            return self._own(number, one(), boundary, nodes)
        self._all = self._all or self._of_all(nodes)
        return self._all[number]

    def _own(self, number: int, given: Problem, boundary: Boundary, nodes: float) -> SurfaceMesh:
        posed = first_options(given, boundary, bilateral=self._problem.holds_normals)
        found = as_surface(mesh_of(posed, boundary))
        if isinstance(boundary, BoxSurface) and given.mesh.automatic:
            found = with_data_lines(given, boundary, found)
        self.plain[number] = found
        if boundary.exact and boundary.known and given.mesh.automatic:
            found, self.thin[number] = thick_enough(posed, boundary, found, nodes)
        return found

    def _of_all(self, nodes: float) -> list[SurfaceMesh]:
        """Soft primaries have panels as small as those of the stiff bodies that press on them."""
        outlines = self._problem.boundaries
        meshes = [
            self._own(b, as_problem(self._problem, b, outline), outline, nodes)
            for b, outline in enumerate(outlines)
        ]
        for side, (b, part) in self._soft:
            if outlines[b].has_inside:
                meshes[b] = fine_enough(
                    (meshes[side.body], side.part), (meshes[b], part), side.direction, outlines[b]
                )
        return meshes

    def _presses(self, secondary: int, primary: int) -> bool:
        """Whether a stiff body presses on a soft one, whose first panels are not the user's."""
        one, other = (self._problem.body[b] for b in (secondary, primary))
        return (
            one.material.young_modulus > STIFFER * other.material.young_modulus
            and other.mesh.automatic
        )


def first_options(one: Problem, boundary: Boundary, *, bilateral: bool) -> Problem:
    """With the options of the first mesh: order 2 for u_t, which is smooth, else 1, as good a node
    and cheaper."""
    if not one.mesh.automatic:
        return one
    options: dict[str, Any] = {"order": 2 if bilateral else 1}
    touching = [c.part for c in one.boundary if isinstance(c, Contact)]
    if isinstance(boundary, BoxSurface):
        extent = boundary.upper - boundary.lower
        longest = LONGEST * float(extent.min())
        area = {
            part: float(np.delete(extent, axis).prod()) for part, (axis, _) in BOX_PARTS.items()
        }
        sizes = {part: min(longest, math.sqrt(area[part] / FIRST)) for part in touching}
        options |= {
            "element_size": min(longest, 2.0 * min(sizes.values())),
            "element_sizes": sizes,
            "exponent": 1.0,
        }
    elif boundary.known:
        usual = mesh_of(one.model_copy(update={"mesh": MeshOptions(order=0)}), boundary)
        options["element_size"] = min(
            math.sqrt(usual.weight[usual.nodes_of(part)].sum() / ROUND) for part in touching
        )
    return one.model_copy(update={"mesh": MeshOptions(**options)})


def thick_enough(
    one: Problem, boundary: Boundary, mesh: SurfaceMesh, nodes: float
) -> tuple[SurfaceMesh, float]:
    """The first mesh of a body with panels that are small beside its thickness, and the multiple
    that they keep to.

    Parameters
    ----------
    one : Problem
        The body with the options of its first mesh.
    boundary : Boundary
        Onto which the panels are brought that are cut.
    mesh : SurfaceMesh
        That the options make.
    nodes : float
        Of the budget; the mesh has a share of them where the last multiple does with so many, and
        is left as it is where that takes more than all.
    """
    ratio, count = slenderness(mesh) / np.array(STIFF)[mesh.order], np.bincount(mesh.element)
    needed = [float(count @ np.maximum(1.0, ratio / m) ** 2) for m in MULTIPLES]
    multiple = next(
        (m for m, number in zip(MULTIPLES, needed, strict=True) if number <= FIRST_SHARE * nodes),
        MULTIPLES[-1],
    )
    if needed[-1] > nodes or not slender(mesh, multiple).any():
        return mesh, multiple
    # panels are halved: the first ones are such that the last halves are just small enough
    worst, size = float(ratio.max()) / multiple, one.mesh.element_size
    assert size is not None
    options = one.mesh.model_copy(
        update={"element_size": size / (worst / 2.0 ** math.floor(math.log2(worst)))}
    )
    mesh = as_surface(mesh_of(one.model_copy(update={"mesh": options}), boundary))
    while (over := slender(mesh, multiple)).any():
        mesh = cut(mesh, over, boundary)
    return mesh, multiple


def slender(mesh: SurfaceMesh, multiple: float) -> Mask:
    """Panels that are too large beside the thickness behind them, along both coordinates,
    (n_elements, 2); none where they are a small share of the body."""
    over, area = (
        slenderness(mesh) > multiple * np.array(STIFF)[mesh.order],
        np.bincount(mesh.element, mesh.weight),
    )
    return np.repeat(over & bool(area[over].sum() > SHARE * area.sum()), 2).reshape(-1, 2)


def fine_enough(
    secondary: tuple[SurfaceMesh, str],
    primary: tuple[SurfaceMesh, str],
    direction: Array | None,
    surface: Boundary,
) -> SurfaceMesh:
    """The mesh of a soft primary, cut until its panels are not longer than those of a stiff
    secondary that they face.

    Tractions on smaller panels of a stiff body that a soft one does not feel are as large as rigid
    ones would be: sets of contact cycle on them.
    """
    mesh, part = primary
    length = np.linalg.norm(sides(secondary[0]), axis=2).max(axis=1)
    while True:
        own, other = facing(secondary, (mesh, part), direction)
        long = np.linalg.norm(sides(mesh), axis=2)[other].max(axis=1) > LONGER * length[own]
        if not long.any():
            return mesh
        marked = np.zeros((mesh.n_elements, 2), dtype=bool)
        marked[other[long]] = True
        mesh = cut(mesh, marked, surface)
