"""Sets from which semismooth Newton starts."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ..law_protocol import ContactLaw

Guess = tuple[Array, Array, Array]
"""τ, σ and v."""


def tau_of(v: Array, sigma: Array) -> Array:
    """Return ρv - σ with a ρ for which both terms count."""
    size = math.sqrt(np.vdot(v, v)), math.sqrt(np.vdot(sigma, sigma))
    return (size[1] / size[0] if min(size) > 0.0 else 1.0) * v - sigma


def stuck_everywhere(like: Array, law: ContactLaw) -> Array:
    """Return τ of contact that sticks everywhere."""
    tau = np.zeros(like.shape)
    if len(law.groups) > 1:
        tau[:, law.groups[1]] = 1.0
    return tau
