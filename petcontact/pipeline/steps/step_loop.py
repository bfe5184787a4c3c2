"""Load steps: one elimination, then one increment after another. The slip so far is the only
history."""

from __future__ import annotations

import itertools
import logging
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from ...bem.boundary_data import BoundaryData
from ...given.posed import Step
from ...results.records import StepResult
from ...results.solution import Solution
from ...round_off import WRITTEN
from ...runtime.signals import answering
from ..eliminate import MOST_NODES, eliminated
from ..pose.load_states import later_data
from .cycles import Row, later_cycles
from .diagnosis import is_unbalanced
from .halves import PATH_ERROR, Halves, touching
from .increment import Increment, Monitor
from .outcome import step_result
from .prepared import HALVINGS, PreparedProblem
from .sliding import up_to_sliding
from .stored_state import state_after
from .wear import Tried, with_wear

LOG = logging.getLogger(__name__)


def increments(
    problem: PreparedProblem,
    done: list[StepResult],
    monitor: Monitor | None,
    *,
    checked: bool = True,
    rows: list[Row] | None = None,
) -> Iterator[StepResult]:
    """Yield the result of one increment after another, from the end of those done.

    If a step is not reached, the last result is that of the increment that failed.

    Parameters
    ----------
    problem : PreparedProblem
    done : list of StepResult
        The increments that are solved already.
    monitor : Monitor or None
    checked : bool
        Whether the ends of steps get their elastic residual.
    rows : list of Row, optional
        The cycles that are done; more rows are added.
    """
    state, done, rows = state_after(problem, done), list(done), [] if rows is None else rows
    posed = problem.discrete.posed
    cycle = posed.cycle_steps
    for number, step in enumerate(problem.steps, 1):
        passed = bool(done) and number < done[-1].step
        reached = 1.0 if passed else _reached(number, done)
        solving: Iterable[Tried] = ()
        if reached < 1.0:
            problem = _from_step(problem, number, done)
            begun = (
                state_after(problem, [r for r in done if r.step < number])
                if reached > 0.0
                else state
            )
            increment = Increment(
                problem,
                step,
                number,
                problem.motions(number, begun),
                state,
                reached,
                origin=_origin(number, done),
                cycle=int(number in cycle),
            )
            solving = _step(increment, monitor)
        if number in cycle and number == cycle[-1] and not passed:
            solving = itertools.chain(solving, _cycled(problem, done, monitor, rows))
        for tried in solving:
            ends = tried[0].ends or not tried[1].converged
            result = step_result(*tried, checked=checked and ends)
            done.append(result)
            yield result
            if result.status != "converged":
                return
            state = tried[2]


def _reached(number: int, done: Sequence[StepResult]) -> float:
    """Return the share of a step that its increments have reached; 1 where they have ended it."""
    own = [result for result in done if result.step == number]
    return max((1.0 if result.ends else result.load_factor for result in own), default=0.0)


def _origin(number: int, done: Sequence[StepResult]) -> float | None:
    """Return where a step begins, if the one before ended before all its loads acted."""
    before = [r for r in done if r.step == number - 1][-1:]
    return number - 2 + before[0].load_factor if before and before[0].sliding else None


def _cycled(
    problem: PreparedProblem, done: list[StepResult], monitor: Monitor | None, rows: list[Row]
) -> Iterator[Tried]:
    """Solve the cycles that are left and yield the increments of the last one."""
    yield from later_cycles(problem, done, state_after(problem, done), monitor, rows)


class _Shares:
    """Load factors at which the increments of a step end: known ones, else the next by a share of
    the step, which is halved where an increment fails.

    Attributes
    ----------
    reached : float
        Load factor at which the next increment begins.
    known : list of float
        Load factors at which the next increments end.
    whole, size : float
        The largest share, and that of the next increment where no factor is known.
    halves : Halves, optional
        With `increments = "auto"`: how small an increment has to be.
    doubt : bool
        Whether a load may be one that contact cannot hold.
    lost : float
        Load factor of the last increment at which nothing stopped a body, else infinite.
    last : Tried, optional
        The last increment that was solved without halves.
    """

    def __init__(self, increment: Increment, monitor: Monitor | None) -> None:
        self.last: Tried | None = None
        self.lost = math.inf
        self.reached, self.whole = increment.target, _first_share(increment.step)
        self.halves = Halves(monitor) if increment.step.increments == "auto" else None
        factors = increment.problem.factors.get(increment.number, ())
        self.known = [factor for factor in factors if factor > self.reached]
        if self.halves and not self.known:
            first = touching(replace(increment, begun=self.reached))
            if first > self.reached + PATH_ERROR:
                self.known, self.whole = [first], 1.0 - first
        self.size, self.doubt = self.whole, _is_doubtful(increment)
        least = self.whole * 0.5**HALVINGS
        if self.doubt and is_unbalanced(increment.ending_at(self.reached + least)):
            # what contact can hold is convex: it holds no larger share of the step either
            self.known, self.size = [], least

    @property
    def target(self) -> float:
        """Load factor at which the next increment ends."""
        target = self.known[0] if self.known else min(1.0, self.reached + self.size)
        return 1.0 if 1.0 - target < WRITTEN else target

    @property
    def by_halves(self) -> Halves | None:
        """What solves the next increment by its halves, where that is asked for."""
        return None if self.known else self.halves

    def solved_before(self, increment: Increment) -> Tried | None:
        """Return the last increment if it is this one, which need not be solved again."""
        ends = increment.begun, increment.target
        same = self.last is not None and ends == (self.last[0].begun, self.last[0].target)
        return self.last if same else None

    def smaller(self, failed: Increment, tried: list[Tried]) -> bool:
        """Take a smaller share after an increment that failed; return whether there is one.

        It may be as small as an unheld load or halves that differ ask for, where nothing was
        tried.
        """
        if tried and tried[-1][1].unheld:
            self.lost = tried[-1][0].target
        self.doubt = self.doubt or not self.known
        if self.known:
            self.size, self.known = self.target - self.reached, []
            return True
        problem = failed.problem
        # with held normals and no steps a part of the load is solved for only where the whole load
        # has no equilibrium
        divisible = bool(problem.discrete.posed.steps) or not problem.discrete.holds_normals
        least = self.whole * 0.5 ** max(problem.halvings, HALVINGS * (not tried))
        half = 0.5 * (self.target - self.reached)
        if half < least or not (divisible or is_unbalanced(failed)):
            return False
        self.size = half
        return True

    def reach(self) -> None:
        """Go on from the end of the next increment; the one after it is larger, but does not go
        where nothing stopped a body."""
        self.reached, self.known = self.target, self.known[1:]
        self.size = min(self.whole, 2.0 * self.size)
        least = self.whole * 0.5**HALVINGS
        self.size = min(self.size, max(0.5 * (self.lost - self.reached), least))


def _is_doubtful(increment: Increment) -> bool:
    """Return whether the whole step cannot be held, as far as that costs less than a solve.

    The set of loads that contact can hold is convex: between two of them no load needs a test.
    """
    system = increment.problem.system
    jointly = any(body.is_solved_jointly for body in system.bodies)
    return (system.size <= MOST_NODES or jointly) and is_unbalanced(increment.ending_at(1.0))


def _step(increment: Increment, monitor: Monitor | None) -> Iterator[Tried]:
    """Yield the increments of a step, up to where a contact slips if the step ends there."""
    solving = _divided(increment, monitor)
    return up_to_sliding(solving, monitor) if increment.step.until else solving


def _divided(increment: Increment, monitor: Monitor | None) -> Iterator[Tried]:
    """Yield the increments of a step, from an increment of length zero at its start.

    Where it is known at which load factors the increments of "auto" end, they are solved without
    halves, until one of them fails.
    """
    state, shares = increment.before, _Shares(increment, monitor)
    while shares.reached < 1.0 - 1e-12:
        following = replace(increment, target=shares.target, begun=shares.reached, before=state)
        whole, tried = shares.solved_before(following), list[Tried]()
        if not (shares.doubt and is_unbalanced(following)):
            if shares.by_halves:
                tried = shares.by_halves(following)
            else:
                tried = [whole or with_wear(following, following.solved(monitor), monitor)]
                shares.last = tried[0]
        ends = tried and (tried[-1][1].converged or tried[-1][1].stopped)
        if not ends and shares.smaller(following, tried):
            continue
        tried = tried or [whole or with_wear(following, following.solved(monitor), monitor)]
        yield from tried
        state = tried[-1][2]
        end = shares.target, "converged" if tried[-1][1].converged else "failed"
        LOG.info("step %d (%s): load factor %g, %s", increment.number, increment.step.name, *end)
        shares.reach()


def first_increment(problem: PreparedProblem) -> Increment:
    """Return the first increment of the first step; with "auto" it is the whole step."""
    return whole_step(problem, 1).ending_at(_first_share(problem.steps[0]))


def _first_share(step: Step) -> float:
    """Return the share of a step that its first increment has."""
    return 1.0 if step.increments == "auto" else 1.0 / int(step.increments)


def known_factors(solution: Solution) -> dict[int, list[float]]:
    """Return the load factors at which the increments of steps ended that have several, or "auto",
    by number of the step."""
    return {
        number: [
            result.load_factor
            for result in solution.steps
            if result.step == number and result.cycle <= 1
        ]
        for number, step in enumerate(solution.posed.steps, 1)
        if step.increments == "auto" or step.is_divided
    }


def whole_step(problem: PreparedProblem, number: int) -> Increment:
    """Return step `number` (from 1) as one increment, from the loads of the step before to its
    own."""
    state, step = problem.begun(), problem.steps[number - 1]
    for earlier in range(1, number):
        for k, motion in enumerate(problem.motions(earlier, state)):
            state.positions[k], state.loads[k] = motion.position[1], motion.load[1]
    return Increment(problem, step, number, problem.motions(number, state), state, 1.0)


def _from_step(problem: PreparedProblem, number: int, done: list[StepResult]) -> PreparedProblem:
    """Return the problem from a step on, eliminated again if the step holds other components than
    the one before."""
    discrete = problem.discrete
    data = data_from(problem, number, done)
    if data is None:
        return problem
    discrete = replace(discrete, data=data)
    with answering(problem.comm):
        return replace(problem, discrete=discrete, system=eliminated(discrete, problem.comm))


def data_from(
    problem: PreparedProblem, number: int, done: Sequence[StepResult]
) -> list[BoundaryData] | None:
    """Return the boundary data of the bodies from a step on; None if the step holds the same
    components as the one before."""
    before, discrete = [result for result in done if result.step < number], problem.discrete
    if not before:
        return None
    ends = [before[-1].bodies[body.name] for body in discrete.posed.bodies]
    posed = discrete.posed.bodies, discrete.meshes, discrete.interfaces
    return later_data(*posed, number, discrete.data, [(end.u, end.traction) for end in ends])
