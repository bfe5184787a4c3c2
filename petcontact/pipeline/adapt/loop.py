"""Adaptive solution: solve, estimate, mark, refine, repeat.

In the plane, meshes follow refinement levels. The error of each level is about a tenth of the one
before. A finer level has higher orders and a milder grading where the solution is smooth. It has
smaller elements of low order at corners and at edges of contact, stick and slip. The solution of
one level gives the positions of these edges, and is the start for the next level. The difference of
two levels is the error of the lower one. It is the estimate for the upper one, which is returned.

In space, panels are cut where the tails of their tractions are large. The tails are the estimate.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from ...contact.law_protocol import GivenLaw
from ...contact.methods.registry import GivenMethod
from ...contact.rho_rules import Rule
from ...errors import InputError, PetcontactError, SolverError
from ...given.posed import Posed
from ...model.case import checked_problem
from ...model.problem import Problem
from ...refinement.levels import check_accuracy
from ...results.report import Accuracy, Finding
from ...results.solution import Solution
from ...runtime.hints import demand_functions
from ...runtime.ranks import alone, shared_solve
from ...runtime.signals import BrokenOff, answering
from ...untyped import Comm
from ..eliminate import Announce
from ..judge.findings import judged, new_finding
from ..judge.first_panels import missed_curves
from ..pose.body_parts import check_parts
from ..run import described, prepare, reported, run, with_report
from ..steps.increment import Monitor
from ..steps.start import NAMES
from ..steps.step_loop import known_factors
from .budget import Callbacks, Reached, says_something, short_of
from .difference import apart_on_one_mesh
from .fixed_mesh import carries_something, with_estimate
from .halved_panels import HalvedPanels
from .level_solver import LevelSolver
from .slip_ladder import Slip
from .strategy import Estimate, Meshes, Strategy, Tried, Wanted
from .surfaces import PanelTails
from .traction_ladder import Tractions

LOG = logging.getLogger(__name__)
AFTER = "(on the mesh after the last)"
ENDED = "the adaptive solve was ended after mesh"


def strategy_for(posed: Posed, accuracy: float | None) -> Strategy[Any, Any]:
    """Return the strategy: for u_t of the paper's problem, else for p and q or u without contact,
    in space for their tails or for u.

    `accuracy` is what the user wants, None for the default.
    """
    kind: Any = HalvedPanels
    if posed.boundaries[0].dim == 2:
        kind = Slip if posed.kind == "bilateral" and not posed.twisted else Tractions
    elif posed.interfaces:
        kind = PanelTails
    wanted = Wanted(kind.accuracy if accuracy is None else accuracy, accuracy is not None)
    check_accuracy(wanted.accuracy)
    return cast(Strategy[Any, Any], kind(posed, wanted))


class AdaptiveSolve:
    """The loop over the meshes, and its results so far.

    Attributes
    ----------
    wanted : Wanted
    strategy : Strategy
    solver : LevelSolver
    solutions : list of Solution
        One solution for each mesh.
    estimate : Estimate or None
        What is known of the error of the last solution that was accepted.
    trouble : str
        Why a mesh could not be solved or made, or "".
    exhausted : str
        Why there are no finer meshes, if not for want of a finer level.
    missed : float
        Share of the given data that the last mesh misses beyond what is accepted, or 0 [-].
    left : float
        Relative difference between semismooth Newton and the problem's own method on the last mesh
        [-].
    broken_off : bool
        Whether a signal, a monitor or a failure ended the last solve.
    judging : float
        Wall seconds of the report and of other paths, without a solve in more increments.
    """

    def __init__(
        self,
        problem: Problem,
        comm: Comm,
        accuracy: float | None,
        callbacks: Callbacks = (None, None, None),
        law: GivenLaw | None = None,
    ) -> None:
        monitor, announce, self._reached = callbacks
        self._began, self._comm = time.perf_counter(), comm
        check_parts(problem, problem.boundaries)  # strategies look at parts before meshes do
        if problem.method.start not in NAMES:
            raise InputError(
                f"method.start: {problem.method.start!r} is on one mesh, and an adaptive solve "
                "begins on meshes of its own; name mesh.element_size, or leave it out"
            )
        self.strategy = strategy_for(problem.posed, accuracy)
        self.wanted = self.strategy.wanted
        self.solver = LevelSolver(problem, comm, monitor, law, announce)
        self.solver.aim(self.wanted.accuracy)
        self.solutions: list[Solution] = []
        self.estimate: Estimate | None = None
        self.trouble = self.exhausted = ""
        self.missed = self.left = 0.0
        self.broken_off = False
        self.judging = 0.0

    @property
    def error(self) -> float:
        """Estimated error of the last solution that was accepted, infinite before there is one
        [-]."""
        return math.inf if self.estimate is None else self.estimate.error

    def climb(self) -> None:
        """Solve, estimate, mark and refine until the estimate is below the accuracy.

        `trouble` says why a mesh could not be solved or made.
        """
        strategy = self.strategy
        with answering(self._comm):
            meshes: Meshes[Any] | None = strategy.meshes(strategy.first, 0)
        while meshes is not None and (tried := self._solved(meshes)):  # SOLVE
            solution, self.missed = tried.solution, meshes.missed
            if not solution.converged:
                meshes = self._after_failure(tried)
                continue
            self._keep(solution)
            self.estimate = strategy.estimate(tried, self.estimate)  # ESTIMATE
            self.solver.settle(self.solutions[-2:][0], self.estimate.of_before)
            self._report(solution)
            if self.missed > 0.0 or self.error <= self.wanted.accuracy:
                return
            marks = strategy.marks(self.estimate)  # MARK
            meshes = self._refined(marks, meshes.level + 1)  # REFINE

    def _refined(self, marks: Any, level: int) -> Meshes[Any] | None:
        """Return meshes of a level that follow marks, or None if there are no such meshes."""
        try:
            with answering(self._comm):
                meshes = self.strategy.meshes(marks, level)
        except (BrokenOff, InputError) as error:  # a mesh may be too large
            self._end(error)
            return None
        self.trouble = self.exhausted = meshes.exhausted
        return meshes if meshes.of_bodies else None

    def _solved(self, meshes: Meshes[Any]) -> Tried[Any] | None:
        """Return the solve on meshes, or None if it fails and there is one on meshes before."""
        last = self.solutions[-1] if self.solutions else None
        try:
            return self.solver.solved(meshes, last, self.error)
        except (SolverError, BrokenOff, InputError) as error:
            if last is None:
                raise
            self._end(error)
            return None

    def _end(self, error: PetcontactError) -> None:
        """Say why there is no further mesh."""
        self.broken_off, self.trouble = isinstance(error, BrokenOff), f"{error} {AFTER}"

    def _after_failure(self, tried: Tried[Any]) -> Meshes[Any] | None:
        """Return the meshes after a rejected solution, or None if it ends the loop.

        The solution on the mesh before is kept then, if there is one.
        """
        solution, meshes = tried.solution, None
        self.broken_off = solution.status == "failed" and bool(self.solutions)
        if not self.broken_off and not self.missed > 0.0:
            marks = self.strategy.marks_after_failure(tried, self.estimate)
            level = tried.meshes.level + 1
            meshes = None if marks is None else self._refined(marks, level)
        if meshes is None and (self.broken_off or self.estimate is not None):
            self.trouble = f"{solution.reason} {AFTER}"
        else:
            self._keep(solution)
        return meshes

    def _keep(self, solution: Solution) -> None:
        self.solutions.append(solution)
        self.solver.keep()

    def last(self) -> Solution:
        """Return the solution on the last mesh, with its full report."""
        problem, solution, began = self.solver.kept, self.solutions[-1], time.perf_counter()
        timings = solution.timings
        if problem is not None:
            first, wanted = self.solutions[0].meshes, self.wanted.accuracy
            if self.broken_off:  # a user who ends a solve does not wait
                solution = reported(problem, solution)
                accuracy = replace(solution.accuracy, path=math.nan)
                solution = replace(solution, accuracy=accuracy)
            else:
                solution = with_report(problem, solution, self.solver.coarse, wanted)
            missed = missed_curves(problem.discrete, solution, first, wanted)
            solution = solution.with_findings(missed)
        again = 0.0 if solution.timings is timings else solution.timings["iterate"]
        self.judging = time.perf_counter() - began - again
        steps = {"step": solution.problem.step}
        return replace(solution, problem=self.solver.problem.model_copy(update=steps))

    def _report(self, solution: Solution) -> None:
        nodes = sum(mesh.n_nodes for mesh in solution.meshes.values())
        seconds, error = time.perf_counter() - self._began, self.error
        number = len(self.solutions)
        LOG.info("mesh %d: %d nodes, error %.1e, %.1f s", number, nodes, error, seconds)
        if self._reached is not None:
            record = replace(solution.accuracy, wanted=self.wanted.accuracy, error=error)
            ended = replace(
                solution, accuracy=record, status="not converged", reason=f"{ENDED} {number}"
            )
            self._reached(Reached(number, nodes, error, seconds, ended))


def adapt(
    problem: Problem | str | Path,
    accuracy: float | None = None,
    *,
    method: GivenMethod | None = None,
    rule: Rule | None = None,
    law: GivenLaw | None = None,
    comm: Comm = None,
    monitor: Monitor | None = None,
    announce: Announce | None = None,
    reached: Callable[[Reached], None] | None = None,
) -> Solution:
    """Return a solution with an estimated error below a wanted one, on meshes that are refined for
    it.

    Parameters
    ----------
    problem : Problem, or path of a TOML file
        In 2D only `graded_points` of the `[mesh]` tables counts. In 3D these tables make the first
        mesh. Semismooth Newton solves on all meshes. Another method of the problem then
        solves on the last mesh.
    accuracy : float, optional
        Wanted relative L2 error on the contact [-]. For one body in bilateral contact it is the
        error of u_t; the default is the smallest `mesh.accuracy`, or 1e-4. Else it is that of p and
        q at the ends of all steps; the default is 1e-2, in 3D 2e-2.
    method, rule, law
        As in `solve`.
    comm : mpi4py.MPI.Comm or PETSc.Comm, optional
        As in `solve`.
    monitor : callable, optional
        Called with the state after each iteration of each solve. If it returns a reason, the solve
        ends.
    announce : callable, optional
        As in `solve`, on each mesh.
    reached : callable, optional
        Called with each finished mesh and its estimate.

    Returns
    -------
    Solution
        Its `accuracy` contains the wanted and the estimated error. The status is "not converged" if
        the finest refinement level was not enough.

    Raises
    ------
    ValueError
        If the accuracy does not lie in (0, 1).
    InputError, SolverError
        As `solve`.

    Examples
    --------
    >>> solution = adapt(load("block.toml"), 1e-3)
    >>> solution.accuracy.error < solution.accuracy.wanted  # relative [-]
    True
    """

    def call() -> Callable[[], Mapping[str, Any]]:
        nonlocal problem
        demand_functions(monitor=monitor, announce=announce, reached=reached)
        problem = checked_problem(problem)
        given = {"method": method, "rule": rule, "law": law, "accuracy": accuracy}
        return functools.partial(described, problem, **given)

    with shared_solve(comm, call) as comm:
        callbacks = monitor, alone(announce), alone(reached)
        assert isinstance(problem, Problem)
        return _adapted(problem, accuracy, method, rule, law, comm, callbacks)


def _adapted(
    problem: Problem,
    accuracy: float | None,
    method: GivenMethod | None,
    rule: Rule | None,
    law: GivenLaw | None,
    comm: Comm,
    callbacks: Callbacks,
) -> Solution:
    began = time.perf_counter()
    if accuracy is None:
        given = [body.mesh.accuracy for body in problem.body]
        accuracy = min((each for each in given if each is not None), default=None)
    work = AdaptiveSolve(problem, comm, accuracy, callbacks, law)
    with contextlib.closing(work.solver):
        work.climb()
        solution = work.last()
    problem = problem.model_copy(update={"step": solution.problem.step})
    own = (
        rule is not None
        or method is not None
        or problem.method.resolved_name != "semismooth-newton"
    )
    estimate, broken_off = work.estimate, work.broken_off
    if own and not broken_off and solution.converged and estimate is not None:
        exact = solution
        how = estimate.tried, known_factors(exact), comm, method, rule, callbacks[0]
        changes: dict[str, Any] = {"method": problem.method, "step": problem.step}
        solution = _by_its_method(changes, *how)
        if solution.converged:
            work.left = apart_on_one_mesh(exact, solution)
        # a tolerance that nobody gave is that which the accuracy needs, with a margin of 10
        if (
            work.error <= work.wanted.accuracy < work.left
            and "tolerance" not in problem.method.model_fields_set
        ):
            changes["method"] = problem.method.model_copy(
                update={
                    "tolerance": 0.1 * problem.method.tolerance * work.wanted.accuracy / work.left
                }
            )
            solution = _by_its_method(changes, *how)
            work.left = apart_on_one_mesh(exact, solution) if solution.converged else work.left
    if work.trouble and math.isinf(work.error) and not broken_off:
        # there is one mesh only: estimate as on a mesh that the user fixed
        solution = with_estimate(solution, comm, law)
    return _finished(work, replace(solution, problem=problem), time.perf_counter() - began)


def _by_its_method(
    changes: Mapping[str, Any],
    tried: Tried[Any],
    factors: dict[int, list[float]],
    comm: Comm,
    method: GivenMethod | None,
    rule: Rule | None,
    monitor: Monitor | None,
) -> Solution:
    """Solve on the last mesh, with increments that end where Newton's did: another path would be
    another problem. Operators have the tolerance that was found there."""
    last = replace(tried.discrete, problem=tried.discrete.problem.model_copy(update=changes))
    prepared = prepare(last.problem, comm, last, method=method, rule=rule)
    with contextlib.closing(prepared):
        return run(replace(prepared, factors=factors), monitor=monitor)


def _finished(work: AdaptiveSolve, solution: Solution, seconds: float) -> Solution:
    error = max(work.error, work.left)
    if math.isinf(error) and solution.accuracy.is_known:
        error = solution.accuracy.error
    record = _accuracy(work, solution, error)
    reason, findings = solution.reason, list[Finding]()
    if solution.converged:
        findings = [*_shortcomings(work, solution, error, record.meshes_differ)]
        status, reason = judged(findings, reason)
    else:
        status = solution.status
        if (
            status == "not converged"
            and work.exhausted
            and not (work.estimate or work.wanted.asked)
        ):
            reason += f"; {work.exhausted}"
    timings = {"judge": work.judging}
    for seconds_of in {
        id(solved.timings): solved.timings for solved in (*work.solutions, solution)
    }.values():
        timings |= {name: timings.get(name, 0.0) + value for name, value in seconds_of.items()}
    timings["adapt"] = max(0.0, seconds - sum(timings.values()))
    solution = replace(
        solution,
        accuracy=record,
        status=status,
        reason=reason,
        timings=timings,
    )
    return _with_others(work, solution).with_findings(findings)


def _accuracy(work: AdaptiveSolve, solution: Solution, error: float) -> Accuracy:
    """Return what is known of the errors of a solution."""
    estimate = work.estimate
    record = replace(
        solution.accuracy,
        wanted=work.wanted.accuracy,
        error=error if carries_something(solution) else solution.accuracy.error,
        elements=[
            sum(mesh.n_elements for mesh in solved.meshes.values()) for solved in work.solutions
        ],
        **(work.strategy.shown(estimate) if estimate else {}),
    )
    return replace(record, differences=estimate.differences) if estimate else record


def _with_others(work: AdaptiveSolve, solution: Solution) -> Solution:
    """Add to a solution those on coarser meshes, and the one on its own with their increments."""
    coarser, last = _before_last(work), work.solutions[-1]
    undivided = None
    if len(solution.steps) > len(last.steps):
        undivided = replace(last, accuracy=solution.accuracy, coarser=coarser)
    return replace(solution, coarser=coarser, undivided=undivided)


def _before_last(work: AdaptiveSolve) -> Solution | None:
    """Return the accepted solution on the mesh before the last, linked to the one before it, or
    None."""
    *before, last = work.solutions
    chain: Solution | None = None
    for solved in [solved for solved in before if solved.converged][-2:] if last.converged else []:
        chain = replace(solved, coarser=chain)
    return chain


def _shortcomings(
    work: AdaptiveSolve, solution: Solution, error: float, differ: str
) -> Iterator[Finding]:
    """Find what a converged solution lacks.

    It may miss given data, the problem's own method may be inaccurate, or its error may exceed the
    wanted accuracy. `differ` says where meshes differ most.
    """
    accuracy, trouble = work.wanted.accuracy, work.trouble
    if work.missed > 0.0:
        yield new_finding(
            "missed data",
            f"no mesh resolves the given data: {work.missed:.1e} of them is missed",
            advice="check expressions for values without a bound on their parts",
            measured=work.missed,
        )
    elif work.error <= accuracy < error:
        yield new_finding(
            "method error",
            f"{solution.provenance.method} leaves an error of {work.left:.1e} on the last mesh, "
            f"which semismooth-newton solves to {work.error:.1e}",
            measured=work.left,
            limit=accuracy,
        )
    elif error > accuracy:
        # the default may be missed with a warning, whoever wrote it
        usual = accuracy == work.strategy.accuracy and not work.broken_off
        tolerable = says_something(error) and trouble and usual
        text = trouble
        if not (trouble and work.wanted.asked) or work.exhausted:
            differences = work.estimate.differences if work.estimate else []
            text = short_of(error, work.wanted, trouble, differences, differ)
        kind = "accuracy" if tolerable else "accuracy wanted"
        yield new_finding(kind, text, measured=error, limit=accuracy)
