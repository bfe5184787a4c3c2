"""The contact problem of one increment as a contact method sees it: v = u_0 + S σ + M α,
E σ + f = 0."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..arrays import Array
from ..contact.system import ContactSystem, Modes, Surrogate
from .contact_compliance import ContactCompliance, MakeSurrogate


class Joint(Protocol):
    """The equations of all bodies, which are solved together with those of contact."""

    def compliance(self, surrogate: MakeSurrogate) -> ContactCompliance:
        """Return the compliance S of all bodies."""
        ...

    def system(
        self, u_0: Array, weight: Array, modes: Modes, shares: Array, operator: ContactCompliance
    ) -> ContactSystem:
        """Return the contact system of one increment.

        `u_0` (M, k) is v for σ = 0 [length], `shares` (K,) are the weights of the load states.
        """
        ...


class ComposedSystem:
    """A `ContactSystem` of bodies, obstacles, or anything else.

    Parameters
    ----------
    u_0 : (m, k) array
        v for σ = 0 and α = 0 [length].
    weight : (m,) array
        Weights of the contact nodes [length; area in space].
    modes : Modes or None
        Rigid motions that only contact holds.
    operator : ContactCompliance
        S.
    """

    def __init__(
        self, u_0: Array, weight: Array, modes: Modes | None, operator: ContactCompliance
    ) -> None:
        self.u_0, self.weight, self._operator = u_0, weight, operator
        self.modes = modes if modes is not None and len(modes.load) else None
        self.elastic_solves = self.applications = 0
        self._product: tuple[Array, Array] | None = None

    @property
    def matrix_free(self) -> bool:
        """Whether S is known only by its products."""
        return self._operator.matrix_free

    @property
    def ksp_iterations(self) -> int:
        """KSP iterations of the last Robin solve."""
        return self._operator.iterations

    def apply(self, sigma: Array) -> Array:
        """Return the product S σ, (m, k) [length]. That of the last σ is known."""
        if self._product is None or not np.array_equal(self._product[0], sigma):
            self.applications += 1
            self._product = sigma.copy(), self._operator.apply(sigma)
        return self._product[1].copy()

    def compliance(self) -> Array:
        """Return the compliance S as a matrix (m k, m k) [length/stress]."""
        return self._operator.matrix()

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """Return v and σ that satisfy σ + ρ v = f and the equilibrium E σ + load = 0."""
        load = np.zeros(0) if self.modes is None else -self.modes.load
        dv, sigma = self._solve(rho, f - rho * self.u_0, load)
        return self.u_0 + dv, sigma

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """Return δv and δσ that satisfy δσ + ρ δv = r and E δσ = 0."""
        return self._solve(rho, r, np.zeros(0 if self.modes is None else len(self.modes.load)))

    def _solve(self, rho: float | Array, r: Array, work: Array) -> tuple[Array, Array]:
        self.elastic_solves += 1
        self.applications += 1
        return self._operator.robin(np.broadcast_to(rho, r.shape), r, self.modes, work)

    def surrogate(self) -> Surrogate | None:
        """Return the surrogate T of S, or None."""
        return self._operator.surrogate()
