"""Compliance of elastic half planes and half spaces from closed forms, and a rigid indenter that is
free to move."""

from __future__ import annotations

import numpy as np
from reduced_system import ReducedSystem

from petcontact.contact.system import Modes


def half_plane(count, half_width, modulus=1.0, ratio=0.3, datum=10.0):
    """Nodes, weights and S (2m, 2m) for constant tractions on equal elements: -2(1-ν²)/(πE) ∫
    ln|x-s|/datum, and no coupling, as of two equal bodies (Johnson, Contact Mechanics, 2.3)."""
    return half_plane_on(np.linspace(-half_width, half_width, count + 1), modulus, ratio, datum)


def half_plane_on(ends, modulus=1.0, ratio=0.3, datum=10.0):
    """The same on elements between given ends."""
    count = len(ends) - 1
    x = 0.5 * (ends[1:] + ends[:-1])

    def primitive(t):
        return t * np.log(np.abs(t) / datum) - t

    columns = primitive(x[:, None] - ends[:-1]) - primitive(x[:, None] - ends[1:])
    matrix = np.zeros((count, 2, count, 2))
    matrix[:, 0, :, 0] = matrix[:, 1, :, 1] = -2.0 * (1.0 - ratio**2) / (np.pi * modulus) * columns
    return x, np.diff(ends), matrix.reshape(2 * count, 2 * count)


def half_space(count, half_width, modulus=1.0, ratio=0.3):
    """Nodes (m, 2), weights and S (3m, 3m) for tractions lumped on squares: Boussinesq's and
    Cerruti's solutions, coupling and all (Johnson, 3.2 and 3.6), and Love's integral of 1/r over a
    square where a square meets itself."""
    size = 2.0 * half_width / count
    line = -half_width + size * (np.arange(count) + 0.5)
    x, y = (part.ravel() for part in np.meshgrid(line, line, indexing="ij"))
    dx, dy = x[:, None] - x, y[:, None] - y
    r = np.hypot(dx, dy) + np.eye(len(x))
    shear, area = modulus / (2.0 * (1.0 + ratio)), size**2
    inverse = area / r
    inverse[np.diag_indices(len(x))] = 4.0 * size * np.log(1.0 + np.sqrt(2.0))
    own = np.eye(len(x), dtype=bool)
    matrix = np.zeros((len(x), 3, len(x), 3))
    for a, da in enumerate((dx, dy)):
        for b, db in enumerate((dx, dy)):
            along = np.where(own, 0.5 * (a == b), da * db / r**2)
            matrix[:, a, :, b] = (
                ((1.0 - ratio) * (a == b) + ratio * along) * inverse / (2.0 * np.pi * shear)
            )
        skew = np.where(own, 0.0, (1.0 - 2.0 * ratio) * da / r**2 * area) / (4.0 * np.pi * shear)
        # the outward normal of the half space is +z: a push down (σ_n < 0) draws the surface in
        matrix[:, a, :, 2], matrix[:, 2, :, a] = skew, -skew
    matrix[:, 2, :, 2] = (1.0 - ratio) * inverse / (2.0 * np.pi * shear)
    return np.column_stack([x, y]), np.full(len(x), area), matrix.reshape(3 * len(x), 3 * len(x))


def pressed(matrix, weight, gap, force, slip_before=None):
    """A rigid indenter over the surface that translates freely under a force: (tangential...,
    down)."""
    m = len(weight)
    k = len(force)
    u_0 = np.zeros((m, k))
    u_0[:, -1] = -gap
    if slip_before is not None:
        u_0[:, :-1] -= slip_before
    motion = np.broadcast_to(np.eye(k), (m, k, k)).copy()
    resultant = np.moveaxis(motion * weight[:, None, None], 2, 0)
    return ReducedSystem(
        u_0, matrix, weight, Modes(motion, resultant, np.asarray(force, dtype=float))
    )
