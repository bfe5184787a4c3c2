"""Cycles of wear: a range of load steps again and again, many cycles at once where p changes
slowly.

A jump over N > 1 cycles is one cycle whose increments wear as much as N cycles do, and slip as far
as those of the cycle before. A jump of one cycle is solved like steps that are written out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array
from ...contact.friction_law import contact_norm
from ...results.records import StepResult, WearHistory
from ...round_off import TINY
from .increment import Increment, Monitor
from .prepared import IncrementState, PreparedProblem
from .wear import Earlier, Tried, with_wear, worn

GROWTH = 2.0
"""Largest ratio of a jump to the one before it. Without it worn depths of one of three random tools
(scripts/verify_paths --seed 11, cycles with jumps "auto") were off by 0.19, not by 0.14."""
AIM = 0.8
"""Change of p that a jump aims at, over the tolerance. With 1 worn depths of one of these tools
were off by 0.16, not by 0.07."""
GONE = 1e-2
"""Pressure, relative to the largest so far, below which the wear that it causes does not count.
With 0 one of these tools took 24 jumps, not 16."""
Row = tuple[int, Array, Array]
"""The number of cycles done, and p [stress] and the worn depth [length] at that time, (M,) each."""


def later_cycles(
    problem: PreparedProblem,
    done: list[StepResult],
    state: IncrementState,
    monitor: Monitor | None,
    rows: list[Row],
) -> Iterator[Tried]:
    """Solve the remaining cycles; yield the increments of the last one, or of one that fails.

    Parameters
    ----------
    problem : PreparedProblem
    done : list of StepResult
        The increments up to the end of a cycle.
    state : IncrementState
        The state at the end of that cycle.
    monitor : Monitor or None
    rows : list of Row
        One row is added for each jump.
    """
    cycle = problem.discrete.posed.cycle
    assert cycle is not None
    if not rows:
        rows.append(_row(done[-1].cycle, state))
    size, earlier, passed = 1, list[Earlier](), list[Tried]()
    while (reached := rows[-1][0]) < cycle.count:
        prescribed = [end for end in problem.factors.get(0, ()) if end > reached]
        jump = int(prescribed[0]) - reached if prescribed else min(size, cycle.count - reached)
        tried, following = _one_cycle(problem, done, state, reached + jump, jump, earlier, monitor)
        if not tried[-1][1].converged:
            if jump > 1 and not (prescribed or tried[-1][1].stopped):
                size = max(1, jump // 2)
                continue
            passed += tried
            break
        row = _row(reached + jump, tried[-1][2])
        change = _change(problem, rows, row) / cycle.tolerance
        if cycle.jump == "auto":
            if change > 1.0 and jump > 1:
                size = max(1, int(jump * AIM / change))
                continue
            size = max(1, int(jump * min(GROWTH, AIM / max(change, TINY))))
        else:
            size = cycle.jump
        state, earlier, passed = tried[-1][2], following, tried
        rows.append(row)
    yield from passed


def _one_cycle(
    problem: PreparedProblem,
    done: list[StepResult],
    state: IncrementState,
    number: int,
    times: int,
    earlier: list[Earlier],
    monitor: Monitor | None,
) -> tuple[list[Tried], list[Earlier]]:
    """Solve one cycle that wears as much as `times` cycles do.

    Return its increments, up to the first that fails, and what the next cycle needs to know of
    each.
    """
    posed, tried, following = problem.discrete.posed, list[Tried](), list[Earlier]()
    steps = posed.cycle_steps
    for s in steps:
        motions, origin = problem.motions(s, state), steps[-1] if s == steps[0] else None
        step = posed.steps[s - 1]
        increment = Increment(problem, step, s, motions, state, 0.0, origin=origin, cycle=number)
        for target in (r.load_factor for r in done if r.step == s and r.cycle == 1):
            increment = increment.then(target, state)
            if earlier and times > 1:
                solved, next_ = worn(increment, earlier[len(tried)], times, monitor)
            else:
                solved = with_wear(increment, increment.solved(monitor), monitor)
                v, sigma = solved[1].v, solved[1].sigma
                next_ = Earlier(
                    np.linalg.norm(v[:, : problem.system.components - 1], axis=1),
                    ((v, sigma), (v, sigma)),
                )
            tried.append(solved)
            following.append(next_)
            state = solved[2]
            if not solved[1].converged:
                return tried, following
    return tried, following


def _row(cycle: int, state: IncrementState) -> Row:
    return cycle, 0.0 - state.sigma[:, -1], state.worn


def wear_history(problem: PreparedProblem, rows: list[Row]) -> WearHistory | None:
    """Return the rows by interface, or None where there are none."""
    if not rows:
        return None
    system = problem.system
    wears = [s.law.wear_coefficient is not None for s in problem.discrete.sides]
    parts = [
        (face.name, where)
        for face, where, wear in zip(system.interfaces, system.slices, wears, strict=True)
        if wear
    ]
    cycle, pressure, depth = zip(*rows, strict=True)
    histories = [
        {name: np.array(values)[:, where] for name, where in parts} for values in (pressure, depth)
    ]
    return WearHistory(np.array(cycle), *histories)


def rows_of(problem: PreparedProblem, wear: WearHistory | None, last: int) -> list[Row]:
    """Return the rows of a result file, up to cycle `last`."""
    if wear is None:
        return []
    zero = {
        face.name: np.zeros((len(wear.cycle), len(face.nodes)))
        for face in problem.system.interfaces
    }
    pressure, depth = (
        np.concatenate([{**zero, **values}[name] for name in zero], axis=1)
        for values in (wear.pressure, wear.depth)
    )
    return [
        (int(c), p, h) for c, p, h in zip(wear.cycle, pressure, depth, strict=True) if c <= last
    ]


def _change(problem: PreparedProblem, rows: list[Row], new: Row) -> float:
    """Return the change of p in L2, relative to p, where the contact wears.

    It is relative to `GONE` times the largest p so far where p is smaller than that.
    """
    weight = np.where(problem.discrete.wear > 0.0, problem.system.weight, 0.0)
    size = max(
        contact_norm(new[1][:, None], weight),
        GONE * max(contact_norm(row[1][:, None], weight) for row in rows),
    )
    return contact_norm((new[1] - rows[-1][1])[:, None], weight) / size if size > 0.0 else 0.0
