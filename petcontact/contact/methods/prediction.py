"""Prediction by the surrogate T of S which nodes stick, slip or open."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...linalg.bordered import BorderedElimination
from ..active_set.pivots import LinearSolver, Pivot, box_problem
from ..active_set.solvers import SurrogateActiveSetSolver
from ..law_protocol import ContactLaw
from ..linearisation import Linearisation
from ..system import ContactSystem, RigidModeConstraint, Surrogate

LOOSE, FORESIGHT = 1e-5, 20
"""Tolerance and number of exchanges of a prediction, which need not be exact."""


class Foresight:
    """Sets by the contact problem of T through an iterate."""

    def __init__(self, system: ContactSystem, law: ContactLaw, surrogate: Surrogate) -> None:
        self._surrogate, self._system, self._law = surrogate, system, law

    def __call__(self, step: Pivot) -> tuple[Array, Array]:
        """Return τ and σ of the prediction after a step."""
        if step.wrong == 0:
            return step.tau, step.sigma
        return self.through(step.sigma, step.v, step.tau)

    def first(self, solver: LinearSolver, stuck: Array) -> tuple[Array, Array, Array]:
        """Return τ, σ and v of the first iterate, from T's solution for full stick."""
        sigma, v = first_guess(self._system, self._surrogate, solver)
        return *self.through(sigma, v, stuck), v

    def through(self, sigma: Array, v: Array, tau: Array) -> tuple[Array, Array]:
        """Return τ and σ that T predicts from given σ, v and τ."""
        modes, base = self._system.modes, v - self._surrogate.apply(sigma)
        last = box_problem(
            SurrogateActiveSetSolver(self._surrogate),
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
    sigma, coordinates = BorderedElimination(surrogate.solve, *constraint.spread(stuck.active))(
        -base, constraint.rhs
    )
    displacement = solver.apply(sigma)
    surrogate.fit(sigma, displacement)
    v = base + displacement
    return sigma, v if modes is None else v + modes.motion @ constraint.motion(coordinates)
