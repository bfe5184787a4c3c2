"""Load steps: one elimination, then one increment after another. The slip so far is the only
history."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...bem.boundary_data import BoundaryData
from ...errors import PetcontactError
from ...geometry.rotation import Axial, Motions
from ...model.cycle import cycle_steps
from ...model.load_steps import Step, changed_obstacle
from ...results.records import StepResult
from ...results.solution import Solution
from ...runtime.signals import answering
from ..eliminate import eliminated
from ..pose.load_states import later_data
from .cycles import Row, later_cycles
from .diagnosis import is_unbalanced
from .halves import Halves, touching
from .increment import HALVINGS, Increment, IncrementState, Monitor, ObstacleMotion, PreparedProblem
from .outcome import step_results
from .wear import Tried, with_wear

LOOKED_AT_FIRST = 1500
"""Largest number of contact nodes for which the linear program of equilibrium costs less than a
solve. It is then solved first, else only after a failure. A joint solve always costs more."""
SHOWN = 0.2
"""Largest estimated error of a solution whose increments are used again on a finer mesh."""
ROOM = 0.3
"""Path error, over the one allowed, up to which "auto" takes an increment twice as large next."""
LEAST = 1e-3
"""Smallest share of a step before contact begins that becomes an increment of its own."""
TOGETHER = 8
"""Number of increments whose boundary fields are computed in one product. Those that follow an
increment that is not accepted are solved in vain."""


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
    posed = problem.discrete.problem
    current, cycle = list(posed.obstacle), cycle_steps(posed)
    for number, step in enumerate(problem.steps, 1):
        current = [changed_obstacle(o, step) for o in current]
        passed = bool(done) and number < done[-1].step
        reached = max((r.load_factor for r in done if r.step == number), default=float(passed))
        solving: Iterable[Tried] = ()
        if reached < 1.0:
            problem = _from_step(problem, number, done)
            begun = (
                state_after(problem, [r for r in done if r.step < number])
                if reached > 0.0
                else state
            )
            motions = [
                ObstacleMotion.of(o, begun, k, problem.system.motions)
                for k, o in enumerate(current)
            ]
            increment = Increment(
                problem, step, number, motions, state, reached, cycle=1 if number in cycle else 0
            )
            solving = _step(increment, monitor)
        if number in cycle and number == cycle[-1] and not passed:
            solving = itertools.chain(solving, _cycled(problem, done, monitor, rows))
        for group in _grouped(solving, TOGETHER if problem.system.takes_several else 1):
            for result in step_results(group, checked=checked and _is_last(group[-1])):
                done.append(result)
                yield result
                if result.status != "converged":
                    return
            state = group[-1][2]


def _is_last(tried: Tried) -> bool:
    """Whether a step ends with this increment."""
    return not tried[1].converged or tried[0].target == 1.0


def _grouped(solving: Iterable[Tried], size: int) -> Iterator[list[Tried]]:
    """Yield increments in groups of at most `size`; an error is raised after the increments before
    it."""
    group = list[Tried]()
    try:
        for tried in solving:
            group.append(tried)
            if len(group) == size or _is_last(tried):
                yield group
                group = []
    except PetcontactError:
        if group:
            yield group
        raise


def _cycled(
    problem: PreparedProblem, done: list[StepResult], monitor: Monitor | None, rows: list[Row]
) -> Iterator[Tried]:
    """Solve the cycles that are left and yield the increments of the last one."""
    yield from later_cycles(problem, done, state_after(problem, done), monitor, rows)


def _step(increment: Increment, monitor: Monitor | None) -> Iterator[Tried]:
    """Yield the increments of a step, from an increment of length zero at its start.

    Where it is known at which load factors the increments of "auto" end, they are solved without
    halves, until one of them fails.
    """
    problem, step, reached = increment.problem, increment.step, increment.target
    known = [factor for factor in problem.factors.get(increment.number, ()) if factor > reached]
    # with held normals and no steps a part of the load is solved for only where the whole load has
    # no equilibrium
    divisible = bool(problem.discrete.problem.step) or not problem.discrete.holds_normals
    halves = Halves(monitor) if step.increments == "auto" else None
    whole = _first_share(step)
    if (
        halves
        and not known
        and (first := touching(replace(increment, begun=reached))) > reached + LEAST
    ):
        known, whole = [first], 1.0 - first
    state, end = increment.before, increment.to(1.0)
    # the set of loads that contact can hold is convex: between two of them no load needs a test
    costly = problem.system.size <= LOOKED_AT_FIRST or any(
        body.is_solved_jointly for body in problem.system.bodies
    )
    size, doubt = whole, costly and is_unbalanced(end)
    while reached < 1.0 - 1e-12:
        target = known[0] if known else min(1.0, reached + size)
        target = 1.0 if 1.0 - target < 1e-9 else target
        following = replace(increment, target=target, begun=reached, before=state)
        # an unheld load needs no solve
        halved = doubt and is_unbalanced(following)
        if halved:
            tried = None
        elif halves and not known:
            tried = halves(following)
            halved = halves.error > 1.0
        else:
            tried = _unless_failed(with_wear(following, following.solved(monitor), monitor))
        if tried is None and known:
            size, known = target - reached, []
            continue
        if tried is None:
            doubt = True
            size *= 0.5
            if size >= whole * 0.5 ** max(problem.halvings, HALVINGS * halved) and (
                divisible or is_unbalanced(following)
            ):
                continue
            tried = [with_wear(following, following.solved(monitor), monitor)]
            size *= 2.0
        yield from tried
        reached, state, known = target, tried[-1][2], known[1:]
        if halves is None or halves.error <= ROOM:
            size = min(whole, 2.0 * size)


def _unless_failed(tried: Tried) -> list[Tried] | None:
    """An increment; None where it failed."""
    return [tried] if tried[1].converged or tried[1].stopped else None


def first_increment(problem: PreparedProblem) -> Increment:
    """Return the first increment of the first step; with "auto" it is the whole step."""
    return whole_step(problem, 1).to(_first_share(problem.steps[0]))


def _first_share(step: Step) -> float:
    """Return the share of a step that its first increment has."""
    return 1.0 if step.increments == "auto" else 1.0 / int(step.increments)


def known_factors(solution: Solution, estimate: float) -> dict[int, list[float]]:
    """Return the load factors at which the increments of "auto" ended, by number of the step.

    There are none where the error of the solution is too large to trust them on another mesh.
    """
    steps = solution.problem.step if estimate <= SHOWN else ()
    return {
        number: [
            result.load_factor
            for result in solution.steps
            if result.step == number and result.cycle <= 1
        ]
        for number, step in enumerate(steps, 1)
        if step.increments == "auto"
    }


def whole_step(problem: PreparedProblem, number: int) -> Increment:
    """Return step `number` (from 1) as one increment, from the loads of the step before to its
    own."""
    state, step, places = problem.begun(), problem.steps[number - 1], problem.system.motions
    obstacles = list(problem.discrete.problem.obstacle)
    for each in problem.steps[:number]:
        motions = [
            ObstacleMotion.of(changed_obstacle(o, each), state, k, places)
            for k, o in enumerate(obstacles)
        ]
        obstacles = [changed_obstacle(o, each) for o in obstacles]
        if each is not step and motions:
            positions, loads = (
                np.array([getattr(m, key)[1] for m in motions]) for key in ("position", "load")
            )
            state = replace(state, positions=positions, loads=loads)
    return Increment(problem, step, number, motions, state, 1.0)


def state_after(problem: PreparedProblem, done: list[StepResult]) -> IncrementState:
    """Return the state after the last increment, or the unloaded state if there is none."""
    system = problem.system
    if not done:
        return problem.begun()
    pairs = [done[-1].pairs[face.name] for face in system.interfaces]
    slip, v = (
        np.concatenate([getattr(pair, key) for pair in pairs]) for key in ("slip", "slip_increment")
    )
    sigma = np.concatenate([pair.sigma_t for pair in pairs])
    if system.k == system.components:
        gap = np.concatenate([pair.gap for pair in pairs])
        v = np.column_stack([v, -np.where(np.isfinite(gap), gap, 0.0)])
        sigma = np.column_stack([sigma, -np.concatenate([pair.pressure for pair in pairs])])
    places = [done[-1].obstacles[o.name] for o in problem.discrete.problem.obstacle]
    worn = [np.zeros(len(pair.x)) if pair.wear is None else pair.wear.sum(axis=1) for pair in pairs]
    return IncrementState(
        slip,
        (v, sigma),
        done[-1].alpha,
        _each([(place.displacement, place.rotation) for place in places], system.motions),
        _each([(place.force, place.moment) for place in places], system.motions),
        sigma,
        np.concatenate(worn),
    )


def _each(vectors: Sequence[tuple[Array, Axial]], motions: Motions) -> Array:
    """Return the components (o, q) of the vectors and axial vectors of obstacles."""
    rows = [np.hstack(pair)[: motions.components] for pair in vectors]
    return np.array(rows).reshape(len(rows), motions.components)


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
    ends = [before[-1].bodies[body.name] for body in discrete.problem.body]
    posed = discrete.problem, discrete.meshes, discrete.interfaces
    return later_data(*posed, number, discrete.data, [(end.u, end.traction) for end in ends])
