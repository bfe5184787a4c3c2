"""Contact laws: what v and σ on Γ_C must satisfy, as a projection equation like (2.9).

A law is σ + Π(ρv - σ) = 0 at every node, the same for every ρ > 0. Write your own by these four methods and give it to
any contact method; what `ContactLaw` needs besides follows from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ..arrays import Array, States
from .friction_law import contact_state, project_ball, projection_residual


class ContactLaw(Protocol):
    """The law on all contact nodes; v and σ are (m, k) [length], [stress].

    Attributes
    ----------
    k : int
        Components a node: the tangential ones, then the normal one if the law has it.
    groups : tuple of slice
        Components that share a ρ.
    """

    @property
    def k(self) -> int: ...

    @property
    def groups(self) -> tuple[slice, ...]: ...

    def project(self, tau: Array) -> Array:
        """Π(τ), (m, k)."""
        ...

    def residual(self, v: Array, sigma: Array, rho: float | Array) -> Array:
        """R_ρ(v, σ) = σ + Π(ρv - σ), (m, k): zero exactly where the law holds."""
        ...

    def states(self, v: Array, sigma: Array, rho: float | Array) -> States:
        """0 stick, 1 slip, 2 open, (m,)."""
        ...


@dataclass(frozen=True)
class Tresca:
    """Bilateral contact with a given friction bound: Π(τ) = [τ]_g of tangential vectors, (2.5)-(2.6).

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

    def residual(self, v: Array, sigma: Array, rho: float | Array) -> Array:
        """(2.10)."""
        return projection_residual(v, sigma, self.bound, rho)

    def states(self, v: Array, sigma: Array, rho: float | Array) -> States:
        """0 stick, 1 slip."""
        return contact_state(v, sigma, self.bound, rho)
