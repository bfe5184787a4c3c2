"""Kelvin's solution itself: displacement and stress of forces at points of the plane."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...model.problem import Material


def displacement(x: Array, at: Array, force: Array, material: Material, unit_length: float) -> Array:
    """u (n, 2) [length] at points x (n, 2) for forces (f, 2) at points (f, 2), in plane strain or stress.

    The logarithm's argument is in units of `unit_length`, as in the integrals over elements.
    """
    result, nu = np.zeros((len(x), 2)), material.plane_strain_ratio
    for place, load in zip(at, force, strict=True):
        r, square = _from(x, place)
        result += (r @ load / square)[:, None] * r
        result -= 0.5 * (3.0 - 4.0 * nu) * np.log(square / unit_length**2)[:, None] * load
    return result / (8.0 * np.pi * material.shear_modulus * (1.0 - nu))


def stress(x: Array, at: Array, force: Array, material: Material) -> Array:
    """σ_xx, σ_yy, σ_xy (n, 3) [stress] of the same forces."""
    result, nu = np.zeros((len(x), 3)), material.plane_strain_ratio
    for place, load in zip(at, force, strict=True):
        r, square = _from(x, place)
        along = r @ load
        for c, (i, j) in enumerate(((0, 0), (1, 1), (0, 1))):
            result[:, c] -= (1.0 - 2.0 * nu) * (r[:, j] * load[i] + r[:, i] * load[j] - (i == j) * along) / square
            result[:, c] -= 2.0 * r[:, i] * r[:, j] * along / square**2
    return result / (4.0 * np.pi * (1.0 - nu))


def _from(x: Array, place: Array) -> tuple[Array, Array]:
    """r and |r|², which is kept from zero: at the force itself, where all is infinite, r = 0 leaves nothing."""
    r = x - place
    square = np.sum(r * r, axis=1)
    return r, np.maximum(square, 1e-24 * square.max(initial=1e-300))
