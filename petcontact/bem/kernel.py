"""A fundamental solution for the operators and the fields: integrals over elements and point
forces, in any dimension."""

from __future__ import annotations

import abc
import math
from collections.abc import Iterable
from typing import Any, ClassVar, Protocol

import numpy as np

from ..arrays import Array, Index, Mask
from ..given.tables.material import Material
from ..record import record

COMPONENTS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))}
"""Order of the components of symmetric tensors in 2 and 3 dimensions: xx, yy, xy and xx, yy, zz,
xy, xz, yz."""


@record
class ColumnData:
    """Data by which columns of the boundary operators are made from G and H.

    Attributes
    ----------
    traction_known : (n, d) bool array
        Where the column is one of H (with the free term), else of -G.
    frame : (n, d, d) array
        Directions of the unknowns of each node.
    rhs_first : (n + 1,) array
        Node i has the right-hand sides rhs_first[i] to rhs_first[i + 1] - 1.
    rhs_traction, rhs_displacement : (q, d) arrays
        Each is G times a traction less (½ + H) times a displacement.
    """

    traction_known: Mask
    frame: Array
    rhs_first: Index
    rhs_traction: Array
    rhs_displacement: Array


class ColumnFiller(Protocol):
    """An object that fills a block of columns of the boundary operators in one call."""

    def fill(
        self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None
    ) -> None:
        """Fill the arrays that are given.

        Parameters
        ----------
        rows, columns : (m,) and (k,) arrays
            Nodes, the rows increasing.
        system : (k, d, m, d) array or None
            By column, direction, row and component.
        right_hand_sides : (q, m, d) array or None
            Those of the columns, one after another.
        """
        ...

    @property
    def compiled(self) -> tuple[int, int] | None:
        """Return the addresses of a C function that does the same and of its context, or None."""
        ...

    def with_data(self, data: ColumnData) -> ColumnFiller:
        """Return the filler of the same mesh for other right-hand sides."""
        ...


@record
class Kernel(abc.ABC):
    """Kelvin's solution of a material in d dimensions, integrated over the elements of a mesh.

    The constants of the material and the unit of length ℓ of the kernels' arguments are its own:
    tractions come in units of `traction_scale`, so that every integral of the boundary operators is
    a pure number.

    Attributes
    ----------
    material : Material
    unit_length : float
        ℓ, which the argument of the plane's logarithm is measured in [length].
    tolerance : float, optional
        Relative error of quadrature, by default `kelvin3d.rules.TOLERANCE`; the plane's integrals
        are closed forms [-].
    dim : int
        d.
    """

    material: Material
    unit_length: float
    tolerance: float | None = None
    dim: ClassVar[int]

    @property
    def poisson_ratio(self) -> float:
        """ν of the solution [-]."""
        return self.material.poisson_ratio

    @property
    def traction_scale(self) -> float:
        """2µ/ℓ: tractions are unknowns times it [stress/length]."""
        return 2.0 * self.material.shear_modulus / self.unit_length

    @property
    def half_space_compliance(self) -> float:
        """(1-ν)/(πµ): what a load on the surface of a half space moves that by [1/stress].

        Its displacement is this times -ln r in the plane, over 2r in space. It is 2(1-ν²)/(πE) in
        space and in plane strain, and 2/(πE) in plane stress.
        """
        return (1.0 - self.poisson_ratio) / (math.pi * self.material.shear_modulus)

    @abc.abstractmethod
    def potential(self, distance: Array) -> Array:
        """Return φ(r), -ln(r/ℓ) in the plane and 1/r in space."""

    @abc.abstractmethod
    def integrals(self, targets: Any, elements: Any) -> tuple[Array, Array]:
        """Return both kernels integrated over elements against their bases, at targets.

        Parameters
        ----------
        targets, elements
            m targets and elements with k nodes, as the mesh gives them.

        Returns
        -------
        G : (d, d, k, m) array
            2µ/ℓ ∫ U_ij L_b ds [-], i the component at the target, j the component at the element;
            element after element on the third axis.
        H : (d, d, k, m) array
            ∫ T_ij L_b ds [-]; the principal value, without the free term, at a node of the element
            itself.
        """

    def measure(self, points: Array) -> Array:
        """Lengths (f,) by which forces per length at points (f, d) become those of
        `point_displacement`: 1, of rings 2πr."""
        return np.ones(len(points))

    def corner_columns(
        self, mesh: Any, rows: Index, nodes: Index
    ) -> Iterable[tuple[int, Array, Array]]:
        """Some nodes of elements at corners whose unknowns are powers, and what G and H at the
        nodes `rows` gain from the powers over constants, (d, d, m) each; none by default."""
        return ()

    @abc.abstractmethod
    def field(
        self, targets: Any, elements: Any, u: Array, traction: Array
    ) -> tuple[Array, Array, Array]:
        """Return displacement and stress that some elements cause inside a body, by (4.9) and its
        derivative.

        Parameters
        ----------
        targets, elements
            m points off the boundary and elements with k nodes, as the mesh gives them.
        u, traction : (k, d, s) arrays
            Displacement [length] at the nodes, and traction over `traction_scale` [length], in s
            states.

        Returns
        -------
        u : (m, d, s) array
            [length]
        stress : (m, d(d+1)/2, s) array
            Over `traction_scale`; xx, yy, xy in the plane, xx, yy, zz, xy, xz, yz in space.
        wound : (m,) array
            The part of the full angle, in space of the full solid angle, under which the elements
            are seen: a rigid translation, whose sum over a closed boundary is 1 inside and 0
            outside.
        """

    def point_displacement(self, x: Array, points: Array, force: Array) -> Array:
        """u (n, d) [length] at points x (n, d) for forces (f, d) at points (f, d).

        The space is infinite. In the plane they are forces per length:
        ((3-4ν) φ F + r (r·F)/r^d)/(8π(d-1)µ(1-ν)).
        """
        result, nu, d = np.zeros((len(x), self.dim)), self.poisson_ratio, self.dim
        for source, load in zip(points, force, strict=True):
            r, distance = _from(x, source)
            result += (3.0 - 4.0 * nu) * self.potential(distance)[:, None] * load + (
                r @ load / distance**d
            )[:, None] * r
        return result / (8.0 * np.pi * (d - 1) * self.material.shear_modulus * (1.0 - nu))

    def point_stress(self, x: Array, points: Array, force: Array) -> Array:
        """Stress (n, d(d+1)/2) of the same forces, components as in `field` [stress]."""
        result, nu, d = np.zeros((len(x), len(COMPONENTS[self.dim]))), self.poisson_ratio, self.dim
        for source, load in zip(points, force, strict=True):
            r, distance = _from(x, source)
            along = r @ load
            for c, (i, j) in enumerate(COMPONENTS[d]):
                result[:, c] -= (
                    (1.0 - 2.0 * nu)
                    * (r[:, j] * load[i] + r[:, i] * load[j] - (i == j) * along)
                    / distance**d
                )
                result[:, c] -= d * r[:, i] * r[:, j] * along / distance ** (d + 2)
        return result / (4.0 * np.pi * (d - 1) * (1.0 - nu))


def tensor_components(tensor: Array) -> Array:
    """Return the components (q, d(d+1)/2) of symmetric tensors (q, d, d).

    They are xx, yy, xy, or in space xx, yy, zz, xy, xz, yz.
    """
    i, j = np.triu_indices(tensor.shape[1], 1)
    return np.hstack([np.einsum("qii->qi", tensor), tensor[:, i, j]])


def _from(x: Array, source: Array) -> tuple[Array, Array]:
    """Return the vector r and its length. The length is never zero: at the force itself the vector
    0 cancels the infinite factors."""
    r = x - source
    distance = np.linalg.norm(r, axis=1)
    return r, np.maximum(distance, 1e-12 * distance.max(initial=1e-150))
