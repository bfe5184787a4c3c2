"""Sets from which semismooth Newton starts."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ..law_protocol import ContactLaw

Guess = tuple[Array, Array, Array]
"""τ, σ and v."""


def tau_of(law: ContactLaw, v: Array, sigma: Array) -> Array:
    """Return ρv - σ with a ρ for which both terms count."""
    size = math.sqrt(np.vdot(v, v)), math.sqrt(np.vdot(sigma, sigma))
    return (size[1] / size[0] if min(size) > 0.0 else 1.0) * v - sigma


def everywhere(like: Array, law: ContactLaw, slip: float) -> Array:
    """Return τ of contact everywhere: stick, or slip one way along the first tangent."""
    tau = np.zeros(like.shape)
    if len(law.groups) > 1:
        tau[:, law.groups[1]] = 1.0
    # outside of every ball
    tau[:, 0] = slip * 1e150
    return tau
