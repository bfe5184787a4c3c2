"""Westergaard (1939): a surface of waves pressed on a flat one (Johnson, Contact Mechanics,
13.2)."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..record import record


@record
class WavyContact:
    """Waves of the gap Δ(1 - cos 2πx/λ), frictionless.

    Parameters
    ----------
    pressure_far : float
        Mean pressure [stress], >= 0.
    amplitude, wavelength : float
        Δ and λ [length].
    modulus : float
        E* [stress], see `petcontact.reference.hertz.contact_modulus`.

    Examples
    --------
    >>> contact = WavyContact(pressure_far=0.5, amplitude=1.0, wavelength=np.pi, modulus=1.0)
    >>> round(contact.full_pressure, 12), round(contact.half_width / contact.wavelength, 12)
    (1.0, 0.25)
    """

    pressure_far: float
    amplitude: float
    wavelength: float
    modulus: float

    @property
    def full_pressure(self) -> float:
        """p* = πE*Δ/λ, the mean pressure from which on the gap is closed everywhere [stress]."""
        return float(np.pi * self.modulus * self.amplitude / self.wavelength)

    @property
    def half_width(self) -> float:
        """a of the strip in contact, mean pressure = p* sin²(πa/λ); λ/2 where all is closed
        [length]."""
        return float(
            self.wavelength
            / np.pi
            * np.arcsin(np.sqrt(min(self.pressure_far / self.full_pressure, 1.0)))
        )

    def pressure(self, x: Array) -> Array:
        """p at places (n,) from a crest [stress]."""
        phase = np.pi * np.asarray(x) / self.wavelength
        if self.pressure_far >= self.full_pressure:
            return np.asarray(self.pressure_far + self.full_pressure * np.cos(2.0 * phase))
        edge = self.pressure_far / self.full_pressure
        root = np.sqrt(np.maximum(edge - np.sin(phase) ** 2, 0.0))
        return np.asarray(2.0 * self.full_pressure * np.abs(np.cos(phase)) * root)
