"""Solves on the meshes of an adaptive loop, one after another."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.spatial

from ...arrays import Array
from ...contact.law_protocol import OPEN, GivenLaw
from ...contact.state import ContactState
from ...errors import InaccurateOperator
from ...model.problem import Problem
from ...results.records import StepResult
from ...results.solution import Solution
from ...runtime.memory import release_memory
from ...runtime.signals import answering, limited
from ...runtime.terminal import SOON, processor_time
from ...untyped import Comm
from ..choice import TIGHTEST, USUAL, Newton, chosen_tolerance, has_compressed
from ..eliminate import Announce, Progress, silent
from ..judge.thickness import compactness
from ..pose.discretise import Discrete, discretise
from ..run import RESOLVED, Coarse, prepare, reported, unreported
from ..steps.increment import Monitor
from ..steps.prepared import PreparedProblem
from ..steps.start import starts_from
from ..steps.step_loop import known_factors
from .budget import says_something
from .fixed_mesh import FEW, MOST_ITERATIONS, by_newton
from .strategy import M, Meshes, Tried

TIGHTER = 0.25
"""Factor on the compression tolerance after a solution that is not accurate enough [-]."""
OVER = 4
"""Times the announced processor time after which a mesh is given up for the one before it."""


class LevelSolver:
    """Solver on successive meshes by semismooth Newton; it tightens compressed operators as needed.

    Attributes
    ----------
    problem : Problem
        The problem, with the method for intermediate meshes.
    kept : PreparedProblem or None
        The prepared problem of the last solution that was kept.
    coarse : Coarse, optional
        The problem and the solution of a mesh before, if it is small and resolves the contact.
    """

    def __init__(
        self,
        problem: Problem,
        comm: Comm,
        monitor: Monitor | None,
        law: GivenLaw | None,
        announce: Announce | None = None,
    ) -> None:
        self.problem = by_newton(problem)
        self._comm, self._monitor, self._law, self._announce = comm, monitor, law, announce
        self._due, self._late = math.inf, ""
        self._aimed = self._tolerance = math.nan
        self._needed = 0.0
        self._tried: PreparedProblem | None = None
        self._before: PreparedProblem | None = None
        self.kept: PreparedProblem | None = None
        self.coarse: Coarse | None = None

    def _announced(
        self,
        limit: Callable[[float, str], None],
        more: float,
        nodes: int,
        unknowns: int,
        seconds: float,
        memory: float,
    ) -> Progress:
        """Announce a mesh with one before it, and limit its time, which is `more` times as long
        where the number of increments is known from that."""
        told = max(more * seconds, SOON)
        self._due = processor_time() + OVER * told
        self._late = f"{OVER} times the announced {told:.0f} s of processor time are over"
        limit(OVER * told, self._late)
        return (
            silent if self._announce is None else self._announce(nodes, unknowns, seconds, memory)
        )

    def _watch(self, state: ContactState) -> str | None:
        """Return why a mesh with one before it ends, or what the monitor says."""
        if processor_time() > self._due:
            return self._late
        return None if self._monitor is None else self._monitor(state)

    def aim(self, accuracy: float) -> None:
        """Choose the tolerance of compressed operators for a wanted accuracy."""
        self._aimed = self._tolerance = chosen_tolerance(self.problem.bem, accuracy)

    def keep(self) -> None:
        """Keep the operators of the last solution, and those of the one before until `settle`."""
        self._free(self._before)
        self._before, self.kept = self.kept, self._tried

    def settle(self, before: Solution, error: float) -> None:
        """Keep the operators of the solution before as `coarse` if its estimated error is small
        enough, and free them otherwise."""
        unused = self._before
        if self._before is not None and error <= RESOLVED:
            unused = self.coarse and self.coarse[0]
            self.coarse = self._before, before
        self._free(unused)
        self._before = None

    def close(self) -> None:
        """Free every PETSc object."""
        for problem in (self._tried, self.kept, self._before, self.coarse and self.coarse[0]):
            self._free(problem)

    @staticmethod
    def _free(problem: PreparedProblem | None) -> None:
        if problem is not None:
            problem.close()

    def solved(self, meshes: Meshes[M], last: Solution | None, error: float) -> Tried[M]:
        """Return the solve on meshes; `last` is the solution on the meshes before, with its
        estimated error.

        The tolerance of compressed operators is smaller for bodies that bend. The solve is repeated
        with a smaller one while they are too inaccurate for the first one.
        """
        if last is not None:
            tolerance = self._aimed * compactness(last)
            self._tolerance = max(min(self._tolerance, tolerance), TIGHTEST)
        self._needed = 0.0
        while True:
            may_be_tighter = self._tolerance > TIGHTEST
            try:
                tried = self._once(meshes, last, error)
            except InaccurateOperator:
                if not may_be_tighter:
                    raise
            else:
                if _is_large(tried.discrete):
                    release_memory()
                failed = tried.solution.failed
                if not (may_be_tighter and failed and self._is_too_loose(tried.discrete, failed)):
                    return tried
            self._needed = self._needed or self._tolerance
            self._tolerance = max(TIGHTER * self._tolerance, TIGHTEST)

    def _is_too_loose(self, discrete: Discrete, failed: StepResult) -> bool:
        """Return whether an increment failed because of the compression tolerance."""
        return (
            has_compressed(discrete.posed.bem, discrete.meshes)
            and failed.status == "failed"
            and failed.residuals.get("elastic", 0.0) > self._tolerance
        )

    def _once(self, meshes: Meshes[M], last: Solution | None, error: float) -> Tried[M]:
        """Return the solve on meshes, with the current tolerance."""
        self._release()
        with answering(self._comm), limited(self._comm) as limit:
            discrete, self._tried = self._prepared(meshes, last, limit)
        problem = replace(self._tried, start=meshes.start(self._tried), needed=self._needed)
        if last is not None:
            factors = known_factors(last) if says_something(error) else {}
            # once: each try that fails costs as much as the whole mesh
            starts = starts_from(problem, last.steps[1:])
            problem = replace(problem, starts=starts, factors=factors, halvings=1)
        self._tried = problem
        solution = unreported(problem, self._watch)
        if _is_large(discrete):
            solution = reported(problem, solution)
        return Tried(meshes, discrete, replace(solution, problem=self.problem))

    def _prepared(
        self, meshes: Meshes[M], last: Solution | None, limit: Callable[[float, str], None]
    ) -> tuple[Discrete, PreparedProblem]:
        """Return the problem on new meshes, and the same after the elimination."""
        began = time.perf_counter()
        discrete = discretise(self.problem, lambda b, *_: meshes.of_bodies[b], self._law)
        changes = {} if math.isnan(self._tolerance) else {"hmatrix_tol": self._tolerance}
        bem, method = discrete.posed.bem.model_copy(update=changes), self.problem.method
        if last is not None:  # contact sets may cycle without end
            needed = max((step.iterations for step in last.steps), default=0)
            method = method.model_copy(
                update={
                    "max_iterations": min(method.max_iterations, max(MOST_ITERATIONS, 10 * needed))
                }
            )
        discrete = replace(
            discrete, problem=self.problem.model_copy(update={"bem": bem, "method": method})
        )
        seconds, announce = time.perf_counter() - began, self._announce
        if last is not None:
            announce = partial(self._announced, limit, _unnamed(last))
        problem = prepare(
            discrete.problem,
            self._comm,
            discrete,
            announce=announce,
            newton=USUAL if last is None else _steps_of(last, discrete),
        )
        problem.timings["mesh"] += seconds
        return discrete, problem

    def _release(self) -> None:
        """Free operators without a kept solution, and large ones, before the next mesh."""
        tried, kept = self._tried, self.kept
        if tried is not None and (tried is not kept or _is_large(tried.discrete)):
            tried.close()
            self.kept = None if tried is kept else kept
        self._tried = None


def _steps_of(solution: Solution, discrete: Discrete) -> Newton:
    """Return what the increments of a solution have taken, and the share of the nodes of another
    mesh that lie nearest to closed ones."""
    if not (solution.steps and discrete.interfaces):
        return USUAL
    closed = list[Array]()
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        pairs = [step.pairs[side.name] for step in solution.steps]
        nodes = discrete.meshes[interface.body].x[interface.nodes]
        near = scipy.spatial.cKDTree(pairs[0].x).query(nodes)[1]
        closed.append(np.array([pair.state[near] != OPEN for pair in pairs]))
    share = np.hstack(closed).mean(axis=1)
    steps = [max(step.iterations, 1) for step in solution.steps]
    # of increments the operations count, which are as the cube of what is closed
    mean = float(np.average(share**3, weights=steps) ** (1.0 / 3.0))
    return Newton(float(np.mean(steps)), mean)


def _unnamed(last: Solution) -> float:
    """Return how many increments each step had, where their number is not given; else 1."""
    steps = last.posed.steps
    given = all(step.increments != "auto" for step in steps)
    return 1.0 if given else len(last.steps) / len(steps)


def _is_large(discrete: Discrete) -> bool:
    """Return whether a mesh gets its report at once, and its operators are freed before the next
    mesh.

    The operators take several GB together. A mesh that is cheap to solve again gets a report only
    if it is the last.
    """
    return sum(mesh.n_nodes for mesh in discrete.meshes) > FEW
