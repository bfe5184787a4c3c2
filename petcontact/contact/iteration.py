"""Data that all contact methods get besides the system and the law, and the record that they
keep."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from ..arrays import Array
from ..errors import SolverError
from ..record import record
from ..round_off import CHAINED
from .active_set.block_factors import BlockFactors
from .criterion import (
    Criterion,
    balanced,
    equilibrium_defect,
    moves,
    natural_residuals,
    without_motions,
)
from .friction_law import contact_norm, group_norms
from .law_protocol import WITHIN, ContactLaw, bound_excess, law_residual
from .rho_rules import usable_balance
from .state import ContactState, History, Monitor, Start
from .system import ContactSystem, is_monolithic


@record
class Iteration:
    """Stopping criterion, start and monitor of a contact method.

    Attributes
    ----------
    criterion : Criterion
    max_iterations : int
    start : pair of (m, k) arrays, optional
        Initial v [length] and σ [stress]; the method's own choice by default.
    monitor : callable, optional
        Called with the state after each iteration. If it returns a reason, the method ends.
    rho : float, optional
        Last ρ of the run from whose end this one starts [stress/length].
    pairs : sequence of slice
        The nodes of each pair.
    factors : BlockFactors
        Factors of the last active set of a dense S, for runs on the same S.
    """

    criterion: Criterion
    max_iterations: int
    start: Start | None = None
    monitor: Monitor | None = None
    rho: float | None = None
    pairs: Sequence[slice] = (slice(None),)
    factors: BlockFactors = field(default_factory=BlockFactors, repr=False, compare=False)


class ContactMethod(Protocol):
    """A contact method: a function, or an object that holds its parameters."""

    def __call__(
        self, system: ContactSystem, law: ContactLaw, iteration: Iteration
    ) -> ContactState:
        """Return v and σ on Γ_C that satisfy v = u_0 + S σ and the law.

        Raises
        ------
        SolverError
            If a solve or an iterate fails.
        """
        ...


class Judgement(NamedTuple):
    """An iterate (m, k), its balanced ρ and R_ρ, and three norms.

    They are the norms of the displacement (`criterion.moves`), of σ and of R_ρ.
    """

    v: Array
    sigma: Array
    rho: float | Array
    residual: Array
    size: float
    traction: float
    left: float


@dataclass
class Recorder:
    """History, monitor and judged iterates of one run of a method.

    Attributes
    ----------
    law : ContactLaw
    system : ContactSystem
    iteration : Iteration
    history : History
    largest : float
        Largest ‖σ‖ so far.
    """

    law: ContactLaw
    system: ContactSystem
    iteration: Iteration
    history: History = field(default_factory=History)
    largest: float = 0.0
    _judged: Judgement | None = None

    def step(
        self,
        old: Start,
        v: Array,
        sigma: Array,
        dv: Array,
        dsigma: Array,
        *,
        ksp_iterations: int,
        rho: float | Array | None = None,
        residual: Array | None = None,
    ) -> tuple[float, float | Array]:
        """Record the step from `old` to (v, σ); return its relative change and its balance w.

        The balance has one value for each group of components. `rho` and `residual` are ρ and R_ρ
        of the old iterate; balanced ones are used if both are missing.

        Raises
        ------
        SolverError
            If the iterate is not finite.
        """
        law, system = self.law, self.system
        norms = functools.partial(group_norms, system.weight, law.groups)
        # motions without traction do not depend on S
        (moved, *_), (pushed, *given), (_, *strained) = norms(
            dv, dsigma, without_motions(system, dv)
        )
        if rho is None:
            before, after = self.judged(*old), self.judged(v, sigma)
            rho, left, size, traction = before.rho, before.left, after.size, after.traction
        else:
            assert residual is not None
            (left, *_), (size, *_), (traction, *_) = norms(residual, moves(law, system, v), sigma)
        change = self.iteration.criterion.change(moved, size, pushed, traction)
        if not math.isfinite(change):
            raise SolverError(
                "iterate",
                f"iterate {len(self.history) + 1} is not finite (ρ = {rho})",
                "choose another rho or method",
            )
        balances = [usable_balance(*pair) for pair in zip(given, strained, strict=True)]
        balance = balances[0] if len(balances) == 1 else np.array(balances)
        self.history.add(rho, balance, change, left, ksp_iterations)
        self.largest = max(self.largest, traction)
        return change, balance

    def balanced(self, v: Array, sigma: Array) -> float | Array:
        """Return the balanced ρ of an iterate."""
        return self.judged(v, sigma).rho

    def judged(self, v: Array, sigma: Array) -> Judgement:
        """Return the judgement of an iterate; the last one is stored for the next step."""
        judgement = self._judged
        if judgement is None or judgement.v is not v or judgement.sigma is not sigma:
            rho, size, traction = balanced(self.law, self.system, v, sigma)
            residual = law_residual(self.law, v, sigma, rho)
            left = contact_norm(residual, self.system.weight)
            judgement = self._judged = Judgement(v, sigma, rho, residual, size, traction, left)
        return judgement

    def missed(self, v: Array, sigma: Array) -> float:
        """Return the largest residual of the law over pairs and groups, by which results are
        judged.

        Tractions below the tolerance of the largest ones so far count as that: they may vanish.
        """
        iteration = self.iteration
        least = iteration.criterion.tolerance * self.largest
        return max(natural_residuals(self.law, self.system, v, sigma, iteration.pairs, least))

    def within_limits(
        self, v: Array, sigma: Array, rho: float | Array, tolerance: float
    ) -> Start | None:
        """Return a solved iterate with σ within the law's limits and in equilibrium, or None.

        σ may exceed its bound by the share WITHIN. A larger σ is projected, σ = -Π(ρv - σ) with the
        method's ρ, and v follows. The result is None if the law then exceeds the tolerance, or
        equilibrium is lost.
        """
        if bound_excess(self.law, sigma) > WITHIN:
            inside = -self.law.project(rho * v - sigma)
            v, sigma = v + self.system.apply(inside - sigma), inside
            if self.missed(v, sigma) > tolerance or bound_excess(self.law, sigma) > WITHIN:
                return None
        allowed = tolerance if is_monolithic(self.system) else CHAINED
        return (v, sigma) if equilibrium_defect(self.system, sigma) <= allowed else None

    def report(
        self,
        v: Array,
        sigma: Array,
        rho: float | Array,
        reason: str = "",
        *,
        converged: bool = False,
    ) -> ContactState:
        """Return the state after the recorded step, after the monitor has seen it."""
        reason = reason or f"stopped in iteration {len(self.history)}"
        state = ContactState(v, sigma, rho, converged, reason, self.history, law=self.law)
        if self.iteration.monitor is not None and (said := self.iteration.monitor(state)):
            state.reason, state.converged, state.stopped = said, False, True
        return state

    @property
    def exhausted(self) -> bool:
        """Whether no iteration is left."""
        return len(self.history) >= self.iteration.max_iterations
