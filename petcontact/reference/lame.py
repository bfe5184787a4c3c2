"""Lamé: tubes and hollow spheres under pressure; discs and rings that rotate (Timoshenko and
Goodier, 1970, 28, 32, 136)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..arrays import Array
from ..record import record


@record
class Hollow:
    """A hollow body a <= r <= b under pressures inside and outside: σ_r = A - B/rⁿ, σ_θ = A +
    B/((n-1) rⁿ).

    Parameters
    ----------
    inner, outer : float
        a < b [length]; a = 0 is a solid one, with the pressure outside only.
    young, poisson : float
        E [stress], ν [-].
    pressure_inside, pressure_outside : float
        [stress].
    """

    inner: float
    outer: float
    young: float
    poisson: float
    pressure_inside: float = 0.0
    pressure_outside: float = 0.0
    power: ClassVar[int]

    @property
    def _constants(self) -> tuple[float, float]:
        """Return A and B of σ_r = A - B/r^n, n the power."""
        a, b = self.inner**self.power, self.outer**self.power
        mean = (self.pressure_inside * a - self.pressure_outside * b) / (b - a)
        return mean, (self.pressure_inside - self.pressure_outside) * a * b / (b - a)

    def stress(self, r: Array) -> tuple[Array, Array]:
        """σ_r and σ_θ at radii (n,) [stress]."""
        mean, part = self._constants
        return mean - part / r**self.power, mean + part / ((self.power - 1) * r**self.power)


@record
class Cylinder(Hollow):
    """A tube in plane strain, or a ring in plane stress; `plane` is "strain" or "stress", the
    others see `Hollow`.

    Examples
    --------
    >>> tube = Cylinder(1.0, 2.0, 200.0, 0.3, pressure_inside=1.0)
    >>> sigma_r, sigma_theta = tube.stress(np.array([1.0, 2.0]))
    >>> [round(float(s), 6) for s in (*sigma_r, *sigma_theta)]
    [-1.0, 0.0, 1.666667, 0.666667]
    """

    plane: str = "strain"
    power = 2

    def displacement(self, r: Array) -> Array:
        """u_r at radii (n,) [length]."""
        mean, part = self._constants
        young, poisson = in_plane(self.young, self.poisson, self.plane)
        return np.asarray(((1.0 - poisson) * mean * r + (1.0 + poisson) * part / r) / young)


class Sphere(Hollow):
    """A hollow sphere; see `Hollow`.

    Examples
    --------
    >>> shell = Sphere(1.0, 2.0, 1.0, 0.3, pressure_inside=7.0)
    >>> sigma_r, sigma_theta = shell.stress(np.array([1.0, 2.0]))
    >>> [round(float(s), 6) for s in (*sigma_r, *sigma_theta)]
    [-7.0, 0.0, 5.0, 1.5]
    """

    power = 3

    def displacement(self, r: Array) -> Array:
        """u_r at radii (n,) [length]."""
        mean, part = self._constants
        return np.asarray(
            ((1.0 - 2.0 * self.poisson) * mean * r + 0.5 * (1.0 + self.poisson) * part / r**2)
            / self.young
        )


@record
class RotatingDisc:
    """A disc (a = 0) or ring a <= r <= b of constant thickness that rotates, free of pressure on
    its rims.

    Parameters
    ----------
    inner, outer : float
        a < b [length].
    young, poisson : float
        E [stress], ν [-].
    density, speed : float
        Density [stress·time²/length²] and angular velocity ω [1/time].
    plane : {"stress", "strain"}
        A thin disc, or a shaft that cannot grow longer.

    Examples
    --------
    >>> disc = RotatingDisc(0.0, 1.0, 1.0, 0.3, density=1.0, speed=1.0)
    >>> sigma_r, sigma_theta = disc.stress(np.array([0.0, 1.0]))
    >>> [round(float(s), 6) for s in (*sigma_r, *sigma_theta)]
    [0.4125, 0.0, 0.4125, 0.175]
    """

    inner: float
    outer: float
    young: float
    poisson: float
    density: float
    speed: float
    plane: str = "stress"

    def stress(self, r: Array) -> tuple[Array, Array]:
        """σ_r and σ_θ at radii (n,) [stress]."""
        a2, b2 = self.inner**2, self.outer**2
        _, poisson = in_plane(self.young, self.poisson, self.plane)
        load = self.density * self.speed**2 * (3.0 + poisson) / 8.0
        part = a2 * b2 / r**2 if a2 else np.zeros_like(r)
        radial = load * (a2 + b2 - part - r**2)
        return radial, load * (a2 + b2 + part - (1.0 + 3.0 * poisson) / (3.0 + poisson) * r**2)

    def displacement(self, r: Array) -> Array:
        """u_r at radii (n,) [length]."""
        young, poisson = in_plane(self.young, self.poisson, self.plane)
        radial, around = self.stress(r)
        return np.asarray(r / young * (around - poisson * radial))


def in_plane(young: float, poisson: float, plane: str) -> tuple[float, float]:
    """E and ν with which formulas of plane stress hold in plane strain, too: E/(1-ν²), ν/(1-ν).

    Examples
    --------
    >>> in_plane(1.0, 0.5, "strain")
    (1.3333333333333333, 1.0)
    """
    return (
        (young / (1.0 - poisson**2), poisson / (1.0 - poisson))
        if plane == "strain"
        else (young, poisson)
    )
