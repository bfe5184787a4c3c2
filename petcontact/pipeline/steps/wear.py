"""Archard's wear within an increment: h' = k p |w'| at each node, where the worn depth h opens the
gap on which p depends.

The slip is taken to grow evenly from the start to the end of the increment; it is the slip with the
wear of the increment included. The depth grows by the singly diagonal implicit Runge-Kutta method
of order 2 (Alexander, SIAM J. Numer. Anal. 14 (1977) 1006-1021) with γ = 1 - 1/√2:
h₁ = h₀ + γ k|Δw| p₁ at the share γ of the increment's loads,
h₂ = h₀ + k|Δw| ((1-γ) p₁ + γ p₂) at its end. Each stage is a contact problem whose gap opens by
γ k|Δw| times p, which is added to the diagonal of S.

The method is L-stable: an explicit one makes p jump from node
to node where k|Δw| exceeds 2 λ_min(S_nn), this one never. Its weights are positive and add up to 1:
depths never fall, and the volume is k times the force times the slip where that is the same
everywhere.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...contact.friction_law import lengths
from ...contact.state import ContactState, Start
from ...record import record, replace
from .increment import Increment, Monitor
from .prepared import IncrementState

GAMMA = 1.0 - np.sqrt(0.5)
Tried = tuple[Increment, ContactState, IncrementState]
"""An increment, where its method ended, and what it hands to the next."""


@record
class Earlier:
    """The same increment one cycle before: how far it slipped, and where its two stages start.

    Attributes
    ----------
    way : (M,) array
        |Δw| [length].
    starts : pair of starts
        v and σ of the two stages.
    growth : (M,) array or 0
        Growth of |Δw| a cycle [length].
    """

    way: Array
    starts: tuple[Start, Start]
    growth: Array | float = 0.0

    def mean(self, times: int) -> Array:
        """Return |Δw| in the middle of the next `times` cycles."""
        return np.clip(self.way + 0.5 * times * self.growth, 0.0, 2.0 * self.way)


def with_wear(increment: Increment, outcome: ContactState, monitor: Monitor | None) -> Tried:
    """Add to a solved increment the wear in it.

    A predictor takes the slip without wear, a corrector the slip of the predictor. This makes the
    method one of order 2.
    """
    plain = increment, outcome, increment.after(outcome)
    wear = increment.problem.discrete.wear
    if not (outcome.converged and wear.any()):
        return plain
    first = increment.before.start or (outcome.v, outcome.sigma)
    way = _way(increment, outcome)
    if not (wear * way).any():
        return plain
    predictor = Earlier(way, (first, (outcome.v, outcome.sigma)))
    tried, following = worn(increment, predictor, 1, monitor)
    if not tried[1].converged:
        return tried
    return worn(increment, Earlier(following.way, following.starts), 1, monitor)[0]


def worn(
    increment: Increment, earlier: Earlier, times: int, monitor: Monitor | None
) -> tuple[Tried, Earlier]:
    """Solve an increment with the wear of `times` equal ones; return it and its `Earlier`."""
    whole = times * increment.problem.discrete.wear * earlier.mean(times)
    before, (first, second) = increment.before, earlier.starts
    middle = replace(
        increment,
        target=increment.begun + GAMMA * (increment.target - increment.begun),
        layer=GAMMA * whole,
        before=replace(before, start=first, trend=None),
    )
    outcome = middle.solved(monitor)
    if not outcome.converged:
        return (middle, outcome, middle.after(outcome)), earlier
    depth = before.worn + (1.0 - GAMMA) * whole * np.maximum(-outcome.sigma[:, -1], 0.0)
    end = replace(
        increment, layer=GAMMA * whole, before=replace(before, start=second, worn=depth, trend=None)
    )
    last = end.solved(monitor)
    starts = (outcome.v, outcome.sigma), (last.v, last.sigma)
    way = _way(end, last)
    return (end, last, end.after(last)), Earlier(way, starts, (way - earlier.way) / times)


def _way(increment: Increment, outcome: ContactState) -> Array:
    return lengths(outcome.v[:, : increment.problem.system.components - 1])
