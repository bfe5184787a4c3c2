"""Exponents of corner singularities: displacements behave like r^λ where two sides meet.

M. L. Williams, Stress singularities resulting from various boundary conditions in angular corners of plates in
extension, J. Appl. Mech. 19 (1952) 526-528, with sides that slide besides clamped and free ones. In polar coordinates
around the corner, with Kolosov's κ = 3 - 4ν and potentials φ = a z^λ, ψ = b z^λ (Muskhelishvili),

    2µ (u_r + i u_θ)        = r^λ     [κ a e^{i(λ-1)θ} - λ conj(a e^{i(λ-1)θ}) - conj(b e^{i(λ+1)θ})],
    (σ_θθ + i σ_rθ)/λ       = r^(λ-1) [λ a e^{i(λ-1)θ} + conj(a e^{i(λ-1)θ}) + b e^{i(λ+1)θ}];

two conditions on either side make a 4 x 4 matrix for Re a, Im a, Re b, Im b, singular at the exponents.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from ..arrays import Complex

SideKind = str | float
CLAMPED, FREE, SLIDING = "clamped", "free", math.pi / 2.0
"""Kinds of sides; a number is the angle from the side's direction, away from the corner, to the one direction in which
it is held, while it carries no traction across that: π/2 is the side's normal [rad]."""
LOWEST, HIGHEST = 0.02, 1.0 - 1e-4
"""Exponents outside are taken for λ = 0, a translation, and for λ = 1, a rotation or a uniform stress."""
STRAIGHT = math.radians(0.01)
"""Two sides that slide and turn by less are one."""
REAL_GRID, STARTS, STEPS = 200, (12, 4), 16
"""Points of (0, 1) looked at for changes of sign; starts of Newton's method, real by imaginary parts; its steps."""
DIFFERENCE = 1e-7
"""Of exponents, for the slope of the determinant."""


@functools.lru_cache(maxsize=4096)
def corner_exponent(angle: float, kappa: float, first: SideKind, second: SideKind) -> float:
    """The smallest real part in (0, 1) of the exponents of a corner, 1 where there is none.

    Parameters
    ----------
    angle : float
        Interior, in (0, 2π] [rad].
    kappa : float
        3 - 4ν in plane strain, with ν/(1+ν) for ν in plane stress [-].
    first, second : CLAMPED, FREE, SLIDING or another angle
        The side at θ = 0 and that at θ = angle.
    """
    if first == second == SLIDING:
        # closed form: the zeros of sin((λ ± 1) angle)
        turns = [abs(k * math.pi / angle - 1.0) for k in range(1, 4)]
        return 1.0 if abs(angle - math.pi) < STRAIGHT else min(1.0, *turns)

    def determinant(power: Complex) -> Complex:
        rows = np.concatenate([_conditions(power, 0.0, kappa, first), _conditions(power, angle, kappa, second)], axis=1)
        return np.asarray(np.linalg.det(rows))

    found = [1.0]
    grid = np.linspace(LOWEST, HIGHEST, REAL_GRID)
    values = determinant(grid.astype(np.complex128)).real
    cut = np.flatnonzero(values[1:] * values[:-1] <= 0.0)
    if len(cut):
        k = cut[0]
        found.append(float(grid[k] + (grid[k + 1] - grid[k]) * values[k] / (values[k] - values[k + 1])))
    real, imaginary = np.linspace(0.05, 0.95, STARTS[0]), np.linspace(0.02, 0.8, STARTS[1])
    power = (real[:, None] + 1j * imaginary).ravel()
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            value, ahead = determinant(np.concatenate([power, power + DIFFERENCE])).reshape(2, -1)
            step = -value * DIFFERENCE / (ahead - value)
            step = np.where(np.abs(step) < 0.2, step, 0.2 * step / np.abs(step))
            power = power + step
    settled = (np.abs(step) < 1e-6) & (power.real > LOWEST) & (power.real < HIGHEST) & (np.abs(power.imag) < 3.0)
    return float(min(found + power.real[settled].tolist()))


def _conditions(power: Complex, theta: float, kappa: float, kind: SideKind) -> Complex:
    """The two rows (n, 2, 4) of a side for exponents (n,)."""
    cosine, sine = np.cos((power - 1.0) * theta), np.sin((power - 1.0) * theta)
    cosine_b, sine_b = np.cos((power + 1.0) * theta), np.sin((power + 1.0) * theta)
    u_r = [(kappa - power) * cosine, -(kappa - power) * sine, -cosine_b, sine_b]
    u_theta = [(kappa + power) * sine, (kappa + power) * cosine, sine_b, cosine_b]
    t_theta = [(power + 1.0) * cosine, -(power + 1.0) * sine, cosine_b, -sine_b]
    t_r = [(power - 1.0) * sine, (power - 1.0) * cosine, sine_b, cosine_b]
    if kind == CLAMPED:
        rows = [u_r, u_theta]
    elif kind == FREE:
        rows = [t_r, t_theta]
    else:
        along, across = math.cos(float(kind)), math.sin(float(kind))
        rows = [[along * a + across * b for a, b in zip(u_r, u_theta, strict=True)],
                [along * b - across * a for a, b in zip(t_r, t_theta, strict=True)]]  # fmt: skip
    return np.array(rows).transpose(2, 0, 1)
