"""The fields at a corner whose stress has no bound: exponents, angular functions, normalisation.

A mode is a field r^λ f(θ) that satisfies the conditions on both sides. It is scaled so that its
stress on one line, θ = `theta`, is r^(λ-1). Where both sides are of one kind the line is their
bisector; else it is the side that is held or in contact. The stress is the normal one, σ_θθ, in
contact the pressure; in a mode that has none on that line it is the shear stress, σ_rθ.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, Complex
from .corner_exponents import (
    FREE,
    NEAR,
    SINGULAR,
    Matrix,
    SideKind,
    exponents,
    fields,
    joint,
    null_vectors,
    wedge,
)

STRONG = 0.98
"""Exponent from which on stress is told as a value: r^(λ-1) grows by less than 15 % from a tenth of
a feature to a ten-thousandth of it."""
REGULAR = 3.3
"""Largest real part of the exponents of terms that are fitted besides the modes. At 0.3 of the
distance to the next corner the terms left out are below 2 % of those of λ = 1/2, and nearer to the
corner a fit has hardly any of them."""


@dataclass(frozen=True, eq=False)
class Mode:
    """A field whose stress has no bound.

    Attributes
    ----------
    exponent : complex
        λ; of a pair of complex ones that with a positive imaginary part.
    coefficients : (k,) array
        Of the rows of `Expansion.rows`.
    name : str
        "I", "II" or "III", by whether normal stress, shear stress in the plane, or across it is
        r^(λ-1).
    """

    exponent: complex
    coefficients: Complex
    name: str


@dataclass(frozen=True, eq=False)
class Expansion:
    """The modes of a corner, and the exponents of what else a field has there.

    Attributes
    ----------
    modes : tuple of Mode
    regular : tuple of complex
        Exponents of terms whose stress has a bound.
    polluted : tuple of (complex, (k, n) array)
        Exponents, negative, and coefficients of fields that satisfy the conditions of both sides:
        what is wrong at the corner acts farther out like these.
    kappa : float
        3 - 4ν; NaN of displacements across the plane.
    theta : float
        Of the line on which modes are scaled [rad].
    """

    modes: tuple[Mode, ...] = ()
    regular: tuple[complex, ...] = ()
    polluted: tuple[tuple[complex, Complex], ...] = ()
    kappa: float = math.nan
    theta: float = 0.0

    @property
    def least(self) -> float:
        """The least exponent, where stress grows, modes or not; else 1."""
        every = (*(each.exponent for each in self.modes), *self.regular)
        return min((each.real for each in every if each.real < 1.0 - NEAR), default=1.0)

    @property
    def slowest(self) -> float:
        """The least exponent but 1 of a corner without modes, where stress changes with r^(λ-1)."""
        return min((each.real for each in self.regular if abs(each - 1.0) > NEAR), default=math.inf)

    @property
    def components(self) -> int:
        """Number of components of the displacement: 2 in the plane, 1 across it."""
        return 1 if math.isnan(self.kappa) else 2

    def rows(self, power: complex, theta: Array) -> Complex:
        """Return 2µ times the displacement and the stress (n, k, c) at angles (n,) for r = 1.

        In the plane k is 5: u_r, u_θ, σ_rθ, σ_θθ, σ_rr, and across it 3: u_z, σ_θz, σ_rz. The c
        columns are fields that satisfy equilibrium.
        """
        if self.components == 2:
            rows = fields(power, theta, self.kappa)
            rows[:, 2:] *= power
            return rows
        cosine, sine = np.cos(power * theta), np.sin(power * theta)
        own, slope = np.stack([cosine, sine], axis=1), np.stack([-sine, cosine], axis=1)
        half = 0.5 * power  # σ = µ grad u
        return np.asarray(np.stack([own, half * slope, half * own], axis=1))


@functools.lru_cache(maxsize=1024)
def corner_expansion(
    angle: float, kappa: float, first: SideKind, second: SideKind, pressed: bool = False
) -> Expansion:
    """Return the fields at a corner, its sides as of `wedge`; stress is pressure if it is pressed.

    Examples
    --------
    >>> import math
    >>> crack = corner_expansion(2.0 * math.pi, 1.8, FREE, FREE)
    >>> [(mode.name, round(mode.exponent.real, 6)) for mode in crack.modes]
    [('I', 0.5), ('II', 0.5)]
    """
    theta = 0.5 * angle if first == second else 0.0
    blank = Expansion(kappa=kappa, theta=theta)
    return _expansion(wedge(angle, kappa, first, second), blank, pressed)


@functools.lru_cache(maxsize=1024)
def joint_expansions(
    angles: tuple[float, float],
    kappas: tuple[float, float],
    stiffer: float,
    friction: float,
    beside: tuple[SideKind, SideKind] = (FREE, FREE),
    pressed: bool = True,
) -> tuple[Expansion, Expansion]:
    """Return the fields in both bodies at the edge of their contact, as of `joint`; each has its
    angles from the contact."""
    matrix = joint(angles, kappas, stiffer, friction, beside)
    both = _expansion(matrix, Expansion(kappa=kappas[0]), pressed)
    # the other one in a mirror, in which it lies at positive angles
    parts = (slice(0, 4), np.ones(4)), (slice(4, 8), np.array([1.0, -1.0, 1.0, -1.0]))
    first, other = (
        replace(
            both,
            modes=tuple(
                replace(mode, coefficients=mode.coefficients[rows] * signs) for mode in both.modes
            ),
            polluted=tuple((power, signs[:, None] * found[rows]) for power, found in both.polluted),
            kappa=kappa,
        )
        for (rows, signs), kappa in zip(parts, kappas, strict=True)
    )
    return first, other


@functools.lru_cache(maxsize=1024)
def shear_expansion(angle: float, first: bool, second: bool) -> Expansion:
    """Return the displacements across the plane of a corner, from whether its sides hold them."""
    same = first == second
    powers = (np.arange(1.0, REGULAR * angle / math.pi + 1.0) - 0.5 * (not same)) * math.pi / angle
    blank = Expansion(theta=0.0 if first else 0.5 * angle if same else angle)
    field = np.array([[0.0, 1.0] if first else [1.0, 0.0]], dtype=np.complex128)
    strong = [complex(power) for power in powers if power < STRONG]
    modes = [mode for power in strong for mode in _scaled(blank, power, field, False)]
    regular = tuple(complex(power) for power in powers[len(strong) :])
    polluted = tuple((-power, field.T) for power in strong)
    return Expansion(tuple(modes), regular, polluted, theta=blank.theta)


def _expansion(matrix: Matrix, blank: Expansion, pressed: bool) -> Expansion:
    """The fields that satisfy some conditions."""
    roots = exponents(matrix, NEAR, REGULAR)
    modes = [
        mode
        for root in roots
        if root.real < STRONG
        for mode in _scaled(blank, root, null_vectors(matrix, root), pressed)
    ]
    regular = tuple(root for root in roots if root.real >= STRONG)
    negative = exponents(matrix, -STRONG, -NEAR) if modes else []
    polluted = tuple((root, null_vectors(matrix, root).T) for root in negative)
    return replace(blank, modes=tuple(modes), regular=regular, polluted=polluted)


def _scaled(blank: Expansion, root: complex, found: Complex, pressed: bool) -> list[Mode]:
    """The modes of an exponent, from the coefficients (k, n) of its fields in one or two bodies."""
    on_line = blank.rows(root, np.array([blank.theta]))[0]
    own = found[:, : on_line.shape[1]].T
    if blank.components == 1:
        return [Mode(root, found[0] / (on_line[1] @ own)[0], "III")]
    normal, shear = (-1.0 if pressed else 1.0) * (on_line[3] @ own), on_line[2] @ own
    if len(found) == 2 and np.linalg.cond(stress := np.stack([normal, shear])) < 1.0 / SINGULAR:
        both = np.linalg.inv(stress).T @ found
        return [Mode(root, each, name) for each, name in zip(both, ("I", "II"), strict=True)]
    opens = np.abs(normal) > SINGULAR * np.abs(shear)
    return [
        Mode(root, each / (normal[k] if opens[k] else shear[k]), "I" if opens[k] else "II")
        for k, each in enumerate(found)
    ]
