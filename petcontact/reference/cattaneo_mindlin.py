"""Cattaneo (1938) and Mindlin (1949): equal bodies pressed together, then pushed sideways, stick
inside and slip outside.

Johnson, Contact Mechanics, 7.2. In space slip is exactly along the push for ν = 0 only; for other ν
the traction is the usual approximation.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..record import record
from .hertz import LineContact, PointContact, elliptic


@record
class LinePartialSlip:
    """Cylinders under P, then Q.

    Parameters
    ----------
    contact : LineContact
        Of P.
    friction : float
        µ [-].
    force : float
        Q >= 0, at most µP [stress·length].

    Examples
    --------
    >>> slip = LinePartialSlip(LineContact(1.0, 1.0, 1.0), friction=0.5, force=0.32)
    >>> round(slip.stick_half_width / slip.contact.half_width, 12)
    0.6
    """

    contact: LineContact
    friction: float
    force: float

    @property
    def stick_half_width(self) -> float:
        """c = a √(1 - Q/(µP)) [length]."""
        return self.contact.half_width * float(
            np.sqrt(1.0 - self.force / (self.friction * self.contact.load))
        )

    def traction(self, x: Array) -> Array:
        """q = µp_0 (√(1 - x²/a²) - c/a √(1 - x²/c²)) at places (n,) [stress]."""
        a, c = self.contact.half_width, self.stick_half_width
        return self.friction * self.contact.peak * (elliptic(x, a) - c / a * elliptic(x, c))

    def slip(self, x: Array) -> Array:
        """How far the surfaces slid on each other, (n,) [length].

        µp_0/(E*a) (|x| √(x²-c²) - c² arcosh(|x|/c)) where c < |x| < a, 0 where they stick.
        """
        a, c = self.contact.half_width, self.stick_half_width
        away = np.maximum(np.abs(x), c)
        return np.asarray(
            self.friction
            * self.contact.peak
            / (self.contact.modulus * a)
            * (away * np.sqrt(away**2 - c**2) - c**2 * np.arccosh(away / c))
        )


@record
class PointPartialSlip:
    """Spheres under P, then Q.

    Parameters
    ----------
    contact : PointContact
        Of P.
    friction : float
        µ [-].
    force : float
        Q >= 0, at most µP [stress·length²].

    Examples
    --------
    >>> slip = PointPartialSlip(PointContact(1.0, 1.0, 1.0), friction=0.5, force=0.392)
    >>> round(slip.stick_radius / slip.contact.contact_radius, 12)
    0.6
    """

    contact: PointContact
    friction: float
    force: float

    @property
    def stick_radius(self) -> float:
        """c = a (1 - Q/(µP))^(1/3) [length]."""
        return self.contact.contact_radius * float(
            np.cbrt(1.0 - self.force / (self.friction * self.contact.load))
        )

    def traction(self, r: Array) -> Array:
        """q = µp_0 (√(1 - r²/a²) - c/a √(1 - r²/c²)) along the push at distances (n,) [stress]."""
        a, c = self.contact.contact_radius, self.stick_radius
        return self.friction * self.contact.peak * (elliptic(r, a) - c / a * elliptic(r, c))
