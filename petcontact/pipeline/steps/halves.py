"""Increments for `increments = "auto"`: an increment is small enough where its two halves give the
same result."""

from __future__ import annotations

import numpy as np

from ...contact.criterion import balanced
from ...contact.friction_law import contact_norm
from ...contact.law_protocol import law_residual
from ...contact.laws import dissipation
from ...contact.state import ContactState
from ...round_off import SOLVED
from .increment import Increment, Monitor
from .wear import Tried, with_wear

PATH_ERROR = 1e-3
"""Largest change of σ and of w when an increment is halved, relative to their largest values in the
step so far. A slip is compared with at least this share of what the tractions displace, which is
not known better than they are. What that leaves at the end of a step is measured by
scripts/verify_paths. A smaller share of a step changes less: before contact begins only a larger
one becomes an increment of its own, and what can be held of a load is known to it."""
ENERGY_ERROR = 1e-2
"""Largest change of the dissipated energy when an increment is halved, relative to that energy or
to the work of all tractions on the slip, whichever is larger. Without it energies of 27 random
tools on blocks were off by up to three times as much (scripts/verify_paths --seed 11)."""


def touching(increment: Increment) -> float:
    """Return the load factor of a step at which contact begins.

    Before contact the displacements grow in proportion to the loads, so that the gaps are linear in
    the load factor. Where something touches already, or contact holds a motion, it is the load
    factor at which the increment begins.
    """
    system = increment.problem.system
    if (
        system.k < system.components
        or increment.before.sigma.any()
        or increment.system.modes is not None
    ):
        return increment.begun
    room, left = (
        -increment.ending_at(t).system.u_0[np.isfinite(system.gap), -1]
        for t in (increment.begun, 1.0)
    )
    if room.min(initial=0.0) < 0.0 or left.min(initial=0.0) >= 0.0:
        return increment.begun
    closes = left < 0.0
    share = float((room[closes] / (room[closes] - left[closes])).min())
    return increment.begun + (1.0 - increment.begun) * share


def _residual(increment: Increment, outcome: ContactState, after: object) -> tuple[float, float]:
    """Return ‖R_ρ‖ [stress] and ‖R_ρ/ρ‖ [length] of an outcome, with the balanced ρ."""
    system, law = increment.system, increment.law
    rho = balanced(law, system, outcome.v, outcome.sigma)[0]
    residual = law_residual(law, outcome.v, outcome.sigma, rho)
    return contact_norm(residual, system.weight), contact_norm(residual / rho, system.weight)


def _dissipated(increment: Increment, outcome: ContactState, after: object) -> float:
    """Return the energy that an outcome dissipates in its increment."""
    slip = outcome.v[:, : increment.problem.system.components - 1]
    density = dissipation(increment.law, increment.before.sigma, outcome.sigma, slip)[0]
    return float(increment.problem.system.weight @ density)


class Halves:
    """Solve an increment and its two halves, and return the halves where they agree with it.

    Errors are relative to the largest tractions and the largest slip of all increments of the step
    so far, accepted or not; the whole step is tried first. They are not relative to the increment's
    own tractions: a contact that grows from a point is self-similar, and its halves would differ by
    the same share at every load.

    Attributes
    ----------
    error : float
        Error of the last increment that was tried over the largest one allowed; nan where it has no
        solution.
    """

    def __init__(self, monitor: Monitor | None) -> None:
        self._monitor, self._first = monitor, list[Tried]()
        self._tractions = self._slip = self.error = 0.0

    def __call__(self, increment: Increment) -> list[Tried]:
        """Return both halves, or none where they differ from the increment.

        Where a solve fails, or a monitor stops it, return what is solved by then.
        """
        self.error = np.nan
        solved = [
            tried for tried in self._first if abs(tried[0].target - increment.target) < SOLVED
        ]
        whole = solved[0] if solved else self._solved(increment)
        self._first = []
        if not whole[1].converged:
            return [whole]
        half = increment.ending_at(0.5 * (increment.begun + increment.target))
        first = self._solved(half)
        if not first[1].converged:
            return [first]
        second = self._solved(half.then(increment.target, first[2]))
        if not second[1].converged:
            return [first, second]
        self.error = self._apart(whole, first, second)
        self._first = [first] if self.error > 1.0 else []
        return [] if self._first else [first, second]

    def _solved(self, increment: Increment) -> Tried:
        return with_wear(increment, increment.solved(self._monitor), self._monitor)

    def _apart(self, whole: Tried, first: Tried, second: Tried) -> float:
        """Return the largest difference between an increment and its halves, over what is allowed.

        What iterates differ by within their own residuals is allowed: to divide does not reduce it.
        """
        system, tries = whole[0].problem.system, (whole, first, second)
        weight, sigma, slip = system.weight, second[1].sigma, second[2].slip
        self._tractions = max(self._tractions, contact_norm(sigma, weight))
        moved = PATH_ERROR * contact_norm(system.operator.apply(sigma), weight)
        self._slip = max(self._slip, contact_norm(slip, weight), moved)
        once, *twice = (_dissipated(*each) for each in tries)
        stress, length = np.sum([_residual(*each) for each in tries], axis=0)
        energy = max(sum(twice), self._slip * self._tractions)
        pairs = (
            (
                contact_norm(sigma - whole[1].sigma, weight),
                PATH_ERROR * self._tractions + stress,
            ),
            (contact_norm(slip - whole[2].slip, weight), PATH_ERROR * self._slip + length),
            (
                abs(sum(twice) - once),
                ENERGY_ERROR * energy + stress * self._slip + length * self._tractions,
            ),
        )
        return max((a / b if b > 0.0 else np.inf for a, b in pairs if a > 0.0), default=0.0)
