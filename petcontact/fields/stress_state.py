"""Displacement and stress at points, and quantities that follow from the stress."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Index, Rows, scattered
from ..record import record


@record
class StressState(Rows):
    """Displacement and stress at points.

    Attributes
    ----------
    x, u : (n, d) arrays
        Points and displacement [length].
    stress : (n, c) array
        In the plane xx, yy, xy; in space xx, yy, zz, xy, xz, yz. For bodies of revolution xx, yy,
        zz, xy are the radial, axial, hoop and shear stress; torsion adds xz and yz, where z is θ
        [stress].
    sigma_zz : (n,) array
        σ_zz: ν(σ_xx + σ_yy) in plane strain, 0 in plane stress, the hoop stress in bodies of
        revolution [stress].
    """

    x: Array
    u: Array
    stress: Array
    sigma_zz: Array

    @property
    def components(self) -> Array:
        """The components xx, yy, zz, xy, xz, yz, (n, 6) [stress]."""
        if self.stress.shape[1] == 6:
            return self.stress
        x, y, xy = self.in_plane.T
        return np.column_stack([x, y, self.sigma_zz, xy, np.zeros((len(x), 2))])

    @property
    def in_plane(self) -> Array:
        """The components xx, yy, xy of plane bodies and half sections, (n, 3) [stress]."""
        return self.stress[:, [0, 1, 3 if self.stress.shape[1] == 6 else -1]]

    @property
    def tensor(self) -> Array:
        """Stress tensor in three dimensions, (n, 3, 3) [stress]."""
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
        """Principal stresses of σ_xx, σ_yy, σ_xy of a plane body, the larger one first, (n, 2)
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
        """All three principal stresses, the largest first, (n, 3) [stress].

        They are NaN where the stress is not finite.
        """
        tensor = self.tensor
        finite = np.isfinite(tensor).all(axis=(1, 2))
        values = np.linalg.eigvalsh(tensor[finite])[:, ::-1]
        return scattered(values, finite, len(tensor), np.nan)


@record
class Field(StressState):
    """Displacement and stress at points of a body, and the cells between the points.

    Cells are counter-clockwise triangles (k, 3) or hexahedra (k, 8).
    """

    cells: Index
