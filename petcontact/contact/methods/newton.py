"""Semismooth Newton (primal-dual active set) on v = u_0 + S σ, its sets predicted by the stand-in T.

Each iteration solves S σ = -u_0 on the nodes that stick. Which do is foretold, where a solve with S costs more than T,
by the contact problem of T through the last iterate, v + T(q - σ): its set is nearly the right one, so that two
to four solves with S do. Without prediction those nodes that break an inequality are exchanged, which takes some ten
steps. Globalised by block principal pivoting, see `active_set`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, States
from ...model.solver_options import Method
from ..active_set import initial_set, pivots, solve_box
from ..friction_law import balanced_rho, contact_norm
from ..iteration import Iteration, Recorder
from ..laws import Tresca
from ..restricted import ContactCompliance, contact_compliance
from ..rho_rules import Rule
from ..state import ContactState
from ..system import ContactSystem, Surrogate

PLAIN_SIZE = 300
"""Contact nodes of a dense S up to which more of its own steps cost less than to set T up."""
LOOSE, FORESIGHT = 1e-5, 20
"""Tolerance and exchanges of a prediction, which need not be exact."""


@dataclass(frozen=True)
class SemismoothNewton:
    """Newton's method on the friction condition; it ends when no node is wrong, exact up to round-off.

    Attributes
    ----------
    predict : bool, optional
        Whether T predicts the sets; not by default where S is dense and small.
    """

    predict: bool | None = None

    def __call__(self, system: ContactSystem, law: Tresca, iteration: Iteration) -> ContactState:
        """As `ContactMethod`; starts from full stick, or T's own solution.

        The criterion's tolerance bounds the relative friction residual of what is returned as converged.
        """
        bound, base = law.bound[:, None], system.u_0
        predict = system.matrix_free or len(base) > PLAIN_SIZE if self.predict is None else self.predict
        layer = system.surrogate() if predict or system.matrix_free else None
        if layer is not None:
            layer.rtol = LOOSE
        compliance = contact_compliance(system, layer)

        def foretell(sigma: Array, v: Array, active: States) -> tuple[States, Array]:
            assert layer is not None
            step = solve_box(layer, v - layer.apply(sigma), bound, active, sigma, FORESIGHT)
            return step.active, step.sigma

        if iteration.start is not None:
            v, sigma = iteration.start
            active = initial_set(sigma, v, bound, balanced_rho(v, sigma, system.weight, 1.0))
        elif predict and layer is not None:
            sigma, v = first_guess(layer, compliance, base)
            active, sigma = foretell(sigma, v, np.zeros(base.shape, dtype=np.int8))
        else:
            sigma, v, active = np.zeros_like(base), base, np.zeros(base.shape, dtype=np.int8)
        try:
            return _iterate(system, compliance, law, iteration, (sigma, v, active), foretell if predict else None)
        finally:
            compliance.close()


def build(options: Method, rule: Rule | None) -> SemismoothNewton:
    """The method that the options describe."""
    return SemismoothNewton()


def first_guess(layer: Surrogate, compliance: ContactCompliance, base: Array) -> tuple[Array, Array]:
    """σ and v that T gives for full stick; T is scaled to S on it."""
    sigma = -layer.solve(base)
    displacement = compliance.apply(sigma)
    layer.fit(sigma, displacement)
    return sigma, base + displacement


def _iterate(
    system: ContactSystem, compliance: ContactCompliance, law: Tresca, iteration: Iteration,
    first: tuple[Array, Array, States],
    foretell: Callable[[Array, Array, States], tuple[States, Array]] | None,
) -> ContactState:  # fmt: skip
    weight, criterion = system.weight, iteration.criterion
    old_sigma, old_v, active = first
    recorder = Recorder(law, weight, iteration)
    steps = pivots(compliance, system.u_0, law.bound[:, None], active, old_sigma, noise=compliance.noise, predict=foretell)
    for step in steps:
        v, sigma = step.u, step.sigma
        rho = balanced_rho(old_v, old_sigma, weight, 1.0)
        residual = contact_norm(law.residual(old_v, old_sigma, rho), weight)
        recorder.step(
            v, sigma, v - old_v, sigma - old_sigma, rho=rho, residual=residual, ksp_iterations=compliance.ksp_iterations
        )
        reason, converged = f"{step.wrong} nodes on the wrong side", False
        ends = step.wrong == 0 or recorder.exhausted
        if ends:
            relative = criterion.relative_residual(law, v, sigma, weight, rho)
            reason += f", relative friction residual {relative:.1e}"
            converged = step.wrong == 0 and relative <= criterion.tolerance
            rho = balanced_rho(v, sigma, weight, rho)
        state = recorder.tell(v, sigma, rho, reason, converged=converged)
        if ends or state.stopped:
            break
        old_v, old_sigma = v, sigma
    return state
