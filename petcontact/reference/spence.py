"""Spence (1968, 1975): how much of a contact sticks where friction resists the material's own
sideways motion under load.

A rigid indenter under a growing load; the ratio of the stick zone is the same for all profiles and
constant in time. These are the uncoupled forms: what the shear does to the pressure is left out, a
few per cent of c/a.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkm1

LOWEST, HIGHEST = -300.0, -1e-15
"""Logarithms of the ratios that are distinguished from 0 and 1."""


def stick_ratio_in_the_plane(friction: float, beta: float) -> float:
    """c/a from K(c/a)/K'(c/a) = µ/β, with β = (1-2ν)/(2(1-ν)) of an elastic body on a rigid one.

    Examples
    --------
    >>> round(stick_ratio_in_the_plane(0.3, 0.2857), 5)
    0.74383
    """
    return _root(
        lambda log: ellipk(np.exp(2.0 * log)) / ellipkm1(np.exp(2.0 * log)) - friction / beta
    )


def stick_ratio_of_a_circle(friction: float, beta: float) -> float:
    """c/a from K'(c/a) = β/µ · a/(2c) · ln((a+c)/(a-c)).

    Examples
    --------
    >>> stick_ratio_of_a_circle(0.1, 0.2) < stick_ratio_of_a_circle(0.3, 0.2) < 1.0
    True
    """

    def difference(log: float) -> float:
        ratio = np.exp(log)
        return float(friction / beta * ellipkm1(ratio**2) - np.arctanh(ratio) / ratio)

    return _root(lambda log: -difference(log))


def _root(function: Callable[[float], float]) -> float:
    """The ratio whose logarithm is a zero of an increasing function; 0 or 1 where it is that to the
    last digit."""
    if function(LOWEST) > 0.0 or function(HIGHEST) < 0.0:
        return float(function(HIGHEST) < 0.0)
    return float(np.exp(brentq(function, LOWEST, HIGHEST, xtol=1e-16, rtol=1e-14)))
