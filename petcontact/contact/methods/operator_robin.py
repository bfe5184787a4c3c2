"""Operator-valued Robin condition: Algorithm 1 with T⁻¹ in place of ρ.

The number of iterations is the same on every mesh. If T is spectrally equivalent to S, the rate of
the step (T + S) δσ = -ω T(σ - q) does not depend on h. Here q is the projection of σ - T⁻¹v onto
the tractions that the law allows and that are in equilibrium, in the metric of T. This is the
contact problem of T through (σ, v), which needs no elastic solve. Its rigid motions are added to v:
the step alone would move a body as if all its nodes stuck. The method is relaxed Douglas-Rachford
splitting in the inner product of T. It converges for 0 < ω < 2 if the law has a potential.
"""

from __future__ import annotations

import contextlib

from ...arrays import Array
from ...errors import InputError
from ...given.tables.solver_options import Method
from ...record import record
from ..active_set.pivots import Pivot, box_problem
from ..active_set.solvers import (
    DenseActiveSetSolver,
    KrylovActiveSetSolver,
    SurrogateActiveSetSolver,
    active_set_solver,
)
from ..iteration import Iteration, Recorder
from ..law_protocol import ContactLaw
from ..linearisation import Linearisation
from ..rho_rules import Rule
from ..state import ContactState
from ..system import ContactSystem
from .free_motions import touching
from .prediction import first_guess
from .settling import settled
from .starts import stuck_everywhere


@record
class OperatorRobin:
    """Relaxed Douglas-Rachford iteration in the metric of T.

    Attributes
    ----------
    omega : float
        ω in (0, 2) [-].
    """

    omega: float

    def __call__(
        self, system: ContactSystem, law: ContactLaw, iteration: Iteration
    ) -> ContactState:
        """Solve as `ContactMethod`, from T's solution for full stick.

        Raises
        ------
        InputError
            If the system has no T.
        """
        surrogate = system.surrogate()
        if surrogate is None:
            raise InputError(
                "method.name: operator-robin needs a surrogate for S, and there is none (in space "
                "up to 1000 nodes of a side have one); use semismooth-newton"
            )
        criterion = iteration.criterion
        solver = active_set_solver(system, surrogate)
        sigma, v = first_guess(system, surrogate, solver)
        inner = SurrogateActiveSetSolver(surrogate)
        if iteration.start is not None:
            sigma = iteration.start[1]
            v = system.u_0 + solver.apply(sigma)
        tau, stuck = stuck_everywhere(system.u_0, law), Linearisation.all_stick(system.u_0)
        recorder = Recorder(law, system, iteration)
        with contextlib.closing(solver):
            while not recorder.exhausted:
                # friction that turns or grows with p need not come to an end
                step = _through(
                    inner,
                    system,
                    law,
                    v - surrogate.apply(sigma),
                    tau,
                    sigma,
                    iteration.max_iterations,
                )
                tau, old = step.linearised.tau, (v, sigma)
                dsigma, dv = _change(
                    solver,
                    -self.omega * surrogate.apply(sigma - step.sigma),
                    stuck,
                    system,
                    sigma,
                    step.alpha,
                )
                sigma, v = sigma + dsigma, v + dv
                change, _ = recorder.step(
                    old, v, sigma, dv, dsigma, ksp_iterations=solver.ksp_iterations
                )
                relative = recorder.missed(v, sigma)
                reason = f"change {change:.1e}, relative friction residual {relative:.1e}"
                rho = recorder.balanced(v, sigma)
                state = recorder.report(v, sigma, rho, reason)
                if state.stopped:
                    return state
                if (
                    criterion.met(change, relative)
                    and (end := settled(recorder, v, sigma, rho, reason)) is not None
                ):
                    return end
            reason = f"max_iterations = {iteration.max_iterations} reached; {reason}"
            return ContactState(v, sigma, rho, False, reason, recorder.history, law=law)


def build(options: Method, rule: Rule | None) -> OperatorRobin:
    """Return the method that the options describe."""
    return OperatorRobin(options.omega)


def _through(
    inner: SurrogateActiveSetSolver,
    system: ContactSystem,
    law: ContactLaw,
    base: Array,
    tau: Array,
    sigma: Array,
    limit: int,
) -> Pivot:
    """Return the last step of T's contact problem through (σ, v), with rigid motions.

    Bodies that lose contact there are moved to where they touch.
    """
    step = box_problem(inner, law, base, tau, sigma, limit, modes=system.modes)
    if not step.push.any() or (near := touching(system, law, step)) is None:
        return step
    return box_problem(inner, law, base, near, sigma, limit, modes=system.modes)


def _change(
    solver: DenseActiveSetSolver | KrylovActiveSetSolver,
    r: Array,
    stuck: Linearisation,
    system: ContactSystem,
    sigma: Array,
    alpha: Array,
) -> tuple[Array, Array]:
    """δσ and δv of (T + S) δσ + M δα = r, and of the rigid motions α of T's problem."""
    dsigma, dalpha = solver.sum_solve(r, stuck, system.modes, sigma)
    dv = solver.apply(dsigma)
    return dsigma, dv if system.modes is None else dv + system.modes.motion @ (alpha + dalpha)
