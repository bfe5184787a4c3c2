"""The error that the number of increments, and of jumps over cycles, leaves in a solution.

The steps are solved again on other paths. On the first one the increment in which a contact that
grows from nothing grows most is divided, and so is a single increment. On the second one two later
increments are joined to one, too; they are divided where such a path has no solution. So are jumps
of cycles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...arrays import Array
from ...contact.friction_law import contact_norm
from ...contact.law_protocol import friction_bound
from ...contact.methods.newton import SemismoothNewton
from ...errors import SolverError
from ...results.evaluated import Evaluated
from ...results.records import StepResult
from ...results.solution import Solution
from ...round_off import SOLVED
from ...runtime.petsc import options
from ...runtime.signals import BrokenOff, answering
from ..choice import BUDGET, PRODUCT, posed_seconds
from ..eliminate import MOST_NODES
from ..judge.findings import limit_of, new_finding
from .cycles import Row, wear_history
from .halves import PATH_ERROR, touching
from .prepared import PreparedProblem
from .start import starts_from
from .step_loop import increments, whole_step
from .stored_state import state_after

UNNAMED = 64
"""Largest number of increments of the steps that name none, together. 16 leave 1.4 % of p in q of
an unlike disc between plates and of a heated ball, 64 leave 0.1 and 0.3 % (against 128); the whole
solve then takes 1.5 to 2.5 times the processor time of one increment."""
GROWTH = 4
"""Parts of the increment in which a contact that grows from nothing grows most, on another path.
With three, which also begin with a sixteenth of the load, 22 of 1625 numbers were off by more than
they say; 8 are with four (scripts/verify_paths --seed 1)."""
LEAST_RATE = 1.25
"""Least factor by which differences of paths are taken to fall where each path has `GROWTH` times
the increments of the one before; √`GROWTH` where only one difference is known. Between curved
surfaces they fall by 2.7 to 4.7 (disc between plates, heated ball; 4, 16 and 64 increments)."""
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
    with options(problem.discrete.posed.petsc):
        costly = jointly and problem.system.size > MOST_NODES
        paths = None if costly else _other_paths(problem, solution, number)
    solution = replace(solution, paths=paths or ())
    error, text = (np.nan, "") if paths is None else _largest(problem, solution, number)
    return _with_error(problem, solution, error / (1.0 - 1.0 / GROWTH), text, wanted)


def with_fewer(
    problem: PreparedProblem, solution: Solution, fewer: Solution, last: float, wanted: float | None
) -> tuple[Solution, float]:
    """Add to a solution one with fewer increments as its other path, and the error of its own path.

    The error follows from what both differ by, and from the rate at which these differences fall:
    `last` is the one before, 0 where there is none. Also return what both differ by.
    """
    solution = replace(solution, paths=(replace(fewer, paths=()),))
    if (number := _first_that_matters(problem, solution)) is None:
        return solution, 0.0
    apart, text = _largest(problem, solution, number)
    rate = np.clip(last / apart, LEAST_RATE, GROWTH) if last * apart else GROWTH**0.5
    return _with_error(problem, solution, float(apart / (rate - 1.0)), text, wanted), apart


def _with_error(
    problem: PreparedProblem, solution: Solution, error: float, text: str, wanted: float | None
) -> Solution:
    """Add the error of its path to a solution, and a finding where it exceeds the wanted one."""
    limit = wanted or limit_of("path")
    auto = any(step.increments == "auto" for step in problem.steps)
    advice = ADVICE.format("" if auto else ', or "auto"')
    large = [new_finding("path", text, advice=advice, measured=error, limit=limit)]
    solution = replace(solution, accuracy=replace(solution.accuracy, path=error))
    return solution.with_findings(large if error > limit else [])


def divided_load(
    problem: PreparedProblem, solution: Solution, count: int, wanted: float
) -> PreparedProblem | None:
    """Return the problem with `count` increments in each step that names none and adds to the error
    of the path, or None where they would be more than `UNNAMED` together.

    The error of the path exceeds the wanted one, so at least one step adds more than its part.
    """
    first = _first_that_matters(problem, solution)
    if first is None:
        return None
    ends, changes, _ = zip(*_changes(problem, solution, first), strict=True)
    matters = np.diff(np.maximum.accumulate(changes), prepend=0.0) * (
        solution.accuracy.path * len(ends)
    ) > wanted * max(changes)
    # what was divided before stays so
    chosen = {end.step for end, does in zip(ends, matters, strict=True) if does}
    chosen |= {result.step for result in solution.steps if not result.ends}
    divided = {number for number in chosen if not problem.steps[number - 1].is_divided}
    more = count * len(divided)
    if not divided or more > UNNAMED or not is_affordable(problem, solution, more):
        return None
    factors = {
        step: _growing(begun, 1.0, count)
        for step in divided
        if (begun := _begins(problem, solution, step)) is not None
    }
    return replace(
        problem,
        discrete=problem.discrete.with_increments(dict.fromkeys(divided, count)),
        factors=factors,
    )


def is_affordable(problem: PreparedProblem, solution: Solution, count: int) -> bool:
    """Return whether `count` more increments should take no longer than a solve has, or `BUDGET`.

    Only increments of joint solves are dear: of narrow contacts each may cost more than the
    operators do. Where they are not affordable, the error of the path is not known. Products are
    counted, so that no result depends on the speed of a machine.
    """
    if not any(body.is_solved_jointly for body in problem.system.bodies):
        return True
    posed, meshes, steps = problem.discrete.posed, problem.discrete.meshes, solution.steps
    products = sum(sum(r.history.ksp_iterations) + r.iterations * (1 + len(r.alpha)) for r in steps)
    iterate = PRODUCT * products * sum(mesh.n_nodes for mesh in meshes)
    return count * iterate / len(steps) <= max(BUDGET, posed_seconds(posed, meshes, 0) + iterate)


def _changes(
    problem: PreparedProblem, solution: Solution, number: int
) -> list[tuple[StepResult, float, str]]:
    """Return the ends of steps, from step `number` on, that all paths have, each with its
    `_change`."""
    there = {(end.step, end.cycle) for end in solution.paths[0].steps}
    ends = {key: end for end in solution.steps if (key := (end.step, end.cycle)) in there}
    return [
        (end, *_change(problem, solution, end)) for key, end in ends.items() if key[0] >= number
    ]


def _largest(problem: PreparedProblem, solution: Solution, number: int) -> tuple[float, str]:
    """Return the largest change of `_changes`, and its sentence."""
    return max((error, text) for _, error, text in _changes(problem, solution, number))


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
) -> tuple[Solution, ...] | None:
    """Return solutions on other paths from a step on; None where one of them has no solution.

    On the first one the increment in which a contact that grows from nothing grows most is divided,
    and so is each single increment. On the second one later increments are joined, too, or divided
    where joined ones have no solution.
    """
    steps = range(number, len(problem.steps) + 1)
    begins = {step: _begins(problem, solution, step) for step in steps}
    kept = _factors(problem, solution, begins, _kept)
    if (first := _along(problem, solution, number, kept)) is None:
        return None
    for later in (_joined, _divided):
        factors = _factors(problem, solution, begins, later)
        if factors == kept:
            return (first,)
        if (second := _along(problem, solution, number, factors)) is not None:
            return first, second
    return None


def _along(
    problem: PreparedProblem, solution: Solution, number: int, factors: dict[int, list[float]]
) -> Solution | None:
    """Return the solution on another path, from a step on, or None where it costs too much or does
    not converge. None of its increments may be halved. Paths do not depend on the method: Newton's
    takes the fewest iterations."""
    if not is_affordable(problem, solution, sum(map(len, factors.values()))):
        return None
    single = dict.fromkeys(range(1, len(problem.discrete.posed.steps) + 1), 1)
    discrete = problem.discrete.with_increments(single, jump=1)
    problem = replace(
        problem,
        discrete=discrete,
        method=SemismoothNewton(),
        starts=starts_from(problem, solution.steps),
        factors=factors,
        halvings=0,
    )
    rows, done = list[Row](), [result for result in solution.steps if result.step < number]
    try:
        with answering(problem.comm):  # nothing of a path that a signal breaks off is kept
            later = list(increments(problem, done, None, checked=False, rows=rows))
    except (SolverError, BrokenOff):
        return None
    wear = wear_history(problem, rows)
    other = replace(solution, steps=[*done, *later], wear=wear, coarser=None, paths=())
    return other if later[-1].status == "converged" else None


Divide = Callable[[list[float]], list[float]]
"""Return the ends of the parts of another path, for the ends of parts from their beginning on."""


def _factors(
    problem: PreparedProblem,
    solution: Solution,
    begins: dict[int, float | None],
    later: Divide,
) -> dict[int, list[float]]:
    """Return where increments end on another path, by number of the step; key 0: jumps of cycles.

    Each step comes with what `_begins` returns.
    """
    factors = {step: _ends(problem, solution, step, begun, later) for step, begun in begins.items()}
    if solution.wear is not None:
        single, jumps = _jumps([float(cycle) for cycle in solution.wear.cycle])
        factors[0] = [*single, *later([*single[-1:], *jumps])]
    return factors


def _ends(
    problem: PreparedProblem, solution: Solution, step: int, begins: float | None, later: Divide
) -> list[float]:
    """Return the load factors at which the increments of a step end on another path.

    Increments before contact begins are the same on all paths; short ones are none (`PATH_ERROR`),
    and contact is sought from where it is expected, not from an open state.
    """
    ends = [r.load_factor for r in solution.steps if r.step == step and r.cycle <= 1]
    if begins is None:
        return later([0.0, *ends])
    before, ends = (
        [begins] * (begins > PATH_ERROR),
        [begins, *(e for e in ends if e > begins + SOLVED)],
    )
    auto = problem.steps[step - 1].increments == "auto"  # small enough from the first one on
    sizes = np.diff(np.sqrt(np.subtract(ends, begins)))
    k = int(np.argmax(sizes)) if len(sizes) and not auto else 0
    parts = _growing(begins, ends[k + 1], 1 if auto else GROWTH, ends[k]) if len(sizes) else []
    return [*before, *ends[1 : k + 1], *parts, *later(ends[k + 1 :])]


def _begins(problem: PreparedProblem, solution: Solution, step: int) -> float | None:
    """Return the load factor at which contact begins in a step, or None where it is there
    before."""
    before = [r for r in solution.steps if r.step < step][-1:]
    if any(pair.size.any() for result in before for pair in result.pairs.values()):
        return None
    return touching(whole_step(problem, step))


def _growing(begins: float, end: float, count: int, start: float | None = None) -> list[float]:
    """Return the load factors at which increments end where contact grows from nothing.

    Between curved surfaces the size of a contact is like the root of the load, or of its motion. It
    grows by as much in each increment, from `start` on, by default from where contact begins.

    >>> _growing(0.0, 1.0, 4), _growing(0.0, 1.0, 2, 0.25)
    ([0.0625, 0.25, 0.5625, 1.0], [0.5625, 1.0])
    """
    already = 0.0 if start is None else ((start - begins) / (end - begins)) ** 0.5
    shares = already + (1.0 - already) * np.arange(1, count + 1) / count
    return [float(begins + (end - begins) * share**2) for share in shares]


def _kept(ends: list[float]) -> list[float]:
    """Return the ends of the same parts; a single one is divided.

    >>> _kept([0.0, 0.5, 1.0]), _kept([0.5, 1.0])
    ([0.5, 1.0], [0.75, 1.0])
    """
    return ends[1:] if len(ends) > 2 else _divided(ends)


def _joined(ends: list[float]) -> list[float]:
    """Return the ends of parts of which two are joined to one, from the last one back.

    >>> _joined([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]), _joined([0.5, 1.0])
    ([0.6, 1.0], [0.75, 1.0])
    """
    return ends[::-1][: len(ends) - 2 : 2][::-1] if len(ends) > 2 else _divided(ends)


def _divided(ends: list[float]) -> list[float]:
    """Return the ends of parts that are each divided in two; cycles are rounded to whole ones.

    >>> _divided([0.0, 0.5, 1.0]), _divided([2.0, 7.0])
    ([0.25, 0.5, 0.75, 1.0], [4.0, 7.0])
    """
    parts = [(0.5 * (a + b) if b <= 1.0 else (a + b) // 2.0, b) for a, b in pairwise(ends)]
    return sorted({end for pair in parts for end in pair} - {*ends[:1]})


def _jumps(cycles: list[float]) -> tuple[list[float], list[float]]:
    """Return the cycles that were solved: first those solved one by one, then the ends of jumps."""
    count = next((k for k, (a, b) in enumerate(pairwise(cycles), 1) if b - a > 1.0), len(cycles))
    return cycles[:count], cycles[count:]


def _change(problem: PreparedProblem, solution: Solution, end: StepResult) -> tuple[float, str]:
    """Return what the paths differ by at the end of a step, and a sentence about it.

    It is the difference of q, or of p and q where the contact wears, over p in L2, summed over the
    paths. The sentence names the two paths that differ most.
    """
    wears, sigma = problem.discrete.wear.any(), state_after(problem, [end]).sigma
    (q, p), error, differences = _sizes(problem, sigma), 0.0, list[tuple[float, str]]()
    for one, other in pairwise([solution, *solution.paths]):
        (*_, last) = [r for r in other.steps if (r.step, r.cycle) == (end.step, end.cycle)]
        before, sigma = sigma, state_after(problem, [last]).sigma
        apart = _sizes(problem, sigma - before)[0] if q * p > 0.0 else 0.0
        text = (
            f"{'p and q differ' if wears else 'q differs'} by {apart / (q or 1.0):.0%} "
            f"({apart / (p or 1.0):.1%} of p) between {_count(one, end)} and {_count(other, end)} "
            f"{'jumps' if end.cycle > 1 else 'increments'}"
        )
        differences.append((apart, text))
        error += apart / (p or 1.0)
    where = f"step {end.name!r}" if problem.discrete.posed.steps else "the load"
    return error, f"{where} depends on the path: {max(differences)[1]}"


def _sizes(problem: PreparedProblem, sigma: Array) -> tuple[float, float]:
    """Return the L2 norms of q (of p and q where the contact wears) and of p."""
    d, weight = problem.system.components - 1, problem.system.weight
    kept = slice(None if problem.discrete.wear.any() else d)
    return contact_norm(sigma[:, kept], weight), contact_norm(sigma[:, d:], weight)


def _count(solution: Evaluated, end: StepResult) -> int:
    """Return how many increments came up to the end of a step; after the first cycle, how many
    jumps."""
    if end.cycle > 1 and solution.wear is not None:
        return len(solution.wear.cycle) - 1
    return sum((result.cycle, result.step) <= (end.cycle, end.step) for result in solution.steps)
