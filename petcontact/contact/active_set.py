"""Contact by its active set: at each node one smooth piece of the law, linear equations on the components that it holds.

A guess τ⁰ (m, k) says on which piece of Π each node lies (stick, slip and which way, open). With Π linearised there,
σ + Π(τ⁰) + Π'(τ⁰)(ρv - σ - τ⁰) = 0 and v = u_0 + Sσ + Mα, Eσ + f = 0 are linear, and small: σ is an affine function of -τ
on those components of τ that Π' sees (one of two on Coulomb slip in the plane, none on open nodes), so that only these
are solved for. The new τ = ρv - σ says which nodes are on a wrong piece: a step of the semismooth Newton method, also
known as primal-dual active set. In the plane the pieces are linear and the right set gives the solution itself.

Full exchanges may cycle. Block principal pivoting (Júdice and Pires, Comput. Oper. Res. 21 (1994) 587-596) cannot: where
the number of wrong nodes has not fallen for some steps, only the last of them moves until it falls, which ends for
every P-matrix; S is one for Tresca's law, its symmetric part being positive definite in the inner product of the weights.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Mask, States
from .friction_law import lengths
from .laws import ContactLaw
from .mixed import MixedCompliance
from .restricted import Restricted
from .system import Modes

LinearSolver = Restricted | MixedCompliance
"""Who solves the equations of a law on given pieces."""
Predictor = Callable[["Pivot"], tuple[Array, Array]]

PATIENCE = 8
"""Full exchanges that may fail to reduce the number of wrong nodes."""
BALANCED = 1e-9
"""Relative defect of equilibrium that is round-off."""
SHUFFLES = 40
"""Exchanges of a random half of the nodes, which break most cycles, before single exchanges, which break all."""
VANISHED = 1e-12
"""|σ|, over the largest so far, below which a contact is unloaded and no measure of ρ."""
STRAIGHT = 1e-10
"""Relative residual of the law that is round-off: pieces on disks are not linear."""
RUNAWAY = 1e9
"""v over what the first step strains, from which on a body slides away on the pieces that are tried."""
FADED = 1e-60
"""σ over the largest so far below which its pieces are those of loads that vanish, and no step finds them."""
PULL = 0.1
"""ρ|v| over |σ| where a node slips: small, so that a node that moves along its σ sticks before it slips the other way."""


@dataclass(frozen=True)
class Pieces:
    """Π linearised at τ⁰ (m, k): σ = derivative y + constant with y = σ - ρv.

    Attributes
    ----------
    tau, constant : (m, k) arrays
        τ⁰ and Π'(τ⁰)τ⁰ - Π(τ⁰) [stress].
    derivative : (m, k, k) array
    seen, held : (m, k) bool arrays
        Components of τ that Π' sees; those where it is the identity, so that v vanishes there.
    states : (m,) array
    """

    tau: Array
    constant: Array
    derivative: Array
    seen: Mask
    held: Mask
    states: States

    @classmethod
    def at(cls, law: ContactLaw, tau: Array) -> Pieces:
        """Those of a law."""
        derivative = law.linearise(tau)
        constant = np.einsum("iab,ib->ia", derivative, tau) - law.project(tau)
        held = np.all(derivative == np.eye(law.k), axis=2)
        constant[held] = 0.0
        return cls(tau, constant, derivative, np.any(derivative != 0.0, axis=1), held, law.states(tau))

    @classmethod
    def stuck(cls, like: Array) -> Pieces:
        """All components held, at zero."""
        zero, every = np.zeros_like(like), np.ones(like.shape, dtype=bool)
        derivative = np.broadcast_to(np.eye(like.shape[1]), (*like.shape, like.shape[1]))
        return cls(zero, zero, derivative, every, every, np.zeros(len(like), dtype=np.int8))

    def traction(self, y: Array) -> Array:
        """Π' y, (m, k): what y on the seen components adds to σ."""
        return np.asarray(np.einsum("iab,ib->ia", self.derivative, np.where(self.seen, y, 0.0)))


@dataclass(frozen=True)
class Pivot:
    """One step.

    Attributes
    ----------
    sigma, v, alpha : (m, k), (m, k) and (r,) arrays
        Solution of the linear equations.
    pieces : Pieces
        On which they were posed.
    tau : (m, k) array
        Where Π was to be linearised according to it.
    wrong : int
        Nodes that lie on another piece than was supposed.
    push : (r,) array
        Motion along which the loads push and that no node holds; 0 where all are held or in equilibrium.
    bent : float
        Largest |Π(τ) + σ| at the new τ over the largest |σ|: round-off where pieces are linear and no node is wrong.
    """

    sigma: Array
    v: Array
    alpha: Array
    pieces: Pieces
    tau: Array
    wrong: int
    push: Array
    bent: float


def next_tau(
    pieces: Pieces, law: ContactLaw, sigma: Array, v: Array, noise: float, least: float = 0.0
) -> tuple[Array, Array]:
    """τ = ρv - σ after a step, and ρ (m, k): small where nodes slip, any elsewhere; `least` is a |σ| that is round-off.

    Where v is round-off it has no sign: held components have v = 0, the others keep, up to noise, the piece they are on;
    noise is that of the new τ, however large the old one was.
    """
    v = np.where(pieces.held, 0.0, v)
    ratio = (max(float(np.abs(sigma).max(initial=0.0)), least) or 1.0) / (float(np.abs(v).max(initial=0.0)) or 1.0)
    rho = np.full(sigma.shape, ratio)
    tangential = law.groups[0]
    size, moved = lengths(sigma[:, tangential]), lengths(v[:, tangential])
    # what closes slips at once if it slid further than its overlap lets friction hold it: one ρ for both components
    limit = np.divide(PULL * size, moved, out=np.full(len(size), ratio), where=(moved > 0.0) & (size > 0.0))
    rho[:, tangential] = np.clip(limit, 1e-9 * ratio, 1e9 * ratio)[:, None]
    tau = rho * v - sigma
    level = noise * (rho * float(np.abs(v).max(initial=0.0)) + float(np.abs(sigma).max(initial=0.0)))
    return tau + np.clip(noise * (pieces.tau - tau), -level, level), rho


def pivots(
    solver: LinearSolver, law: ContactLaw, base: Array, modes: Modes | None, tau: Array, *,
    sigma: Array | None = None, alpha: Array | None = None, predict: Predictor | None = None,
) -> Iterator[Pivot]:  # fmt: skip
    """Steps until no node is wrong.

    Parameters
    ----------
    solver : Restricted or MixedCompliance
        Products with S and solves on seen components.
    law : ContactLaw
    base : (m, k) array
        v for σ = 0 [length].
    modes : Modes, optional
    tau : (m, k) array
        First guess of τ [stress]: only its pieces matter where these are linear.
    sigma, alpha : arrays, optional
        Where an iterative solve starts from.
    predict : callable, optional
        Gives a better next (τ, σ) than the plain exchange from a pivot, as long as full exchanges are allowed.
    """
    rank = 0 if modes is None else len(modes.load)
    sigma = np.zeros_like(base) if sigma is None else sigma
    alpha = np.zeros(rank) if alpha is None else alpha
    rho = np.ones_like(base)
    fewest, patience, seen_sets = len(base) + 1, PATIENCE, set[bytes]()
    farthest, largest, begun = np.inf, 0.0, float(np.abs(sigma).max(initial=0.0))
    shuffle = np.random.default_rng(2019)
    while True:
        pieces = Pieces.at(law, tau)
        sigma, v, alpha, push = linear_solve(solver, pieces, base, modes, sigma, alpha, rho)
        size = float(np.abs(sigma).max(initial=0.0))
        largest = max(largest, size)
        if not np.abs(v).max(initial=0.0) <= farthest or 0.0 < size < FADED * largest:
            return
        if np.isinf(farthest):
            strain = v - base if modes is None else v - base - modes.motion @ alpha
            farthest = RUNAWAY * max(float(np.abs(part).max(initial=0.0)) for part in (base, strain)) or np.inf
        revised, rho = next_tau(pieces, law, sigma, v, solver.noise, VANISHED * max(begun, largest))
        wrong = np.flatnonzero(law.states(revised) != pieces.states)
        bent = float(np.abs(law.project(revised) + sigma).max(initial=0.0) / (np.abs(sigma).max(initial=0.0) or 1.0))
        step = Pivot(sigma, v, alpha, pieces, revised, len(wrong), push, bent)
        yield step
        if len(wrong) < fewest:
            fewest, patience = len(wrong), PATIENCE
            seen_sets.clear()
        else:
            patience -= 1
        if patience > 0 or len(wrong) == 0:
            tau = revised
            if predict is not None:
                tau, sigma = predict(step)
        elif patience > -SHUFFLES:
            tau = np.where((shuffle.random(len(tau)) < 0.5)[:, None], revised, tau)
        else:
            signature = pieces.states.tobytes() + np.sign(pieces.constant).tobytes()
            if signature in seen_sets:
                return
            seen_sets.add(signature)
            tau = tau.copy()
            tau[wrong[-1]] = revised[wrong[-1]]


def linear_solve(
    solver: LinearSolver, pieces: Pieces, base: Array, modes: Modes | None, sigma: Array, alpha: Array, rho: Array
) -> tuple[Array, Array, Array, Array]:
    """σ, v, α on given pieces, from a nearby σ and α; and the push along motions that no node holds."""
    if isinstance(solver, MixedCompliance):
        return *solver.linear_solve(pieces, rho), alpha, np.zeros_like(alpha)
    y = np.where(pieces.held, sigma, -pieces.tau)
    sigma = pieces.traction(y) + pieces.constant
    v = base + solver.apply(sigma)
    if modes is not None:
        v = v + modes.motion @ alpha
    slack = np.where(pieces.held, 0.0, (y - sigma) / rho)
    push = np.zeros_like(alpha)
    if pieces.seen.any() or modes is not None:
        dy, dalpha, free = solver.solve(pieces, rho, -(slack + v), modes, sigma)
        change = pieces.traction(dy)
        sigma, v, alpha = sigma + change, v + solver.apply(change), alpha + dalpha
        if modes is not None:
            v = v + modes.motion @ dalpha
            if modes.defect(sigma, free) > BALANCED:
                push = free @ (free.T @ (modes.unbalanced(sigma) / modes.size)) / modes.size
    return sigma, v, alpha, push


def box_problem(
    solver: Restricted, law: ContactLaw, base: Array, tau: Array, sigma: Array, limit: int | None = None,
    tolerance: float = STRAIGHT, modes: Modes | None = None,
) -> Pivot:  # fmt: skip
    """The last of `pivots`, or of the first `limit` of them; its law holds to the tolerance.

    For Tresca's law and a symmetric operator it is the minimum of ½σᵀWSσ + σᵀWu_0 over |σ| <= g, W the weights.
    """
    for last in itertools.islice(pivots(solver, law, base, modes, tau, sigma=sigma), limit):
        if last.wrong == 0 and last.bent <= tolerance:
            break
    return last
