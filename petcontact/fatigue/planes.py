"""Critical planes: the orientation at which a parameter of the stress on planes is largest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array

SPREAD = 200
"""Planes that are looked at first, about 10° apart."""
RINGS, AROUND = 14, 8
"""Rounds of the search, each with half the reach of the one before, and planes on a ring."""

OnPlanes = Callable[[Array, Array], Array]
"""A parameter (n, q) of stresses (k, n, 3, 3) on planes with unit normals (n, q, 3)."""


def half_sphere(count: int) -> Array:
    """Unit vectors (count, 3) spread evenly over the half sphere z >= 0, by the golden angle."""
    k = np.arange(count)
    z = (k + 0.5) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z * z)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])


def critical_planes(stress: Array, value: OnPlanes) -> tuple[Array, Array]:
    """Where a parameter is largest over all planes, at each point.

    The coordinate planes and those of the principal stresses at each moment are looked at beside
    planes that are spread evenly; from the best of them the search goes on along rings that shrink
    to 1e-4 of a degree.

    Parameters
    ----------
    stress : (k, n, 3, 3) array
        At n points at k moments [stress].
    value : callable
        See `OnPlanes`.

    Returns
    -------
    largest : (n,) array
    normal : (n, 3) array
        Unit normals of the planes.
    """
    damages, normals = [np.empty(0)], [np.empty((0, 3))]
    step = max(1, (1 << 19) // (SPREAD * len(stress)))
    for first in range(0, stress.shape[1], step):
        best, normal = _search(stress[:, first : first + step], value)
        damages.append(best)
        normals.append(normal)
    return np.concatenate(damages), np.concatenate(normals)


def _search(stress: Array, value: OnPlanes) -> tuple[Array, Array]:
    n = stress.shape[1]
    principal = (
        np.linalg.eigh(stress)[1]
        .transpose(1, 0, 3, 2)
        .reshape(n, -1, 3)[:, :: max(1, len(stress) // 8)]
    )
    spread = np.vstack([half_sphere(SPREAD), np.eye(3)])
    planes = np.concatenate([np.broadcast_to(spread, (n, *spread.shape)), principal], axis=1)
    values = value(stress, planes)
    # better planes are looked for next to these
    chosen = np.argsort(-values, axis=1)[:, :4]
    best = np.take_along_axis(values, chosen, 1)
    normal = np.take_along_axis(planes, chosen[..., None], 1)
    reach = 2.0 / np.sqrt(SPREAD)
    angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
    for turn in range(RINGS):
        for _ in range(2):
            a, b = _tangents(normal)
            ring = reach * (
                np.cos(angle + turn)[:, None] * a[:, :, None]
                + np.sin(angle + turn)[:, None] * b[:, :, None]
            )
            tried = normal[:, :, None] + ring
            tried /= np.linalg.norm(tried, axis=3, keepdims=True)
            values = value(stress, tried.reshape(n, -1, 3)).reshape(n, -1, AROUND)
            k = np.argmax(values, axis=2)[..., None]
            higher = np.take_along_axis(values, k, 2)[..., 0]
            better = higher > best
            best = np.where(better, higher, best)
            normal = np.where(
                better[..., None], np.take_along_axis(tried, k[..., None], 2)[:, :, 0], normal
            )
        reach *= 0.5
    k = np.argmax(best, axis=1)[:, None]
    return np.take_along_axis(best, k, 1)[:, 0], _upward(
        np.take_along_axis(normal, k[..., None], 1)[:, 0]
    )


def _tangents(normal: Array) -> tuple[Array, Array]:
    """Two unit vectors across each normal (..., 3)."""
    axis = np.eye(3)[np.abs(normal).argmin(axis=-1)]
    a = np.cross(normal, axis)
    a /= np.linalg.norm(a, axis=-1, keepdims=True)
    return a, np.cross(normal, a)


def _upward(normal: Array) -> Array:
    """Return n or -n (..., 3): the one whose last component other than 0 is positive, without
    negative zeros."""
    clean = np.where(np.abs(normal) < 1e-6, 0.0, normal)
    last = 2 - np.argmax(clean[:, ::-1] != 0.0, axis=1)
    sign = np.sign(np.take_along_axis(clean, last[:, None], 1))
    return np.asarray(normal * sign + 0.0)
