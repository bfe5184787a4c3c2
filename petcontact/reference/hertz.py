"""Hertz: cylinders and spheres pressed together (Johnson, Contact Mechanics, 1985, chapter 4)."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..record import record


def contact_modulus(
    young: float, poisson: float, young_2: float = np.inf, poisson_2: float = 0.0
) -> float:
    """E* of two bodies in plane strain or in space: 1/E* = (1-ν1²)/E1 + (1-ν2²)/E2 [stress]; the
    second is rigid by default.

    Examples
    --------
    >>> round(contact_modulus(200.0, 0.3, 200.0, 0.3), 6)
    109.89011
    """
    return 1.0 / ((1.0 - poisson**2) / young + (1.0 - poisson_2**2) / young_2)


@record
class RoundContact:
    """A round body on a flat one.

    Parameters
    ----------
    load : float
        P [stress·length²], of a cylinder per length.
    radius : float
        R, 1/R = 1/R1 + 1/R2 [length].
    modulus : float
        E* [stress], see `contact_modulus`.
    """

    load: float
    radius: float
    modulus: float


class LineContact(RoundContact):
    """A cylinder on a half plane (Johnson 4.42-4.45); parameters load [stress·length], radius
    [length], modulus E* [stress].

    Examples
    --------
    Two equal cylinders of R = 8 under 10 per length, a test of Yang, Laursen and Meng (2005):

    >>> contact = LineContact(10.0, 4.0, contact_modulus(200.0, 0.3, 200.0, 0.3))
    >>> round(contact.half_width, 6), round(contact.peak, 6)
    (0.680778, 9.351351)
    """

    @property
    def half_width(self) -> float:
        """a, a² = 4PR/(πE*) [length]."""
        return float(np.sqrt(4.0 * self.load * self.radius / (np.pi * self.modulus)))

    @property
    def peak(self) -> float:
        """p_0 = 2P/(πa) [stress]."""
        return 2.0 * self.load / (np.pi * self.half_width)

    def pressure(self, x: Array) -> Array:
        """p = p_0 √(1 - x²/a²) at places (n,) from the middle, 0 outside [stress]."""
        return self.peak * elliptic(x, self.half_width)


class PointContact(RoundContact):
    """A sphere on a half space (Johnson 4.22-4.24); parameters load [stress·length²], radius
    [length], modulus E* [stress].

    Examples
    --------
    >>> contact = PointContact(load=4.0 / 3.0, radius=1.0, modulus=1.0)
    >>> round(contact.contact_radius, 12), round(contact.approach, 12), round(contact.peak, 6)
    (1.0, 1.0, 0.63662)
    """

    @property
    def contact_radius(self) -> float:
        """a, a³ = 3PR/(4E*) [length]."""
        return float(np.cbrt(0.75 * self.load * self.radius / self.modulus))

    @property
    def approach(self) -> float:
        """δ = a²/R of points far away [length]."""
        return self.contact_radius**2 / self.radius

    @property
    def peak(self) -> float:
        """p_0 = 3P/(2πa²) [stress]."""
        return 1.5 * self.load / (np.pi * self.contact_radius**2)

    def pressure(self, r: Array) -> Array:
        """p = p_0 √(1 - r²/a²) at distances (n,) from the middle, 0 outside [stress]."""
        return self.peak * elliptic(r, self.contact_radius)


def elliptic(x: Array, a: float) -> Array:
    """√(1 - x²/a²), 0 outside, of places (n,)."""
    return np.asarray(np.sqrt(np.maximum(1.0 - (np.asarray(x) / a) ** 2, 0.0)))
