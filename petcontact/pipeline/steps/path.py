"""The error that the number of increments, and of jumps over cycles, leaves in a solution.

The steps are solved again with half as many increments, and the cycles with half as many jumps. A
step of one increment and cycles of one jump are solved with two instead. So are all steps where the
solution with half as many increments fails.
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
from ...runtime.signals import BrokenOff, answering
from ..judge.findings import limit_of, new_finding
from .cycles import Row, wear_history
from .halves import PATH_ERROR, touching
from .increment import PreparedProblem
from .load_steps import MOST_NODES, increments, state_after, whole_step

UNNAMED = 16
"""Largest number of increments of the steps that name none, together. It divides an error that
falls like √h by four. The number is chosen for its cost; what is left of the error is reported."""
ADVICE = (
    "take more [[step]] increments{}, and in cycles a smaller jump; loads that really come one "
    "after the other need a [[step]] each, which is another path"
)


def with_paths(problem: PreparedProblem, solution: Solution, wanted: float | None) -> Solution:
    """Add to a solution its solutions on other paths and the error of its own path.

    The error is that of p and q at the ends of steps, relative to p in L2. It is 0 where the path
    does not matter, and nan where no other path was solved. A finding says where it exceeds the
    wanted accuracy.
    """
    number = _first_that_matters(problem, solution)
    if number is None:
        return solution
    jointly = any(body.is_solved_jointly for body in problem.system.bodies)
    with options(problem.discrete.problem.petsc):
        costly = jointly and problem.system.size > MOST_NODES
        paths = None if costly else _other_paths(problem, solution, number)
    solution = replace(solution, paths=paths or ())
    error, text = (np.nan, "") if paths is None else _largest(problem, solution, number)
    limit = wanted or limit_of("path")
    auto = any(step.increments == "auto" for step in problem.steps)
    advice = ADVICE.format("" if auto else ', or "auto"')
    large = [new_finding("path", text, advice=advice, measured=error, limit=limit)]
    solution = replace(solution, accuracy=replace(solution.accuracy, path=error))
    return solution.with_findings(large if error > limit else [])


def divided_load(
    problem: PreparedProblem, solution: Solution, wanted: float
) -> PreparedProblem | None:
    """Return the problem with its steps in increments, where the error of the path exceeds the
    wanted one; else None.

    They are steps whose `increments` is not named, from the first that depends on the path on. The
    increments are as many as leave the wanted error where it falls like √h, and at most `UNNAMED`
    together: many steps are a path of their own. They are more than those of the solution, or the
    return is None.
    """
    posed, error = problem.discrete.problem, solution.accuracy.path
    first = _first_that_matters(problem, solution)
    if first is None or posed.method.start not in ("zero", "frictionless") or not error > wanted:
        return None
    divided = {
        number
        for number, step in enumerate(problem.steps, 1)
        if number >= first and "increments" not in step.model_fields_set
    }
    taken = [result.step for result in solution.steps if result.cycle <= 1]
    each = max((taken.count(number) for number in divided), default=UNNAMED)
    count = int(min(np.ceil(each * (error / wanted) ** 2), UNNAMED // max(1, len(divided))))
    if count <= each:
        return None
    steps = tuple(
        step.model_copy(update={"increments": count}) if number in divided else step
        for number, step in enumerate(problem.steps, 1)
    )
    posed = posed.model_copy(update={"step": steps})
    return replace(problem, discrete=replace(problem.discrete, problem=posed))


def _largest(problem: PreparedProblem, solution: Solution, number: int) -> tuple[float, str]:
    """Return the largest `_change` at the ends of steps, from step `number` on, that all paths
    have."""
    there = {(end.step, end.cycle) for end in solution.paths[0][1].steps}
    ends = {key: end for end in solution.steps if (key := (end.step, end.cycle)) in there}
    return max(_change(problem, solution, end) for key, end in ends.items() if key[0] >= number)


def _first_that_matters(problem: PreparedProblem, solution: Solution) -> int | None:
    """Return the first step whose result depends on the path, or None.

    It is the first step with wear, or the first in which friction carries a load and the tractions
    do not grow in proportion to the loads.
    """
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
        # a smaller shear, relative to p in L2, is less than its own error may be
        if wears or (grows and q > PATH_ERROR * p):
            return end.step
    return None


def _other_paths(
    problem: PreparedProblem, solution: Solution, number: int
) -> tuple[tuple[float, Solution], ...] | None:
    """Solve on other paths from a step on; return None where one of them has no solution.

    Each solution comes with the factor by which its difference from the solution before it is
    multiplied to estimate the error of that one. Errors fall like √h of the increments h at least:
    where a contact grows from a point, the first increment covers a part √h of it, and the error
    that it makes there remains. So it is 1/(√2 - 1) with half, and 1/(1 - 1/√2) with twice as many.
    """
    own = _own(problem, solution, number)
    fewer = {key: (before, _halved(ends)) for key, (before, ends) in own.items()}
    paths, last = list[tuple[float, Solution]](), solution if fewer == own else None
    if last is None and (last := _along(problem, solution, fewer)) is not None:
        paths.append((1.0 + 2.0**0.5, last))
    whole = own if last is None else {key: fewer[key] for key in own if len(own[key][1]) == 1}
    if whole:
        divided = {key: (before, _divided(before, ends)) for key, (before, ends) in whole.items()}
        last = _along(problem, solution, fewer | divided)
        paths.append((2.0 + 2.0**0.5, last or solution))
    return tuple(paths) if last is not None else None


def _along(
    problem: PreparedProblem, solution: Solution, parts: dict[int, Parts]
) -> Solution | None:
    """Return the solution on another path, from the first step of that path on, or None."""
    first, rows = min(step for step in parts if step), list[Row]()
    done = [result for result in solution.steps if result.step < first]
    try:
        with answering(problem.comm):  # nothing of a path that a signal breaks off is kept
            later = list(increments(_posed(problem, parts), done, None, checked=False, rows=rows))
    except (SolverError, BrokenOff):
        return None
    wear = wear_history(problem, rows)
    companion = replace(solution, steps=[*done, *later], wear=wear, coarser=None, paths=())
    return companion if later[-1].status == "converged" else None


def _posed(problem: PreparedProblem, parts: dict[int, Parts]) -> PreparedProblem:
    """Return the problem with the increments and jumps of a path; none of them may be halved."""
    posed = problem.discrete.problem
    steps = tuple(step.model_copy(update={"increments": 1}) for step in posed.step)
    cycle = posed.cycle and posed.cycle.model_copy(update={"jump": 1})
    posed = posed.model_copy(update={"step": steps, "cycle": cycle})
    factors = {key: [*before, *ends] for key, (before, ends) in parts.items()}
    discrete = replace(problem.discrete, problem=posed)
    return replace(problem, discrete=discrete, factors=factors, halvings=0)


Parts = tuple[list[float], list[float]]
"""The load factors at which the increments of a step end, or the cycles at which jumps end. The
first list is the same on all paths, the second one is not."""


def _own(problem: PreparedProblem, solution: Solution, number: int) -> dict[int, Parts]:
    """Return the parts of a solution from a step on, by number of the step; key 0: cycles."""
    own = {step: _parts(problem, solution, step) for step in range(number, len(problem.steps) + 1)}
    if solution.wear is not None:
        own[0] = _jumps([float(cycle) for cycle in solution.wear.cycle])
    return own


def _parts(problem: PreparedProblem, solution: Solution, step: int) -> Parts:
    """Return the parts of one step. Increments before contact begins are the same on all paths."""
    ends = [r.load_factor for r in solution.steps if r.step == step and r.cycle <= 1]
    before = [r for r in solution.steps if r.step < step][-1:]
    untouched = not any(pair.size.any() for result in before for pair in result.pairs.values())
    begins = touching(whole_step(problem, step)) if untouched else 0.0
    later = [end for end in ends if end > begins + SOLVED]
    return ([begins], later) if begins > 0.0 and later else ([], ends)


def _halved(ends: list[float]) -> list[float]:
    """Return every second end, counted back from the last one.

    >>> _halved([0.2, 0.4, 0.6, 0.8, 1.0]), _halved([0.5, 1.0]), _halved([1.0])
    ([0.6, 1.0], [1.0], [1.0])
    """
    return ends[::-1][: max(1, len(ends) - 1) : 2][::-1]


def _divided(before: list[float], ends: list[float]) -> list[float]:
    """Return the ends and the middle before each of them; cycles are rounded to whole ones.

    >>> _divided([], [0.5, 1.0]), _divided([1.0, 2.0], [7.0])
    ([0.25, 0.5, 0.75, 1.0], [4.0, 7.0])
    """
    begins = [*(before[-1:] or [0.0]), *ends][: len(ends)]
    pairs = [
        (0.5 * (a + b) if b <= 1.0 else (a + b) // 2.0, b)
        for a, b in zip(begins, ends, strict=True)
    ]
    return sorted({share for pair in pairs for share in pair} - {*before})


def _jumps(cycles: list[float]) -> Parts:
    """Return the cycles that were solved: first those solved one by one, then the ends of jumps."""
    count = next((k for k, (a, b) in enumerate(pairwise(cycles), 1) if b - a > 1.0), len(cycles))
    return cycles[:count], cycles[count:]


def _change(problem: PreparedProblem, solution: Solution, end: StepResult) -> tuple[float, str]:
    """Return the error of the path at the end of a step, and a sentence about it.

    It is the error of q, or of p and q where the contact wears, over p in L2. The sentence names
    the two paths that differ most.
    """
    differences, sigma = list[tuple[float, str]](), state_after(problem, [end]).sigma
    q, p = _sizes(problem, sigma)
    last: SolutionData = solution
    for factor, companion in solution.paths:
        (*_, last_result) = [
            r for r in companion.steps if (r.step, r.cycle) == (end.step, end.cycle)
        ]
        before, sigma = sigma, state_after(problem, [last_result]).sigma
        apart = _sizes(problem, sigma - before)[0] if q * p > 0.0 else 0.0
        text = (
            f"{'p and q differ' if problem.discrete.wear.any() else 'q differs'} by "
            f"{apart / (q or 1.0):.0%} ({apart / (p or 1.0):.1%} of p) between {_count(last, end)} "
            f"and {_count(companion, end)} {'jumps' if end.cycle > 1 else 'increments'}"
        )
        differences.append((factor * apart / (p or 1.0), text))
        last = companion
    where = f"step {end.name!r}" if problem.discrete.problem.step else "the load"
    return sum(
        error for error, _ in differences
    ), f"{where} depends on the path: {max(differences)[1]}"


def _sizes(problem: PreparedProblem, sigma: Array) -> tuple[float, float]:
    """Return the L2 norms of q (of p and q where the contact wears) and of p."""
    d, weight = problem.system.components - 1, problem.system.weight
    kept = slice(None if problem.discrete.wear.any() else d)
    return contact_norm(sigma[:, kept], weight), contact_norm(sigma[:, d:], weight)


def _count(solution: SolutionData, end: StepResult) -> int:
    """Return how many increments came up to the end of a step; after the first cycle, how many
    jumps."""
    if end.cycle > 1 and solution.wear is not None:
        return len(solution.wear.cycle) - 1
    return sum((result.cycle, result.step) <= (end.cycle, end.step) for result in solution.steps)
