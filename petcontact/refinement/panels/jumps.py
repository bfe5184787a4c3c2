"""Jumps of polynomials on panels across their edges, and what those of displacements do to the
pressure beside them."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ...bem.kernel import Kernel
from ...geometry.rotation import rigid_motions
from ...mesh.surface_mesh import SurfaceMesh

ALONG = 4
"""Points on each edge."""
OUTSIDE = 2e-3
"""Distance of these points from the edge over that of the edge from the middle of the panel."""
BESIDE = 0.1
"""Distance over the length of an edge up to which a panel lies beyond it: others are on the far
side of the body."""
FIRST = 0.2
"""Distance of the first nodes of a panel from its edge over its size."""


def strained(mesh: SurfaceMesh, u: Array) -> Array:
    """Displacements (n, 3) without the rigid motion in them, which polynomials on curved panels do
    not follow."""
    modes = rigid_motions((mesh.x - mesh.x.mean(axis=0)) / np.ptp(mesh.x)).reshape(u.size, -1)
    return u - (
        modes @ np.linalg.lstsq(modes.T @ modes, modes.T @ u.ravel(), rcond=None)[0]
    ).reshape(u.shape)


class EdgeJumps:
    """Where edges of the panels of a part lie on other panels of it, at points along them; computed
    once.

    Hanging nodes are nothing special. Edges on the rim of the part are left out.

    Attributes
    ----------
    element, other : (k,) arrays
        Numbers of the panel and of the one beyond its edge.
    length : (k,) array
        Of the piece of edge that the point stands for [length].
    """

    def __init__(self, mesh: SurfaceMesh, part: str) -> None:
        numbers, faces = mesh.faces(part)
        following = np.roll(faces.polygon, -1, axis=1)
        number, side = np.nonzero(np.any(following != faces.polygon, axis=2))
        start, end = faces.polygon[number, side], following[number, side]
        length = np.linalg.norm(faces.at(number, end)[0] - faces.at(number, start)[0], axis=1)
        share = (np.arange(ALONG) + 0.5)[:, None, None] / ALONG
        triangle = np.all(faces.polygon[:, 2:3] == faces.polygon[:, 3:], axis=2)
        middle = np.where(triangle, faces.polygon[:, :3].mean(axis=1), faces.polygon.mean(axis=1))[
            number
        ]
        place = (middle + (1.0 + OUTSIDE) * (start + share * (end - start) - middle)).reshape(-1, 2)
        number = np.tile(number, ALONG)
        x, normal = faces.at(number, place)
        there, back = faces.cast(x, normal), faces.cast(x, -normal)
        nearer = np.abs(there.distance) < np.abs(back.distance)
        beyond, opposite = (
            np.where(nearer, there.face, back.face),
            np.where(nearer[:, None], there.place, back.place),
        )
        length = np.tile(length, ALONG)
        close = np.minimum(np.abs(there.distance), np.abs(back.distance)) < BESIDE * length
        found = close & (beyond >= 0) & (beyond != number)
        self.element, self.other = numbers[number[found]], numbers[beyond[found]]
        self.length = length[found] / ALONG
        self._own, self._beyond = (
            mesh.basis_at(self.element, place[found]),
            mesh.basis_at(self.other, opposite[found]),
        )

    def of(self, values: Array) -> Array:
        """Lengths (k,) of the vectors by which nodal values (n, c) jump [as values]."""
        return np.asarray(np.linalg.norm(self._own @ values - self._beyond @ values, axis=1))

    def pressure_squares(self, u: Array, size: Array, kernel: Kernel) -> Array:
        """Squared errors (k,) of the pressure on the panels beyond, by the jumps of the
        displacement [stress² · area].

        A tangential jump δ along a straight edge moves what is at a distance d in the same plane by
        (1-2ν)/(2π(1-ν)) δ ln(1/d) along the normal, so that tractions there are about
        (1-2ν)/(2π²(1-ν)) δ/(C d) off, C = (1-ν)/(πµ): their squares, integrated from the first
        nodes of the panel on. The smaller it is, beside the one that jumps, the worse.

        Parameters
        ----------
        u : (n, 3) array
            At the nodes [length].
        size : (n_elements,) array
            Of the panels [length].
        kernel : Kernel
        """
        nu = kernel.material.poisson_ratio
        share = (1.0 - 2.0 * nu) / (2.0 * math.pi**2 * (1.0 - nu)) / kernel.half_space_compliance
        return np.asarray((share * self.of(u)) ** 2 * self.length / (FIRST * size[self.other]))
