"""Prediction by the surrogate T of S which nodes stick, slip or open.

It is made once the steps have cost as much as the prediction will.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...linalg.bordered import Elimination
from ..active_set.pivots import LinearSolver, Pivot, box_problem
from ..active_set.solvers import SurrogateActiveSetSolver
from ..law_protocol import ContactLaw
from ..linearisation import Linearisation
from ..system import ContactSystem, RigidModeConstraint, Surrogate

# Seconds of one core with a dense S of bodies in the plane, of 200 to 900 unknowns, of which about
# two thirds are active.
STEP, STEP_FLOP = 5e-4, 2e-11
"""A step with q unknowns takes STEP + STEP_FLOP q³ [s]."""
PREDICTION, PREDICTION_UNKNOWN = 1e-2, 5e-5
"""Setting T up and one prediction take PREDICTION + PREDICTION_UNKNOWN q [s]."""
LATE = (2, 8)
"""Least and largest number of steps with a dense S before a prediction. Most problems need no more
than 2; after 8, exchanges may have stopped reducing the wrong nodes (`pivots.PATIENCE`)."""
LOOSE, FORESIGHT = 1e-5, 20
"""Tolerance and number of exchanges of a prediction, which need not be exact."""


class Foresight:
    """Sets by the contact problem of T through an iterate.

    T is made once the steps have cost as much as that. Predictions go on as long as each leaves
    fewer wrong nodes.
    """

    def __init__(self, system: ContactSystem, law: ContactLaw, surrogate: Surrogate | None) -> None:
        self.surrogate, self._system, self._law = surrogate, system, law
        self._wait = 0 if surrogate is not None else steps_before(system.u_0.size)
        self._late, self._fewest, self._vain = surrogate is None, len(system.u_0) + 1, 0

    def __call__(self, step: Pivot) -> tuple[Array, Array]:
        """Return τ and σ of the prediction."""
        self._wait -= 1
        # so many predictions in turn may be in vain where a step costs less
        if self._wait > 0 or step.wrong == 0 or (self._late and self._vain > 3):
            return step.tau, step.sigma
        self._vain = 0 if step.wrong < self._fewest else self._vain + 1
        self._fewest = min(self._fewest, step.wrong)
        if self.surrogate is None:
            self.surrogate = prediction(self._system)
        if self.surrogate is None:
            return step.tau, step.sigma
        return self.through(self.surrogate, step.sigma, step.v, step.tau)

    def through(
        self, surrogate: Surrogate, sigma: Array, v: Array, tau: Array
    ) -> tuple[Array, Array]:
        """Return τ and σ that a surrogate predicts from given σ, v and τ."""
        modes, base = self._system.modes, v - surrogate.apply(sigma)
        last = box_problem(
            SurrogateActiveSetSolver(surrogate),
            self._law,
            base,
            tau,
            sigma,
            FORESIGHT,
            LOOSE,
            modes,
        )
        if last.wrong == 0 and not last.push.any():
            return last.linearised.tau, last.sigma
        # bodies that lose contact in T's problem give no prediction
        return (last.tau, last.sigma) if modes is None else (tau, sigma)


def prediction(system: ContactSystem) -> Surrogate | None:
    """Return T if there is one that costs less than the steps that it saves, else None."""
    surrogate = system.surrogate()
    return surrogate if getattr(surrogate, "predicts", True) else None


def first_guess(
    system: ContactSystem, surrogate: Surrogate, solver: LinearSolver
) -> tuple[Array, Array]:
    """Return σ and v of T's solution for full stick, on which T is scaled to S."""
    base, modes = system.u_0, system.modes
    stuck = Linearisation.all_stick(base)
    constraint = RigidModeConstraint(
        modes, stuck, np.zeros_like(base), float(np.abs(base).max(initial=0.0))
    )
    sigma, coordinates = Elimination(surrogate.solve, *constraint.spread(stuck.active))(
        -base, constraint.rhs
    )
    displacement = solver.apply(sigma)
    surrogate.fit(sigma, displacement)
    v = base + displacement
    return sigma, v if modes is None else v + modes.motion @ constraint.motion(coordinates)


def steps_before(unknowns: int) -> int:
    """Return the number of steps with a dense S that cost as much as T and a prediction.

    >>> steps_before(300), steps_before(900), steps_before(2000)
    (8, 4, 2)
    """
    price = (PREDICTION + PREDICTION_UNKNOWN * unknowns) / (STEP + STEP_FLOP * unknowns**3)
    return min(max(round(price), LATE[0]), LATE[1])
