"""The field in a half plane under an elliptic load, by Muskhelishvili's potentials: blocks cut out
of it are exact tests."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Complex


def elliptic_load(
    x: Array, load: complex, a: float, poisson: float
) -> tuple[Complex, Array, Array, Array]:
    """Displacement and stress at points of y <= 0 under tractions load·√(1 - x²/a²) on |x| < a of y
    = 0, in plane strain.

    Parameters
    ----------
    x : (n, 2) array
        Points [length].
    load : complex
        p + iq, pressure and shear in the middle [stress].
    a : float
        Half width [length].
    poisson : float
        ν [-].

    Returns
    -------
    u : (n,) complex array
        2G(u_x + iu_y) [stress·length], up to a rigid motion.
    xx, yy, xy : (n,) arrays
        Stress [stress].

    Examples
    --------
    >>> _, _, yy, xy = elliptic_load(np.array([[0.6, 0.0], [2.0, 0.0]]), 1.0 + 0.5j, 1.0, 0.3)
    >>> [round(abs(float(s)), 6) for s in (*yy, *xy)]
    [0.8, 0.0, 0.4, 0.0]
    """
    kappa = 3.0 - 4.0 * poisson
    z = x[:, 0] + 1j * np.minimum(x[:, 1], -1e-300)
    near, far = z, np.conj(z)

    def root(w: Complex) -> Complex:
        return np.asarray(np.sqrt(w - a) * np.sqrt(w + a))

    def integral(w: Complex) -> Complex:
        return np.asarray(
            1j * load / (4.0 * a) * (w * w - w * root(w) + a * a * np.log((w + root(w)) / a))
        )

    def potential(w: Complex) -> Complex:
        return 1j * load / (2.0 * a) * (w - root(w))

    slope = 1j * load / (2.0 * a) * (1.0 - near / root(near))
    u = kappa * integral(near) + integral(far) - (near - far) * np.conj(potential(near))
    other = potential(near) - potential(far) + (near - far) * np.conj(slope)
    yy, xy = other.real, -other.imag
    return u, 4.0 * potential(near).real - yy, yy, xy
