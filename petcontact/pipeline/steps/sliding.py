"""The load of a step at which a whole contact slips: where `until = "sliding"` ends the step.

Friction carries the share ∫|σ_t| / ∫b of what it could carry at the pressures there, b being the
bound. It is 1 where the whole contact slips. Beyond that load a force has no solution, while under
a motion the contact slips on. With two tangents shear may still turn then, until all of it points
against the force: the load is the last one that has a solution, if the end of the step has none.
The load is found between the increment before and one beyond.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...contact.friction_law import lengths
from ...contact.law_protocol import friction_bound
from ...results.records import SLIDING_WITHIN
from ...round_off import TINY
from .increment import Increment, Monitor
from .wear import Tried, with_wear

NEARLY = 0.98
"""Share of friction from which on a load without a solution is taken for one beyond the load at
which the contact slips. A taper that is pulled off carries 0.998 at 0.998 of that load."""

SHORT = 0.25
"""Share of the way to a load without a solution that a try leaves: the way that slip told was up to
1.2 times as long as the true one, of discs that are turned until they slide."""
LEAST = math.sqrt(TINY)
"""Slip whose square is no round-off yet [length]."""
GOLDEN = 0.382
"""Share of the interval that a try leaves where nothing tells more: unlike a half it does not meet
limit loads that are simple numbers, at which a body slides without end."""


def slipping(increment: Increment, sigma: Array) -> tuple[float, str]:
    """Return the largest share of its friction that a contact carries, and the name of it."""
    problem, bound = increment.problem, friction_bound(increment.law, sigma)
    shear, weight = lengths(sigma[:, : problem.system.components - 1]), problem.system.weight
    sums = dict[str, Array]()
    for side, where in zip(problem.discrete.sides, problem.system.slices, strict=True):
        acting = weight[where] @ np.column_stack([shear[where], bound[where]])
        sums[side.group] = sums.get(side.group, np.zeros(2)) + acting
    shares = [(float(q / b), name) for name, (q, b) in sums.items() if 0.0 < b < np.inf]
    return max(shares, default=(0.0, ""))


def slipping_words(increment: Increment) -> str:
    """Return what ends the message of an increment that failed where a contact nearly slips."""
    share, name = slipping(increment, increment.before.sigma)
    if share < NEARLY:
        return ""
    return (
        f"; contact {name!r} has used {100.0 * share:.1f} % of its friction at load factor "
        f"{increment.begun:.4g}, which is near the limit load: give a motion instead of a force, "
        'or the step until = "sliding"'
    )


def up_to_sliding(solving: Iterable[Tried], monitor: Monitor | None) -> Iterator[Tried]:
    """Yield the increments of a step up to the one at whose end a whole contact slips."""
    for tried in solving:
        solved = tried[1].converged
        if tried[1].stopped or (solved and slipping(*_end(tried))[0] < 1.0 - SLIDING_WITHIN):
            yield tried
            continue
        found = _found(_beyond(tried, monitor), monitor)
        share, name = slipping(*_end(found))
        slides = found[1].converged and share >= NEARLY
        yield (replace(found[0], sliding=name), *found[1:]) if slides else tried
        return


def _end(tried: Tried) -> tuple[Increment, Array]:
    return tried[0], tried[1].sigma


def _turns(increment: Increment) -> bool:
    """Whether shear has a direction that may turn."""
    return increment.problem.system.components > 2


def _beyond(tried: Tried, monitor: Monitor | None) -> Tried:
    """Return the increment up to the end of the step instead, if shear may turn and this has no
    solution."""
    if not tried[1].converged or tried[0].target == 1.0 or not _turns(tried[0]):
        return tried
    whole = tried[0].ending_at(1.0)
    beyond = with_wear(whole, whole.solved(monitor), monitor)
    return tried if beyond[1].converged else beyond


def _guess(points: list[tuple[float, float]], low: float, high: float, short: float) -> float:
    """Return where what is left at the last two loads falls to half of `SLIDING_WITHIN`, or short
    of it by a share of the way, at least `SLIDING_WITHIN` further."""
    guess = GOLDEN * low + (1.0 - GOLDEN) * high
    if len(points) > 1 and points[-2][1] > points[-1][1]:
        (a, left_a), (b, left_b) = points[-2:]
        way = (b - a) * (left_b - 0.5 * SLIDING_WITHIN * (not short)) / (left_a - left_b)
        guess = b + max((1.0 - short) * way, 0.9 * SLIDING_WITHIN * b)
    return float(np.clip(guess, low, 0.1 * low + 0.9 * high))


def _found(beyond: Tried, monitor: Monitor | None) -> Tried:
    """Return the increment that ends where a contact slips, or the last one before that.

    What friction could carry more is taken to fall linearly with the load, which it does under a
    force on one body. Where shear turns until a load has no solution, slip has no bound there; the
    angle that is left is like 1 over it, and its square falls linearly. A load without a solution
    takes twenty times as long as others, so that tries stay short of it.
    """
    increment, low, high = beyond[0], beyond[0].begun, beyond[0].target
    above, below = beyond if beyond[1].converged else None, beyond
    to_last = _turns(increment) and above is None
    points = [(low, 1.0 - slipping(increment, increment.before.sigma)[0])] * (not to_last)
    while high - low > SLIDING_WITHIN * high and high - increment.begun > SLIDING_WITHIN:
        target = _guess(points, low, high, SHORT * to_last)
        following = increment.ending_at(target)
        tried = with_wear(following, following.solved(monitor), monitor)
        left = 1.0 - slipping(*_end(tried))[0]
        if tried[1].stopped:
            return tried
        if tried[1].converged and (to_last or left >= SLIDING_WITHIN):
            low, below = target, tried
            moved = max(float(lengths(tried[1].v).max()), LEAST)
            points.append((low, moved**-2.0 if to_last else left))
            continue
        points = points[-1:] if to_last else points
        high, above = target, tried if tried[1].converged else above
    return above or below
