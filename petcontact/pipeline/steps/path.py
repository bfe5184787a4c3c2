"""How much friction and wear at the end of a step depend on its number of increments.

An increment takes all tangential motion of a node for slip in contact, whenever in the increment
the node touches. Friction is otherwise of the first order in the size of the increments, and wear
of the second. So what a number of increments leaves is about what half as many differ by.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...contact.friction_law import contact_norm
from ...contact.law_protocol import OPEN
from ...model.load_steps import changed_obstacle
from ...results.records import StepResult
from ...results.report import Finding
from ...results.solution import Solution
from ...round_off import SOLVED
from ..judge.findings import limit_of, new_finding
from .halves import PATH_ERROR, touching
from .increment import Increment, ObstacleMotion, PreparedProblem
from .load_steps import data_from, state_after
from .wear import with_wear

CARRIES = 1e-3
"""Shear over pressure, in L2, from which on the path is looked at: an error of it that is a tenth
as large is below all that is wanted of meshes."""
MOST, PATIENT = 2000, 10
"""Contact nodes and iterations of a step up to which it is looked at with bodies on H-matrices:
there it costs as much as the step."""


def path_errors(problem: PreparedProblem, solution: Solution) -> tuple[float, list[Finding]]:
    """The error that increments leave in p and q at the ends of steps, over p in L2, of the worst
    step in which a contact with friction grows or wears; and findings of it. Increments that the
    path chose leave what `Halves` allows.

    One increment is compared with two, more with half as many, each started from its own solution.
    Where contact begins on the way those before do not count. The error is 0 where the path does
    not matter, and nan where one of the two is not solved.
    """
    findings, worst = list[Finding](), _of_chosen(problem, solution)
    for ends, whole in _growing(problem, solution.steps if solution.converged else []):
        begins = touching(whole)
        later = _after(begins, ends)
        count = 2 if later == 1 else later // 2
        change, share = _differences(problem, ends, whole, begins, count)
        worst = share if math.isnan(share) else max(worst, share)
        if share > limit_of("path"):
            name = "p and q differ" if problem.discrete.wear.any() else "q differs"
            what = f"step {whole.name!r}" if problem.discrete.problem.step else "the load"
            touch = " after the bodies touch" if begins else ""
            text = (
                f"{what} depends on the path: {name} by {change:.0%} ({share:.0%} of p) "
                f"between {len(ends)} and {count} increments{touch}"
            )
            advice = (
                f"if all loads grow together, {_auto(problem)}; if they really come one after "
                "the other, give each a [[step]], which is another path"
            )
            findings.append(new_finding("path", text, advice=advice, measured=share))
    return worst, findings


def _of_chosen(problem: PreparedProblem, solution: Solution) -> float:
    """What increments leave where the path chose them: more than one in a step."""
    many = {result.step for result in solution.steps if result.load_factor < 1.0}
    chosen = any(problem.steps[number - 1].increments == "auto" for number in many)
    return PATH_ERROR if chosen else 0.0


def _auto(problem: PreparedProblem) -> str:
    """Advice to let the path choose the increments."""
    interfaces = problem.discrete.sides
    turning = any(i.direction is None and i.law.gap == "geometry" for i in interfaces)
    along = "; round bodies need the direction of approach of their pair for it"
    return f'take [[step]] increments = "auto"{along if turning else ""}'


def _after(begins: float, ends: Sequence[StepResult]) -> int:
    """How many increments end after contact begins."""
    return sum(end.load_factor > begins + SOLVED for end in ends)


def _growing(
    problem: PreparedProblem, results: Sequence[StepResult]
) -> Iterator[tuple[list[StepResult], Increment]]:
    """The results of steps in which nodes with a gap close that carry friction, or that wear, and
    the step in one."""
    system, obstacles = problem.system, list(problem.discrete.problem.obstacle)
    jointly = any(body.is_solved_jointly for body in system.bodies)
    looks = system.k == system.components and not (jointly and system.size > MOST)
    for number, step in enumerate(problem.steps if looks else (), 1):
        obstacles = [changed_obstacle(o, step) for o in obstacles]
        once = [result for result in results if result.cycle <= 1]
        before, own = [r for r in once if r.step < number], [r for r in once if r.step == number]
        if jointly and sum(r.iterations for r in own) > PATIENT:
            continue
        if step.increments == "auto" or not own or not _grows(problem, [*before[-1:], own[-1]]):
            continue
        if any(data_from(problem, earlier, before) is not None for earlier in range(2, number + 1)):
            return  # bodies are held in another way than those of the first step
        begun = state_after(problem, before)
        motions = [ObstacleMotion.of(o, begun, k, system.motions) for k, o in enumerate(obstacles)]
        whole = Increment(problem, step, number, motions, begun, 1.0)
        if _after(touching(whole), own):
            yield own, whole


def _grows(problem: PreparedProblem, ends: Sequence[StepResult]) -> bool:
    """Whether nodes with a gap that are open at the first of some ends are not at the last, in a
    contact with friction; or something wears."""
    if problem.discrete.wear.any():
        return True
    friction = pressure = 0.0
    for face in problem.system.interfaces:
        first, pair = ends[0].pairs[face.name], ends[-1].pairs[face.name]
        opened = (first.state == OPEN) | (first is pair)
        closes = np.isfinite(face.gap) & (face.gap != 0.0) & opened & (pair.state != OPEN)
        friction += float(closes.any() * (pair.weight @ np.sum(pair.sigma_t**2, axis=1)))
        pressure += float(pair.weight @ pair.pressure**2)
    return friction > CARRIES**2 * pressure


def _differences(
    problem: PreparedProblem, ends: list[StepResult], whole: Increment, begins: float, count: int
) -> tuple[float, float]:
    """How much q, with wear p and q, at the end of a step differ from those after another number of
    increments from where contact begins, over themselves and over p, in L2; nan where one of them
    fails."""
    state, reached = whole.before, 0.0
    last = state_after(problem, ends)
    for target in np.append(
        [begins] if begins else [], begins + (1.0 - begins) * np.arange(1, count + 1) / count
    ):
        near = [r for r in ends if abs(r.load_factor - target) < SOLVED]
        near_to, share = (state_after(problem, near), 1.0) if near else (last, target)
        assert near_to.start is not None
        v, sigma = near_to.start
        start = share * v, share * sigma + (1.0 - share) * whole.before.sigma
        state = replace(state, start=start, trend=None)
        part = replace(whole, target=target, begun=reached, before=state)
        _, outcome, state = with_wear(part, part.solved(), None)
        if not outcome.converged:
            return math.nan, math.nan
        reached = target
    return _shares(problem, outcome.sigma - last.sigma, last.sigma)


def _shares(problem: PreparedProblem, change: Array, sigma: Array) -> tuple[float, float]:
    """A change of q, with wear of p and q, over these and over p, in L2."""
    weight, tangential = problem.system.weight, problem.system.components - 1
    kept = slice(None if problem.discrete.wear.any() else tangential)
    parts = (change[:, kept], sigma[:, kept], sigma[:, tangential:])
    differs, size, p = (contact_norm(part, weight) for part in parts)
    return (differs / size, differs / p) if size * p > 0.0 else (0.0, 0.0)
