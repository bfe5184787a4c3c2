"""Active-set method for contact: one smooth piece of the law at each node, and linear equations.

A guess τ⁰ (m, k) decides on which piece of Π each node lies: stick, slip with its direction, or
open. With Π linearised there, σ + Π(τ⁰) + Π'(τ⁰)(ρv - σ - τ⁰) = 0, v = u_0 + Sσ + Mα and Eσ + f = 0
are linear equations. They are small, since σ is an affine function of -τ on the active components.
These are the components of τ on which Π' depends: one of two in Coulomb slip in the plane, none at
open nodes. The new τ = ρv - σ shows which nodes are on a wrong piece. This is a step of the
semismooth Newton method, also known as primal-dual active set. In the plane the pieces are linear,
and the right set gives the solution.

Full exchanges may cycle, for example if bodies that only contact holds roll to and fro. If the
number of wrong nodes has not fallen for some steps, damped steps follow (`line_search`). After them
laws without normal components move only the last of the wrong nodes, until the number falls. This
block principal pivoting (Júdice and Pires, Comput. Oper. Res. 21 (1994) 587-596) cannot cycle, and
ends for every P-matrix. S is one for Tresca's law, since its symmetric part is positive definite in
the inner product of the weights. For Coulomb's law `complementarity` finds the sets that cycle.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator

import numpy as np

from ... import native
from ...arrays import Array
from ...record import record
from ...round_off import CHAINED, ROUNDED, SOLVED
from ..law_protocol import ContactLaw
from ..linearisation import Linearisation
from ..system import Modes
from .line_search import LineSearch
from .monolithic import MonolithicSolver
from .solvers import ActiveSetSolver

_NEXT_TAU = native.function("petcontact_next_tau", "iiiDDBDdddDD")
LinearSolver = ActiveSetSolver | MonolithicSolver
"""A solver of the equations of a linearised law."""
Predictor = Callable[["Pivot"], tuple[Array, Array]]

PATIENCE = 8
"""Number of full exchanges that may fail to reduce the number of wrong nodes."""
PULL = 0.1
"""ρ|v| over |σ| at nodes in slip [-]. It is small, so that a node that moves along its σ sticks
before it slips the other way."""


@record
class Pivot:
    """One step.

    Attributes
    ----------
    sigma, v, alpha : (m, k), (m, k) and (r,) arrays
        Solution of the linear equations.
    linearised : Linearisation
        The linearised law of these equations.
    tau : (m, k) array
        The next point of linearisation.
    wrong : int
        Number of nodes that lie on another piece than assumed.
    push : (r,) array
        Motion along which the loads push and that no node resists; 0 if all motions are resisted or
        in equilibrium.
    """

    sigma: Array
    v: Array
    alpha: Array
    linearised: Linearisation
    tau: Array
    wrong: int
    push: Array

    def bent(self, law: ContactLaw) -> float:
        """Return the largest |Π(τ) + σ| at the new τ over the largest |σ| [-].

        It is round-off if pieces are linear and no node is wrong.
        """
        size = float(np.abs(self.sigma).max(initial=0.0)) or 1.0
        return float(np.abs(law.project(self.tau) + self.sigma).max(initial=0.0)) / size


def next_tau(
    linearised: Linearisation,
    law: ContactLaw,
    sigma: Array,
    v: Array,
    noise: float,
    least: float = 0.0,
) -> tuple[Array, Array]:
    """Return τ = ρv - σ after a step, and ρ (m, k), which is small at nodes in slip.

    `least` is a |σ| of the size of round-off. v has no sign if it is round-off. Sticking components
    have v = 0; the others keep their piece up to `noise`.
    """
    tangential = law.groups[0]
    if tangential.start != 0 or tangential.stop > 2:
        raise ValueError(f"at most two tangential components come first, got {tangential}")
    tau, rho = np.empty(sigma.shape), np.empty(sigma.shape)
    given = [np.ascontiguousarray(a) for a in (sigma, v, linearised.stick, linearised.tau)]
    _NEXT_TAU(*sigma.shape, tangential.stop, *given, noise, least, PULL, tau, rho)
    return tau, rho


def pivots(
    solver: LinearSolver,
    law: ContactLaw,
    base: Array,
    modes: Modes | None,
    tau: Array,
    *,
    sigma: Array | None = None,
    alpha: Array | None = None,
    predict: Predictor | None = None,
) -> Generator[Pivot, None, str]:
    """Yield steps until no node is wrong; return why there is no further step.

    Parameters
    ----------
    solver : ActiveSetSolver or MonolithicSolver
        Products with S and solves on active components.
    law : ContactLaw
    base : (m, k) array
        v for σ = 0 [length].
    modes : Modes, optional
    tau : (m, k) array
        First guess of τ [stress]; only its pieces matter if these are linear.
    sigma, alpha : arrays, optional
        Start of iterative solves.
    predict : callable, optional
        Function of a pivot that returns a better next (τ, σ) than the plain exchange. It is called
        while full exchanges are allowed.
    """
    rank = 0 if modes is None else len(modes.load)
    sigma = np.zeros_like(base) if sigma is None else sigma
    alpha = np.zeros(rank) if alpha is None else alpha
    rho = np.ones_like(base)
    fewest, patience, seen_sets = len(base) + 1, PATIENCE, set[bytes]()
    farthest, largest, begun = np.inf, 0.0, float(np.abs(sigma).max(initial=0.0))
    search: LineSearch | None = None
    while True:
        linearised = Linearisation.from_law(law, tau)
        sigma, v, alpha, push = linear_solve(solver, linearised, base, modes, sigma, alpha, rho)
        size = float(np.abs(sigma).max(initial=0.0))
        largest = max(largest, size)
        if not np.abs(v).max(initial=0.0) <= farthest:
            return "a body that contact holds moves away"
        if modes is not None and not modes.load.any() and size < ROUNDED * largest:
            sigma, push = np.zeros_like(sigma), np.zeros_like(push)
        # the loads vanish if σ is so small, and no step finds the pieces of the law
        elif 0.0 < size < 1e-60 * largest:
            return "the tractions vanish"
        if np.isinf(farthest):
            farthest = _farthest(v, base, modes, alpha)
        revised, rho = next_tau(
            linearised, law, sigma, v, solver.noise, SOLVED * max(begun, largest)
        )
        wrong = np.flatnonzero(law.states(revised) != linearised.states)
        step = Pivot(sigma, v, alpha, linearised, revised, len(wrong), push)
        yield step
        if len(wrong) < fewest:
            fewest, patience = len(wrong), PATIENCE
            seen_sets.clear()
        else:
            patience -= 1
        if patience > 0:
            tau, sigma = (revised, sigma) if predict is None else predict(step)
        elif search is None or search.goes_on:
            search = search or LineSearch(law, base, modes)
            tau, rho = search.after(sigma, v, alpha)
            sigma, alpha = search.sigma, search.alpha
        else:
            signature = linearised.states.tobytes() + np.sign(linearised.constant).tobytes()
            if not len(wrong) or len(law.groups) > 1 or signature in seen_sets:
                return "the sets repeat"
            seen_sets.add(signature)
            tau = tau.copy()
            tau[wrong[-1]] = revised[wrong[-1]]


def _farthest(v: Array, base: Array, modes: Modes | None, alpha: Array) -> float:
    """Return the displacement beyond which a body slides away on the assumed pieces [length]."""
    strain = v - base if modes is None else v - base - modes.motion @ alpha
    return 1e9 * max(float(np.abs(part).max(initial=0.0)) for part in (base, strain)) or np.inf


def linear_solve(
    solver: LinearSolver,
    linearised: Linearisation,
    base: Array,
    modes: Modes | None,
    sigma: Array,
    alpha: Array,
    rho: Array,
) -> tuple[Array, Array, Array, Array]:
    """Return σ, v and α of a linearised law, and the push along motions that no node resists.

    `sigma` and `alpha` are near the solution.
    """
    if isinstance(solver, MonolithicSolver):
        sigma, v, alpha, free = solver.linear_solve(linearised, rho, sigma, alpha)
        return sigma, v, alpha, _push(modes, sigma, free)
    sigma, slack = linearised.first_traction(sigma, rho)
    v = base + solver.apply(sigma)
    if modes is not None:
        v = v + modes.motion @ alpha
    free = np.zeros((len(alpha), 0))
    if linearised.active.any() or modes is not None:
        dy, dalpha, free = solver.solve(linearised, rho, -(slack + v), modes, sigma)
        change = linearised.traction(dy)
        sigma, v, alpha = sigma + change, v + solver.apply(change), alpha + dalpha
        if modes is not None:
            v = v + modes.motion @ dalpha
    return sigma, v, alpha, _push(modes, sigma, free)


def _push(modes: Modes | None, sigma: Array, free: Array) -> Array:
    """Return the motion (r,) along which the loads push by more than round-off.

    It is a combination of the motions of unit size in `free`, (r, p).
    """
    if modes is None or modes.defect(sigma, free) <= CHAINED:
        return np.zeros(len(free))
    return np.asarray(free @ (free.T @ (modes.unbalanced(sigma) / modes.size)) / modes.size)


def box_problem(
    solver: ActiveSetSolver,
    law: ContactLaw,
    base: Array,
    tau: Array,
    sigma: Array,
    limit: int | None = None,
    tolerance: float = CHAINED,
    modes: Modes | None = None,
) -> Pivot:
    """Return the last step of `pivots`, or of the first `limit` of them, which satisfies the law.

    For Tresca's law and a symmetric operator it is the minimum of ½σᵀWSσ + σᵀWu_0 over |σ| <= g,
    with the weights W.
    """
    for last in itertools.islice(pivots(solver, law, base, modes, tau, sigma=sigma), limit):
        if last.wrong == 0 and last.bent(law) <= tolerance:
            break
    return last
