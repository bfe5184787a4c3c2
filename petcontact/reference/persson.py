"""Persson (1964): a pin in the hole of an infinite plate of the same material, frictionless.

A. Persson, On the stress distribution of cylindrical elastic bodies in contact, Gothenburg. With b
= tan(ε/2), ε half of the angle of contact, y = tan(φ/2), c = √(b²+1), d = √(b²-y²).
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array


def play(angle: float, young: float, poisson: float) -> float:
    """ΔR of hole and pin of radius 1 for which a force 1 on the pin makes a contact of ±angle, in
    plane strain [length].

    Examples
    --------
    >>> bool(abs(play(np.radians(84.8279), 1.0, 0.0)) < 1e-5)
    True
    """
    b = np.tan(0.5 * angle)
    size = (2.0 * (1.0 - b**4) - np.log1p(b * b)) / (np.pi * b * b * (1.0 + b * b))
    return float(size * (1.0 - poisson**2) / young)


def pressure(phi: Array, angle: float) -> Array:
    """p at angles (n,) from the direction of the force 1, on a pin of radius 1; 0 beyond ±angle
    [force/length²].

    p = 2d/(πc(1+y²)) + ln((c+d)/(c-d))/(2πb²c²).

    Examples
    --------
    >>> round(float(pressure(np.zeros(1), 2.0 * np.arctan(0.3))[0]), 6)
    1.142316
    """
    b, y = np.tan(0.5 * angle), np.tan(0.5 * np.asarray(phi))
    c, d = np.sqrt(b * b + 1.0), np.sqrt(np.maximum(b * b - y * y, 0.0))
    return np.asarray(
        2.0 * d / (np.pi * c * (1.0 + y * y))
        + np.log((c + d) / (c - d)) / (2.0 * np.pi * (b * c) ** 2)
    )
