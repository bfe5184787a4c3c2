"""A law linearised at a guess: on which smooth piece each node lies, and what the law is there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Mask, States
from .laws import ContactLaw


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
