"""What all methods are given besides the system and the law, and what all of them keep account
of."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from ..arrays import Array
from ..errors import SolverError
from ..frozen import frozen
from ..round_off import CHAINED, SUMMED, of_vectors
from .criterion import (
    Criterion,
    balanced,
    equilibrium_defect,
    moves,
    over_traction,
    without_motions,
)
from .friction_law import contact_norm, group_norms
from .law_protocol import WITHIN, ContactLaw, bound_excess, law_residual
from .rho_rules import usable_balance
from .state import ContactState, History, Monitor, Start
from .system import ContactSystem, is_monolithic


@frozen
class Iteration:
    """When a method stops, where it starts, and who looks on.

    Attributes
    ----------
    criterion : Criterion
    max_iterations : int
    start : pair of (m, k) arrays, optional
        Initial v [length] and σ [stress]; the method's own choice by default.
    monitor : callable, optional
        Called with the state so far after each iteration; a reason that it returns ends the method.
    """

    criterion: Criterion
    max_iterations: int
    start: Start | None = None
    monitor: Monitor | None = None


class ContactMethod(Protocol):
    """A method is a function, or an object that holds its parameters."""

    def __call__(
        self, system: ContactSystem, law: ContactLaw, iteration: Iteration
    ) -> ContactState:
        """v and σ on Γ_C that satisfy v = u_0 + S σ and the law.

        Raises
        ------
        SolverError
            If a solve or an iterate fails.
        """
        ...


class Judgement(NamedTuple):
    """An iterate (m, k) with its balanced ρ, R_ρ, and the norms of displacement
    (`criterion.moves`), σ and R_ρ."""

    v: Array
    sigma: Array
    rho: float | Array
    residual: Array
    size: float
    traction: float
    left: float


@dataclass
class Recorder:
    """The rows of history of one run, the monitor, and the judgement of each iterate.

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
        """Note the step from `old` to (v, σ): its relative change, and its balance w, one for each
        group of components.

        ρ and R_ρ of the old iterate are those given, both, or balanced ones.

        Raises
        ------
        SolverError
            If the iterate is not finite.
        """
        law, system = self.law, self.system
        norms = functools.partial(group_norms, system.weight, law.groups)
        # motions that cost no traction say nothing of S
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
        balances = [usable_balance(*each) for each in zip(given, strained, strict=True)]
        balance = balances[0] if len(balances) == 1 else np.array(balances)
        self.history.add(rho, balance, change, left, ksp_iterations)
        self.largest = max(self.largest, traction)
        return change, balance

    def balanced(self, v: Array, sigma: Array) -> float | Array:
        """The balanced ρ of an iterate."""
        return self.judged(v, sigma).rho

    def judged(self, v: Array, sigma: Array) -> Judgement:
        """An iterate by its balanced ρ; asked for again as the old one of the next step."""
        known = self._judged
        if known is None or known.v is not v or known.sigma is not sigma:
            rho, size, traction = balanced(self.law, self.system, v, sigma)
            residual = law_residual(self.law, v, sigma, rho)
            left = contact_norm(residual, self.system.weight)
            known = self._judged = Judgement(v, sigma, rho, residual, size, traction, left)
        return known

    def relative(self, v: Array, sigma: Array) -> float:
        """Residual of the law, ‖R_ρ‖/‖σ‖, of an iterate (`relative_residual`)."""
        known = self.judged(v, sigma)
        noise = known.rho * of_vectors(v, self.system.u_0, share=SUMMED)
        return over_traction(
            known.left,
            contact_norm(np.broadcast_to(noise, v.shape), self.system.weight),
            known.traction,
        )

    def within_limits(
        self, v: Array, sigma: Array, rho: float | Array, tolerance: float
    ) -> Start | None:
        """An iterate that is as good as solved with σ within what the law allows to WITHIN of the
        bound, and in equilibrium.

        Where σ is outside it is put back, σ = -Π(ρv - σ) with the method's ρ, and v follows. None
        if the law does not hold to the tolerance then, or equilibrium is lost.
        """
        if bound_excess(self.law, sigma) > WITHIN:
            inside = -self.law.project(rho * v - sigma)
            v, sigma = v + self.system.apply(inside - sigma), inside
            if self.relative(v, sigma) > tolerance or bound_excess(self.law, sigma) > WITHIN:
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
        """The state after the step just noted, which the monitor sees."""
        reason = reason or f"stopped in iteration {len(self.history)}"
        state = ContactState(v, sigma, rho, converged, reason, self.history, law=self.law)
        if self.iteration.monitor is not None and (said := self.iteration.monitor(state)):
            state.reason, state.converged, state.stopped = said, False, True
        return state

    @property
    def exhausted(self) -> bool:
        """Whether no iteration is left."""
        return len(self.history) >= self.iteration.max_iterations
