"""Kelvin's solution itself: displacement and stress of forces at points of space."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...model.problem import Material

COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def displacement(x: Array, at: Array, force: Array, material: Material) -> Array:
    """u (n, 3) [length] at points x (n, 3) for forces (f, 3) at points (f, 3)."""
    result, nu = np.zeros((len(x), 3)), material.poisson_ratio
    for place, load in zip(at, force, strict=True):
        r, distance = _from(x, place)
        result += ((3.0 - 4.0 * nu) * load + (r @ load / distance**2)[:, None] * r) / distance[:, None]
    return result / (16.0 * np.pi * material.shear_modulus * (1.0 - nu))


def stress(x: Array, at: Array, force: Array, material: Material) -> Array:
    """σ_xx, σ_yy, σ_zz, σ_xy, σ_xz, σ_yz (n, 6) [stress] of the same forces."""
    result, nu = np.zeros((len(x), 6)), material.poisson_ratio
    for place, load in zip(at, force, strict=True):
        r, distance = _from(x, place)
        along = r @ load
        for c, (i, j) in enumerate(COMPONENTS):
            result[:, c] -= (1.0 - 2.0 * nu) * (r[:, j] * load[i] + r[:, i] * load[j] - (i == j) * along) / distance**3
            result[:, c] -= 3.0 * r[:, i] * r[:, j] * along / distance**5
    return result / (8.0 * np.pi * (1.0 - nu))


def _from(x: Array, place: Array) -> tuple[Array, Array]:
    """r and |r|, which is kept from zero: at the force itself, where all is infinite, r = 0 leaves nothing."""
    r = x - place
    distance = np.linalg.norm(r, axis=1)
    return r, np.maximum(distance, 1e-12 * distance.max(initial=1e-150))
