"""Semismooth Newton (primal-dual active set) on u_t = u_0 + S σ_t, its sets predicted by the layer operator T.

Each iteration solves S σ = -u_0 on the nodes that stick. Which do is foretold, where a solve with S costs more than T,
by the contact problem of the layer through the last iterate, u + T(q - σ): its set is nearly the right one, so that two
to four solves with S do. Without prediction those nodes that break an inequality are exchanged, which takes some ten
steps. Globalised by block principal pivoting, see `active_set`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arrays import Array, States
from ...compliance.base import ContactSystem
from ...compliance.layer.operator import LayerOperator
from ..active_set import Predictor, initial_set, pivots, solve_box
from ..friction_law import balanced_rho, contact_norm, projection_residual
from ..restricted import ContactCompliance, contact_compliance
from ..state import ContactState, History
from .projection import Criterion

PLAIN_SIZE = 300
"""Contact nodes of a dense S up to which more of its own steps cost less than to set T up."""
LOOSE, FORESIGHT = 1e-5, 20
"""Tolerance and exchanges of a prediction, which need not be exact."""
Monitor = Callable[[ContactState], None]


def semismooth_newton(
    system: ContactSystem,
    *,
    criterion: Criterion,
    max_iterations: int,
    start: tuple[Array, Array] | None = None,
    predict: bool | None = None,
    monitor: Monitor | None = None,
) -> ContactState:
    """Newton's method on the friction condition; it ends when no node is wrong, exact up to round-off.

    Parameters
    ----------
    system : ContactSystem
    criterion : Criterion
        Its tolerance bounds the relative friction residual of what is returned as converged.
    max_iterations : int
    start : pair of (m, 1) arrays, optional
        u_t [length] and σ_t [stress] whose set is the first guess; full stick, or T's own solution, by default.
    predict : bool, optional
        Whether T predicts the sets; not by default where S is dense and small.
    monitor : callable, optional
        Called with the state so far after each iteration.

    Raises
    ------
    SolverError
        If a solve on the sticking nodes fails.
    """
    data = system.operators.data
    weight, bound = system.operators.mesh.weight[data.contact_nodes], data.friction_bound
    base = system.u_0[:, 0]
    compressed = bool(getattr(system, "compressed", False))
    if predict is None:
        predict = compressed or len(base) > PLAIN_SIZE
    layer = LayerOperator(system.operators) if predict or compressed else None
    if layer is not None:
        layer.rtol = LOOSE
    compliance = contact_compliance(system, layer)

    def foretell(sigma: Array, u: Array, active: States) -> tuple[States, Array]:
        assert layer is not None
        step = solve_box(layer, u - layer.apply(sigma), bound, active, sigma, FORESIGHT)
        return step.active, step.sigma

    if start is not None:
        u, sigma = start[0][:, 0], start[1][:, 0]
        active = initial_set(sigma, u, bound, balanced_rho(*start, weight, 1.0))
    elif predict and layer is not None:
        sigma, u = first_guess(layer, compliance, base)
        active, sigma = foretell(sigma, u, np.zeros(len(base), dtype=np.int8))
    else:
        sigma, u, active = np.zeros_like(base), base, np.zeros(len(base), dtype=np.int8)
    try:
        return _iterate(system, compliance, criterion, max_iterations, (sigma, u, active),
                        foretell if predict else None, monitor)  # fmt: skip
    finally:
        compliance.close()


def first_guess(layer: LayerOperator, compliance: ContactCompliance, base: Array) -> tuple[Array, Array]:
    """σ and u that the layer gives for full stick; T is scaled to S on it."""
    sigma = -layer.solve(base)
    displacement = compliance.apply(sigma)
    layer.fit(sigma, displacement)
    return sigma, base + displacement


def _iterate(
    system: ContactSystem, compliance: ContactCompliance, criterion: Criterion, max_iterations: int,
    first: tuple[Array, Array, States], foretell: Predictor | None,
    monitor: Monitor | None,
) -> ContactState:  # fmt: skip
    data = system.operators.data
    weight, bound = system.operators.mesh.weight[data.contact_nodes], data.friction_bound
    sigma, u, active = first
    old = u[:, None], sigma[:, None]
    history, state = History(), ContactState(*old, 1.0, False, "no iteration", History())
    steps = pivots(compliance, system.u_0[:, 0], bound, active, sigma, noise=compliance.noise, predict=foretell)
    for step in steps:
        new = step.u[:, None], step.sigma[:, None]
        change = criterion.change(*new, new[0] - old[0], new[1] - old[1], weight)
        rho = balanced_rho(*old, weight, 1.0)
        residual = contact_norm(projection_residual(*old, bound, rho), weight)
        history.add(rho, np.nan, change, residual, compliance.ksp_iterations)
        reason, converged = f"{step.wrong} nodes on the wrong side", False
        ends = step.wrong == 0 or len(history) >= max_iterations
        if ends:
            relative = criterion.relative_residual(*new, bound, weight, rho)
            reason += f", relative friction residual {relative:.1e}"
            converged = step.wrong == 0 and relative <= criterion.tolerance
            rho = balanced_rho(*new, weight, rho)
        state = ContactState(*new, rho, converged, reason, history)
        if monitor is not None:
            monitor(state)
        if ends:
            break
        old = new
    return state
