"""Operator-valued Robin condition: Algorithm 1 with T⁻¹ in the place of ρ, as many iterations on every mesh.

With T spectrally equivalent to S the step (T + S) δσ = -ω T(σ - q) contracts at a rate that knows no h. Here q is the
projection of σ - T⁻¹v onto |q| <= g in the metric of T: the contact problem of the layer through (σ, v), which costs no
elastic solve. This is relaxed Douglas-Rachford splitting in the inner product of T, convergent for 0 < ω < 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model.solver_options import Method
from ..active_set import solve_box
from ..friction_law import balanced_rho, contact_norm
from ..iteration import Iteration, Recorder
from ..laws import Tresca
from ..restricted import contact_compliance
from ..rho_rules import Rule
from ..state import ContactState
from ..system import ContactSystem
from .newton import first_guess


@dataclass(frozen=True)
class OperatorRobin:
    """Relaxed Douglas-Rachford iteration in the metric of T.

    Attributes
    ----------
    omega : float
        ω in (0, 2) [-].
    """

    omega: float

    def __call__(self, system: ContactSystem, law: Tresca, iteration: Iteration) -> ContactState:
        """As `ContactMethod`; starts from T's answer for full stick."""
        weight, criterion = system.weight, iteration.criterion
        layer = system.surrogate()
        compliance = contact_compliance(system, layer)
        base = system.u_0
        sigma, v = first_guess(layer, compliance, base)
        if iteration.start is not None:
            sigma = iteration.start[1]
            v = base + compliance.apply(sigma)
        active = np.zeros(base.shape, dtype=np.int8)
        recorder = Recorder(law, weight, iteration)
        try:
            while not recorder.exhausted:
                step = solve_box(layer, v - layer.apply(sigma), law.bound[:, None], active, sigma)
                active = step.active
                rho = balanced_rho(v, sigma, weight, 1.0)
                residual = contact_norm(law.residual(v, sigma, rho), weight)
                dsigma = compliance.sum_solve(-self.omega * layer.apply(sigma - step.sigma))
                dv = compliance.apply(dsigma)
                sigma, v = sigma + dsigma, v + dv
                change, _ = recorder.step(
                    v, sigma, dv, dsigma, rho=rho, residual=residual, ksp_iterations=compliance.ksp_iterations
                )
                relative = criterion.relative_residual(law, v, sigma, weight, rho, recorder.largest)
                reason = f"change {change:.1e}, relative friction residual {relative:.1e}"
                rho = balanced_rho(v, sigma, weight, rho)
                state = recorder.tell(v, sigma, rho, reason, converged=criterion.met(change, relative))
                if state.converged or state.stopped:
                    return state
            reason = f"max_iterations = {iteration.max_iterations} reached; {reason}"
            return ContactState(v, sigma, rho, False, reason, recorder.history)
        finally:
            compliance.close()


def build(options: Method, rule: Rule | None) -> OperatorRobin:
    """The method that the options describe."""
    return OperatorRobin(options.omega)
