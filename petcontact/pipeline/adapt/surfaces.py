"""Adaptive strategy in space: the tails of tractions on panels."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Mask
from ...contact.state import Start
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...record import field, record, replace
from ...refinement.panels.cut_directions import halved
from ...refinement.panels.panel_cuts import faded, largest, wider_than
from ...refinement.panels.rings import SHRINK
from ...results.records import StepResult, step_ends
from ...untyped import Keyed
from ..judge.findings import WHOLE_MESH, wants_smaller_elements
from ..judge.first_panels import lowest_between, overlapping_sides, unseen_panels
from ..steps.prepared import PreparedProblem
from ..steps.start import carried_over, start_within
from .banded import Bands
from .budget import budget_of, says_something
from .cut_panels import PanelCuts, Seen
from .first_mesh import FirstMeshes
from .long_contacts import LaidBands
from .strategy import Estimate, Meshes, Strategy, Tried, Wanted
from .surface_errors import TailErrors

SHARE = 0.9
"""Share of the sum of squared errors whose panels are cut [-]."""
MOST = 40
"""Largest number of meshes, more than any budget allows."""


@record
class TailEstimate(Estimate):
    """The error of p and q, or of u_t, by tails.

    Attributes
    ----------
    errors : TailErrors
        The errors of all panels.
    resultants : float
        The relative error of forces [-].
    all : list of float
        Estimated errors on all meshes [-].
    """

    errors: TailErrors = field(kw_only=True)
    resultants: float = math.nan
    all: list[float] = field(default_factory=list)

    @property
    def of_before(self) -> float:
        """The estimated error of the solution on the meshes before [-]."""
        return self.all[-2] if len(self.all) > 1 else math.inf


@record
class PanelMarks:
    """Which panels of a solution are cut or get the next order.

    Attributes
    ----------
    seen : Seen
        What solves have shown.
    errors : TailErrors or None
        The errors of the solution, which may be rejected; None before the first solve.
    error : float
        The last estimate [-].
    cut : list of (n_elements, 2) masks
        Panels of each body that are halved along a coordinate.
    raised : list of (n_elements,) masks
        Panels of each body that get the next order.
    follow : bool
        Whether bands or rings along the edges of contacts are laid instead, if they fit.
    bands : LaidBands
        The bands and rings that meshes have had.
    """

    seen: Seen = field(default_factory=Seen)
    errors: TailErrors | None = None
    error: float = math.inf
    cut: list[Mask] = field(default_factory=list)
    raised: list[Mask] = field(default_factory=list)
    follow: bool = True
    bands: LaidBands = field(default_factory=LaidBands)


class PanelTails(Strategy[TailEstimate, PanelMarks]):
    """The strategy for p and q, or for u_t in bilateral contact, from the tails of tractions on
    panels.

    Attributes
    ----------
    accuracy : float
        Default of the wanted accuracy [-].
    """

    accuracy, first = 2e-2, PanelMarks()

    def __init__(self, posed: Posed, wanted: Wanted) -> None:
        self._posed, self._sides, self.wanted = posed, posed.interfaces, wanted
        bodies = len(posed.bodies)
        self._first = FirstMeshes(posed, budget_of(bodies, wanted.asked).nodes / bodies)
        self._cuts = PanelCuts(posed, self._first, wanted)
        self._bands = Bands(posed, wanted.accuracy)

    def estimate(self, tried: Tried[PanelMarks], before: TailEstimate | None) -> TailEstimate:
        """Return the error by the tails of a solution, or by its change from the bands before."""
        errors, apart = TailErrors(tried.solution), math.inf
        every = [*before.all] if before else []
        if before is not None:
            apart = tried.meshes.marks.bands.apart(before.solution, tried.solution, errors)
            # numbers gain from one band to the next what bands gain
            every[-1] = min(every[-1], apart / SHRINK)
        error, resultants = errors.error(apart)
        every.append(error)
        return TailEstimate(tried, error, errors=errors, resultants=resultants, all=every)

    def marks(self, estimate: TailEstimate) -> PanelMarks:
        """Return the panels with the largest errors."""
        errors = estimate.errors
        by_step = [self._squares(errors, step) for step in step_ends(errors.solution.steps)]
        by_body = [np.sum(mask, axis=0) for mask in zip(*by_step, strict=True)]
        marked = largest(np.concatenate(by_body), SHARE)
        own = np.split(marked, np.cumsum([len(squares) for squares in by_body])[:-1])
        raised = [mask & smooth for mask, smooth in zip(own, errors.smooth(), strict=True)]
        cut_ones = [mask & ~higher for mask, higher in zip(own, raised, strict=True)]
        # rings around one contact mend no error of another one that no node sees; what a band has
        # wrong is known from the next one only, whatever the tails say
        laid: PanelMarks = estimate.tried.meshes.marks
        off = errors.are_off_contact(estimate.error) and not laid.bands.by_change
        return replace(
            laid,
            seen=_seen(estimate.tried),
            errors=errors,
            error=estimate.error,
            cut=list(map(halved, errors.meshes, cut_ones, errors.directional_squares())),
            raised=raised,
            follow=not off,
        )

    def marks_after_failure(
        self, tried: Tried[PanelMarks], estimate: TailEstimate | None
    ) -> PanelMarks | None:
        """Return the panels in which surfaces may overlap, or all if tractions are not in
        equilibrium."""
        solution, failed = tried.solution, tried.solution.failed
        if failed is None or any(finding.kind == "overlap" for finding in failed.findings):
            return None
        kinds = wants_smaller_elements(failed.findings)
        if failed.status != "not converged" or not kinds:
            return None
        errors, everywhere = TailErrors(solution), bool(kinds & WHOLE_MESH)
        marked = [np.full((mesh.n_elements, 2), everywhere) for mesh in errors.meshes]
        for more in (
            self._overlapping(errors, failed),
            overlapping_sides(self._posed, solution, failed),
            unseen_panels(self._posed, solution, failed),
        ):
            marked = [mask | also for mask, also in zip(marked, more, strict=True)]
        none = [np.zeros(mesh.n_elements, dtype=bool) for mesh in errors.meshes]
        seen = _seen(tried)._replace(last=estimate.solution if estimate else None)
        error = estimate.error if estimate else math.inf
        return replace(
            tried.meshes.marks,
            seen=seen,
            errors=errors,
            error=error,
            cut=marked,
            raised=none,
            follow=not everywhere,
        )

    def meshes(self, marks: PanelMarks, level: int) -> Meshes[PanelMarks]:
        """Return the first meshes; later ones with bands or rings along the edges of contacts, or
        with panels that are cut or have the next order."""
        if level == MOST:
            return Meshes(marks, level)
        if marks.errors is None:
            made, bands = self._with_bands()
            laid, made, refused = replace(marks, bands=bands), made or self._first.meshes, ""
        else:
            laid, made, refused = self._followed(marks, marks.errors)
            if not (made or refused):
                made, refused = self._refined(marks, marks.errors)
        start = functools.partial(_start, laid)
        return Meshes(laid, level, made, exhausted="" if made else refused, start=start)

    def _with_bands(self) -> tuple[list[SurfaceMesh], LaidBands]:
        """Return first meshes with bands, if contacts are known before a solve."""
        if not all(body.mesh.automatic for body in self._posed.bodies):
            return [], LaidBands()

        def completed(meshes: list[SurfaceMesh]) -> list[SurfaceMesh]:
            made, refused = self._cuts.completed(meshes, Seen(), self._bands.faces)
            return [] if refused else made

        return self._bands.first(self._first.meshes, completed)

    def _followed(
        self, marks: PanelMarks, errors: TailErrors
    ) -> tuple[PanelMarks, list[SurfaceMesh], str]:
        """Return meshes with bands or rings along contact edges, or none that the budget allows;
        the marks with these, and why bands that are there do not go on."""
        if not marks.follow:
            return marks, [], ""
        solution, refused = errors.solution, ""

        def completed(meshes: list[SurfaceMesh]) -> list[SurfaceMesh]:
            nonlocal refused
            made, refused = self._cuts.completed(meshes, marks.seen, self._bands.faces)
            return [] if refused else made

        laid = marks.bands
        if not says_something(marks.error):  # first bands show where the next ones lie
            laid = replace(laid, most=0)
        made, bands = self._bands.next(laid, solution, self._first.plain, completed)
        # halving such panels costs more than a band
        return replace(marks, bands=bands), made, refused if bands.by_change and not made else ""

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
                meshes, errors.tails, self._cuts.touching(meshes), step.bodies.values(), strict=True
            )
        ]
        whole = sum(values.sum() for values in elsewhere)
        in_contact = sum(values.sum() for values in square)
        share = min(1.0 / min(norms), in_contact / whole) if whole > 0.0 else 0.0
        data = np.concatenate(errors.data_squares(step)) / min(norms)
        total = np.concatenate(square) + share * np.concatenate(elsewhere) + data
        return np.split(total, np.cumsum([mesh.n_elements for mesh in meshes])[:-1])

    def _refined(self, marks: PanelMarks, errors: TailErrors) -> tuple[list[SurfaceMesh], str]:
        """Return meshes with panels of the next order, and with panels halved along marked
        coordinates; and why there are none that the budget allows.

        Halving is repeated where `_once_more` says so.
        """
        meshes, marked = [as_surface(mesh) for mesh in errors.meshes], marks.cut
        meshes = self._raised(meshes, marks.raised)
        made, overlaps, again = list[SurfaceMesh](), errors.overlaps(), True
        while again:
            finer, parent = self._cuts.cut(meshes, marked, marks.seen)
            if refused := self._cuts.too_much(finer, marks.seen):
                return made, refused
            made = meshes = finer
            marked = [mask[number] for mask, number in zip(marked, parent, strict=True)]
            marked = self._once_more(meshes, marked, overlaps)
            again = errors.solution.kind != "bilateral" and any(mask.any() for mask in marked)
        return made, ""

    def _once_more(
        self,
        meshes: Sequence[SurfaceMesh],
        marked: Sequence[Mask],
        overlaps: Sequence[Sequence[tuple[Array, float]]],
    ) -> list[Mask]:
        """Return which halves of marked panels are halved again for the same mesh.

        They are at rims, where p may be infinite, and longer than the strip in which errors fade
        out, or over narrow overlaps.
        """
        more = self._cuts.at_rims(meshes, marked)
        return [
            mask | (wider_than(mesh, spots) & panels.any(axis=1, keepdims=True))
            for mask, mesh, spots, panels in zip(more, meshes, overlaps, marked, strict=True)
        ]

    def _raised(self, meshes: Sequence[SurfaceMesh], raised: Sequence[Mask]) -> list[SurfaceMesh]:
        """Return the meshes with the next order on marked panels and on those that face them."""
        raised = [mask.copy() for mask in raised]
        for side in self._sides:
            if side.primary is not None:
                b = side.primary[0]
                own, opposite = self._cuts.facing(side, meshes)
                lower = meshes[b].order[opposite] <= meshes[side.body].order[own]
                raised[b][opposite[raised[side.body][own] & lower]] = True
        return [
            replace(mesh, order=mesh.order + mask)
            for mesh, mask in zip(meshes, raised, strict=True)
        ]

    def shown(self, estimate: TailEstimate) -> Keyed:
        """Return fields of `Accuracy`: the estimates of all meshes, and those of resultants on the
        last."""
        last = {"resultants": estimate.resultants, "shared": estimate.errors.shared}
        return {"estimates": estimate.all} | last


def _start(marks: PanelMarks, problem: PreparedProblem) -> Start | None:
    """Return a start that is closed in bands, else that of the first increment of the last
    solution."""
    if within := marks.bands.places:
        return start_within(problem, within)
    last = marks.seen.last
    return None if last is None else carried_over(problem, last.steps[0])


def _seen(tried: Tried[PanelMarks]) -> Seen:
    """Return what an accepted solve has shown."""
    motions = sum(free.shape[2] for free in tried.discrete.motions)
    return Seen(tried.solution, len(tried.solution.steps), motions)
