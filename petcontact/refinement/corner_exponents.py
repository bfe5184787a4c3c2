"""Exponents of corner singularities: displacements behave like r^λ where two sides meet.

Source: M. L. Williams, Stress singularities resulting from various boundary conditions in angular
corners of plates in extension, J. Appl. Mech. 19 (1952) 526-528. Sides that slide are added to
clamped and free ones. Polar coordinates have their origin at the corner. With Kolosov's κ = 3 - 4ν
and Muskhelishvili's potentials φ = a z^λ, ψ = b z^λ,

    2µ (u_r + i u_θ)    = r^λ     [κ A - λ conj(A) - conj(B)],
    (σ_θθ + i σ_rθ)/λ   = r^(λ-1) [λ A + conj(A) + B],

where A = a e^{i(λ-1)θ} and B = b e^{i(λ+1)θ}. Two conditions on each side make a 4 x 4 matrix for
Re a, Im a, Re b and Im b. It is singular at the exponents. For two wedges that meet at θ = 0 the
matrix is 8 x 8. It has two conditions on each free side, and four between the wedges (D. B. Bogy,
Two edge-bonded elastic wedges of different materials and wedge angles under surface tractions, J.
Appl. Mech. 38 (1971) 377-386).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from ..arrays import Complex
from ..round_off import HALF

SideKind = str | float
CLAMPED, FREE, SLIDING = "clamped", "free", math.pi / 2.0
"""Kinds of sides. A number is an angle from the side's direction, away from the corner [rad]. The
side is held in that direction and has no traction across it; π/2 is the side's normal."""
NEAR = 1e-4
"""Distance from 0 and 1 within which an exponent is not one of a corner [-]. λ = 0 is a
translation, λ = 1 a rotation or a uniform stress; of two sliding sides λ = 0 says that they are one
straight side."""


@functools.lru_cache(maxsize=4096)
def corner_exponent(angle: float, kappa: float, first: SideKind, second: SideKind) -> float:
    """Return the least real part in (0, 1) of the exponents of a corner, 1 if there is none.

    Parameters
    ----------
    angle : float
        Interior angle, in (0, 2π] [rad].
    kappa : float
        3 - 4ν in plane strain, with ν/(1+ν) for ν in plane stress [-].
    first, second : CLAMPED, FREE, SLIDING or another angle
        The side at θ = 0 and that at θ = angle.
    """
    if first == second == SLIDING:
        # closed form: the zeros of sin((λ ± 1) angle)
        turns = (abs(k * math.pi / angle - 1.0) for k in range(1, 4))
        return min([1.0, *(turn for turn in turns if turn > NEAR)])

    def determinant(power: Complex) -> Complex:
        rows = np.concatenate(
            [_conditions(power, 0.0, kappa, first), _conditions(power, angle, kappa, second)],
            axis=1,
        )
        return np.asarray(np.linalg.det(rows))

    return _least_root(determinant)


def shear_exponent(angle: float, first: bool, second: bool) -> float:
    """Return the least exponent of the displacement across the plane of a corner, at most 1.

    The displacement is r^λ cos(λθ), a solution of Laplace's equation.

    Parameters
    ----------
    angle : float
        Interior angle, in (0, 2π] [rad].
    first, second : bool
        Whether the sides are held in that direction.

    Examples
    --------
    >>> shear_exponent(math.pi, True, False), shear_exponent(2.0 * math.pi, False, False)
    (0.5, 0.5)
    """
    return min(1.0, math.pi / angle / (1.0 if first == second else 2.0))


@functools.lru_cache(maxsize=4096)
def pair_exponent(
    angles: tuple[float, float],
    kappas: tuple[float, float],
    stiffer: float,
    friction: float,
    beside: tuple[SideKind, SideKind] = (FREE, FREE),
) -> float:
    """Return the least real part in (0, 1) of the exponents at an edge of the contact of two
    bodies.

    It is 1 if there is none.

    Parameters
    ----------
    angles : (2,) floats
        Interior angles of the bodies, from the contact to their other sides [rad].
    kappas : (2,) floats
        As in `corner_exponent`.
    stiffer : float
        Shear modulus of the second body over that of the first.
    friction : float
        σ_rθ over σ_θθ in slip, positive if it pulls the first body away from the edge; infinite in
        stick.
    beside : (2,) kinds of sides, optional
        The other sides of the bodies. The first one lies at θ > 0.

    Examples
    --------
    A block that sticks on a half-space of the same material is a notch of 270 degrees:

    >>> round(pair_exponent((math.pi / 2.0, math.pi), (1.8, 1.8), 1.0, math.inf), 3)
    0.544
    """
    scales = stiffer / (1.0 + stiffer), 1.0 / (1.0 + stiffer)

    def determinant(power: Complex) -> Complex:
        first, second = (_fields(power, 0.0, kappa) for kappa in kappas)
        matrix = np.zeros((len(power), 8, 8), dtype=np.complex128)
        matrix[:, :2, :4] = _conditions(power, angles[0], kappas[0], beside[0])
        matrix[:, 2:4, 4:] = _conditions(power, -angles[1], kappas[1], beside[1])
        matrix[:, 4:6, :4], matrix[:, 4:6, 4:] = (
            scales[0] * first[:, :2],
            -scales[1] * second[:, :2],
        )
        matrix[:, 6:, :4], matrix[:, 6:, 4:] = first[:, 2:], -second[:, 2:]
        if math.isfinite(friction):  # this replaces the continuity of u_r
            matrix[:, 4, :4], matrix[:, 4, 4:] = first[:, 2] - friction * first[:, 3], 0.0
        return np.asarray(np.linalg.det(matrix))

    return _least_root(determinant)


def _least_root(determinant: Callable[[Complex], Complex]) -> float:
    """Return the least real part in (0, 1) of the zeros of a function, 1 if there is none.

    The function is real on the real line.
    """
    roots = [1.0]
    grid = np.linspace(NEAR, 1.0 - NEAR, 200)
    values = determinant(grid.astype(np.complex128)).real
    cut = np.flatnonzero(values[1:] * values[:-1] <= 0.0)
    if len(cut):
        k = cut[0]
        roots.append(
            float(grid[k] + (grid[k + 1] - grid[k]) * values[k] / (values[k] - values[k + 1]))
        )
    real, imaginary = np.linspace(0.05, 0.95, 12), np.linspace(0.02, 0.8, 4)
    power = (real[:, None] + 1j * imaginary).ravel()
    with np.errstate(all="ignore"):
        for _ in range(16):
            value, ahead = determinant(np.concatenate([power, power + HALF])).reshape(2, -1)
            step = -value * HALF / (ahead - value)
            step = np.where(np.abs(step) < 0.2, step, 0.2 * step / np.abs(step))
            power = power + step
    from_ends = np.minimum(power.real, 1.0 - power.real)
    settled = (np.abs(step) < 1e-6) & (from_ends > NEAR) & (np.abs(power.imag) < 3.0)
    return float(min(roots + power.real[settled].tolist()))


def _fields(power: Complex, theta: float, kappa: float) -> Complex:
    """Return rows (n, 4, 4) of 2µ u_r, 2µ u_θ, σ_rθ/λ and σ_θθ/λ for exponents (n,)."""
    cosine, sine = np.cos((power - 1.0) * theta), np.sin((power - 1.0) * theta)
    cosine_b, sine_b = np.cos((power + 1.0) * theta), np.sin((power + 1.0) * theta)
    u_r = [(kappa - power) * cosine, -(kappa - power) * sine, -cosine_b, sine_b]
    u_theta = [(kappa + power) * sine, (kappa + power) * cosine, sine_b, cosine_b]
    t_theta = [(power + 1.0) * cosine, -(power + 1.0) * sine, cosine_b, -sine_b]
    t_r = [(power - 1.0) * sine, (power - 1.0) * cosine, sine_b, cosine_b]
    return np.array([u_r, u_theta, t_r, t_theta]).transpose(2, 0, 1)


def _conditions(power: Complex, theta: float, kappa: float, kind: SideKind) -> Complex:
    """Return the two rows (n, 2, 4) of a side for exponents (n,)."""
    fields = _fields(power, theta, kappa)
    if kind in (CLAMPED, FREE):
        return fields[:, :2] if kind == CLAMPED else fields[:, 2:]
    along, across = math.cos(float(kind)), math.sin(float(kind))
    u_r, u_theta, t_r, t_theta = fields.transpose(1, 0, 2)
    return np.stack([along * u_r + across * u_theta, along * t_theta - across * t_r], axis=1)
