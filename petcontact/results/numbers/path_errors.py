"""The errors of numbers that the increments of the path cause."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...round_off import CHAINED
from ..evaluated import Evaluated
from ..records import StepResult
from .changes import FUNCTIONS, STATES, change_of, counted
from .number import ENERGY, Key, Number
from .printed import End, by_key, end_of, ends_of
from .stress_errors import Left, NearStress, stresses_near

COARSER = 2.0
"""What changes along paths may be over those on a coarser mesh, which sees maxima less: 18 rollers
on given meshes have 0.4 to 1.1 of the change of the largest p there, 0.5 to 1.2 of that of q. What
slips is known there to two nodes at best."""


def path_errors(solution: Evaluated, numbers: Sequence[Number]) -> dict[Key, float]:
    """Return the errors of numbers that the increments of the path cause.

    An error is what a number differs by on other paths at the end of the same step. It is at least
    the error that the increments of the path itself show.
    """
    last = solution.tracked or solution
    errors = {number.key: 0.0 for number in numbers if not np.isinf(number.error)}
    now = {number.key: number for number in numbers}
    known = {key[2:] for key in now} if last is solution else set[End]()
    for other in last.paths:
        before, ends = ends_of(last), ends_of(other)
        differ = {at for at in before.keys() & ends.keys() if not _alike(before[at], ends[at])}
        now |= by_key(last, differ - known)
        there = by_key(other, differ)
        stresses = stresses_near(last, [each for each in numbers if each.key[2:] in differ])
        for key in errors:
            if key[2:] in differ:
                change = _path_change(last, other, now[key], there, stresses)
            else:
                change = _spent_apart(last, other, now[key]) if key[2:] in ends else np.nan
            errors[key] += _left(solution, last, other) * change
        now, last, known = now | there, other, known | differ
    return {each.key: _whole(solution, each, errors.get(each.key, 0.0)) for each in numbers}


def _left(solution: Evaluated, last: Evaluated, other: Evaluated) -> float:
    """What is left in a solution of the difference of two paths: errors fall like √h of the
    increments h at least; of two increments one is made."""
    more = COARSER if solution.tracked else 1.0
    return float(more / (max(2.0, len(last.steps) / len(other.steps)) ** 0.5 - 1.0))


def _whole(solution: Evaluated, number: Number, error: float) -> float:
    """The error of a number by its difference on other paths and by its own increments; a K that
    the mesh of these paths does not resolve is off by as large a share as tractions are."""
    if np.isnan(error) and not np.isnan(number.exponent):
        error = solution.accuracy.path * number.size
    if solution.tracked and number.name == "slipping" and solution.accuracy.path > CHAINED:
        error += 2.0 * float(end_of(solution.tracked, number).pairs[number.of].weight.max())
    return float(np.maximum(error, of_increments(number)))


def of_increments(number: Number) -> float:
    """What of `alone` lies between increments, where that is not between nodes."""
    return number.alone if number.name == ENERGY else 0.0


def _alike(one: StepResult, two: StepResult) -> bool:
    """Whether all contacts are the same at the end of a step on two paths, but for round-off: then
    all is the same there but what increments add up to."""
    moved = max(float(np.abs(body.u).max()) for body in one.bodies.values())
    pressed = max((float(pair.size.max(initial=0.0)) for pair in one.pairs.values()), default=0.0)
    return all(
        pair.wear is None
        and np.abs(pair.slip - two.pairs[name].slip).max(initial=0.0) <= CHAINED * moved
        and np.abs(pair.pressure - two.pairs[name].pressure).max(initial=0.0) <= CHAINED * pressed
        and np.abs(pair.sigma_t - two.pairs[name].sigma_t).max(initial=0.0) <= CHAINED * pressed
        for name, pair in one.pairs.items()
    )


def _spent_apart(solution: Evaluated, other: Evaluated, number: Number) -> float:
    """What two paths that end alike differ by in a number: its energy adds up."""
    if number.name != ENERGY:
        return 0.0
    one, two = (
        sum(
            step.pairs[number.of].dissipated
            for step in each.steps
            if (step.step, step.cycle) == number.key[2:]
        )
        for each in (solution, other)
    )
    return abs(one - two)


def _path_change(
    solution: Evaluated,
    other: Evaluated,
    number: Number,
    there: dict[Key, Number],
    stresses: dict[Key, NearStress],
) -> float:
    """Return the difference of a number on another path.

    A maximum differs by the largest difference of its function, and an area by at least that of the
    nodes whose state differs.
    """
    name, least = number.name, 0.0
    if number.key in there and name in {*FUNCTIONS, *STATES}:
        one, two = (end_of(each, number).pairs[number.of] for each in (solution, other))
        if name in FUNCTIONS:
            first, second = (FUNCTIONS[name](pair) for pair in (one, two))
            rows = counted(solution, number)
            return float(np.abs(first - second)[rows].max(initial=0.0))
        least = float(one.weight @ (STATES[name](one) != STATES[name](two)))
    change = change_of(solution, other, number, there.get(number.key), stresses, Left())
    return float(np.maximum(least, change))
