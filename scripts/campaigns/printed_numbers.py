"""Printed numbers of random problems beside those of a tenth of the error: what is off by more than
is reported."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from climbs import HOLDS_NOT

from petcontact import PetcontactError, adapt

FINER = 10.0
"""Accuracy over that of the reference."""


@dataclass(frozen=True)
class Compared:
    """A number of a problem with its true and its reported error."""

    problem: int
    key: tuple
    value: float
    true: float
    reported: float

    @property
    def ratio(self) -> float:
        """True over reported; what agrees to round-off is right."""
        if self.true <= 1e-9 * max(self.value, 1e-12):
            return 0.0
        return self.true / max(self.reported, 1e-300)


def compared(problem, number, accuracy):
    """The numbers of a problem at an accuracy that are known at a tenth of it, too, and the
    processor seconds of solve and numbers; else "refused" where it is proved that nothing holds the
    loads, or "not solved"."""
    best = None
    try:
        began = time.process_time()
        solution = adapt(problem, accuracy)
        reason, solved = solution.reason, time.process_time()
        if solution.converged:
            numbers, asked = solution.numbers, time.process_time()
            # loads that one of both holds are not refused
            reason, best = "", adapt(problem, accuracy / FINER)
    except PetcontactError as error:
        reason = str(error)
    if best is None or not best.converged:
        return "refused" if HOLDS_NOT in reason else "not solved"
    return differences(number, numbers, best.numbers), (solved - began, asked - solved)


def differences(problem, numbers, best):
    """The numbers of a problem whose errors are known beside more accurate ones; of bodies of
    revolution these have two components, of which the one along the axis counts."""
    known, found = {each.key: each for each in best}, []
    for each in numbers:
        other = known.get(each.key)
        if other is None or np.isinf(each.error) or np.isnan(each.error) or np.isinf(other.error):
            continue
        one, two = each.value, other.value
        true = float(np.abs(one - two if len(one) == len(two) else one[-1:] - two[-1:]).max())
        # what the reference is off by itself is not counted
        true = max(0.0, true - np.nan_to_num(other.error))
        found.append(Compared(problem, each.key, each.size, true, each.error))
    return found


def table(draw, seed, first, count, accuracy):
    """Lines of a table of random problems, and how many numbers are off by more than they say."""
    numbers = range(first, first + count)
    return listed((number, compared(draw(seed, number), number, accuracy)) for number in numbers)


def listed(problems):
    """The lines for numbers of problems and what `compared` found for each."""
    yield "| problem | number | value | true error | reported |\n|---|---|---|---|---|"
    every, times = [], np.zeros(2)
    for number, result in problems:
        if isinstance(result, str):
            yield f"| {number} | {result} | | | |"
            continue
        found, spent = result
        every += found
        times += spent
        for each in found:
            if each.ratio > 1.0:
                name = f"{each.key[0]}, {each.key[1]}, step {each.key[2]}"
                yield (
                    f"| {number} | {name} | {each.value:.4g} | {each.true:.1e} | "
                    f"{each.reported:.1e} |"
                )
    above = sum(each.ratio > 1.0 for each in every)
    worst = max((each.ratio for each in every), default=0.0)
    yield ""
    yield (
        f"{above} of {len(every)} numbers are off by more than they say, the worst by {worst:.2g} "
        f"times; the numbers took {times[1]:.2f} s beside {times[0]:.2f} s of the solves"
    )
