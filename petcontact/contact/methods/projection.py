"""Algorithm 1: projection of the contact law, a Robin step, and a rule for ρ."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import SolverError
from ...given.tables.solver_options import Method
from ...record import record
from ...runtime.ranks import answered
from ..criterion import relative_residual, smooth_balance
from ..iteration import Iteration, Recorder
from ..law_protocol import ContactLaw, bound_excess, law_residual
from ..rho_rules import Rule, begun, make_rule
from ..state import ContactState
from ..system import ContactSystem
from .settling import settled

STALLED = 60
"""Iterations in which a run must halve its least change [-]: three times the 20 that one of the 128
cases of Tables 1 and 2 needs."""


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
        rules that have left ρ_0 as it is. An iterate near the solution moves little at a ρ far off,
        and would pass for converged.
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

        A run from the given ρ_0 that stalls is begun anew with a balanced one: c_k is used up on
        the way to it, and a body that only contact holds has been moved by load/ρ_0.

        Raises
        ------
        SolverError
            If an iterate or the rule's ρ is not finite, or ρ is not positive.
        """
        recorder = Recorder(law, system, iteration)
        if self.rho is not None and (iteration.rho is None or np.all(iteration.rho == self.rho)):
            end = self._run(recorder, self.rho, STALLED)
            if end.converged or end.stopped or recorder.exhausted:
                return end
        return self._run(recorder, smooth_balance(law, system), iteration.max_iterations)

    def _run(self, recorder: Recorder, rho: float | Array, patience: int) -> ContactState:
        """Return the end of Algorithm 1 from ρ_0.

        A run ends, too, if ρ has moved and the least change was not halved in `patience`
        iterations.
        """
        law, system, iteration = recorder.law, recorder.system, recorder.iteration
        v, sigma = (np.zeros_like(system.u_0),) * 2 if iteration.start is None else iteration.start
        # c_k belongs to one run (Lemma 3.1) and to one group of components
        rules, first = [begun(self.rule) for _ in law.groups], rho
        # the given start need not satisfy v = u_0 + Sσ: the first step is solved whole, later ones
        # for their increments
        consistent, least, waited = False, np.inf, 0
        while not recorder.exhausted:
            # (2.10); where R_ρ = 0, (2.9), also σ + ρv = σ + ρv - ωR_ρ, (2.11)
            old, residual = (v, sigma), law_residual(law, v, sigma, rho)
            if consistent:
                # (3.1) less what the iterate before satisfies: its equation for δv, δσ
                dv, dsigma = system.robin_increment(rho, -self.omega * residual)
                v, sigma = v + dv, sigma + dsigma
            else:
                # (3.1), (4.11): σ' + ρv' = σ + ρv - ωR_ρ(v, σ), with v' = u_0 + Sσ' from (4.12)
                new_v, new_sigma = system.robin(rho, sigma + rho * v - self.omega * residual)
                dv, dsigma, v, sigma = new_v - v, new_sigma - sigma, new_v, new_sigma
                consistent = True
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
            state = recorder.report(v, sigma, rho)
            if state.stopped:
                return state
            if (end := _settled(recorder, state, change)) is not None:
                return end
            rho = self._updated(rules, law, rho, balance, len(recorder.history))  # (4.2), (4.3)
            least, waited = (change, 0) if change <= least / 2.0 else (least, waited + 1)
            if waited >= patience and np.any(rho != first):
                return state
        relative = relative_residual(law, system, v, sigma, float(np.max(rho)), recorder.largest)
        reason = (
            f"max_iterations = {iteration.max_iterations} reached with change {change:.1e}, "
            f"relative friction residual {relative:.1e}, {bound_excess(law, sigma):.1e} beyond "
            f"the bound; the tolerance is {iteration.criterion.tolerance:g}"
        )
        return ContactState(v, sigma, rho, False, reason, recorder.history, law=law)

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
    v, sigma, rho = state.v, state.sigma, state.rho
    criterion, relative = recorder.iteration.criterion, np.inf
    if criterion.stop == "residual" or change <= criterion.tolerance:
        relative = relative_residual(
            recorder.law, recorder.system, v, sigma, float(np.max(rho)), recorder.largest
        )
    if not criterion.met(change, relative):
        return None
    reason = f"change {change:.1e}, relative friction residual {relative:.1e}"
    return settled(recorder, v, sigma, rho, reason)


def build(options: Method, rule: Rule | None) -> Projection:
    """Return the method that the options describe; a rule of the user replaces theirs."""
    return Projection(rule or make_rule(options), options.rho, options.omega)


def _checked(rho: float, k: int) -> float:
    if not (np.isfinite(rho) and rho > 0.0):
        raise SolverError(
            "iterate",
            f"the rule gave ρ = {rho} after iteration {k}",
            "a rule returns a positive number",
        )
    return float(rho)
