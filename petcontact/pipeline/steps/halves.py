"""Increments that are as small as the path asks for: those whose two halves end where they do."""

from __future__ import annotations

import numpy as np

from ...contact.friction_law import contact_norm
from ...contact.laws import dissipation
from ...round_off import SOLVED
from .increment import Increment, Monitor
from .wear import Tried, with_wear

PATH_ERROR = 1e-3
"""Change of σ and of w, over the largest that the step is known to have, that halving an increment
may make."""
ENERGY_ERROR = 1e-2
"""The same of the energy dissipated, over itself or the work of all tractions on the slip."""
LEAST_SLIP = 1e-3
"""Slip, over what the tractions move, below which its path error is relative to that."""
BEGUN = 0.05
"""Tractions of a pair that carried nothing at the middle of an increment, over the largest of the
step, that it may have at its end: halves agree on what moves before a pair touches, whenever that
is."""


def touching(increment: Increment) -> float:
    """Load factor of a step at which contact begins, where nothing touches before and nothing moves
    but by the loads; else that at which the increment begins.

    Nothing but loads displaces the bodies before, and in proportion.
    """
    system = increment.problem.system
    if (
        system.k < system.components
        or increment.before.sigma.any()
        or increment.system.modes is not None
    ):
        return increment.begun
    room, left = (
        -increment.to(t).system.u_0[np.isfinite(system.gap), -1] for t in (increment.begun, 1.0)
    )
    if room.min(initial=0.0) < 0.0 or left.min(initial=0.0) >= 0.0:
        return increment.begun
    closes = left < 0.0
    share = float((room[closes] / (room[closes] - left[closes])).min())
    return increment.begun + (1.0 - increment.begun) * share


class Halves:
    """Two halves in the place of an increment that they agree with, for `increments = "auto"`.

    Errors are over the largest tractions and the largest slip that any increment of the step has
    had so far, accepted or not: the first one to be tried is the whole step. Over those of the
    increment itself a contact that grows from a point would never agree, however little is loaded:
    where it is self-similar, halves differ as much at all loads.

    Attributes
    ----------
    error : float
        Of the last increment that was tried, over the largest error that is allowed; nan where it
        was not solved.
    """

    def __init__(self, monitor: Monitor | None) -> None:
        self._monitor, self._first = monitor, list[Tried]()
        self._tractions = self._slip = self.error = 0.0

    def __call__(self, increment: Increment) -> list[Tried] | None:
        """Both halves; the whole increment or what there is of them where a monitor stops it; None
        where it is too large."""
        self.error = np.nan
        known = [each for each in self._first if abs(each[0].target - increment.target) < SOLVED]
        whole = known[0] if known else self._solved(increment)
        self._first = []
        if not whole[1].converged:
            return [whole] if whole[1].stopped else None
        half = increment.to(0.5 * (increment.begun + increment.target))
        first = self._solved(half)
        if not first[1].converged:
            return [first] if first[1].stopped else None
        second = self._solved(half.then(increment.target, first[2]))
        if not second[1].converged:
            return [first, second] if second[1].stopped else None
        self.error = self._apart(whole, first, second)
        self._first = [first] if self.error > 1.0 else []
        return None if self._first else [first, second]

    def _solved(self, increment: Increment) -> Tried:
        return with_wear(increment, increment.solved(self._monitor), self._monitor)

    def _apart(self, whole: Tried, first: Tried, second: Tried) -> float:
        """Differences of the whole increment and its halves, and of the energy that they dissipate,
        over what is allowed."""
        system = whole[0].problem.system
        weight, (one, other) = system.weight, (whole[1].sigma, second[1].sigma)
        self._tractions = max(self._tractions, contact_norm(other, weight))
        # where nothing slips w is round-off of what the tractions move
        moved = LEAST_SLIP * contact_norm(system.operator.apply(other), weight)
        self._slip = max(self._slip, contact_norm(second[2].slip, weight), moved)
        law = whole[0].problem.discrete.law
        once, *twice = (
            float(
                weight
                @ dissipation(
                    law, each.before.sigma, outcome.sigma, outcome.v[:, : system.components - 1]
                )[0]
            )
            for each, outcome, _ in (whole, first, second)
        )
        begun = [
            contact_norm(other[pair], weight[pair])
            for pair in system.slices
            if not first[1].sigma[pair].any()
        ]
        differences = (
            contact_norm(other - one, weight),
            contact_norm(second[2].slip - whole[2].slip, weight),
            abs(sum(twice) - once),
            max(begun, default=0.0),
        )
        sizes = (
            PATH_ERROR * self._tractions,
            PATH_ERROR * self._slip,
            ENERGY_ERROR * max(sum(twice), self._slip * self._tractions),
            BEGUN * self._tractions,
        )
        return max(
            (
                a / b if b > 0.0 else np.inf
                for a, b in zip(differences, sizes, strict=True)
                if a > 0.0
            ),
            default=0.0,
        )
