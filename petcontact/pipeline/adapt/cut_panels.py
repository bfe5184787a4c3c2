"""Cutting of panels of all bodies of a problem in space, together with those that they need."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Array, Index, Mask
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...refinement.panels.cut_directions import at_edges, matched, sides
from ...refinement.panels.data_lines import gap_edges
from ...refinement.panels.panel_cuts import LONGER, facing, too_large, with_equal_orders
from ...refinement.panels.quartering import cut, parents
from ...refinement.panels.tail import FADE
from ...results.solution import Solution
from ...round_off import WRITTEN
from ..judge.first_panels import bent_sides
from .budget import beyond_budget
from .first_mesh import MULTIPLES, FirstMeshes, multiple_of, slender
from .strategy import Wanted


class Seen(NamedTuple):
    """What solves have shown that the cost and the panels of finer meshes depend on.

    Attributes
    ----------
    last : Solution or None
        The last accepted solution.
    increments, motions : int
        Numbers of increments, and of motions that only contact holds.
    """

    last: Solution | None = None
    increments: int = 1
    motions: int = 0


class PanelCuts:
    """Cuts panels of all bodies of a problem together with those that they need.

    Parameters
    ----------
    posed : Posed
    first : FirstMeshes
        The first meshes, which say what bodies are thin.
    wanted : Wanted
        The wanted accuracy, which gives the budget.
    """

    def __init__(self, posed: Posed, first: FirstMeshes, wanted: Wanted) -> None:
        self._posed, self._sides, self._first = posed, posed.interfaces, first
        self._wanted = wanted
        self._faced = dict[str, tuple[list[Array], tuple[Index, Index]]]()

    def completed(
        self, meshes: list[SurfaceMesh], seen: Seen, faces: int = 0
    ) -> tuple[list[SurfaceMesh], str]:
        """Return meshes whose panels off the contact fit those in it, and why they exceed the
        budget, or "".

        Each of the `faces` that bands follow has the budget of a pair. Thin bodies have larger
        panels where the budget asks for it.
        """
        thin = self._thin(seen)
        for most in [m for m in MULTIPLES if m >= min(thin.values(), default=MULTIPLES[-1])]:
            thin, made, count = {b: max(m, most) for b, m in thin.items()}, meshes, 0
            while count < (count := sum(mesh.n_elements for mesh in made)):
                nothing = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in made]
                made = self.cut(made, nothing, seen, thin)[0]
            planes = [body.mirrors for body in self._posed.bodies]
            made = list(map(with_equal_orders, made, self.touching(made), planes))
            if not (refused := self.too_much(made, seen, faces)):
                break
        return made, refused

    def _thin(self, seen: Seen) -> dict[int, float]:
        """The entries of `MULTIPLES` that thin bodies have on the last meshes, or on the first."""
        if seen.last is None:
            return self._first.thin
        last = [as_surface(mesh) for mesh in seen.last.meshes.values()]
        return {b: max(m, multiple_of(last[b])) for b, m in self._first.thin.items()}

    def cut(
        self,
        meshes: Sequence[SurfaceMesh],
        marked: Sequence[Mask],
        seen: Seen,
        thin: Mapping[int, float] | None = None,
    ) -> tuple[list[SurfaceMesh], list[Index]]:
        """Return meshes cut along marked coordinates, and the number of each panel's parent.

        Panels that face cut panels, and panels that are too large next to the contact or the
        thickness (`thin`), are cut, too.
        """
        marked = [
            mask | too_large(mesh, contact)
            for mask, mesh, contact in zip(
                self._with_opposite(meshes, marked), meshes, self.touching(meshes), strict=True
            )
        ]
        for b, multiple in (self._thin(seen) if thin is None else thin).items():
            marked[b] |= slender(meshes[b], multiple)
        finer = [
            cut(mesh, mask, surface)
            for mesh, mask, surface in zip(meshes, marked, self._posed.boundaries, strict=True)
        ]
        parent = [parents(mesh, mask) for mesh, mask in zip(meshes, marked, strict=True)]
        if seen.last is None:
            return finer, parent
        more = bent_sides(self._posed, seen.last, finer, self._wanted.accuracy)
        if any(mask.any() for mask in more) and not self.too_much(finer, seen):
            finer, number = self.cut(finer, more, seen, thin)
            parent = [old[new] for old, new in zip(parent, number, strict=True)]
        return finer, parent

    def _with_opposite(self, meshes: Sequence[SurfaceMesh], marked: Sequence[Mask]) -> list[Mask]:
        """Return the marks with those of panels of primaries that face marked, smaller ones."""
        vectors, marked = [sides(mesh) for mesh in meshes], [mask.copy() for mask in marked]
        lengths = [np.linalg.norm(edges, axis=2) for edges in vectors]
        for side in self._sides:
            if side.primary is not None and marked[side.body].any():
                b = side.primary[0]
                own, opposite = self.facing(side, meshes)
                axis = matched(vectors[side.body][own], vectors[b][opposite])
                length = np.take_along_axis(lengths[b][opposite], axis, axis=1)
                halves = 0.5 * lengths[side.body][own]
                k, a = np.nonzero(marked[side.body][own] & (length > LONGER * halves))
                marked[b][opposite[k], axis[k, a]] = True
        return marked

    def touching(self, meshes: Sequence[BoundaryMesh]) -> list[Mask]:
        """Return which elements of each body are in a contact part, or face such elements."""
        touching = [np.zeros(mesh.n_elements, dtype=bool) for mesh in meshes]
        for side in self._sides:
            mesh = meshes[side.body]
            touching[side.body] |= mesh.part == mesh.part_names.index(side.part)
            if side.primary is not None:
                b = side.primary[0]
                touching[b][self.facing(side, meshes)[1]] = True
        return touching

    def facing(self, side: PosedInterface, meshes: Sequence[BoundaryMesh]) -> tuple[Index, Index]:
        """Return `facing` of an interface, computed once for the same panels of both parts."""
        secondary, primary = ((as_surface(meshes[b]), part) for b, part in side.ends)
        own, opposite = (mesh.elements_of(part) for mesh, part in (secondary, primary))
        corners = [secondary[0].corners[own], primary[0].corners[opposite]]
        cached = self._faced.get(side.name)
        if cached is None or not all(map(_are_same, cached[0], corners)):
            first, second = facing(secondary, primary, side.direction)
            couples = np.searchsorted(own, first), np.searchsorted(opposite, second)
            cached = self._faced[side.name] = (corners, couples)
        return own[cached[1][0]], opposite[cached[1][1]]

    @functools.cached_property
    def _edges(self) -> list[list[Array]]:
        """The points of the edges that press on each interface's secondary."""
        boundaries = self._posed.boundaries
        return [
            [] if gap is None else gap_edges(boundaries[side.body], side.part, gap)
            for side, gap in ((side, side.law.gap) for side in self._sides)
        ]

    def at_rims(self, meshes: Sequence[SurfaceMesh], marked: Sequence[Mask]) -> list[Mask]:
        """Return the marks of secondaries along coordinates in which panels end at a rim, or at an
        edge that presses, and are long."""
        result = [np.zeros_like(mask) for mask in marked]
        for side, edges in zip(self._sides, self._edges, strict=True):
            mesh = meshes[side.body]
            size = math.sqrt(mesh.weight[mesh.nodes_of(side.part)].sum())
            long = np.linalg.norm(sides(mesh), axis=2) > FADE * size
            ends = at_edges(mesh, side.part, edges, self._posed.bodies[side.body].mirrors)
            result[side.body] |= marked[side.body] & long & ends
        return result

    def too_much(self, meshes: Sequence[BoundaryMesh], seen: Seen, faces: int = 0) -> str:
        """Return why solves on meshes exceed the budget, or ""."""
        counts = seen.increments, seen.motions
        automatic = all(body.mesh.automatic for body in self._posed.bodies)
        own = () if automatic else self._first.meshes
        return beyond_budget(self._posed, meshes, counts, self._wanted, faces, own)


def _are_same(corners: Array, others: Array) -> bool:
    """Return whether panels have the same corners (n, 4, 3), up to round-off of projections."""
    return corners.shape == others.shape and np.allclose(
        corners,
        others,
        rtol=0.0,
        atol=WRITTEN * np.ptp(corners[:, :3], axis=(0, 1)).max(),
        equal_nan=True,
    )
