"""Exponents of corner singularities: displacements behave like r^λ where two sides meet.

Source: M. L. Williams, Stress singularities resulting from various boundary conditions in angular
corners of plates in extension, J. Appl. Mech. 19 (1952) 526-528. Sides that slide are added to
clamped and free ones. Polar coordinates have their origin at the corner. With Kolosov's κ = 3 - 4ν
and Muskhelishvili's potentials φ = a z^λ, ψ = b z^λ,

    2µ (u_r + i u_θ)    = r^λ     [κ A - λ conj(A) - conj(B)],
    (σ_θθ + i σ_rθ)/λ   = r^(λ-1) [λ A + conj(A) + B],
    (σ_rr + σ_θθ)/λ     = r^(λ-1) 4 Re A,

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
from typing import NamedTuple

import numpy as np

from ..arrays import Array, Complex, Mask
from ..round_off import HALF


class Slip(NamedTuple):
    """A side that slides on what is rigid; `friction` is σ_rθ over σ_θθ [-]."""

    friction: float


SideKind = str | float | Slip
CLAMPED, FREE, SLIDING = "clamped", "free", math.pi / 2.0
"""Kinds of sides. A number is an angle from the side's direction, away from the corner [rad]. The
side is held in that direction and has no traction across it; π/2 is the side's normal."""
NEAR = 1e-4
"""Distance from 0 and 1 within which an exponent is not one of a corner [-]. λ = 0 is a
translation, λ = 1 a rotation or a uniform stress; of two sliding sides λ = 0 says that they are one
straight side."""
DEGREE, IMAGINARY = 30, 1.0
"""Of the polynomial whose zeros are the exponents, over 1 and the length of the interval, and the
largest imaginary part of these. The determinant has terms like sin(2λα), with α up to 3π for two
wedges: of these a polynomial needs a degree of 3πL and 20 more on an interval of length L."""
POLISHED = 4
"""Steps of Newton's method from the zeros of the polynomial."""
SINGULAR = 1e-6
"""Smallest over largest singular value of a matrix at one of its exponents, and what of the stress
of a mode is round-off: polished zeros leave round-off, and half of its digits where two of them are
one."""

Matrix = Callable[[Complex], Complex]
"""A function from exponents (n,) to the conditions at a corner (n, k, k). Only at exponents of the
corner they have a solution other than 0."""


def wedge(angle: float, kappa: float, first: SideKind, second: SideKind) -> Matrix:
    """Return the conditions on the two sides of a corner, for the coefficients of its fields.

    Parameters
    ----------
    angle : float
        Interior angle, in (0, 2π] [rad].
    kappa : float
        3 - 4ν in plane strain, with ν/(1+ν) for ν in plane stress [-].
    first, second : CLAMPED, FREE, SLIDING, another angle or Slip
        The side at θ = 0 and that at θ = angle.
    """

    def matrix(power: Complex) -> Complex:
        sides = ((0.0, first), (angle, second))
        rows = [_conditions(power, theta, kappa, kind) for theta, kind in sides]
        return np.concatenate(rows, axis=1)

    return matrix


def joint(
    angles: tuple[float, float],
    kappas: tuple[float, float],
    stiffer: float,
    friction: float,
    beside: tuple[SideKind, SideKind] = (FREE, FREE),
) -> Matrix:
    """Return the conditions at the edge of the contact of two bodies, for the coefficients of both.

    Parameters
    ----------
    angles : (2,) floats
        Interior angles of the bodies, from the contact to their other sides [rad].
    kappas : (2,) floats
        As in `wedge`.
    stiffer : float
        Shear modulus of the second body over that of the first.
    friction : float
        σ_rθ over σ_θθ in slip, positive if it pulls the first body away from the edge; infinite in
        stick.
    beside : (2,) kinds of sides, optional
        The other sides of the bodies. The first one lies at θ > 0.
    """
    scales = stiffer / (1.0 + stiffer), 1.0 / (1.0 + stiffer)

    def matrix(power: Complex) -> Complex:
        first, second = (fields(power, 0.0, kappa) for kappa in kappas)
        matrix = np.zeros((len(power), 8, 8), dtype=np.complex128)
        matrix[:, :2, :4] = _conditions(power, angles[0], kappas[0], beside[0])
        matrix[:, 2:4, 4:] = _conditions(power, -angles[1], kappas[1], beside[1])
        matrix[:, 4:6, :4] = scales[0] * first[:, :2]
        matrix[:, 4:6, 4:] = -scales[1] * second[:, :2]
        matrix[:, 6:, :4], matrix[:, 6:, 4:] = first[:, 2:4], -second[:, 2:4]
        if math.isfinite(friction):  # this replaces the continuity of u_r
            matrix[:, 4, :4], matrix[:, 4, 4:] = first[:, 2] - friction * first[:, 3], 0.0
        return matrix

    return matrix


@functools.lru_cache(maxsize=4096)
def corner_exponent(angle: float, kappa: float, first: SideKind, second: SideKind) -> float:
    """Return the least real part in (0, 1) of the exponents of a corner, 1 if there is none; the
    arguments are those of `wedge`."""
    if first == second == SLIDING:
        # closed form: the zeros of sin((λ ± 1) angle)
        turns = (abs(k * math.pi / angle - 1.0) for k in range(1, 4))
        return min([1.0, *(turn for turn in turns if turn > NEAR)])
    return least_exponent(wedge(angle, kappa, first, second))


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


def least_exponent(matrix: Matrix) -> float:
    """Return the least real part in (0, 1) of the exponents, 1 if there is none.

    Examples
    --------
    A block that sticks on a half-space of the same material is a notch of 270 degrees:

    >>> stuck = joint((math.pi / 2.0, math.pi), (1.8, 1.8), 1.0, math.inf)
    >>> round(least_exponent(stuck), 3)
    0.544
    """
    roots = exponents(matrix, NEAR, 1.0 - NEAR)
    return min([1.0, *(root.real for root in roots)])


def exponents(matrix: Matrix, low: float, high: float) -> list[complex]:
    """Return the exponents with real parts between two bounds, increasing.

    The determinant is real for real exponents, and has no pole: they are the zeros of its
    polynomial. Those of complex pairs with a negative imaginary part are left out.

    Examples
    --------
    Of a crack they are multiples of 1/2; 1 is a rotation and the stress along the crack:

    >>> crack = wedge(2.0 * math.pi, 1.8, FREE, FREE)
    >>> [round(each.real, 6) for each in exponents(crack, 0.1, 1.6)]
    [0.5, 1.0, 1.5]
    """

    def determinant(power: Complex) -> Complex:
        return np.asarray(np.linalg.det(matrix(power.astype(np.complex128))))

    count = int(DEGREE * (1.0 + high - low)) + 1
    turn = math.pi * (np.arange(count) + 0.5) / count
    nodes = 0.5 * (low + high + (high - low) * np.cos(turn))
    # numpy's own interpolation multiplies the round-off of the nodes by the square of the degree
    size = 2.0 / count * np.cos(np.outer(np.arange(count), turn)) @ determinant(nodes).real
    size[0] *= 0.5
    told = np.flatnonzero(np.abs(size) > _round_off(matrix, nodes))
    zeros = np.polynomial.Chebyshev(size[: told[-1] + 1], domain=[low, high]).roots()
    zeros = zeros[(zeros.imag >= 0.0) & (zeros.imag < IMAGINARY)].astype(np.complex128)
    for _ in range(POLISHED):  # the polynomial is less exact away from the real line
        value, ahead = determinant(np.concatenate([zeros, zeros + HALF])).reshape(2, -1)
        step = value * HALF / np.where(ahead == value, np.inf, ahead - value)
        zeros = zeros - np.where(np.abs(step) < NEAR, step, 0.0)
    zeros = np.where(np.abs(zeros.imag) < NEAR, zeros.real, zeros)
    kept = list[complex]()
    for zero in np.sort_complex(zeros[_solves(matrix, zeros)]).tolist():
        if low < zero.real < high and all(abs(zero - each) > NEAR for each in kept):
            kept.append(zero)
    return kept


def _round_off(matrix: Matrix, power: Array) -> float:
    """The largest round-off of the determinants at some powers (n,).

    Elimination changes each row by a unit of round-off, and each row changes the determinant by no
    more than Hadamard's bound, the product of the lengths of all rows. A polynomial with terms that
    are smaller than this has zeros anywhere.
    """
    lengths = np.linalg.norm(matrix(power.astype(np.complex128)), axis=2)
    count: int = lengths.shape[1]
    return float(count * np.finfo(float).eps * lengths.prod(axis=1).max())


def _solves(matrix: Matrix, power: Complex) -> Mask:
    """Which of some powers (n,) are exponents."""
    size = np.linalg.svd(matrix(power), compute_uv=False)
    return np.asarray(size[:, -1] < SINGULAR * size[:, 0])


def null_vectors(matrix: Matrix, root: complex) -> Complex:
    """Return the coefficients (k, n) of the fields of an exponent, none where it is not one."""
    _, size, rows = np.linalg.svd(matrix(np.array([root], dtype=np.complex128))[0])
    found = rows[size < SINGULAR * size[0]].conj()
    return np.asarray(found.real if root.imag == 0.0 else found, dtype=np.complex128)


def fields(power: Complex | complex, theta: float | Array, kappa: float) -> Complex:
    """Return rows (n, 5, 4) of 2µ u_r, 2µ u_θ, σ_rθ/λ, σ_θθ/λ and σ_rr/λ for exponents (n,), or for
    angles (n,) and one exponent."""
    cosine, sine = np.cos((power - 1.0) * theta), np.sin((power - 1.0) * theta)
    cosine_b, sine_b = np.cos((power + 1.0) * theta), np.sin((power + 1.0) * theta)
    u_r = [(kappa - power) * cosine, -(kappa - power) * sine, -cosine_b, sine_b]
    u_theta = [(kappa + power) * sine, (kappa + power) * cosine, sine_b, cosine_b]
    t_theta = [(power + 1.0) * cosine, -(power + 1.0) * sine, cosine_b, -sine_b]
    t_r = [(power - 1.0) * sine, (power - 1.0) * cosine, sine_b, cosine_b]
    t_rr = [(3.0 - power) * cosine, -(3.0 - power) * sine, -cosine_b, sine_b]
    return np.array([u_r, u_theta, t_r, t_theta, t_rr]).transpose(2, 0, 1)


def _conditions(power: Complex, theta: float, kappa: float, kind: SideKind) -> Complex:
    """Return the two rows (n, 2, 4) of a side for exponents (n,)."""
    return known_on(fields(power, theta, kappa), kind)


def known_on(rows: Complex, kind: SideKind) -> Complex:
    """Return what is known on a side, (n, 2, k), of rows (n, 4 or 5, k) as of `fields`."""
    if kind in (CLAMPED, FREE):
        return rows[:, :2] if kind == CLAMPED else rows[:, 2:4]
    u_r, u_theta, t_r, t_theta, *_ = rows.transpose(1, 0, 2)
    if isinstance(kind, Slip):
        return np.stack([u_theta, t_r - kind.friction * t_theta], axis=1)
    along, across = math.cos(float(kind)), math.sin(float(kind))
    return np.stack([along * u_r + across * u_theta, along * t_theta - across * t_r], axis=1)
