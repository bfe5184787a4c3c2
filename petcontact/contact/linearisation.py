"""A law linearised at a guess: the smooth piece on which each node lies, and the law there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .. import native
from ..arrays import Array, Mask, States
from ..record import record
from .law_protocol import ContactLaw

_TRACTION = native.function("petcontact_first_traction", "iiDDDDBBDDD")
_LINEARISE = native.function("petcontact_linearise", "iiDDDDBB")


@record
class Linearisation:
    """Π linearised at τ⁰ (m, k): σ = derivative y + constant with y = σ - ρv.

    Attributes
    ----------
    tau, constant : (m, k) arrays
        τ⁰ and Π'(τ⁰)τ⁰ - Π(τ⁰) [stress].
    derivative : (m, k, k) array
        Π'(τ⁰).
    active : (m, k) bool array
        Components of τ on which Π' depends: the unknowns of an active set. None where a node is
        open.
    stick : (m, k) bool array
        Active components on which Π' is the identity, so that v = 0 there: tangential ones of nodes
        that stick, normal ones of nodes that are closed.
    states : (m,) array
        0 stick, 1 slip, 2 open.
    """

    tau: Array
    constant: Array
    derivative: Array
    active: Mask
    stick: Mask
    states: States

    @classmethod
    def from_law(cls, law: ContactLaw, tau: Array) -> Linearisation:
        """Return the linearisation of a law at τ⁰; a law may have its own `linearised`."""
        own: Callable[[Array], Linearisation | None] | None = getattr(law, "linearised", None)
        if own is not None and (result := own(tau)) is not None:
            return result
        derivative, projection = law.linearise(tau), law.project(tau)
        if derivative.shape != (*tau.shape, law.k) or projection.shape != tau.shape:
            raise ValueError(
                f"a law's projection and derivative are {tau.shape} and {(*tau.shape, law.k)}, "
                f"got {projection.shape} and {derivative.shape}"
            )
        arrays = [native.contiguous(array) for array in (tau, projection, derivative)]
        constant, active, stick = (np.empty(tau.shape, dtype=kind) for kind in (float, bool, bool))
        _LINEARISE(*tau.shape, *arrays, constant, active, stick)
        return cls(tau, constant, derivative, active, stick, law.states(tau))

    @classmethod
    def all_stick(cls, like: Array) -> Linearisation:
        """Return v = 0 on all components, σ unknown, for the shape (m, k) of an array."""
        zero, all_components = np.zeros_like(like), np.ones(like.shape, dtype=bool)
        derivative = np.broadcast_to(np.eye(like.shape[1]), (*like.shape, like.shape[1]))
        return cls(
            zero,
            zero,
            derivative,
            all_components,
            all_components,
            np.zeros(len(like), dtype=np.int8),
        )

    def traction(self, y: Array) -> Array:
        """Return Π' y, (m, k): the change of σ by y on the active components."""
        result, of_law = np.empty(y.shape), np.ascontiguousarray(self.derivative)
        active, given = map(np.ascontiguousarray, (self.active, y))
        _TRACTION(*y.shape, of_law, None, None, None, active, None, given, result, None)
        return result

    def first_traction(self, so_far: Array, rho: Array) -> tuple[Array, Array]:
        """Return σ and the slack (y - σ)/ρ.

        y is σ so far where nodes stick, and -τ elsewhere.
        """
        given = (self.derivative, self.constant, self.tau, rho, self.active, self.stick, so_far)
        kept = [*map(np.ascontiguousarray, given)]
        sigma = np.empty(so_far.shape)
        slack = np.empty(so_far.shape)
        _TRACTION(*so_far.shape, *kept, sigma, slack)
        return sigma, slack
