"""Contact laws: v and σ on Γ_C satisfy a projection equation like (2.9).

A law is σ + Π(τ) = 0 with τ = ρv - σ at every node, the same for every ρ > 0. Write your own with
the members of `ContactLaw` and give it to any contact method; those of `LimitedLaw` and `bound_at`
(see `friction_bound`) are optional, and make failures and results say more. `linearised` and
`residual` (see `laws`) are optional, too, and save time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from ..arrays import Array, States
from ..record import record
from ..round_off import HALF
from .friction_law import lengths

STICK, SLIP, OPEN = 0, 1, 2


class ContactLaw(Protocol):
    """The law on all contact nodes; v, σ and τ are (m, k) [length], [stress], [stress].

    Attributes
    ----------
    k : int
        Components a node: the tangential ones, then the normal one if the law has it.
    groups : tuple of slice
        Components that share a ρ: the tangential ones, and the normal one if there is one.

    Examples
    --------
    Adhesion: what touches neither slides nor opens until it is pulled by a strength, which then
    goes on to pull.

    >>> class Adhesion:
    ...     k, groups = 2, (slice(0, 1), slice(1, 2))
    ...
    ...     def __init__(self, strength):
    ...         self.strength = strength                  # (m,) [stress]
    ...
    ...     def opens(self, tau):
    ...         return tau[:, 1] < -self.strength
    ...
    ...     def project(self, tau):
    ...         opened = np.column_stack([np.zeros(len(tau)), -self.strength])
    ...         return np.where(self.opens(tau)[:, None], opened, tau)
    ...
    ...     def linearise(self, tau):
    ...         return np.eye(2) * ~self.opens(tau)[:, None, None]
    ...
    ...     def states(self, tau):
    ...         return np.where(self.opens(tau), OPEN, STICK).astype(np.int8)
    >>> law = Adhesion(np.array([0.5, 0.5]))
    >>> law.project(np.array([[3.0, -0.4], [3.0, -0.6]]))
    array([[ 3. , -0.4],
           [ 0. , -0.5]])
    """

    @property
    def k(self) -> int: ...

    @property
    def groups(self) -> tuple[slice, ...]: ...

    def project(self, tau: Array) -> Array:
        """Return the projection Π(τ) on the tractions that the law allows, (m, k) [stress]."""
        ...

    def linearise(self, tau: Array) -> Array:
        """Return the generalised derivative of Π at τ, (m, k, k)."""
        ...

    def states(self, tau: Array) -> States:
        """Return the piece of Π on which τ lies: 0 stick, 1 slip, 2 open, (m,)."""
        ...


@record
class Admissible:
    """Convex limits on the tractions of each node, for any displacement; infinite where there is
    none.

    Attributes
    ----------
    cap : (m,) array
        |σ_t| <= cap [stress].
    cohesion, slope : (m,) arrays
        |σ_t| <= cohesion - slope σ_n [stress], [-].
    pull, push : (m,) arrays
        -push <= σ_n <= pull [stress].
    """

    cap: Array
    cohesion: Array
    slope: Array
    pull: Array
    push: Array


GivenLaw = ContactLaw | Callable[..., ContactLaw]
"""A law for the contact nodes as they are, or a function of them to one."""


@runtime_checkable
class LimitedLaw(ContactLaw, Protocol):
    """A law with limits on its tractions.

    A linear program then recognises loads that nothing can hold.
    """

    def admissible(self) -> Admissible:
        """Return the limits of σ, by which impossible loads are recognised."""
        ...


def friction_bound(law: ContactLaw, sigma: Array) -> Array:
    """Return the largest |σ_t| for the given σ_n, (m,) [stress]; infinite if the law has no
    `bound_at(σ)`.

    >>> from petcontact.contact.laws import Tresca
    >>> friction_bound(Tresca(np.array([150.0])), np.array([[20.0]]))
    array([150.])
    """
    bound_at = getattr(law, "bound_at", None)
    return np.full(len(sigma), np.inf) if bound_at is None else np.asarray(bound_at(sigma))


def law_residual(law: ContactLaw, v: Array, sigma: Array, rho: float | Array) -> Array:
    """Return R_ρ(v, σ) = σ + Π(ρv - σ) [stress], (m, k), equation (2.10): zero exactly where the
    law holds.

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

    Examples
    --------
    Stick below the bound, slip against the traction at it, and slip along it, which no friction
    allows:

    >>> from petcontact.contact.laws import Tresca
    >>> law = Tresca(np.array([2.0, 2.0, 2.0]))
    >>> v, sigma = np.array([[0.0], [0.1], [0.1]]), np.array([[1.5], [-2.0], [2.0]])
    >>> law_residual(law, v, sigma, 10.0).ravel()
    array([0., 0., 1.])
    """
    if not (np.asarray(rho) > 0.0).all():
        raise ValueError(f"the Robin parameter is positive, got {rho}")
    if v.shape != sigma.shape:
        raise ValueError(
            f"displacement and traction have one shape, got {v.shape} and {sigma.shape}"
        )
    own: Callable[[Array, Array, float | Array], Array] | None = getattr(law, "residual", None)
    if own is not None:
        return own(v, sigma, rho)
    return sigma + law.project(rho * v - sigma)  # (2.10); (2.9) where it is zero


WITHIN = 1e-6
"""Accepted excess of tractions over the law's limits [-]: (|σ_t| - g)/g, and the excess over other
limits relative to max|σ|."""


def bound_excess(law: ContactLaw, sigma: Array) -> float:
    """Return how far σ (m, k) exceeds the limits of the law, relative to the bound of each node
    [-].

    The bound is |Π(-σ)_t|, the σ_t that is allowed beside σ_n; what is outside along the normal is
    relative to max|σ|.

    >>> from petcontact.contact.laws import Tresca
    >>> bound_excess(Tresca(np.array([1e-3, 100.0])), np.array([[1.5e-3], [100.0]]))
    0.5
    """
    allowed = -law.project(-sigma)
    outside, tangential = sigma - allowed, law.groups[0]
    size = float(np.abs(allowed).max(initial=0.0)) or float(np.abs(sigma).max(initial=0.0)) or 1.0
    bound = np.maximum(lengths(allowed[:, tangential]), HALF * size)
    along = float((lengths(outside[:, tangential]) / bound).max(initial=0.0))
    return max(
        along,
        *(float(np.abs(outside[:, normal]).max(initial=0.0)) / size for normal in law.groups[1:]),
        0.0,
    )
