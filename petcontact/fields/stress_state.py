"""Displacement and stress at points, and what follows from the stress."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Index
from ..frozen import frozen


@frozen
class StressState:
    """Displacement and stress at points.

    Attributes
    ----------
    x, u : (n, d) arrays
        Points and displacement [length].
    stress : (n, c) array
        xx, yy, xy, in space xx, yy, zz, xy, xz, yz, and of bodies of revolution xx, yy, zz, xy:
        radial, axial, hoop, shear; with torsion also xz, yz, z being θ [stress].
    sigma_zz : (n,) array
        Also in the plane: ν(σ_xx + σ_yy) in plane strain, 0 in plane stress; the hoop stress of
        bodies of revolution [stress].
    """

    x: Array
    u: Array
    stress: Array
    sigma_zz: Array

    @property
    def components(self) -> Array:
        """xx, yy, zz, xy, xz, yz, (n, 6) [stress]."""
        if self.stress.shape[1] == 6:
            return self.stress
        x, y, xy = self.in_plane.T
        return np.column_stack([x, y, self.sigma_zz, xy, np.zeros((len(x), 2))])

    @property
    def in_plane(self) -> Array:
        """σ_xx, σ_yy, σ_xy of plane bodies and half sections, (n, 3) [stress]."""
        return self.stress[:, [0, 1, 3 if self.stress.shape[1] == 6 else -1]]

    @property
    def tensor(self) -> Array:
        """σ of space, (n, 3, 3) [stress]."""
        return self.components[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]

    @property
    def von_mises(self) -> Array:
        """Von Mises stress, (n,) [stress]."""
        x, y, z, *shear = self.components.T
        return np.asarray(
            np.sqrt(
                0.5 * ((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) + 3.0 * sum(s**2 for s in shear)
            )
        )

    @property
    def principal_in_plane(self) -> Array:
        """Principal stresses (n, 2) of σ_xx, σ_yy, σ_xy of a plane body, the larger one first
        [stress]."""
        x, y, xy = self.in_plane.T
        mean, radius = 0.5 * (x + y), np.hypot(0.5 * (x - y), xy)
        return np.column_stack([mean + radius, mean - radius])

    @property
    def first_principal(self) -> Array:
        """Largest principal stress, (n,) [stress]."""
        if self.stress.shape[1] < 6:
            return np.asarray(np.maximum(self.principal_in_plane[:, 0], self.sigma_zz))
        return np.asarray(self.principal[:, 0])

    @property
    def principal(self) -> Array:
        """All three principal stresses, the largest first, (n, 3) [stress]; NaN where the stress is
        not known."""
        tensor = self.tensor
        known = np.isfinite(tensor).all(axis=(1, 2))
        values = np.full((len(tensor), 3), np.nan)
        values[known] = np.linalg.eigvalsh(tensor[known])[:, ::-1]
        return values


@frozen
class Field(StressState):
    """Displacement and stress at points of a body, and triangles (k, 3), counter-clockwise, or
    cells (k, 8) between them."""

    cells: Index
