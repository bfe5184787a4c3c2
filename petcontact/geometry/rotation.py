"""Small rotations and moments: one in the plane, three in space, about x, y and z."""

from __future__ import annotations

import numpy as np

from ..arrays import Array

PLANES = {2: ((0, 1),), 3: ((1, 2), (2, 0), (0, 1))}
"""Axes that turn into one another, by the number of dimensions."""

Axial = float | Array
"""A rotation or a moment: a number in the plane, (3,) in space."""


def rotations(away: Array) -> Array:
    """Displacement (m, d, d(d-1)/2) of points at `away` (m, d) from the centre for unit small
    rotations [length]."""
    planes = PLANES[away.shape[1]]
    result = np.zeros((*away.shape, len(planes)))
    for k, (i, j) in enumerate(planes):
        result[:, i, k], result[:, j, k] = -away[:, j], away[:, i]
    return result


def rigid_motions(away: Array) -> Array:
    """Translations along the axes, then rotations, (m, d, d(d+1)/2)."""
    d = away.shape[1]
    result = np.zeros((len(away), d, d * (d + 1) // 2))
    result[:, range(d), range(d)] = 1.0
    result[:, :, d:] = rotations(away)
    return result


def moment(x: Array, force: Array) -> Axial:
    """Moment about the origin of forces (m, d) at points (m, d)."""
    return axial(
        np.array([x[:, i] @ force[:, j] - x[:, j] @ force[:, i] for i, j in PLANES[x.shape[1]]])
    )


def axial(components: Array) -> Axial:
    """A rotation or a moment from its components (d(d-1)/2,)."""
    return components if len(components) > 1 else float(components[0])
