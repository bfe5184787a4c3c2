"""Newton's method on unilateral contact with Coulomb or Tresca friction: primal-dual active sets, no penalty.

With v = v_0 + S σ + M α and E σ + f = 0 each node is open (σ = 0), sticks (v_n = 0, w = w_prev) or slips (v_n = 0,
σ_t = ∓b). Given the sets, one linear solve yields σ and the rigid motions α, and the nodes that break an inequality change
sides. Motions that no closed node sees are gauged; if the loads push along them, nothing holds the body.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array, Index, Mask, States
from .law import PairLaw

NOISE = 1e-12
"""Relative size of what round-off may leave of a gap, a pressure or a slip."""
UNSEEN = 1e-9
"""Relative size of what the closed nodes see of a motion that they do not see."""
TRIES = 3
"""Attempts with all nodes sticking before loads are said to be out of equilibrium."""
STEPS = 60
"""Exchanges from one start."""
PATIENCE = 8
"""Exchanges that may fail to reduce the number of wrong nodes before only some of them move."""


@dataclass(frozen=True)
class Reduced:
    """The contact problem of one increment, reduced to m contact nodes and r rigid motions.

    Attributes
    ----------
    base : (m, 2) array
        v for σ = 0, α = 0: tangential, and normal minus the gap [length].
    compliance : (2m, 2m) array
        S, component c of node i being 2i + c, tangential first [length/stress].
    modes : (2m, r) array
        M.
    balance : (r, 2m) array
        E.
    resultant : (r,) array
        f, of the loads.
    weight : (m,) array
    slip_before : (m,) array
        w_prev [length].
    """

    base: Array
    compliance: Array
    modes: Array
    balance: Array
    resultant: Array
    weight: Array
    slip_before: Array


@dataclass(frozen=True)
class Sets:
    """Which nodes are closed; and which way they slip: the sign of δw, 0 where they stick; and where the cap bounds σ_t."""

    closed: Mask
    slip: Index
    capped: Mask

    def same(self, other: Sets) -> bool:
        """Whether nothing differs."""
        return bool(np.array_equal(self.closed, other.closed) and np.array_equal(self.slip, other.slip)
                    and np.array_equal(self.capped, other.capped))  # fmt: skip

    @property
    def states(self) -> States:
        """0 stick, 1 slip, 2 open, (m,)."""
        return np.where(self.closed, np.where(self.slip != 0, 1, 0), 2).astype(np.int8)


@dataclass(frozen=True)
class Outcome:
    """Where an increment ended.

    Attributes
    ----------
    v, sigma : (m, 2) arrays
    alpha : (r,) array
    sets : Sets
    iterations : int
        Linear solves, over all starts.
    normal, tangential : float
        Relative natural residuals.
    balance : float
        ‖Eσ + f‖ over ‖f‖ and ‖|E||σ|‖, the larger.
    pushed : (r,) array
        What of f nothing holds.
    converged : bool
    reason : str
    """

    v: Array
    sigma: Array
    alpha: Array
    sets: Sets
    iterations: int
    normal: float
    tangential: float
    balance: float
    pushed: Array
    converged: bool
    reason: str


def all_closed(law: PairLaw, slip: int = 0) -> Sets:
    """Every node that faces something, sticking or slipping one way."""
    return _admissible(law, Sets(law.present.copy(), np.full(len(law.cap), slip), np.zeros(len(law.cap), dtype=bool)))


def _admissible(law: PairLaw, sets: Sets) -> Sets:
    """Bilateral nodes are closed, bonded ones stick, those without friction slip."""
    closed = (sets.closed | ~law.unilateral) & law.present
    smooth = ~law.bonded & np.where(law.coulomb, (law.coefficient == 0.0) | (law.cap == 0.0), law.cap == 0.0)
    slip = np.where(smooth, 1, np.where(law.bonded, 0, sets.slip))
    return Sets(closed, np.where(closed, slip, 0), np.where(law.coulomb, sets.capped, True) & closed & (slip != 0))


def starts(law: PairLaw, warm: Sets | None) -> Iterator[Sets]:
    """First guesses, the best first: the sets of the step before, its contact sticking, everything, everything slipping."""
    if warm is not None:
        yield _admissible(law, warm)
        yield _admissible(law, replace(warm, slip=np.zeros_like(warm.slip)))
    yield all_closed(law)
    yield all_closed(law, 1)
    yield all_closed(law, -1)


def pair_newton(
    problem: Reduced, law: PairLaw, *, tolerance: float, warm: Sets | None = None,
    monitor: Callable[[int, int], None] | None = None,
) -> Outcome:  # fmt: skip
    """The solution of one increment, from one start after the other; the best outcome if none converges.

    Parameters
    ----------
    problem : Reduced
    law : PairLaw
    tolerance : float
        Of the natural residuals of what is accepted although single nodes still change sides.
    warm : Sets, optional
        Sets of the increment or the mesh before.
    monitor : callable, optional
        Called with the number of solves so far and of wrong nodes.
    """
    best: Outcome | None = None
    count = 0
    for first in starts(law, warm):
        outcome = _from_start(problem, law, first, tolerance, count, monitor)
        count = outcome.iterations
        if outcome.converged:
            return outcome
        if best is None or _defect(outcome) < _defect(best):
            best = outcome
    assert best is not None
    return replace(best, iterations=count)


def _defect(outcome: Outcome) -> float:
    worst = max(outcome.normal, outcome.tangential, outcome.balance)
    return worst if np.isfinite(worst) else np.inf


def _from_start(
    problem: Reduced, law: PairLaw, sets: Sets, tolerance: float, count: int, monitor: Callable[[int, int], None] | None
) -> Outcome:
    tries, fewest, patience = TRIES, len(law.cap) + 1, PATIENCE
    for _ in range(STEPS):
        v, sigma, alpha, pushed = solve_sets(problem, law, sets)
        count += 1
        revised, wrong = revised_sets(problem, law, sets, v, sigma)
        if monitor is not None:
            monitor(count, len(wrong))
        if len(wrong) == 0:
            outcome = _judged(problem, law, sets, v, sigma, alpha, pushed, count, tolerance)
            if outcome.converged or outcome.balance <= tolerance:
                return outcome
            # the loads push along a motion that nothing closed sees: perhaps because all of it was let slip
            slips = (sets.slip != 0) & (law.bound(np.ones(len(law.cap))) > 0.0)
            tries -= 1
            if tries < 0 or not slips.any():
                return outcome
            sets = _admissible(law, replace(sets, slip=np.zeros_like(sets.slip)))
            continue
        if len(wrong) < fewest:
            fewest, patience = len(wrong), PATIENCE
        else:
            patience -= 1
        if patience <= 0:
            outcome = _judged(problem, law, sets, v, sigma, alpha, pushed, count, tolerance)
            if outcome.normal <= tolerance and outcome.tangential <= tolerance and outcome.balance <= tolerance:
                reason = f"residuals below the tolerance, {len(wrong)} nodes undecided"
                return replace(outcome, converged=True, reason=reason)
            revised = _some(sets, revised, wrong[-max(1, len(wrong) // 2) :] if patience % 2 else wrong[-1:])
        sets = revised
    return _judged(problem, law, sets, v, sigma, alpha, pushed, count, tolerance, wrong=len(wrong))


def _some(old: Sets, new: Sets, chosen: Index) -> Sets:
    """The old sets, changed at some nodes only."""
    parts = [getattr(old, name).copy() for name in ("closed", "slip", "capped")]
    for part, name in zip(parts, ("closed", "slip", "capped"), strict=True):
        part[chosen] = getattr(new, name)[chosen]
    return Sets(*parts)


def _judged(
    problem: Reduced, law: PairLaw, sets: Sets, v: Array, sigma: Array, alpha: Array, pushed: Array, count: int,
    tolerance: float, wrong: int = 0,
) -> Outcome:  # fmt: skip
    moved = v - np.column_stack([problem.slip_before, np.zeros(len(v))])
    diagonal = np.maximum(np.diag(problem.compliance).reshape(-1, 2), 1e-300)
    normal, tangential = law.residuals(moved, sigma, 1.0 / diagonal, problem.weight)
    defect = np.abs(problem.balance @ sigma.ravel() + problem.resultant)
    carried = np.abs(problem.balance) @ np.abs(sigma.ravel())
    size = max(float(np.abs(problem.resultant).max(initial=0.0)), float(carried.max(initial=0.0)))
    balance = float(defect.max(initial=0.0)) / size if size > 0.0 else 0.0
    good = wrong == 0 and max(normal, tangential, balance) <= tolerance
    if wrong:
        reason = f"{wrong} nodes on the wrong side after {STEPS} exchanges"
    elif balance > tolerance:
        reason = "the loads are not in equilibrium with any contact force that was found"
    else:
        reason = f"natural residuals {normal:.1e} normal, {tangential:.1e} tangential"
    return Outcome(v, sigma, alpha, sets, count, normal, tangential, balance, pushed, good, reason)


def solve_sets(problem: Reduced, law: PairLaw, sets: Sets) -> tuple[Array, Array, Array, Array]:
    """v, σ (m, 2), α (r,) for given sets, and what of f is left over along motions that they do not see (r,)."""
    m, r = len(law.cap), len(problem.resultant)
    closed = np.flatnonzero(sets.closed)
    stick = np.flatnonzero(sets.closed & (sets.slip == 0))
    slope = np.where(sets.closed & ~sets.capped, sets.slip * law.coefficient, 0.0)[closed]
    sigma = np.zeros((m, 2))
    sigma[:, 0] = np.where(sets.capped & sets.closed, -sets.slip * np.where(sets.capped, law.cap, 0.0), 0.0)
    given = problem.compliance[:, np.flatnonzero(sigma[:, 0]) * 2] @ sigma[sigma[:, 0] != 0.0, 0]
    rows = np.concatenate([2 * closed + 1, 2 * stick])
    unit = 1.0 / max(float(np.abs(np.diag(problem.compliance)).max(initial=0.0)), 1e-300)
    n = len(rows)
    full = np.concatenate([problem.compliance[:, 2 * closed + 1], problem.compliance[:, 2 * stick]], axis=1)
    sums = np.concatenate([problem.balance[:, 2 * closed + 1], problem.balance[:, 2 * stick]], axis=1)
    slides = np.flatnonzero(slope)
    full[:, slides] += problem.compliance[:, 2 * closed[slides]] * slope[slides]
    sums[:, slides] += problem.balance[:, 2 * closed[slides]] * slope[slides]
    wanted = np.concatenate([np.zeros(len(closed)), problem.slip_before[stick]])
    v_0 = problem.base.ravel()
    hidden = _unseen(problem.modes[rows]) if r else np.zeros((0, 0))
    h = hidden.shape[1] if r else 0
    scale = 1.0 / np.maximum(np.abs(problem.balance).max(axis=1, initial=0.0), 1e-300)
    matrix = np.zeros((n + r + h, n + r + h))
    matrix[:n, :n] = full[rows] * unit
    rhs = np.concatenate([wanted - v_0[rows] - given[rows], np.zeros(r + h)])
    if r:
        matrix[:n, n : n + r] = problem.modes[rows]
        matrix[n : n + r, :n] = scale[:, None] * sums
        matrix[n : n + r, n + r :] = hidden
        matrix[n + r :, n : n + r] = hidden.T
        rest = problem.resultant + problem.balance[:, ::2] @ sigma[:, 0]
        rhs[n : n + r] = -scale * rest / unit
    x = _solve(matrix, rhs)
    forces = x[:n] * unit
    sigma[closed, 1] = forces[: len(closed)]
    sigma[closed, 0] += slope * forces[: len(closed)]
    sigma[stick, 0] = forces[len(closed) :]
    alpha = x[n : n + r]
    v = v_0 + given + full @ forces + problem.modes @ alpha
    pushed = hidden @ x[n + r :] * unit / scale if h else np.zeros(r)
    return v.reshape(m, 2), sigma, alpha, pushed


def _unseen(seen: Array) -> Array:
    """Combinations (r, h) of motions that rows (n, r) do not see."""
    r = seen.shape[1]
    if len(seen) == 0:
        return np.eye(r)
    _, values, vectors = np.linalg.svd(seen, full_matrices=True)
    values = np.append(values, np.zeros(r - len(values)))
    return np.asarray(vectors[values <= UNSEEN * max(float(values[0]), 1e-300)].T)


def _solve(matrix: Array, rhs: Array) -> Array:
    if len(rhs) == 0:
        return rhs
    try:
        return np.linalg.solve(matrix, rhs)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(matrix, rhs, rcond=1e-13)[0]


def revised_sets(problem: Reduced, law: PairLaw, sets: Sets, v: Array, sigma: Array) -> tuple[Sets, Index]:
    """The sets that the inequalities ask for, and the nodes that change."""
    finite = v[np.isfinite(v[:, 1]), :]
    length = NOISE * max(float(np.abs(problem.base[law.present]).max(initial=0.0)), float(np.abs(finite).max(initial=0.0)))
    stress = NOISE * float(np.abs(sigma).max(initial=0.0))
    pressure = -sigma[:, 1]
    opens = sets.closed & law.unilateral & (pressure < -stress)
    closes = ~sets.closed & law.present & (v[:, 1] > length)
    closed = (sets.closed | closes) & ~opens
    bound = law.bound(pressure)
    moved = v[:, 0] - problem.slip_before
    stick = sets.closed & (sets.slip == 0)
    starts_ = stick & (np.abs(sigma[:, 0]) > bound * (1.0 + 1e-11) + stress)
    stops = sets.closed & (sets.slip != 0) & (sets.slip * moved < -length)
    slip = np.where(starts_, -np.sign(sigma[:, 0]), np.where(stops, 0, sets.slip))
    # what closes slips at once if it slid further than the gap would let friction hold it: Π with one ρ for both
    slides = law.coulomb & (np.abs(moved) > law.coefficient * np.abs(v[:, 1]))
    slip = np.where(closes, np.where(slides, np.sign(moved), 0), slip).astype(np.int64)
    with np.errstate(invalid="ignore"):
        capped = law.coulomb & (law.coefficient * np.maximum(pressure, 0.0) > law.cap)
    new = _admissible(law, Sets(closed, slip, capped))
    changed = (new.closed != sets.closed) | (new.slip != sets.slip) | ((new.capped != sets.capped) & new.closed)
    return new, np.flatnonzero(changed)
