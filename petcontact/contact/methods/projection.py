"""Algorithm 1: projection of the friction condition, a Robin step, and a rule for ρ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...arrays import Array
from ...compliance.base import ContactSystem
from ...errors import SolverError
from ..friction_law import balanced_rho, contact_norm, projection_residual
from ..rho_rules import Rule, usable_balance
from ..state import ContactState, History

Stop = Literal["both", "displacement", "residual"]
SLACK = 1e3
"""How much larger than the tolerance the relative friction residual may be when the change has met it: a change that is
small only because ρ is far off is no convergence."""


@dataclass(frozen=True)
class Criterion:
    """The stopping criterion of section 5, and two others.

    Attributes
    ----------
    tolerance : float
    stop : {"both", "displacement", "residual"}
        Relative change of u_t and σ_t together (the paper's), of u_t alone, or ‖R_ρ‖/‖σ_t‖ with the balanced ρ.
    """

    tolerance: float
    stop: Stop = "both"

    def change(self, u: Array, sigma: Array, du: Array, dsigma: Array, weight: Array) -> float:
        """The relative change of a step that led to (u, σ)."""
        moved, size = contact_norm(du, weight), contact_norm(u, weight)
        if self.stop != "displacement":
            moved, size = moved + contact_norm(dsigma, weight), size + contact_norm(sigma, weight)
        return moved / size if size > 0.0 else (0.0 if moved == 0.0 else np.inf)

    def relative_residual(
        self, u: Array, sigma: Array, bound: Array, weight: Array, rho: float, scale: float = 0.0
    ) -> float:
        """‖R_ρ‖/‖σ_t‖ with the balanced ρ: independent of the method's ρ and of units.

        `scale` is the largest ‖σ_t‖ seen so far: where friction vanishes σ_t itself does, and cannot be its own measure.
        """
        balanced = balanced_rho(u, sigma, weight, rho)
        size = max(contact_norm(sigma, weight), scale) or balanced * contact_norm(u, weight)
        residual = contact_norm(projection_residual(u, sigma, bound, balanced), weight)
        return residual / size if size > 0.0 else 0.0

    def met(self, change: float, relative_residual: float) -> bool:
        """Whether the method may stop."""
        if self.stop == "residual":
            return relative_residual <= self.tolerance
        return change <= self.tolerance and relative_residual <= SLACK * self.tolerance


def project(
    system: ContactSystem,
    rule: Rule,
    *,
    rho: float,
    omega: float,
    criterion: Criterion,
    max_iterations: int,
    start: tuple[Array, Array] | None = None,
    monitor: Callable[[ContactState], None] | None = None,
) -> ContactState:
    """Algorithm 1 of the paper on a contact system.

    Parameters
    ----------
    system : ContactSystem
    rule : Rule
        Gives ρ_{k+1}; `rules.Fixed`, `SelfAdaptive` (4.2), `Modified` (4.3), or any object with `update(rho, balance)`.
    rho : float
        ρ_0 > 0 [stress/length].
    omega : float
        ω in (0, 2) [-].
    criterion : Criterion
    max_iterations : int
    start : pair of (m, 1) arrays, optional
        Initial u_t [length] and σ_t [stress]; zero by default.
    monitor : callable, optional
        Called with the state so far after each step.

    Raises
    ------
    SolverError
        If an iterate or the rule's ρ is not finite, or ρ is not positive.
    """
    weight = system.operators.mesh.weight[system.operators.data.contact_nodes]
    bound = system.operators.data.friction_bound
    u, sigma = (np.zeros((len(weight), 1)),) * 2 if start is None else start
    history = History()
    # the given start need not satisfy u = u_0 + Sσ: the first step is solved whole, later ones for their increments
    consistent, largest = False, 0.0
    for k in range(max_iterations):
        residual = projection_residual(u, sigma, bound, rho)
        if consistent:
            du, dsigma = system.robin_increment(rho, -omega * residual)
            u, sigma = u + du, sigma + dsigma
        else:
            new_u, new_sigma = system.robin(rho, sigma + rho * u - omega * residual)
            du, dsigma, u, sigma = new_u - u, new_sigma - sigma, new_u, new_sigma
            consistent = True
        change = criterion.change(u, sigma, du, dsigma, weight)
        if not np.isfinite(change):
            raise SolverError("iterate", f"iterate {k + 1} is not finite (ρ = {rho:g})", "choose another rho or rule")
        balance = usable_balance(contact_norm(dsigma, weight), contact_norm(du, weight))
        history.add(rho, balance, change, contact_norm(residual, weight), system.ksp_iterations)
        if monitor is not None:
            monitor(ContactState(u, sigma, rho, False, f"stopped in iteration {k + 1}", history))
        largest = max(largest, contact_norm(sigma, weight))
        relative = np.inf
        if criterion.stop == "residual" or change <= criterion.tolerance:
            relative = criterion.relative_residual(u, sigma, bound, weight, rho, largest)
        if criterion.met(change, relative):
            reason = f"change {change:.1e}, relative friction residual {relative:.1e}"
            return ContactState(u, sigma, rho, True, reason, history)
        if not np.isnan(balance):
            rho = _checked(rule.update(rho, balance), k)
    reason = f"max_iterations = {max_iterations} reached with change {history.change[-1]:.1e} > {criterion.tolerance:g}"
    return ContactState(u, sigma, rho, False, reason, history)


def _checked(rho: float, k: int) -> float:
    if not (np.isfinite(rho) and rho > 0.0):
        raise SolverError("iterate", f"the rule gave ρ = {rho} after iteration {k + 1}", "a rule returns a positive number")
    return float(rho)
