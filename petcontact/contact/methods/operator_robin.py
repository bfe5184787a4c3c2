"""Operator-valued Robin condition: Algorithm 1 with T⁻¹ in the place of ρ, as many iterations on every mesh.

With T spectrally equivalent to S the step (T + S) δσ = -ω T(σ - q) contracts at a rate that knows no h. Here q is the
projection of σ - T⁻¹u onto |q| <= g in the metric of T: the contact problem of the layer through (σ, u), which costs no
elastic solve. This is relaxed Douglas-Rachford splitting in the inner product of T, convergent for 0 < ω < 2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arrays import Array
from ...compliance.base import ContactSystem
from ...compliance.layer.operator import LayerOperator
from ...errors import SolverError
from ..active_set import solve_box
from ..friction_law import balanced_rho, contact_norm, projection_residual
from ..restricted import contact_compliance
from ..rho_rules import usable_balance
from ..state import ContactState, History
from .newton import first_guess
from .projection import Criterion


def operator_robin(
    system: ContactSystem,
    *,
    omega: float,
    criterion: Criterion,
    max_iterations: int,
    start: tuple[Array, Array] | None = None,
    monitor: Callable[[ContactState], None] | None = None,
) -> ContactState:
    """Relaxed Douglas-Rachford iteration in the metric of the layer operator T.

    Parameters
    ----------
    system : ContactSystem
    omega : float
        ω in (0, 2) [-].
    criterion : Criterion
    max_iterations : int
    start : pair of (m, 1) arrays, optional
        Initial u_t [length] and σ_t [stress]; the layer's answer for full stick by default.
    monitor : callable, optional
        Called with the state so far after each step.

    Raises
    ------
    SolverError
        If an iterate is not finite or a solve fails.
    """
    data = system.operators.data
    weight, bound = system.operators.mesh.weight[data.contact_nodes], data.friction_bound
    layer = LayerOperator(system.operators)
    compliance = contact_compliance(system, layer)
    base = system.u_0[:, 0]
    sigma, u = first_guess(layer, compliance, base)
    if start is not None:
        sigma = start[1][:, 0]
        u = base + compliance.apply(sigma)
    active = np.zeros(len(base), dtype=np.int8)
    history, largest, reason = History(), 0.0, "no iteration"
    try:
        for k in range(max_iterations):
            step = solve_box(layer, u - layer.apply(sigma), bound, active, sigma)
            active = step.active
            rho = balanced_rho(u[:, None], sigma[:, None], weight, 1.0)
            residual = contact_norm(projection_residual(u[:, None], sigma[:, None], bound, rho), weight)
            d_sigma = compliance.sum_solve(-omega * layer.apply(sigma - step.sigma))
            d_u = compliance.apply(d_sigma)
            sigma, u = sigma + d_sigma, u + d_u
            new, moved = (u[:, None], sigma[:, None]), (d_u[:, None], d_sigma[:, None])
            change = criterion.change(*new, *moved, weight)
            if not np.isfinite(change):
                raise SolverError("iterate", f"iterate {k + 1} is not finite", "look at the data and the mesh")
            balance = usable_balance(contact_norm(moved[1], weight), contact_norm(moved[0], weight))
            history.add(rho, balance, change, residual, compliance.ksp_iterations)
            largest = max(largest, contact_norm(new[1], weight))
            relative = criterion.relative_residual(*new, bound, weight, rho, largest)
            reason = f"change {change:.1e}, relative friction residual {relative:.1e}"
            state = ContactState(*new, balanced_rho(*new, weight, rho), criterion.met(change, relative), reason, history)
            if monitor is not None:
                monitor(state)
            if state.converged:
                return state
        reason = f"max_iterations = {max_iterations} reached; {reason}"
        rho = balanced_rho(u[:, None], sigma[:, None], weight, 1.0)
        return ContactState(u[:, None], sigma[:, None], rho, False, reason, history)
    finally:
        compliance.close()
