"""Interface of a fundamental solution for the operators and the fields: integrals over elements, in
any dimension."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from ..arrays import Array, Index, Mask
from ..model.problem import Material


@dataclass(frozen=True)
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


class Kernel(Protocol):
    """The fundamental solution of a material in d dimensions, integrated over the elements of a
    mesh.

    The constants of the material and the unit of length ℓ of the kernels' arguments are its own:
    tractions come in units of `traction_scale`, so that every integral of the boundary operators is
    a pure number.

    Attributes
    ----------
    dim : int
        d.
    material : Material
    traction_scale : float
        2µ/ℓ: tractions are unknowns times it [stress/length].
    half_space_compliance : float
        (1-ν)/(πµ) = 2(1-ν²)/(πE) of plane strain or space: what a load on the surface of a half
        space moves that by; its displacement is this times -ln r in the plane, over 2r in space
        [1/stress].
    """

    @property
    def dim(self) -> int: ...
    @property
    def material(self) -> Material: ...
    @property
    def traction_scale(self) -> float: ...
    @property
    def half_space_compliance(self) -> float: ...

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
        ...

    def measure(self, points: Array) -> Array:
        """Lengths (f,) by which forces per length at points (f, d) become those of
        `point_displacement`: 1, of rings 2πr."""
        ...

    def corner_columns(
        self, mesh: Any, rows: Index, nodes: Index
    ) -> Iterable[tuple[int, Array, Array]]:
        """Some nodes of elements at corners whose unknowns are powers, and what G and H at the
        nodes `rows` gain from the powers over constants, (d, d, m) each."""
        ...

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
        ...

    def point_displacement(self, x: Array, points: Array, force: Array) -> Array:
        """u (n, d) [length] at points x (n, d) for forces (f, d) at points (f, d) of infinite
        space."""
        ...

    def point_stress(self, x: Array, points: Array, force: Array) -> Array:
        """Stress (n, d(d+1)/2) of the same forces, components as in `field` [stress]."""
        ...
