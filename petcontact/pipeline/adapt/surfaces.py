"""Adaptive strategy in space: the tails of tractions on panels."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Array, Mask
from ...contact.state import Start
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...refinement.marks import LevelMesh
from ...refinement.panels.cut_directions import halved
from ...refinement.panels.panel_cuts import faded, largest, wider_than
from ...refinement.panels.small_contact import SmallContact
from ...results.records import StepResult, step_ends
from ...results.solution import Solution
from ..judge.findings import WHOLE_MESH, wants_smaller_elements
from ..judge.first_panels import lowest_between, overlapping_sides, unseen_panels
from ..pose.body_parts import body_alone
from ..steps.increment import PreparedProblem
from ..steps.start import carried_over
from .banded import Bands
from .budget import budget_of
from .cut_panels import CutPanels
from .ringed import EllipticContacts, expected_start, small_contacts, zone_about
from .surface_errors import TailErrors

SHARE = 0.9
"""Share of the sum of squared errors whose panels are cut [-]."""


class PanelTails(CutPanels):
    """The strategy for p and q, or for u_t in bilateral contact, from the tails of tractions on
    panels.

    Attributes
    ----------
    levels : range
        Numbers of the meshes, as many as the budget allows. In each mesh some panels of the one
        before are cut or get order 2.
    estimate : float
        Estimated error of the last mesh [-].
    exhausted : str
        Why there is no next mesh, or "".
    """

    levels = range(40)

    def __init__(self, posed: Posed) -> None:
        super().__init__(posed)
        self.differences: list[float] = []
        self.estimate, self.exhausted = math.inf, ""
        self._estimates: list[float] = []
        self._resultants, self._shared = math.nan, 0.0
        self._meshes = list[BoundaryMesh]()
        self._expected = list[tuple[PosedInterface, SmallContact]]()
        self._elliptic = EllipticContacts(posed, self._first.plain)
        self._bands = Bands(posed)

    def refine(self, number: int, posed: Body, boundary: Boundary, level: int) -> LevelMesh:
        """Return the first mesh of a body, from the config if it names one; later the refined
        mesh."""
        if not self._meshes:
            self._meshes = self._with_bands()
        if not self._meshes:
            bodies = len(self._posed.bodies)
            return LevelMesh(
                self._first.mesh(
                    number, posed, boundary, budget_of(bodies, self.asked).nodes / bodies
                ),
                0.0,
            )
        return LevelMesh(self._meshes[number], 0.0)

    def _with_bands(self) -> list[BoundaryMesh]:
        """Return first meshes with bands, if long contacts are known before a solve."""
        posed = self._posed
        if not all(body.mesh.automatic for body in posed.bodies):
            return []
        nodes = budget_of(len(posed.bodies), self.asked).nodes / len(posed.bodies)
        plain = [
            self._first.mesh(b, body_alone(posed, b, boundary), boundary, nodes)
            for b, boundary in enumerate(posed.boundaries)
        ]
        completed = functools.partial(self._completed, solution=None, faces=self._bands.faces)
        return [*self._bands.first(plain, self.wanted, completed)]

    def start(self, problem: PreparedProblem) -> Start | None:
        """Return a start from the first increment of the last solution.

        If that mesh was too coarse, the start is closed where contact is expected.
        """
        self._motions = sum(free.shape[2] for free in problem.discrete.motions)
        if (start := self._bands.start(problem)) is not None:
            return start
        if self._last is None:
            return expected_start(problem, self._expected)
        return carried_over(problem, replace(self._last, steps=self._last.steps[:1]))

    def mark(self, solution: Solution, level: int) -> None:
        """Estimate the error of a solution, and make the next meshes from its panels."""
        before, self._last, errors = self._last, solution, TailErrors(solution)
        self.estimate, self._resultants = errors.error()
        if before is not None and before.converged and self.estimate > self.wanted:
            apart = self._bands.apart((before, solution), errors)
            self.estimate = min(self.estimate, math.hypot(apart, errors._of_bodies))
        self._shared = errors.shared
        self._estimates.append(self.estimate)
        # rings around one contact mend no error of another one that no node sees; what a band has
        # wrong is known from the next one only, whatever the tails say
        off = errors.are_off_contact(self.estimate) and not self._bands.level
        if self.estimate > self.wanted and (off or not self._follows(solution)):
            self._cut_largest(errors)

    def _cut_largest(self, errors: TailErrors) -> None:
        """Make the next meshes by cutting the panels with the largest errors, or by raising their
        orders."""
        by_step = [self._squares(errors, step) for step in step_ends(errors.solution.steps)]
        by_body = [np.sum(mask, axis=0) for mask in zip(*by_step, strict=True)]
        marked = largest(np.concatenate(by_body), SHARE)
        own = np.split(marked, np.cumsum([len(squares) for squares in by_body])[:-1])
        raised = [mask & smooth for mask, smooth in zip(own, errors.smooth(), strict=True)]
        cut_ones = [mask & ~higher for mask, higher in zip(own, raised, strict=True)]
        along = map(halved, errors.meshes, cut_ones, errors.directional_squares())
        self._refine(errors, list(along), raised)

    def _follows(self, solution: Solution) -> bool:
        """Make the next meshes with bands or rings along contact edges.

        Return whether there are such meshes, or none that the budget allows.
        """
        completed = functools.partial(self._completed, solution=solution)
        plain = [self._first.plain[b] for b in range(len(self._posed.bodies))]
        on_both = functools.partial(completed, faces=self._bands.faces)
        if banded := self._bands.next(solution, plain, on_both):
            self._meshes = [*banded]
            return True
        if self._bands.level and self._refused:  # halving such panels costs more than a band
            self.exhausted = self._refused
            return True
        small = {
            side.name: zone_about(expected)
            for side, expected in small_contacts(self._posed, solution)
        }
        meshes = self._elliptic.meshes(solution, small, (self.estimate, self.wanted), completed)
        self._meshes = [*meshes] or self._meshes
        return bool(meshes)

    def mark_failed(self, solution: Solution) -> bool:
        """Make smaller panels for a rejected solution; return whether there are any.

        They are the panels in which surfaces may overlap, or all if tractions are not in
        equilibrium.
        """
        failed = solution.failed
        if failed is None or any(finding.kind == "overlap" for finding in failed.findings):
            return False
        kinds = wants_smaller_elements(failed.findings)
        if failed.status != "not converged" or not kinds:
            return False
        unresolved = bool(kinds & WHOLE_MESH)
        self._expected = small_contacts(self._posed, solution)
        if not unresolved and self._follows(solution):
            return True
        errors = TailErrors(solution)
        marked = [np.full((mesh.n_elements, 2), unresolved) for mesh in errors.meshes]
        for mask, more in zip(marked, self._overlapping(errors, failed), strict=True):
            mask |= more
        for panels_of in (overlapping_sides, unseen_panels):
            for mask, more in zip(marked, panels_of(self._posed, solution, failed), strict=True):
                mask |= more
        self._refine(errors, marked, [mask[:, 0] & False for mask in marked])
        return not self.exhausted

    def _overlapping(self, errors: TailErrors, failed: StepResult) -> list[Mask]:
        """Return the panels of secondaries that overlap most between nodes, (n_elements, 1) for
        each body.

        The measure is the pressure of the overlap. Where the gap is that of the geometry, they are
        the panels with the smallest gap.
        """
        marked = [np.zeros((mesh.n_elements, 1), dtype=bool) for mesh in errors.meshes]
        for number, side in enumerate(self._sides):
            mesh, gap = errors.meshes[side.body], failed.pairs[side.name].gap
            overlapping = largest(errors.gap_squares(failed, number), SHARE)
            if not overlapping.any():
                element = mesh.element[errors.solution.nodes[side.name]]
                overlapping = lowest_between(element, gap, mesh.n_elements) <= gap.min()
            marked[side.body] |= overlapping[:, None]
        return marked

    def _squares(self, errors: TailErrors, step: StepResult) -> list[Array]:
        """Return the squared errors of each body's elements after a step, over the square of the
        norm.

        The norm is that of p. In bilateral contact the values are squared errors of u_t instead
        [length² · area].
        """
        solution = errors.solution
        meshes = list(solution.meshes.values())
        if solution.kind == "bilateral":
            return [errors.slip_squares(step)]
        norms = list[float]()
        square = [np.zeros(mesh.n_elements) for mesh in meshes]
        for side in self._sides:
            mesh, pair, nodes = meshes[side.body], step.pairs[side.name], solution.nodes[side.name]
            assert pair.pressure_error is not None and pair.sigma_t_error is not None
            error = errors.weight(side, step)
            norms.append(float(error @ pair.size**2) or math.inf)
            error = error * (pair.pressure_error**2 + pair.sigma_t_error**2) / norms[-1]
            np.add.at(square[side.body], mesh.element[nodes], error)
            square[side.body] += errors.gap_squares(step, len(norms) - 1) / norms[-1]
        # elsewhere errors of tractions count as far as they reach the contact; the estimate leaves
        # them out
        elsewhere = [
            np.bincount(mesh.element, mesh.weight * size.errors(body.traction) ** 2)
            * faded(mesh, contact)
            * ~contact
            for mesh, size, contact, body in zip(
                meshes, errors.tails, self._touching(meshes), step.bodies.values(), strict=True
            )
        ]
        whole = sum(values.sum() for values in elsewhere)
        in_contact = sum(values.sum() for values in square)
        share = min(1.0 / min(norms), in_contact / whole) if whole > 0.0 else 0.0
        data = np.concatenate(errors.data_squares(step)) / min(norms)
        total = np.concatenate(square) + share * np.concatenate(elsewhere) + data
        return np.split(total, np.cumsum([mesh.n_elements for mesh in meshes])[:-1])

    def _refine(self, errors: TailErrors, marked: list[Mask], raised: list[Mask]) -> None:
        """Make the next meshes: panels of the next order, and panels halved along marked
        coordinates.

        Halving is repeated where `_once_more` says so. If the meshes are too expensive,
        `exhausted` says why.
        """
        solution = errors.solution
        meshes = [as_surface(mesh) for mesh in errors.meshes]
        small = small_contacts(self._posed, solution)
        if small:
            within = self._within(meshes, small)
            marked = [mask | more for mask, more in zip(marked, within, strict=True)]
        else:
            meshes = self._raised(meshes, raised)
        next_meshes, overlaps = list[SurfaceMesh](), errors.overlaps()
        again = True
        while again:
            finer, parent = self._cut(meshes, marked)
            reason = self._too_much(solution, finer)
            if reason:
                break
            next_meshes = meshes = finer
            marked = [mask[number] for mask, number in zip(marked, parent, strict=True)]
            marked = self._once_more(meshes, marked, small, overlaps)
            again = solution.kind != "bilateral" and any(mask.any() for mask in marked)
        self.exhausted = "" if next_meshes else reason
        self._meshes = [*next_meshes] or self._meshes

    def _once_more(
        self,
        meshes: Sequence[SurfaceMesh],
        marked: Sequence[Mask],
        small: Sequence[tuple[PosedInterface, SmallContact]],
        overlaps: Sequence[Sequence[tuple[Array, float]]],
    ) -> list[Mask]:
        """Return which halves of marked panels are halved again for the same mesh.

        They are at rims, where p may be infinite, and longer than the strip in which errors fade
        out; too long for small contacts; or over narrow overlaps.
        """
        more = self._within(meshes, small) if small else self._at_rims(meshes, marked)
        return [
            mask | (wider_than(mesh, spots) & panels.any(axis=1, keepdims=True))
            for mask, mesh, spots, panels in zip(more, meshes, overlaps, marked, strict=True)
        ]

    @staticmethod
    def _within(
        meshes: Sequence[SurfaceMesh], small: Sequence[tuple[PosedInterface, SmallContact]]
    ) -> list[Mask]:
        """Return which panels of secondaries are too long for small contacts, (n_elements, 2)."""
        marked = [np.zeros((mesh.n_elements, 2), dtype=bool) for mesh in meshes]
        for side, expected in small:
            marked[side.body] |= expected.too_large(meshes[side.body], side.part)
        return marked

    def _raised(self, meshes: Sequence[SurfaceMesh], raised: Sequence[Mask]) -> list[SurfaceMesh]:
        """Return the meshes with the next order on marked panels and on those that face them."""
        raised = [mask.copy() for mask in raised]
        for side in self._sides:
            if side.primary is not None:
                b = side.primary[0]
                own, opposite = self._facing(side, meshes)
                lower = meshes[b].order[opposite] <= meshes[side.body].order[own]
                raised[b][opposite[raised[side.body][own] & lower]] = True
        return [
            replace(mesh, order=mesh.order + mask)
            for mesh, mask in zip(meshes, raised, strict=True)
        ]

    def shown(self) -> dict[str, Any]:
        """Return fields of `Accuracy`: the estimates of all meshes, and those of resultants on the
        last."""
        last = {"resultants": self._resultants, "shared": self._shared}
        return {"estimates": self._estimates} | last
