"""Small rigid motions and moments: of plane bodies, of bodies in space, of bodies of revolution."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Index
from ..record import record

Axial = float | Array
"""A rotation or a moment: a number in the plane, (3,) in space."""


@record
class Motions:
    """The rigid motions that bodies of a kind may have.

    Attributes
    ----------
    dim : int
        Components d of a displacement. Points may have fewer: what turns about the axis moves out
        of a half section.
    along : tuple of int
        Axes along which bodies may be translated. Along the others a translation is no rigid
        motion: it stretches a body of revolution.
    planes : tuple of pairs of int
        Axes that turn into one another, one pair for each rotation.
    """

    dim: int
    along: tuple[int, ...]
    planes: tuple[tuple[int, int], ...]

    @property
    def count(self) -> int:
        """Number of rigid motions."""
        return len(self.along) + len(self.planes)

    @property
    def components(self) -> int:
        """Components of a translation and of a rotation."""
        return self.dim + len(self.planes)

    @property
    def across(self) -> tuple[int, ...]:
        """Axes along which nothing is translated."""
        return tuple(sorted({*range(self.dim)} - {*self.along}))

    @property
    def possible(self) -> Index:
        """Which columns of `every` are rigid motions, (count,)."""
        return np.array([*self.along, *range(self.dim, self.components)], dtype=int)

    def every(self, x: Array, centre: Array | float = 0.0) -> Array:
        """Return the displacement of points (m, d) for unit motions, (m, d, d + rotations).

        Translations along the d axes come first, then rotations about a centre. A translation that
        is no rigid motion has zeros.
        """
        held = np.array([axis in self.along for axis in range(self.dim)])
        away = lifted(x, self.dim) - held * lifted(np.zeros(x.shape[1]) + centre, self.dim)
        result = np.zeros((*away.shape, self.components))
        result[:, self.along, self.along] = 1.0
        for k, (i, j) in enumerate(self.planes, self.dim):
            result[:, i, k], result[:, j, k] = -away[:, j], away[:, i]
        return result

    def modes(self, x: Array, centre: Array | float = 0.0) -> Array:
        """Return the displacement of points (m, d) for the unit rigid motions, (m, d, count)."""
        return self.every(x, centre)[:, :, self.possible]

    def moment(self, x: Array, force: Array) -> Axial:
        """Moment about the origin of forces (m, d) at points (m, d); 0 where nothing can turn."""
        x = lifted(x, self.dim)
        return axial(
            np.array([x[:, i] @ force[:, j] - x[:, j] @ force[:, i] for i, j in self.planes])
        )


PLANE = Motions(2, (0, 1), ((0, 1),))
SPACE = Motions(3, (0, 1, 2), ((1, 2), (2, 0), (0, 1)))
REVOLUTION = Motions(2, (1,), ())
"""Rigid motions of bodies of revolution in (r, z): a translation along their axis."""
TORSION = Motions(3, (1,), ((0, 2),))
"""Rigid motions of bodies of revolution in (r, z, θ): they also turn about their axis."""
MOTIONS = {2: PLANE, 3: SPACE}


def lifted(vectors: Array, components: int) -> Array:
    """Points or normals (..., d) as vectors with as many components as a displacement has, 0
    beyond their own.

    Examples
    --------
    >>> lifted(np.array([[3.0, 4.0]]), 3).tolist()
    [[3.0, 4.0, 0.0]]
    """
    missing = components - vectors.shape[-1]
    if missing == 0:
        return vectors
    return np.concatenate([vectors, np.zeros((*vectors.shape[:-1], missing))], axis=-1)


def axial(components: Array) -> Axial:
    """A rotation or a moment from its components; 0 where there is none."""
    return components if len(components) > 1 else float(components.sum())


def moment(x: Array, force: Array) -> Axial:
    """Moment about the origin of forces (m, d) at points (m, d) of the plane or of space."""
    return MOTIONS[x.shape[1]].moment(x, force)
