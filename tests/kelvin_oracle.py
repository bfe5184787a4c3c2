"""Kelvin's kernels as printed, in the plane and in space, at the precision of what is given."""

from __future__ import annotations

import itertools

import numpy as np

from petcontact.arrays import Array
from petcontact.bem.kernel import COMPONENTS


def _parts(r: Array, normal: Array, nu: float) -> tuple:
    """d, the distance, the unit vector and the normal (d, q), their product, ν and the scale."""
    d, distance = r.shape[-1], np.sqrt(np.sum(r * r, axis=-1))
    e, n = np.moveaxis(r, -1, 0) / distance, np.moveaxis(np.broadcast_to(normal, r.shape), -1, 0)
    nu, pi = r.dtype.type(nu), 4 * np.arctan(r.dtype.type(1))
    return d, distance, e, n, np.sum(e * n, axis=0), nu, 1 / (4 * (d - 1) * pi * (1 - nu))


def kelvin(r: Array, normal: Array, nu: float, length: float = 1.0) -> tuple[Array, Array]:
    """2µU and T, (d, d, q), of vectors r (q, d) from y to x and normals at x; in the plane
    logarithms are of r over a length."""
    d, distance, e, n, w, nu, scale = _parts(r, normal, nu)
    identity = np.eye(d).reshape(d, d, *([1] * distance.ndim))
    dyad, skew = e[:, None] * e, e[:, None] * n
    even = -np.log(distance / r.dtype.type(length)) if d == 2 else 1 / distance
    u = scale * ((3 - 4 * nu) * even * identity + dyad / distance ** (d - 2))
    t = (1 - 2 * nu) * (skew - skew.swapaxes(0, 1) - w * identity) - d * w * dyad
    return u, scale / distance ** (d - 1) * t


def stress_of_kelvin(r: Array, normal: Array, nu: float) -> tuple[Array, Array]:
    """D and S/2µ, (3 or 6, d, q): components of stress at y first, then those of t or u. Brebbia,
    Telles and Wrobel (1984), section 5.6, and for plane strain."""
    d, distance, e, n, w, nu, scale = _parts(r, normal, nu)
    by_t, by_u = np.empty((2, len(COMPONENTS[d]), d, *distance.shape), r.dtype)
    for (c, (i, j)), k in itertools.product(enumerate(COMPONENTS[d]), range(d)):
        ij, ki, kj, eee = i == j, k == i, k == j, e[i] * e[j] * e[k]
        by_t[c, k] = (1 - 2 * nu) * (ki * e[j] + kj * e[i] - ij * e[k]) + d * eee
        turned = (1 - 2 * nu) * ij * e[k] + nu * (ki * e[j] + kj * e[i]) - (d + 2) * eee
        by_u[c, k] = d * w * turned + d * nu * (n[i] * e[j] + n[j] * e[i]) * e[k]
        by_u[c, k] += (1 - 2 * nu) * (d * n[k] * e[i] * e[j] + n[j] * ki + n[i] * kj)
        by_u[c, k] -= (1 - 4 * nu) * n[k] * ij
    return scale / distance ** (d - 1) * by_t, -scale / distance**d * by_u
