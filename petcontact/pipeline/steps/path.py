"""How much friction and wear depend on the number of increments, and of jumps over cycles.

The steps are solved again with half as many increments, and cycles with half as many jumps. Where a
step has one increment, or cycles have one jump, they are then solved with two; so are all where
half as many have no solution.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...arrays import Array
from ...contact.friction_law import contact_norm
from ...contact.law_protocol import friction_bound
from ...errors import SolverError
from ...results.data import SolutionData
from ...results.records import StepResult
from ...results.solution import Solution
from ...round_off import SOLVED
from ...runtime.petsc import options
from ...runtime.signals import BrokenOff
from ..judge.findings import limit_of, new_finding
from .cycles import Row, wear_history
from .halves import touching
from .increment import PreparedProblem
from .load_steps import increments, state_after, whole_step

CARRIES = 1e-3
"""Shear over pressure, in L2, from which on the path is looked at: an error of it that is a tenth
as large is below all that is wanted of meshes."""
MOST = 2000
"""Contact nodes up to which it is looked at with bodies on H-matrices, where a step costs more than
the assembly of the bodies."""
FEWER, MORE = 1.0 / (2.0**0.5 - 1.0), 1.0 / (1.0 - 0.5**0.5)
"""The error of a solution over what it differs by from one with half, and twice, as many
increments, where it falls like √h at least: of a contact that grows from a point the first
increment takes a share √h, and what it leaves there stays."""
ADVICE = (
    'take more [[step]] increments, or "auto", and in cycles a smaller jump; loads that really '
    "come one after the other need a [[step]] each, which is another path"
)


def with_paths(problem: PreparedProblem, solution: Solution, wanted: float | None) -> Solution:
    """A solution with those on other paths, the error that its increments leave in p and q at the
    ends of steps, over p in L2, and a finding where it is larger than a wanted accuracy.

    The error is 0 where the path does not matter, and nan where others are not solved.
    """
    number = _first_that_matters(problem, solution)
    if number is None:
        return solution
    jointly = any(body.is_solved_jointly for body in problem.system.bodies)
    with options(problem.discrete.problem.petsc):
        costly = jointly and problem.system.size > MOST
        paths = None if costly else _other_paths(problem, solution, number)
    solution = replace(solution, paths=paths or ())
    error, text = (np.nan, "") if paths is None else _largest(problem, solution, number)
    limit = wanted or limit_of("path")
    large = [new_finding("path", text, advice=ADVICE, measured=error, limit=limit)]
    solution = replace(solution, accuracy=replace(solution.accuracy, path=error))
    return solution.with_findings(large if error > limit else [])


def _largest(problem: PreparedProblem, solution: Solution, number: int) -> tuple[float, str]:
    """Of `_change` at the ends of steps from one on, those that all paths have."""
    there = {(each.step, each.cycle) for each in solution.paths[0][1].steps}
    ends = {at: each for each in solution.steps if (at := (each.step, each.cycle)) in there}
    return max(_change(problem, solution, end) for at, end in ends.items() if at[0] >= number)


def _first_that_matters(problem: PreparedProblem, solution: Solution) -> int | None:
    """The first step in which something wears, or in which friction carries what is not in
    proportion to the loads from the unloaded state on; None where there is none."""
    system, law, wears = problem.system, problem.discrete.law, problem.discrete.wear.any()
    if system.k < system.components or not solution.converged:
        return None
    gap = np.where(np.isfinite(system.gap), system.gap, 0.0)
    for end in solution.steps:
        sigma = state_after(problem, [end]).sigma
        whole, half = friction_bound(law, sigma), friction_bound(law, 0.5 * sigma)
        slides = np.where(np.isinf(whole), 0.0, system.weight)
        q, p = (contact_norm(part, slides) for part in (sigma[:, :-1], sigma[:, -1:]))
        grows = end.step > 1 or gap[sigma.any(axis=1)].any() or (half != 0.5 * whole).any()
        if wears or (grows and q > CARRIES * p):
            return end.step
    return None


def _other_paths(
    problem: PreparedProblem, solution: Solution, number: int
) -> tuple[tuple[float, Solution], ...] | None:
    """Solutions on other paths from a step on, each with the error of the one before over what the
    two differ by; None where one is not solved."""
    own = _own(problem, solution, number)
    fewer = {key: (before, _halved(ends)) for key, (before, ends) in own.items()}
    found, last = list[tuple[float, Solution]](), solution if fewer == own else None
    if last is None and (last := _along(problem, solution, fewer)) is not None:
        found.append((FEWER, last))
    whole = own if last is None else {key: fewer[key] for key in own if len(own[key][1]) == 1}
    if whole:
        divided = {key: (before, _divided(before, ends)) for key, (before, ends) in whole.items()}
        last = _along(problem, solution, fewer | divided)
        found.append((MORE, last or solution))
    return tuple(found) if last is not None else None


def _along(
    problem: PreparedProblem, solution: Solution, parts: dict[int, Parts]
) -> Solution | None:
    """The solution on another path from the first step that it has on; None where there is none."""
    first, rows = min(step for step in parts if step), list[Row]()
    done = [result for result in solution.steps if result.step < first]
    try:
        later = list(increments(_posed(problem, parts), done, None, checked=False, rows=rows))
    except (SolverError, BrokenOff):
        return None
    wear = wear_history(problem, rows)
    other = replace(solution, steps=[*done, *later], wear=wear, coarser=None, paths=())
    return other if later[-1].status == "converged" else None


def _posed(problem: PreparedProblem, parts: dict[int, Parts]) -> PreparedProblem:
    """A problem whose increments and jumps end where a path has them end, none of them halved."""
    posed = problem.discrete.problem
    steps = tuple(each.model_copy(update={"increments": 1}) for each in posed.step)
    cycle = posed.cycle and posed.cycle.model_copy(update={"jump": 1})
    posed = posed.model_copy(update={"step": steps, "cycle": cycle})
    factors = {key: [*before, *ends] for key, (before, ends) in parts.items()}
    discrete = replace(problem.discrete, problem=posed)
    return replace(problem, discrete=discrete, factors=factors, halvings=0)


Parts = tuple[list[float], list[float]]
"""Where increments of a step end, as load factors, or jumps, as cycles: first those that are kept
on all paths, then those that are not."""


def _own(problem: PreparedProblem, solution: Solution, number: int) -> dict[int, Parts]:
    """Of a solution from a step on; under 0, of its cycles."""
    own = {step: _parts(problem, solution, step) for step in range(number, len(problem.steps) + 1)}
    if solution.wear is not None:
        own[0] = _jumps([float(each) for each in solution.wear.cycle])
    return own


def _parts(problem: PreparedProblem, solution: Solution, step: int) -> Parts:
    """Of a step; where contact begins on the way the increments before do not count."""
    ends = [r.load_factor for r in solution.steps if r.step == step and r.cycle <= 1]
    before = [r for r in solution.steps if r.step < step][-1:]
    untouched = not any(pair.size.any() for each in before for pair in each.pairs.values())
    begins = touching(whole_step(problem, step)) if untouched else 0.0
    later = [end for end in ends if end > begins + SOLVED]
    return ([begins], later) if begins > 0.0 and later else ([], ends)


def _halved(ends: list[float]) -> list[float]:
    """Every second one of some ends, the last one too.

    >>> _halved([0.2, 0.4, 0.6, 0.8, 1.0]), _halved([0.5, 1.0]), _halved([1.0])
    ([0.6, 1.0], [1.0], [1.0])
    """
    return ends[::-1][: max(1, len(ends) - 1) : 2][::-1]


def _divided(before: list[float], ends: list[float]) -> list[float]:
    """Ends with the middles before them; cycles are whole ones.

    >>> _divided([], [0.5, 1.0]), _divided([1.0, 2.0], [7.0])
    ([0.25, 0.5, 0.75, 1.0], [4.0, 7.0])
    """
    begins = [*(before[-1:] or [0.0]), *ends][: len(ends)]
    pairs = [
        (0.5 * (a + b) if b <= 1.0 else (a + b) // 2.0, b)
        for a, b in zip(begins, ends, strict=True)
    ]
    return sorted({each for pair in pairs for each in pair} - {*before})


def _jumps(cycles: list[float]) -> Parts:
    """Those of cycles that were solved: first come some that are solved one by one."""
    count = next((k for k, (a, b) in enumerate(pairwise(cycles), 1) if b - a > 1.0), len(cycles))
    return cycles[:count], cycles[count:]


def _change(problem: PreparedProblem, solution: Solution, end: StepResult) -> tuple[float, str]:
    """The error of q, with wear of p and q, at the end of a step over p, in L2; and in words by how
    much they differ on the path that says most."""
    found, sigma = list[tuple[float, str]](), state_after(problem, [end]).sigma
    q, p = _sizes(problem, sigma)
    last: SolutionData = solution
    for factor, other in solution.paths:
        (*_, there) = [r for r in other.steps if (r.step, r.cycle) == (end.step, end.cycle)]
        before, sigma = sigma, state_after(problem, [there]).sigma
        apart = _sizes(problem, sigma - before)[0] if q * p > 0.0 else 0.0
        text = (
            f"{'p and q differ' if problem.discrete.wear.any() else 'q differs'} by "
            f"{apart / (q or 1.0):.0%} ({apart / (p or 1.0):.0%} of p) between {_count(last, end)} "
            f"and {_count(other, end)} {'jumps' if end.cycle > 1 else 'increments'}"
        )
        found.append((factor * apart / (p or 1.0), text))
        last = other
    where = f"step {end.name!r}" if problem.discrete.problem.step else "the load"
    return sum(error for error, _ in found), f"{where} depends on the path: {max(found)[1]}"


def _sizes(problem: PreparedProblem, sigma: Array) -> tuple[float, float]:
    """Of q, with wear of p and q, and of p, in L2."""
    d, weight = problem.system.components - 1, problem.system.weight
    kept = slice(None if problem.discrete.wear.any() else d)
    return contact_norm(sigma[:, kept], weight), contact_norm(sigma[:, d:], weight)


def _count(solution: SolutionData, end: StepResult) -> int:
    """How many increments the end of a step took, in later cycles how many jumps."""
    if end.cycle > 1 and solution.wear is not None:
        return len(solution.wear.cycle) - 1
    return sum((each.step, each.cycle) == (end.step, end.cycle) for each in solution.steps)
