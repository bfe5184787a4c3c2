"""Friction law on Γ_C: projection, residual and norm. Tangential vectors have the shape (m,
d-1)."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence

import numpy as np

from .. import native
from ..arrays import Array

_NORMS = native.function("petcontact_norms", "iiiDpp")


def lengths(x: Array) -> Array:
    """Return the Euclidean lengths (m,) of vectors (m, k), without overflow or underflow."""
    return (
        np.abs(x[:, 0]) if x.shape[1] == 1 else np.asarray(np.hypot.reduce(x, axis=1, initial=0.0))
    )


def main_direction(x: Array) -> Array:
    """Return the unit vector (k,) along the longest of some vectors (m, k); in the plane +1."""
    size = lengths(x)
    if x.shape[1] == 1 or not size.any():
        return np.asarray(np.eye(1, x.shape[1])[0])
    k = int(np.argmax(size))
    return np.asarray(x[k] / size[k])


def signed(x: Array, direction: Array) -> Array:
    """Return the lengths (m,) of vectors (m, k), negative for vectors against a direction (k,)."""
    return np.asarray(np.where(x @ direction < 0.0, -lengths(x), lengths(x)))


def project_ball(x: Array, radius: Array) -> Array:
    """Return [x]_α, each vector projected onto the ball of its radius.

    Parameters
    ----------
    x : (m, d-1) array
    radius : (m,) array
        α >= 0, in the unit of x.

    Returns
    -------
    (m, d-1) array
        The projection defined before Lemma 2.1.

    Raises
    ------
    ValueError
        If the shapes differ or a radius is negative.

    Examples
    --------
    >>> project_ball(np.array([[3.0, 4.0], [0.3, 0.4]]), np.array([1.0, 1.0]))
    array([[0.6, 0.8],
           [0.3, 0.4]])
    """
    if x.ndim != 2 or radius.shape != x.shape[:1]:
        raise ValueError(f"vectors (m, d-1) need radii (m,), got {x.shape} and {radius.shape}")
    if (radius < 0.0).any():
        raise ValueError("the radius of a ball is not negative")
    if x.shape[1] == 1:
        limit = radius[:, None]
        return np.asarray(np.minimum(np.maximum(x, -limit), limit))
    size = lengths(x)
    outside = size > radius
    shrink = np.divide(radius, size, out=np.ones_like(size), where=outside)
    return np.where(outside[:, None], x * shrink[:, None], x)


def ball_derivative(x: Array, radius: Array) -> tuple[Array, Array]:
    """Return the derivatives of [x]_α with respect to x, (m, d-1, d-1), and α, (m, d-1).

    They are the identity and 0 inside the ball, and 0 where α = 0.
    """
    size = lengths(x)
    outside = (size > radius) | (radius == 0.0)
    if x.shape[1] == 1:
        return np.where(outside, 0.0, 1.0)[:, None, None], np.where(
            outside[:, None], np.sign(x), 0.0
        )
    direction = np.divide(
        x, size[:, None], out=np.zeros_like(x), where=(outside & (size > 0.0))[:, None]
    )
    shrink = np.divide(radius, size, out=np.ones_like(size), where=outside & (size > 0.0))
    shrink[outside & (radius == 0.0)] = 0.0
    identity = np.eye(x.shape[1])
    along = np.where(outside[:, None, None], direction[:, :, None] * direction[:, None, :], 0.0)
    return shrink[:, None, None] * (identity - along), direction


def contact_norm(x: Array, weight: Array) -> float:
    """Return the L2(Γ_C) norm of nodal vectors (m, k) with the nodes' quadrature weights (m,)."""
    return group_norms(weight, (), x)[0][0]


def group_norms(weight: Array, groups: Sequence[slice], *arrays: Array) -> list[list[float]]:
    """Return the `contact_norm` of each array (m, k), and of groups of its components.

    >>> group_norms(np.ones(2), (slice(0, 1), slice(1, 2)), np.array([[3.0, 1.0], [4.0, 1.0]]))
    [[5.196152422706632, 5.0, 1.4142135623730951]]
    """
    k, grouped = arrays[0].shape[1], list[list[float]]()
    kept = [native.contiguous(x) for x in (weight, *arrays)]
    pointers = map(native.pointer, kept[1:])
    filled = (ctypes.c_double * (k * len(arrays)))()
    _NORMS(len(weight), k, len(arrays), kept[0], (ctypes.c_void_p * len(arrays))(*pointers), filled)
    norms = list(filled)
    for first in range(0, len(norms), k):
        own = norms[first : first + k]
        grouped.append(
            [
                math.hypot(*own),
                *(own[g.start] if g.stop - g.start == 1 else math.hypot(*own[g]) for g in groups),
            ]
        )
    return grouped


def ratio(u: float, sigma: float, fallback: float) -> float:
    """Return ρ = σ/u of two norms, with which both terms of R_ρ have equal weight [stress/length].

    `fallback` is returned if one norm vanishes. The residual with this ρ does not depend on the
    method's ρ: with a very small or large ρ, one term of R_ρ is small for any iterate.
    """
    return sigma / u if u > 0.0 and sigma > 0.0 else fallback
