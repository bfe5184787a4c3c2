"""The friction condition by its active set: which nodes slip, and which way; linear equations on the others.

With u = u_0 + Sσ the displacement, a node sticks (u = 0 and |σ| <= g) or slips (σ = ±g against u). Given a guess of the
set, one linear solve on the sticking nodes yields σ and u, and those that break an inequality change sides: a step of
the semismooth Newton method, also known as primal-dual active set. Full exchanges may cycle. Block principal pivoting
(Júdice and Pires, Comput. Oper. Res. 21 (1994) 587-596) cannot: where the number of wrong nodes has not fallen for
some steps, only the last of them moves until it falls, which ends for every P-matrix, and S is one: its symmetric part
is positive definite in the inner product of the node weights.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..arrays import Array, Mask, States

Predictor = Callable[[Array, Array, States], tuple[States, Array]]

PATIENCE = 8
"""Full exchanges that may fail to reduce the number of wrong nodes."""
EXCESS = 1e-11
"""Relative excess of |σ| over g that round-off may cause at a node that ends a zone."""


class Compliance(Protocol):
    """What the active set needs of S or of T; vectors (m, 1)."""

    def apply(self, x: Array) -> Array: ...
    def stick_solve(self, stick: Mask, rhs: Array) -> Array: ...


@dataclass(frozen=True)
class Pivot:
    """One step: σ and u (m, 1) for a set, 0 stick and ±1 the sign of σ where it slips, and how many nodes are wrong."""

    sigma: Array
    u: Array
    active: States
    wrong: int


def initial_set(sigma: Array, u: Array, bound: Array, rho: float) -> States:
    """The set on which the projection of (2.10) is active: sign of σ - ρu where it exceeds g, else 0."""
    trial = sigma - rho * u
    return np.where(np.abs(trial) > bound, np.sign(trial), 0.0).astype(np.int8)


def revised_set(active: States, sigma: Array, u: Array, bound: Array, noise: float) -> States:
    """Sticking nodes with |σ| > g slip along σ; slipping nodes that move along their σ stick. Nodes with g = 0 stay."""
    revised = active.copy()
    over = (active == 0) & (np.abs(sigma) > bound * (1.0 + EXCESS))
    revised[over] = np.sign(sigma[over]).astype(np.int8)
    revised[(active * u > noise) & (bound > 0.0)] = 0
    return revised


def pivots(
    operator: Compliance, base: Array, bound: Array, active: States, sigma: Array, *,
    noise: float = 1e-13, predict: Predictor | None = None,
) -> Iterator[Pivot]:  # fmt: skip
    """Steps until no node is wrong; the last one solves u = base + S σ with the friction condition.

    Parameters
    ----------
    operator : Compliance
    base : (m, 1) array
        u for σ = 0 [length].
    bound : (m, 1) array
        g >= 0 [stress].
    active : (m, 1) array of int8
        First guess of the set.
    sigma : (m, 1) array
        Where an iterative solve on the sticking nodes starts from [stress].
    noise : float
        Displacements below noise·max|base| have no sign.
    predict : callable, optional
        Gives a better next set than the plain exchange from (σ, u, set), and a σ to start from, as long as full
        exchanges are allowed.
    """
    free = (bound == 0.0) & (active == 0)
    active = np.where(free, 1, active).astype(np.int8)
    level = noise * float(np.abs(base).max(initial=0.0))
    fewest, patience = len(bound) + 1, PATIENCE
    while True:
        stick = active == 0
        sigma = np.where(stick, sigma, bound * active)
        u = base + operator.apply(sigma)
        if stick.any():
            change = operator.stick_solve(stick, np.where(stick, -u, 0.0))
            sigma = sigma + change
            u = u + operator.apply(change)
        revised = revised_set(active, sigma, np.where(stick, 0.0, u), bound, level)
        wrong = np.flatnonzero(revised != active)
        yield Pivot(sigma, u, active, len(wrong))
        if len(wrong) == 0:
            return
        if len(wrong) < fewest:
            fewest, patience = len(wrong), PATIENCE
        else:
            patience -= 1
        if patience > 0:
            active, sigma = (revised, sigma) if predict is None else predict(sigma, u, revised)
        else:
            active = active.copy()
            active.flat[wrong[-1]] = revised.flat[wrong[-1]]


def solve_box(
    operator: Compliance, base: Array, bound: Array, active: States, sigma: Array, limit: int | None = None
) -> Pivot:
    """The last of `pivots`, or of the first `limit` of them.

    For a symmetric operator it is the minimum of ½σᵀWSσ + σᵀWu_0 over |σ| <= g, W the weights.
    """
    return deque(itertools.islice(pivots(operator, base, bound, active, sigma), limit), maxlen=1)[0]
