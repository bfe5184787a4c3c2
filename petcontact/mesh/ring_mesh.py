"""Meshes of the generating curves of bodies of revolution, with or without torsion."""

from __future__ import annotations

import functools
from typing import ClassVar

import numpy as np

from ..arrays import Array, Index
from ..geometry.rotation import REVOLUTION, TORSION, Motions, lifted
from ..record import record
from .basis import lagrange
from .curve_mesh import CurveMesh

AXIS = 1e-5
"""Distance from the axis over the largest one, below which u_r/r is replaced by u_r' [-]. The error
of u_r' is the square of this distance; that of u_r/r is the error of integrals, 1e-9, over it."""


@record
class RingMesh(CurveMesh):
    """A mesh of the generating curve of a body of revolution; x is r and y is z.

    Weights are those of whole rings, 2πr times those of the curve [length²]. A chain of elements
    that begins and ends on the axis has no neighbours there.
    """

    weight_power = 2
    of_forces = ""
    motions: ClassVar[Motions] = REVOLUTION
    stresses: ClassVar[tuple[str, ...]] = ("xx", "yy", "zz", "xy")

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "weight", self.around(self.x) * self.weight)

    @staticmethod
    def around(x: Array) -> Array:
        """Return the circumference of rings at points (q, 2) [length]."""
        return 2.0 * np.pi * x[:, 0]

    @functools.cached_property
    def measure(self) -> Array:
        """Weights of integrals over the curve alone, (n,) [length]."""
        return self.weight / self.around(self.x)

    @staticmethod
    def with_hoop(stress: Array, across: Array) -> Array:
        """Return rr, zz, rz with the hoop stress as third component."""
        return np.insert(stress, 2, across, axis=1)

    @staticmethod
    def images(x: Array) -> list[Array]:
        """Return points (m, 2), and their mirror images beyond the axis."""
        return [x, x * [-1.0, 1.0]]

    def over_radius(self, x: Array, u: Array, slope: Array) -> Array:
        """Return u/r (m,) of a component (m,) that is 0 on the axis, at points (m, 2) [-].

        Near the axis, where u/r loses its digits, it is replaced by its limit `slope` (m,), the
        derivative along r.
        """
        off = x[:, 0] > AXIS * np.abs(self.x[:, 0]).max()
        return np.where(off, u / np.where(off, x[:, 0], 1.0), slope)

    def strained(self, x: Array, u: Array, gradient: Array) -> tuple[Array, Array]:
        """Return the gradients and the hoop strain u_r/r."""
        return gradient, self.over_radius(x, u[:, 0], gradient[:, 0, 0])

    def on_axis(self, u: Array) -> Array:
        """Return nodal displacements (n, k) with zero components across the axis at elements that
        end on it.

        Polynomials make u_r zero there only up to their error, which u_r/r would amplify.
        """
        result, across = u.copy(), np.array(self.motions.across)
        for ends, at in ((self.start, -1.0), (self.end, 1.0)):
            for e in np.flatnonzero(ends[:, 0] == 0.0).tolist():
                nodes = np.arange(self.first_node[e], self.first_node[e + 1])[:, None]
                left = lagrange(int(self.order[e]), np.array([at]))[:, 0] @ result[nodes, across]
                result[nodes, across] -= 0.5 * (1.0 + at * self.xi[nodes]) * left
        return result

    def neighbours(self) -> tuple[Index, Index]:
        """As in `CurveMesh`, but an element that ends on the axis is its own neighbour."""
        before, after = super().neighbours()
        own = np.arange(self.n_elements)
        return (
            np.where(self.start[:, 0] == 0.0, own, before),
            np.where(self.end[:, 0] == 0.0, own, after),
        )


@record
class TwistedRingMesh(RingMesh):
    """A `RingMesh` of a body that also turns about its axis.

    Displacements and tractions have the components r, z and θ, the latter by the right-hand rule
    about +z.
    """

    components: ClassVar[int] = 3
    motions: ClassVar[Motions] = TORSION
    stresses: ClassVar[tuple[str, ...]] = ("xx", "yy", "zz", "xy", "xz", "yz")

    def slip_directions(self, normal: Array) -> Array:
        """Return the directions along the curve and along θ, (m, 2, 3)."""
        along = lifted(self.tangents_to(normal), 3)
        round_axis = np.broadcast_to(np.array([0.0, 0.0, 1.0]), along.shape)
        return np.concatenate([along, round_axis], axis=1)

    @staticmethod
    def with_hoop(stress: Array, across: Array) -> Array:
        """Return all components with this hoop stress."""
        result = stress.copy()
        result[:, 2] = across
        return result

    def strained(self, x: Array, u: Array, gradient: Array) -> tuple[Array, Array]:
        """Return the gradients (m, 3, 3) and the hoop strain.

        The displacement turns around the axis with the directions, which adds to the gradients.
        """
        whole = lifted(gradient, 3)
        whole[:, 0, 2] = -self.over_radius(x, u[:, 2], gradient[:, 2, 0])
        whole[:, 2, 2] = self.over_radius(x, u[:, 0], gradient[:, 0, 0])
        return whole, np.zeros(len(x))
