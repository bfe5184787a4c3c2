"""Semismooth Newton (primal-dual active set) on v = u_0 + S σ + M α, E σ + f = 0.

Each iteration solves the linear equations of `active_set`. If a solve with S costs more than T, the
surrogate T predicts which nodes stick, slip or open. The prediction is the solution of the contact
problem of T through the last iterate, v + T(q - σ). Its set is nearly right, so that two to four
solves with S are enough. Without prediction, nodes that violate an inequality are exchanged, in
about ten steps. If the sets of Coulomb's law cycle, steps are damped. Then the iteration starts
again from other sets.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator
from functools import cached_property

import numpy as np

from ...arrays import Array, States
from ...errors import SolverError
from ...given.tables.solver_options import Method
from ...record import record, replace
from ...round_off import CHAINED
from ..active_set.monolithic import MonolithicSolver
from ..active_set.pivots import PATIENCE, LinearSolver, Pivot, next_tau, pivots
from ..active_set.solvers import active_set_solver
from ..criterion import equilibrium_defect
from ..equilibrium import unbalanced_load
from ..iteration import Iteration, Recorder
from ..law_protocol import OPEN, ContactLaw
from ..laws import SignoriniCoulomb
from ..linearisation import Linearisation
from ..rho_rules import Rule
from ..state import ContactState
from ..system import ContactSystem, is_monolithic
from .free_motions import lies_free, touching
from .prediction import LOOSE, Foresight, prediction
from .starts import Guess, stuck_everywhere, tau_of


@record
class SemismoothNewton:
    """Newton's method on the contact law; it ends when no node is wrong, exact up to round-off.

    Attributes
    ----------
    predict : bool, optional
        Whether T predicts the sets. By default it does not if S is dense and small. It does not
        either if rigid motions are unknown and friction has disks, along which T's problem does not
        slip.
    """

    predict: bool | None = None

    def __call__(
        self, system: ContactSystem, law: ContactLaw, iteration: Iteration
    ) -> ContactState:
        """Solve as `ContactMethod`, from full stick or T's own solution.

        The criterion's tolerance bounds the relative residuals of converged results.
        """
        linear = system.modes is None or law.groups[0].stop == 1
        predict = self.predict
        if predict is None:
            # steps with a dense S cost less than T does to set up, except many for Tresca's law
            many = system.u_0.size > 300 and len(law.groups) == 1
            predict = linear and (system.matrix_free or many)
        # a mixed system's step costs no more than T does to set up
        mixed, asked = is_monolithic(system), system.matrix_free or predict
        surrogate = prediction(system) if asked and not mixed else None
        foretell = None
        if surrogate is not None:
            surrogate.rtol = LOOSE
            foretell = Foresight(system, law, surrogate) if predict else None
        solver = (
            MonolithicSolver(system, iteration.criterion.tolerance)
            if is_monolithic(system)
            else active_set_solver(system, surrogate, iteration.factors)
        )
        with contextlib.closing(solver):
            run = _Run(system, law, iteration, solver, foretell)
            state = run.at_rest() if iteration.start is None else None
            state = state or run.state(_first_guess(system, law, iteration, solver, foretell))
            # what jams keeps its tractions
            return state if state.sigma.any() else run.at_rest() or state


def build(options: Method, rule: Rule | None) -> SemismoothNewton:
    """Return the method that the options describe."""
    return SemismoothNewton()


def _first_guess(
    system: ContactSystem,
    law: ContactLaw,
    iteration: Iteration,
    solver: LinearSolver,
    foretell: Foresight | None,
) -> Guess:
    base = system.u_0
    stuck = stuck_everywhere(base, law)
    start = iteration.start
    if start is None and is_monolithic(system) and system.modes is None and len(law.groups) > 1:
        # nodes that do not meet without contact need not be solved for, nor preconditioned, as
        # closed ones
        start = base, np.zeros_like(base)
    if start is not None:
        v, sigma = start
        tau = tau_of(v, sigma)
        # v of a solution that sticks is round-off; without tractions only v says what is closed
        if sigma.any():
            tau = next_tau(Linearisation.from_law(law, tau), law, sigma, v, 0.0)[0]
        return tau, sigma, v
    if foretell is not None:
        return foretell.first(solver, stuck)
    return stuck, np.zeros_like(base), base


class _Run:
    """One run of the method: attempts from several sets, with one history."""

    def __init__(
        self,
        system: ContactSystem,
        law: ContactLaw,
        iteration: Iteration,
        solver: LinearSolver,
        foretell: Foresight | None,
    ) -> None:
        self.system = system
        self.law = law
        self.iteration = iteration
        self.solver = solver
        self.foretell = foretell
        self.recorder = Recorder(law, system, iteration)
        self.ended = ""
        self.last = deque[States](maxlen=PATIENCE)
        self.step: Pivot | None = None
        self.unheld = False

    def at_rest(self) -> ContactState | None:
        """Return the state without motion if it is a solution, else None.

        It has the smallest motion of all solutions for bodies that contact holds.
        """
        v, modes = self.system.u_0, self.system.modes
        if modes is None or not lies_free(self.system, self.law):
            return None
        sigma, still = np.zeros_like(v), np.zeros(len(modes.load))
        return self._judged(
            Pivot(sigma, v, still, Linearisation.from_law(self.law, v), v, 0, still), sigma, v
        )

    def state(self, first: Guess) -> ContactState:
        """Return the end of the first attempt that converges, or of the last one.

        If contact cannot hold the loads, there is no further attempt.
        """
        state, failure = None, None
        for tau, sigma, v in self._starts(first):
            try:
                state = self._attempt(tau, sigma, v)
            except SolverError as error:
                # sets on the way may leave equations that nearly are singular: those of another
                # start need not
                failure = failure or error
                continue
            if state.converged or state.stopped or self.recorder.exhausted or self._overloaded:
                break
        if state is None:
            assert failure is not None
            raise failure
        return state

    @cached_property
    def _overloaded(self) -> bool:
        return unbalanced_load(self.system.modes, self.law) is not None

    def _starts(self, first: Guess) -> Iterator[Guess]:
        """Yield starts of attempts: the first guess, that of a solve without a start, then sets by
        complementary pivots.

        Zones of another mesh may close nodes that no load closes. Nodes whose sets cycle are
        pivoted on alone, at most three times and while there are more of them, then all that are
        near. Where the loads move a body no sets cycle.
        """
        yield first
        if self.iteration.start is not None and not self.unheld:
            cold = replace(self.iteration, start=None)
            yield _first_guess(self.system, self.law, cold, self.solver, self.foretell)
        near, law = np.zeros(len(first[0]), dtype=bool), self.law
        if type(law) is not SignoriniCoulomb:
            return
        from ..active_set.complementarity import complementary_guesses

        for _ in range(3):
            known = near.sum()
            near = near | np.any([states != self.last[-1] for states in self.last], axis=0)
            if self.step is None or self.unheld or near.sum() == known:
                break
            pieces = self.step.linearised, self.step.sigma
            yield from complementary_guesses(self.system, law, near, pieces)
        closed = np.any([states != OPEN for states in self.last], axis=0)
        near = closed if closed.any() else ~closed
        yield from complementary_guesses(self.system, law, near)

    def _attempt(self, tau: Array, sigma: Array, v: Array) -> ContactState:
        """Solve until no node is wrong, the sets repeat, or the loads have no equilibrium."""
        recorder = self.recorder
        state: ContactState | None = None
        alpha, tries, pushed = None, 0, None
        while True:
            for step in self._steps(tau, sigma, alpha):
                state = self._judged(step, sigma, v)
                self.last.append(self.law.states(step.tau))
                self.step = step
                sigma, v, alpha = step.sigma, step.v, step.alpha
                if state.converged or state.stopped or recorder.exhausted:
                    return state
                if step.wrong == 0 and step.push.any():
                    tries, pushed, against = tries + 1, step, False
                    break
            else:
                assert state is not None
                if pushed is None:
                    return self._failed(state, self.ended)
                # nothing stopped the bodies where the loads push them
                step, pushed, against = pushed, None, True
            # nodes are made to stick or to close so often because the loads are not in
            # equilibrium
            lost = tries > 3 or self._overloaded
            touched = None if lost else touching(self.system, self.law, step, against=against)
            if touched is None:
                self.unheld = not against
                why = "no equilibrium: the loads move a body that contact does not hold"
                return self._failed(state, self.ended if against else why)
            tau, sigma, v, alpha = touched, step.sigma, step.v, step.alpha

    def _failed(self, state: ContactState, why: str) -> ContactState:
        if self._overloaded:
            why = (
                "no equilibrium: the loads are more than contact and friction at the nodes can hold"
            )
        state.reason, state.unheld = f"{why}; {state.reason}", self.unheld
        return state

    def _steps(self, tau: Array, sigma: Array, alpha: Array | None) -> Iterator[Pivot]:
        system = self.system
        self.ended = yield from pivots(
            self.solver,
            self.law,
            system.u_0,
            system.modes,
            tau,
            sigma=sigma,
            alpha=alpha,
            predict=self.foretell,
        )

    def _judged(self, step: Pivot, old_sigma: Array, old_v: Array) -> ContactState:
        """Record and judge a step; return its state."""
        recorder, system = self.recorder, self.system
        sigma, v = step.sigma, step.v
        recorder.step(
            (old_v, old_sigma),
            v,
            sigma,
            v - old_v,
            sigma - old_sigma,
            ksp_iterations=self.solver.ksp_iterations,
        )
        recorder.history.exchanged.append(step.wrong)
        relative = recorder.missed(v, sigma)
        defect = self.solver.defect if isinstance(self.solver, MonolithicSolver) else 0.0
        tolerance = self.iteration.criterion.tolerance
        solved = max(relative, defect) <= tolerance and (step.wrong == 0 or relative <= CHAINED)
        within = (
            recorder.within_limits(v, sigma, recorder.balanced(v, sigma), tolerance)
            if solved
            else None
        )
        v, sigma = within or (v, sigma)
        reason = f"{step.wrong} nodes on the wrong side, relative friction residual {relative:.1e}"
        if system.modes is not None:
            reason += f", equilibrium {equilibrium_defect(system, sigma):.1e}"
        if defect > tolerance:
            reason += f", elastic residual {defect:.1e}"
        state = recorder.report(
            v, sigma, recorder.balanced(v, sigma), reason, converged=within is not None
        )
        state.alpha = step.alpha
        state.direct = getattr(self.solver, "direct", None) is not None
        return state
