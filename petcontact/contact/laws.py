"""Contact laws: what v and σ on Γ_C must satisfy, as a projection equation like (2.9).

A law is σ + Π(τ) = 0 with τ = ρv - σ at every node, the same for every ρ > 0. Write your own with the members of
`ContactLaw` and give it to any contact method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from ..arrays import Array, Mask, States
from .friction_law import ball_derivative, lengths, project_ball, robin_residual

STICK, SLIP, OPEN = 0, 1, 2


class ContactLaw(Protocol):
    """The law on all contact nodes; v, σ and τ are (m, k) [length], [stress], [stress].

    Attributes
    ----------
    k : int
        Components a node: the tangential ones, then the normal one if the law has it.
    groups : tuple of slice
        Components that share a ρ: the tangential ones, and the normal one.
    """

    @property
    def k(self) -> int: ...

    @property
    def groups(self) -> tuple[slice, ...]: ...

    def project(self, tau: Array) -> Array:
        """Π(τ), (m, k)."""
        ...

    def linearise(self, tau: Array) -> Array:
        """The generalised derivative of Π at τ, (m, k, k)."""
        ...

    def states(self, tau: Array) -> States:
        """Which piece of Π τ lies on: 0 stick, 1 slip, 2 open, (m,)."""
        ...


def law_residual(law: ContactLaw, v: Array, sigma: Array, rho: float | Array) -> Array:
    """R_ρ(v, σ) = σ + Π(ρv - σ) [stress], (m, k), equation (2.10): zero exactly where the law holds.

    Parameters
    ----------
    law : ContactLaw
    v, sigma : (m, k) arrays
        [length], [stress]
    rho : float or (k,) array
        Robin parameter, > 0 [stress/length].

    Raises
    ------
    ValueError
        If rho is not positive or the shapes differ.
    """
    return robin_residual(law.project, v, sigma, rho)


EXCESS = 100.0
"""Tolerances by which tractions may exceed what the law allows: an iteration ends near it, not at it."""


def law_excess(law: ContactLaw, sigma: Array, scale: float) -> float:
    """How far σ lies outside of what the law allows whatever the displacement, over a stress `scale` or max|σ|."""
    outside = float(np.abs(sigma + law.project(-sigma)).max(initial=0.0))
    size = max(scale, float(np.abs(sigma).max(initial=0.0)))
    return outside / size if outside > 0.0 else 0.0


@dataclass(frozen=True)
class Tresca:
    """Bilateral contact of one body, u_n = 0, with a given friction bound: Π(τ) = [τ]_g, (2.5)-(2.6).

    Attributes
    ----------
    bound : (m,) array
        g >= 0 [stress].
    k : int
        d - 1.
    """

    bound: Array
    k: int = 1

    @property
    def groups(self) -> tuple[slice, ...]:
        """One ρ for all components."""
        return (slice(0, self.k),)

    def project(self, tau: Array) -> Array:
        """[τ]_g."""
        return project_ball(tau, self.bound)

    def linearise(self, tau: Array) -> Array:
        """Derivative of [τ]_g."""
        return ball_derivative(tau, self.bound)[0]

    def states(self, tau: Array) -> States:
        """0 stick, 1 slip; slip where g = 0."""
        return np.where(_slips(tau, self.bound), SLIP, STICK).astype(np.int8)


@dataclass(frozen=True)
class Frictional:
    """Normal and tangential contact: p = max(τ_n, 0), or τ_n where bilateral, and [τ_t] on the ball of radius r(p).

    r is the least of μ|p| and g: Coulomb's law, Tresca's, or both; frictionless with g = 0; bonded where both are infinite
    and the contact is bilateral. It vanishes where the contact is open. v_n is the overlap beyond the gap, σ_n = -p.

    Attributes
    ----------
    coefficient : (m,) array
        μ >= 0 [-]; infinite where friction does not depend on pressure.
    bound : (m,) array
        g >= 0 [stress]; infinite where there is none.
    unilateral : (m,) bool array
        Whether the parts may separate.
    k : int
        d, the dimension.
    absent : (m,) bool array, optional
        Nodes that face nothing and carry nothing.
    """

    coefficient: Array
    bound: Array
    unilateral: Mask
    k: int
    absent: Mask | None = None

    @property
    def groups(self) -> tuple[slice, ...]:
        """ρ_t and ρ_n."""
        return slice(0, self.k - 1), slice(self.k - 1, self.k)

    def pressure(self, tau: Array) -> Array:
        """p(τ), (m,) [stress]."""
        return np.where(self.opened(tau), 0.0, tau[:, -1])

    def opened(self, tau: Array) -> Mask:
        """Where nothing touches, (m,)."""
        opened = self.unilateral & (tau[:, -1] <= 0.0)
        return opened if self.absent is None else opened | self.absent

    def radius(self, pressure: Array) -> Array:
        """r(p), (m,) [stress]."""
        limit = np.multiply(self.coefficient, np.abs(pressure), out=np.full(len(pressure), np.inf), where=self._coulomb)
        return np.where(self.unilateral & (pressure <= 0.0), 0.0, np.minimum(limit, self.bound))

    def project(self, tau: Array) -> Array:
        """Π(τ)."""
        p = self.pressure(tau)
        return np.column_stack([project_ball(tau[:, :-1], self.radius(p)), p])

    def linearise(self, tau: Array) -> Array:
        """Derivative of Π: the ball's, and how its radius follows the pressure."""
        p = self.pressure(tau)
        closed = ~self.opened(tau)
        radius = self.radius(p)
        tangential, outward = ball_derivative(tau[:, :-1], radius)
        slope = np.where(self._coulomb & (radius < self.bound) & closed, np.sign(p), 0.0)
        slope[slope != 0.0] *= self.coefficient[slope != 0.0]
        derivative = np.zeros((len(tau), self.k, self.k))
        derivative[:, :-1, :-1] = tangential
        derivative[:, :-1, -1] = slope[:, None] * outward
        derivative[:, -1, -1] = closed
        return derivative

    def states(self, tau: Array) -> States:
        """0 stick, 1 slip, 2 open."""
        slips = _slips(tau[:, :-1], self.radius(self.pressure(tau)))
        return np.where(self.opened(tau), OPEN, np.where(slips, SLIP, STICK)).astype(np.int8)

    @cached_property
    def _coulomb(self) -> Mask:
        return np.isfinite(self.coefficient)


def dissipation(law: Frictional, before: Array, after: Array, slid: Array) -> tuple[Array, Array]:
    """Energy that friction takes at each node while it slips, and a bound of its error, (m,) each [stress · length].

    The trapezoidal rule: |q| on slip is the radius of friction, which goes from that of the tractions before to that of the
    ones after. It is exact where slip grows in proportion to the radius, and where the radius stays as it is. The bound is
    what either of its ends would give.

    Parameters
    ----------
    law : Frictional
    before, after : (m, k) arrays
        σ at the start and at the end of an increment [stress].
    slid : (m, k-1) array
        Slip in between [length].
    """
    way = lengths(slid)
    ends = [np.where(way > 0.0, law.radius(-sigma[:, -1]), 0.0) for sigma in (before, after)]
    old, new = (np.where(np.isfinite(radius), radius, 0.0) for radius in ends)
    work = -np.sum(after[:, :-1] * slid, axis=1)
    # what sticks has slipped by round-off, and is not on the radius
    slipped = work >= 0.5 * new * way
    change = np.where(slipped, 0.5 * (old - new) * way, 0.0)
    return work + change, np.abs(change)


@dataclass(frozen=True)
class Stacked:
    """Laws of several contact parts or pairs as one law over all their nodes, in order.

    Attributes
    ----------
    laws : sequence of ContactLaw
        Of one k.
    counts : sequence of int
        Nodes of each.
    """

    laws: Sequence[ContactLaw]
    counts: Sequence[int]

    @property
    def k(self) -> int:
        """That of the parts."""
        return self.laws[0].k

    @property
    def groups(self) -> tuple[slice, ...]:
        """Those of the parts."""
        return self.laws[0].groups

    def project(self, tau: Array) -> Array:
        """Π(τ), part by part."""
        return np.concatenate([law.project(part) for law, part in self._parts(tau)])

    def linearise(self, tau: Array) -> Array:
        """Derivative of Π, part by part."""
        return np.concatenate([law.linearise(part) for law, part in self._parts(tau)])

    def states(self, tau: Array) -> States:
        """Pieces, part by part."""
        return np.concatenate([law.states(part) for law, part in self._parts(tau)])

    def _parts(self, tau: Array) -> list[tuple[ContactLaw, Array]]:
        return list(zip(self.laws, np.split(tau, np.cumsum(self.counts)[:-1]), strict=True))


def _slips(tau: Array, radius: Array) -> Mask:
    return np.asarray((lengths(tau) > radius) | (radius == 0.0))
