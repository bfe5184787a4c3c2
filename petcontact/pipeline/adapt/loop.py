"""Adaptive solution: solve, find where the solution is singular, refine towards it, estimate,
repeat.

Meshes come from refinement levels, each with an error about ten times smaller than the one before:
more order and a milder grading where the solution is smooth, smaller elements of low order at
corners and edges of contact, stick and slip. The solution of one level places these edges for the
next one and is its start. The difference of two levels is the error of the lower one; it is the
estimate for the upper one, which is returned. What the last step gains is not claimed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...errors import InaccurateOperator, InputError, SolverError
from ...geometry.surface import Boundary
from ...mesh.boundary_mesh import BoundaryMesh
from ...model.problem import Problem
from ...refinement.levels import check_accuracy
from ...results.records import StepResult
from ...results.report import Finding
from ...results.solution import Solution
from ...runtime.memory import release_memory
from ...runtime.signals import BrokenOff, answering
from ...runtime.world import world
from ..choice import TIGHTEST, chosen_tolerance, has_compressed
from ..eliminate import Announce
from ..judge.findings import judged, new_finding
from ..judge.first_panels import missed_curves
from ..pose.discretise import Discrete, MeshMaker, discretise
from ..run import prepare, reported, run, unreported, with_paths
from ..steps.increment import Monitor, PreparedProblem
from ..steps.load_steps import known_factors
from .budget import USELESS, Quantity, Reached, short_of
from .fixed_mesh import MOST, carries_something, with_estimate
from .slip_ladder import Slip
from .surfaces import PanelTails
from .traction_ladder import Tractions

TIGHTER = 0.25
"""By what the tolerance of compressed surfaces falls where a solution on them is not accurate
enough."""
MANY_NODES = 1000
"""From which on a mesh is reported of, and its operators are released, before those of the next are
made: several GB in all. Of smaller ones only the last is reported of; what depends on the path of
the loads is looked at on the last of all."""


def quantity_for(problem: Problem) -> Quantity:
    """In the plane u_t of one body in bilateral contact without load steps, else p and q; in space
    their tails.

    Raises
    ------
    InputError
        If no part is in contact.
    """
    if problem.kind == "elastic":
        raise InputError(
            "contact: no part is in contact, which adaptive meshes follow; set mesh.element_size"
        )
    if problem.boundaries[0].dim > 2:
        return PanelTails(problem)
    return Slip() if problem.kind == "bilateral" else Tractions(problem)


class AdaptiveSolve:
    """Meshes one after another, and what the last one showed.

    Attributes
    ----------
    quantity : Quantity
    solutions : list of Solution
        One a mesh.
    discrete : Discrete or None
        The problem on the last mesh.
    missed, left : float
        What its mesh leaves of the given data beyond what is asked (or 0), and what a method of the
        problem's own leaves on it, by the quantity's difference [-].
    broken_off : bool
        Whether a signal, a monitor or a failure ended the last solve.
    """

    def __init__(
        self,
        problem: Problem,
        comm: Any,
        monitor: Monitor | None,
        law: Any,
        announce: Announce | None = None,
        reached: Callable[[Reached], None] | None = None,
    ) -> None:
        self._began, self._announce, self._reached = time.perf_counter(), announce, reached
        method = problem.method.model_copy(
            update={
                "name": "semismooth-newton",
                "rule": None,
                "start": "zero",
                "formulation": "condensed",
            }
        )
        self.problem, self.comm, self.monitor, self.law = (
            problem.model_copy(update={"method": method}),
            comm,
            monitor,
            law,
        )
        self.quantity = quantity_for(problem)
        self.solutions: list[Solution] = []
        self.discrete: Discrete | None = None
        self.missed = self.left = 0.0
        self.broken_off = False
        self._tolerance = math.nan
        self._tried: PreparedProblem | None = None
        self._kept: PreparedProblem | None = None

    def climb(self, accuracy: float) -> str:
        """Level after level until the estimate is below the accuracy; what kept a level from being
        solved, or nothing."""
        quantity = self.quantity
        quantity.wanted = accuracy
        self._tolerance = chosen_tolerance(self.problem.bem, accuracy)
        for level in quantity.levels:
            for attempt in range(quantity.attempts):
                try:
                    solution = self._solved(level)
                except (SolverError, BrokenOff) as error:
                    self.broken_off = isinstance(error, BrokenOff)
                    if not self.solutions:
                        raise
                    return f"{error} (on the mesh after the last)"
                if solution.status == "failed" and self.solutions:
                    self.broken_off = True
                    return f"{solution.reason} (on the mesh after the last)"
                if solution.status != "converged":
                    more = quantity.goes_on(solution)
                    if not more and any(each.converged for each in self.solutions):
                        return f"{solution.reason} (on the mesh after the last)"
                    self._keep(solution)
                    if not more:
                        return ""
                    break
                self._keep(solution)
                quantity.observe(solution, level)
                self._report(solution)
                if not quantity.is_vague() or attempt == quantity.attempts - 1:
                    break
            if self.missed > 0.0 or quantity.estimate <= accuracy or quantity.exhausted:
                break
        return quantity.exhausted

    def _keep(self, solution: Solution) -> None:
        if self._kept is not None:
            self._kept.close()
        self.solutions.append(solution)
        self._kept = self._tried

    def last(self) -> Solution:
        """The solution on the last mesh, with all that is reported of it."""
        problem, found = self._kept, self.solutions[-1]
        if problem is not None:
            found = found if found.provenance.versions else reported(problem, found)
            found = with_paths(problem, found)
            first, wanted = self.solutions[0].meshes, self.quantity.wanted
            found = found.with_findings(missed_curves(problem.discrete, found, first, wanted))
        return replace(found, problem=self.problem)

    def close(self) -> None:
        """Free every PETSc object."""
        for problem in filter(None, (self._tried, self._kept)):
            problem.close()

    def _release(self) -> None:
        """Free operators before the next are made: those that gave no solution, and large ones."""
        tried, kept = self._tried, self._kept
        if tried is not None and (tried is not kept or _is_large(tried.discrete)):
            tried.close()
            self._kept = None if tried is kept else kept
        self._tried = None

    def _report(self, solution: Solution) -> None:
        if self._reached is not None:
            nodes = sum(mesh.n_nodes for mesh in solution.meshes.values())
            seconds = time.perf_counter() - self._began
            self._reached(Reached(len(self.solutions), nodes, self.quantity.estimate, seconds))

    def _solved(self, level: Any) -> Solution:
        """The solution on the mesh of a level; again with more digits where compressed operators
        leave too few."""
        while True:
            may_be_tighter = self._tolerance > TIGHTEST
            try:
                solution = self._once(level)
            except InaccurateOperator:
                if not may_be_tighter:
                    raise
            else:
                if self.discrete is not None and _is_large(self.discrete):
                    release_memory()
                if not (
                    may_be_tighter
                    and solution.failed is not None
                    and self._is_too_loose(solution.failed)
                ):
                    return solution
            self._tolerance = max(TIGHTER * self._tolerance, TIGHTEST)

    def _is_too_loose(self, failed: StepResult) -> bool:
        """Whether an increment is not accepted for the tolerance of compressed operators."""
        compressed = self.discrete is not None and has_compressed(
            self.discrete.problem.bem, self.discrete.meshes
        )
        return (
            compressed
            and failed.status == "failed"
            and failed.residuals.get("elastic", 0.0) > self._tolerance
        )

    def _once(self, level: Any) -> Solution:
        """The solution on the mesh of a level."""
        self.missed = 0.0
        self._release()

        def make(number: int, one: Callable[[], Problem], boundary: Boundary) -> BoundaryMesh:
            made = self.quantity.mesh(number, one, boundary, level)
            self.missed = max(self.missed, made.missed)
            mesh: BoundaryMesh = made.mesh
            return mesh

        with answering(self.comm):
            self.discrete, self._tried = self._prepared(make)
        factors = (
            known_factors(self.solutions[-1], self.quantity.estimate) if self.solutions else {}
        )
        self._tried = problem = replace(
            self._tried, start=self.quantity.start(self._tried), factors=factors
        )
        solution = unreported(problem, self.monitor)
        if _is_large(self.discrete):
            solution = reported(problem, solution)
        return replace(solution, problem=self.problem)

    def _prepared(self, make: MeshMaker) -> tuple[Discrete, PreparedProblem]:
        """The problem on the meshes that are made for it, eliminated."""
        began = time.perf_counter()
        discrete = discretise(self.problem, make, self.law)
        largest = max(mesh.n_nodes for mesh in discrete.meshes)
        changes: dict[str, Any] = (
            {} if math.isnan(self._tolerance) else {"hmatrix_tol": self._tolerance}
        )
        if discrete.problem.bem.mat_type == "auto" and largest <= self.quantity.dense_nodes:
            changes["mat_type"] = "dense"
        bem, method = discrete.problem.bem.model_copy(update=changes), self.problem.method
        if self.solutions:  # where sets cycle there may be no solution
            needed = max((step.iterations for step in self.solutions[-1].steps), default=0)
            method = method.model_copy(
                update={"max_iterations": min(method.max_iterations, max(MOST, 10 * needed))}
            )
        discrete = replace(
            discrete, problem=self.problem.model_copy(update={"bem": bem, "method": method})
        )
        seconds = time.perf_counter() - began
        problem = prepare(discrete.problem, self.comm, discrete, announce=self._announce)
        problem.timings["mesh"] += seconds
        return discrete, problem


def _is_large(discrete: Discrete) -> bool:
    return sum(mesh.n_nodes for mesh in discrete.meshes) > MANY_NODES


def adapt(
    problem: Problem,
    accuracy: float | None = None,
    *,
    method: Any = None,
    rule: Any = None,
    law: Any = None,
    comm: Any = None,
    monitor: Monitor | None = None,
    announce: Announce | None = None,
    reached: Callable[[Reached], None] | None = None,
) -> Solution:
    """The solution with an estimated error below a wanted one, on meshes that follow it.

    Parameters
    ----------
    problem : Problem
        Of plane `[mesh]` tables only `graded_points` count; in space the first mesh is what they
        ask for. The meshes are found with semismooth Newton; the problem's own method, where it is
        another one, then solves on the last of them.
    accuracy : float, optional
        Wanted error, relative, L2 on the contact [-]: of u_t of one body in bilateral contact (by
        default the smallest `mesh.accuracy`, or 1e-4), else of p and q at the ends of all steps
        (1e-2); in space 2e-2.
    method, rule, law
        As in `solve`.
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default.
    monitor : callable, optional
        Called with the state so far after each iteration of each solve; a reason that it returns
        ends the solve there.
    announce : callable, optional
        As in `prepare`, on each mesh.
    reached : callable, optional
        Called with each mesh that has been solved on, and its estimate.

    Returns
    -------
    Solution
        Its `accuracy` says what was wanted and what is estimated.
        The status is "not converged" when the finest refinement level was not enough.

    Raises
    ------
    ValueError
        If the accuracy does not lie in (0, 1).
    InputError, SolverError
        As `solve`.
    """
    comm, began = comm if comm is not None else world(), time.perf_counter()
    work = AdaptiveSolve(problem, comm, monitor, law, announce, reached)
    given = [body.mesh.accuracy for body in problem.body if body.mesh.accuracy is not None]
    work.quantity.asked = accuracy is not None or bool(given)
    accuracy = min(given, default=work.quantity.accuracy) if accuracy is None else accuracy
    check_accuracy(accuracy)
    try:
        trouble, solution = work.climb(accuracy), work.last()
    finally:
        work.close()
    own = (
        rule is not None
        or method is not None
        or problem.method.resolved_name != "semismooth-newton"
    )
    if own and not trouble and solution.status == "converged" and work.discrete is not None:
        last = replace(work.discrete, problem=problem)
        prepared = prepare(problem, comm, last, method=method, rule=rule)
        try:
            solution = run(prepared, monitor=monitor)
        finally:
            prepared.close()
        work.left = work.quantity.apart(solution) if solution.converged else 0.0
    if (
        trouble and math.isinf(work.quantity.estimate) and not work.broken_off
    ):  # as of a mesh that the user fixed
        solution = with_estimate(solution, comm, law)
    return _finished(
        work, replace(solution, problem=problem), accuracy, trouble, time.perf_counter() - began
    )


def _finished(
    work: AdaptiveSolve, solution: Solution, accuracy: float, trouble: str, seconds: float
) -> Solution:
    quantity, shown = work.quantity, any(each.converged for each in work.solutions)
    estimate = max(quantity.estimate, work.left) if shown else math.inf
    if math.isinf(estimate) and solution.accuracy.is_known:
        estimate = solution.accuracy.error
    record = replace(
        solution.accuracy,
        wanted=accuracy,
        error=estimate if carries_something(solution) else solution.accuracy.error,
        differences=quantity.differences,
        elements=[sum(mesh.n_elements for mesh in each.meshes.values()) for each in work.solutions],
        **(quantity.shown() if shown else {}),
    )
    reason, findings = solution.reason, list[Finding]()
    if solution.converged:
        reached = short_of(estimate, accuracy, trouble, quantity, record.meshes_differ)
        findings = _shortcomings(work, solution, (estimate, accuracy), trouble, reached)
        status, reason = judged(findings, reason)
    else:
        status = solution.status
        if status == "not converged" and quantity.exhausted and not (shown or quantity.asked):
            reason += f"; {quantity.exhausted}"
    timings: dict[str, float] = {}
    for seconds_of in {
        id(each.timings): each.timings for each in (*work.solutions, solution)
    }.values():
        timings |= {name: timings.get(name, 0.0) + value for name, value in seconds_of.items()}
    timings["adapt"] = max(0.0, seconds - sum(timings.values()))
    solution = replace(solution, accuracy=record, status=status, reason=reason, timings=timings)
    return solution.with_findings(findings)


def _shortcomings(
    work: AdaptiveSolve,
    solution: Solution,
    errors: tuple[float, float],
    trouble: str,
    reached: str,
) -> list[Finding]:
    """Find what a converged solution lacks: data that no mesh resolves, digits of the problem's own
    method, or the accuracy wanted (`errors` are the estimate and that)."""
    quantity, (estimate, accuracy) = work.quantity, errors
    if work.missed > 0.0:
        text = f"no mesh resolves the given data: {work.missed:.1e} of them is missed"
        return [new_finding("missed data", text, measured=work.missed)]
    if quantity.estimate <= accuracy < estimate:
        text = (
            f"{solution.provenance.method} leaves an error of {work.left:.1e} on the last mesh, "
            f"which semismooth-newton solves to {quantity.estimate:.1e}"
        )
        return [new_finding("method error", text, measured=work.left, limit=accuracy)]
    if not estimate > accuracy:
        return []
    tolerable = estimate < USELESS and trouble and not (quantity.asked or work.broken_off)
    kind = "accuracy" if tolerable else "accuracy wanted"
    return [new_finding(kind, reached, measured=estimate, limit=accuracy)]
