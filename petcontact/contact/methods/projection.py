"""Algorithm 1: projection of the contact law, a Robin step, and a rule for ρ."""

from __future__ import annotations

import contextlib

import numpy as np

from ...arrays import Array
from ...errors import SolverError
from ...given.tables.solver_options import Method
from ...record import record
from ...round_off import SOLVED, TINY
from ...runtime.ranks import answered
from ..criterion import smooth_balance
from ..iteration import Iteration, Recorder
from ..law_protocol import ContactLaw, bound_excess, law_residual
from ..rho_rules import Fixed, Rule, begun, make_rule
from ..state import ContactState, Start
from ..system import ContactSystem
from .free_motions import in_equilibrium, lies_free
from .newton import SemismoothNewton
from .settling import settled

STALLED = 60
"""Iterations in which a run must halve its least change [-]: three times the 20
that one of the 128 cases of Tables 1 and 2 needs."""


@record
class Projection:
    """Algorithm 1 of the paper.

    Attributes
    ----------
    rule : Rule
        Returns ρ_{k+1}: `rho_rules.Fixed`, `SelfAdaptive` (4.2), `Modified` (4.3), or any object
        with `update(rho, balance)`. Each run begins with a copy of it.
    rho : float, optional
        ρ_0 > 0 of the first run [stress/length]. Other runs begin with `smooth_balance`, but for
        rules that have left ρ_0 as it is, whose runs go on where others stall. An iterate near the
        solution moves little at a ρ far off, and would pass for converged.
    omega : float
        ω in (0, 2) [-].
    """

    rule: Rule
    rho: float | None
    omega: float

    def __call__(
        self, system: ContactSystem, law: ContactLaw, iteration: Iteration
    ) -> ContactState:
        """Solve as `ContactMethod`, from zero.

        A run from the given ρ_0 that stalls or overflows is begun anew with a balanced one: c_k is
        used up on the way to it, and a body that only contact holds has been moved by load/ρ_0.
        Later runs that stall go on from their iterate with its own balanced ρ: that of smooth
        tractions is far off where few nodes touch. Where a body lies free, nothing would take such
        a motion back: it stays at rest.

        Raises
        ------
        SolverError
            If an iterate or the rule's ρ is not finite, or ρ is not positive.
        """
        start = iteration.start
        if (start is None or not start[1].any()) and lies_free(system, law):
            return SemismoothNewton(predict=False)(system, law, iteration)
        recorder = Recorder(law, system, iteration)
        if self.rho is not None and (iteration.rho is None or np.all(iteration.rho == self.rho)):
            with contextlib.suppress(SolverError):
                end = self._run(recorder, self.rho)
                if end.converged or end.stopped or recorder.exhausted:
                    return end
            # the largest ‖σ‖ so far is that of one run
            recorder = Recorder(law, system, iteration, recorder.history)
        end = self._run(recorder, smooth_balance(law, system))
        while not (end.converged or end.stopped or recorder.exhausted):
            end = self._run(recorder, recorder.balanced(end.v, end.sigma), (end.v, end.sigma))
        return end

    def _run(
        self, recorder: Recorder, first: float | Array, start: Start | None = None
    ) -> ContactState:
        """Return the end of Algorithm 1 from ρ_0.

        A run ends, too, if it stalls and ρ has moved, or nothing moves.
        """
        law, rho, begin = recorder.law, first, len(recorder.history)
        start = start or recorder.iteration.start or (np.zeros_like(recorder.system.u_0),) * 2
        state = ContactState(*start, first, False, "", recorder.history, law=law)
        # c_k belongs to one run (Lemma 3.1) and to one group of components
        rules = [begun(self.rule) for _ in law.groups]
        while not recorder.exhausted:
            whole = len(recorder.history) == begin
            state, change, balance = self._step(recorder, (state.v, state.sigma), rho, whole=whole)
            if state.stopped:
                return state
            moved = recorder.history.change[begin:]
            if isinstance(self.rule, Fixed):  # others leave ρ only where it is balanced
                change = _with_rest(moved)
            if (end := _settled(recorder, state, change)) is not None:
                return end
            rho = self._updated(rules, law, rho, balance, len(recorder.history))  # (4.2), (4.3)
            if _stalled(moved) and (moved[-1] == 0.0 or np.any(rho != self.rho)):
                return state
        return _unfinished(recorder, state)

    def _step(
        self, recorder: Recorder, old: Start, rho: float | Array, *, whole: bool
    ) -> tuple[ContactState, float, float | Array]:
        """Return the next iterate, its relative change and its balance w.

        The given start need not satisfy v = u_0 + Sσ: the first step is solved whole, later ones
        for their increments.
        """
        system, sigma = recorder.system, old[1]
        v = in_equilibrium(system, recorder.law, *old, rho)
        # (2.10); where R_ρ = 0, (2.9), also σ + ρv = σ + ρv - ωR_ρ, (2.11)
        residual = law_residual(recorder.law, v, sigma, rho)
        if whole:
            # (3.1), (4.11): σ' + ρv' = σ + ρv - ωR_ρ(v, σ), with v' = u_0 + Sσ' from (4.12)
            v, sigma = system.robin(rho, sigma + rho * v - self.omega * residual)
            dv, dsigma = v - old[0], sigma - old[1]
        else:
            # (3.1) less what the iterate before satisfies: its equation for δv, δσ
            strain, dsigma = system.robin_increment(rho, -self.omega * residual)
            dv, v, sigma = v - old[0] + strain, v + strain, sigma + dsigma
        change, balance = recorder.step(
            old,
            v,
            sigma,
            dv,
            dsigma,
            rho=rho,
            residual=residual,
            ksp_iterations=system.ksp_iterations,
        )
        return recorder.report(v, sigma, rho), change, balance

    @staticmethod
    def _updated(
        rules: list[Rule], law: ContactLaw, rho: float | Array, balance: float | Array, k: int
    ) -> float | Array:
        """Return ρ_{k+1} of each group of components."""
        if len(rules) == 1:
            if np.isnan(balance):
                return rho
            return _checked(answered(rules[0].update)(rho, balance), k)
        new = np.array(np.broadcast_to(rho, law.k))
        for rule, group, w in zip(rules, law.groups, np.atleast_1d(balance), strict=True):
            if not np.isnan(w):
                new[group] = _checked(answered(rule.update)(float(new[group][0]), float(w)), k)
        return new


def _settled(recorder: Recorder, state: ContactState, change: float) -> ContactState | None:
    """Return the end of a run whose last change meets the criterion, or None."""
    criterion, relative = recorder.iteration.criterion, np.inf
    if criterion.stop == "residual" or change <= criterion.tolerance:
        relative = recorder.missed(state.v, state.sigma)
    if not criterion.met(change, relative):
        return None
    return settled(
        recorder,
        state.v,
        state.sigma,
        state.rho,
        f"change {change:.1e}, relative friction residual {relative:.1e}",
    )


def _unfinished(recorder: Recorder, state: ContactState) -> ContactState:
    """Return the end of a run that has no iteration left."""
    iteration, relative = recorder.iteration, recorder.missed(state.v, state.sigma)
    state.reason = (
        f"max_iterations = {iteration.max_iterations} reached with change "
        f"{recorder.history.change[-1]:.1e}, relative friction residual {relative:.1e}, "
        f"{bound_excess(recorder.law, state.sigma):.1e} beyond the bound; the tolerance is "
        f"{iteration.criterion.tolerance:g}"
    )
    return state


def _with_rest(changes: list[float]) -> float:
    """Return what is still to come after steps at one ρ, or their last change if that is more.

    They contract at one rate r, which the last two changes show, so that r/(1 - r) of the last one
    is to come (Banach). Changes by round-off show no rate.
    """
    before, last = [*changes[:1], *changes][-2:]  # the first one shows no rate
    return last if last <= SOLVED else last * max(1.0, last / max(before - last, TINY))


def _stalled(changes: list[float]) -> bool:
    """Return whether the last changes are at least half of the least one before."""
    before, last = changes[:-STALLED], changes[-STALLED:]
    return bool(before) and min(last) >= min(before) / 2.0


def build(options: Method, rule: Rule | None) -> Projection:
    """Return the method that the options describe; a rule of the user replaces theirs."""
    return Projection(rule or make_rule(options), options.rho, options.omega)


def _checked(rho: float, k: int) -> float:
    try:
        number = float(rho)
    except (TypeError, ValueError):
        number = np.nan
    if not 0.0 < number < np.inf:
        raise SolverError(
            "iterate",
            f"the rule gave ρ = {rho} after iteration {k}",
            "a rule returns a positive number",
        )
    return number
