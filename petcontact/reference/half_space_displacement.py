"""The displacement in a half space under a load √(1 - r²/a²), of Hertz or Mindlin: blocks cut out
of it are exact tests.

It follows from that of the punch's density 1/√(t² - r²) by integration over t, with w = z + it, S =
√(w² + r²), V = 2π Im ln(w + S), F = 2π Im(w ln(w + S) - S), ∂F/∂z = V, and for ν = 0 2G·2π u is for
p (-F_x - z V_x, -F_y - z V_y, 2V - z V_z), for a shear e_x (2V - z F_xx, -z F_xy, F_x - z F_xz).
"""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array

_gauss = functools.cache(np.polynomial.legendre.leggauss)


def elliptic_load(
    x: Array, a: float, pressure: float, shear: float, poisson: float, points: int = 40
) -> Array:
    """Displacement times E at points of z >= 0, into the body, under pressure and shear e_x times
    √(1 - r²/a²) on z = 0.

    Parameters
    ----------
    x : (n, 3) array
        Points [length].
    a : float
        Radius of the load [length].
    pressure, shear : float
        In the middle [stress].
    poisson : float
        ν; shear needs 0 [-].
    points : int, optional
        Of Gauss over t. The error falls with 3.7^(-2 points) at half a radius from the load.

    Returns
    -------
    (n, 3) array
        [stress·length]

    Examples
    --------
    >>> u = elliptic_load(np.zeros((1, 3)), 1.0, 1.0, 0.0, 0.0)
    >>> round(float(u[0, 2]), 9)  # π p a (1 - ν²)/(2E)
    1.570796327
    """
    u = np.zeros_like(x)
    (along, across, depth), square = x.T, x[:, 0] ** 2 + x[:, 1] ** 2
    for node, weight in zip(*_gauss(points), strict=True):
        t = 0.5 * a * (1.0 + node)
        share = 0.5 * weight * t * (1.0 + poisson) / np.pi * 0.5
        w = depth + 1j * t
        s = np.sqrt(w * w + square)
        v, v_z = 2.0 * np.pi * np.log(w + s).imag, 2.0 * np.pi * (1.0 / s).imag
        # F_x = x f, F_xx = f + x² g, V_x = x h
        f = -2.0 * np.pi * (1.0 / (w + s)).imag
        g = 2.0 * np.pi * (1.0 / (s * (w + s) ** 2)).imag
        h = 2.0 * np.pi * (1.0 / (s * (w + s))).imag
        radial = -(1.0 - 2.0 * poisson) * f - depth * h
        u += (
            pressure
            * share
            * np.column_stack(
                [along * radial, across * radial, 2.0 * (1.0 - poisson) * v - depth * v_z]
            )
        )
        u += (
            shear
            * share
            * np.column_stack(
                [
                    2.0 * v - depth * (f + along**2 * g),
                    -depth * along * across * g,
                    along * (f - depth * h),
                ]
            )
        )
    return u
