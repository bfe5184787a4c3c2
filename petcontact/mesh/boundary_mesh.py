"""The interface of boundary meshes, of curves and of surfaces, for all higher layers."""

from __future__ import annotations

import abc
import functools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import scipy

from ..arrays import Array, Index
from ..geometry.rotation import Motions
from ..given.sites import Sites
from ..record import Keeping, record
from .pairs.ray_casting import Faces


@record
class Batch:
    """Elements of one kind as the kernels need them, and the numbers of their nodes.

    The nodes are listed element after element.
    """

    elements: Any
    nodes: Index


class BoundaryMesh(Keeping, abc.ABC):
    """Elements on the boundary of a body in d dimensions, collocated at nodes inside of them.

    What all meshes share follows from the elements' order and part and the nodes' element.

    Attributes
    ----------
    dim : int
        Number of coordinates of points.
    components : int
        Components of displacements and tractions: `dim`, with torsion one more.
    x, normal : (n, d) arrays
        Nodes [length] and outward unit normals.
    weight : (n,) array
        Quadrature weights: the sum of weight·f(x) is the integral of f over the boundary
        [length^weight_power].
    weight_power : int
        1 for plane bodies whose forces are per length, else 2.
    depth : float
        Thickness of a plane body, 1 where it has none [length].
    motions : Motions
        The rigid motions of such bodies.
    stresses : tuple of str
        Components of the stress that are reported.
    element : (n,) array
        The element of each node.
    first_node : (n_elements + 1,) array
        The nodes of element e are first_node[e] to first_node[e + 1] - 1.
    order : (n_elements,) array
        Order p of each element.
    part : (n_elements,) array
        Number of the part in `part_names`.
    kind : (n_elements,) array
        Kind of each element, its shape and order; one call of a kernel takes one kind.
    corners : (n_elements, c, d) array
        Corners of each element, NaN where it has fewer [length].
    unit_length : float
        Length by which the arguments of the kernels are divided [length].
    spheres : (n_elements, d) and (n_elements,) arrays
        Centres and radii of spheres around the elements [length].
    """

    dim: ClassVar[int]
    components: ClassVar[int]
    motions: ClassVar[Motions]
    stresses: ClassVar[tuple[str, ...]]
    x: Array
    normal: Array
    weight: Array
    element: Index
    first_node: Index
    order: Index
    part: Index
    part_names: tuple[str, ...]
    if TYPE_CHECKING:  # fields of some meshes, and properties of others

        @property
        def kind(self) -> Index: ...
        @property
        def weight_power(self) -> int: ...
        @property
        def corners(self) -> Array: ...
        @property
        def places(self) -> Array: ...
        @property
        def unit_length(self) -> float: ...
        @property
        def spheres(self) -> tuple[Array, Array]: ...

    @property
    def smooth_normal(self) -> Array:
        """Normals of the smooth surface that the elements stand for, along which bodies touch."""
        return self.normal

    @property
    def measure(self) -> Array:
        """Weights of integrals over the elements themselves, for rings over their generating curve
        [length^(d-1)]."""
        return self.weight

    @property
    def depth(self) -> float:
        """By what weights are multiplied beyond those of the elements: the thickness of a plane
        body [length]."""
        return 1.0

    @property
    def of_forces(self) -> str:
        """Whether forces of plane bodies are per length or whole, in words; nothing for others."""
        return ""

    @property
    def n_nodes(self) -> int:
        """Number of collocation nodes.

        At each node the elastic system has as many unknowns as a displacement has components.
        """
        return len(self.element)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.order)

    @property
    def corner_nodes(self) -> Index:
        """Nodes of elements at corners whose unknowns are powers of the distance, not
        polynomials."""
        return np.empty(0, dtype=np.int64)

    @functools.cached_property
    def node_part(self) -> Index:
        """Number of the part of each node, (n,)."""
        return self.part[self.element]

    def elements_of(self, *parts: str) -> Index:
        """Return the numbers of the elements of parts, increasing."""
        return np.flatnonzero(np.isin(self.part, [self.part_names.index(part) for part in parts]))

    def nodes_of(self, part: str) -> Index:
        """Return the numbers of the nodes of a part, increasing."""
        return np.flatnonzero(self.node_part == self.part_names.index(part))

    def tangents(self, nodes: Index) -> Array:
        """Return orthonormal tangents at nodes, (m, d-1, d)."""
        return self.tangents_to(self.normal[nodes])

    @staticmethod
    @abc.abstractmethod
    def tangents_to(normal: Array) -> Array:
        """Return orthonormal tangents to unit vectors (m, d), (m, d-1, d), along the axes of
        points."""

    def slip_directions(self, normal: Array) -> Array:
        """Return orthonormal directions of slip for unit normals, (m, d-1, d).

        They have the components of displacements: the tangents, and with torsion θ.
        """
        return self.tangents_to(normal)

    @abc.abstractmethod
    def at(self, element: Index, place: Array) -> tuple[Array, Array]:
        """Return points (q, d) [length] and outward unit normals (q, d) at positions, as in `Hits`,
        on elements (q,)."""

    def sites(self, nodes: Index) -> Sites:
        """Return the sites of nodes (m,); on curves with the arc lengths along the part."""
        s = self.arc_lengths(self.element[nodes], self.places[nodes])
        return Sites(self.x[nodes], self.normal[nodes], s)

    def sites_at(self, element: Index, place: Array) -> Sites:
        """Return the sites of positions, as in `Hits`, on elements (q,)."""
        return Sites(*self.at(element, place), self.arc_lengths(element, place))

    def arc_lengths(self, element: Index, place: Array) -> Array | None:
        """Return the arc lengths along their parts of positions on elements (q,) [length].

        Surfaces have none.
        """
        return None

    @abc.abstractmethod
    def faces(self, *parts: str) -> tuple[Index, Faces]:
        """Return the numbers of the elements of parts, increasing, and these elements for contact
        search."""

    @abc.abstractmethod
    def basis_at(self, element: Index, place: Array) -> scipy.sparse.csr_array:
        """Return the sparse matrix (q, n) from nodal values to values at positions, as in `Hits`,
        on elements (q,)."""

    @staticmethod
    @abc.abstractmethod
    def lower_degree(kind: int, less: int = 1) -> Array:
        """Return a basis (k, r) of polynomials of one or two degrees (`less`) lower, at an
        element's k nodes.

        The element has the given kind, of order 1 or more. The degree is at least 0.
        """

    @staticmethod
    def around(x: Array) -> Array:
        """Return the factor of integrals over elements at points (q, d): 1, or 2πr on rings."""
        return np.ones(len(x))

    @staticmethod
    def normals_through(x: Array, direction: Array) -> Array:
        """Return normals of a surface through points (m, d) that face nodes along a direction (d,).

        They need not have length 1. Where nodes have no order the direction is taken for them.
        """
        return np.broadcast_to(direction, x.shape)

    @staticmethod
    def with_hoop(stress: Array, across: Array) -> Array:
        """Return the stress (m, d(d+1)/2) with all components.

        On bodies of revolution the normal stress `across` (m,) the half section is inserted as the
        third.
        """
        return stress

    @staticmethod
    def images(x: Array) -> list[Array]:
        """Return points (m, d) and their mirror images.

        The image of a half section looks from a point like the half section from the image of the
        point. Other meshes are the whole boundary.
        """
        return [x]

    def strained(self, x: Array, u: Array, gradient: Array) -> tuple[Array, Array]:
        """Return gradients (m, d, d) of displacements (m, d) at points, and the strain (m,) across
        their plane.

        The given gradients (m, d, k) are along the axes of points [-]. Both results include the
        terms of bodies of revolution around the axis.
        """
        return gradient, np.zeros(len(x))

    def on_axis(self, u: Array) -> Array:
        """Return nodal displacements (n, k), with u_r = 0 on the axis of a body of revolution."""
        return u

    @abc.abstractmethod
    def batches(self) -> Iterator[Batch]:
        """Yield all elements, grouped by kind."""

    @abc.abstractmethod
    def elements(self, numbers: Index) -> Any:
        """Return elements of one kind as the kernels need them, with their numbers in `index`."""

    def by_kind(self, elements: Index) -> Iterator[tuple[Index, Any]]:
        """Elements (q,) by their kind: the rows of one, and its elements as the kernels need
        them."""
        for kind in np.unique(self.kind[elements]):
            rows = np.flatnonzero(self.kind[elements] == kind)
            yield rows, self.elements(elements[rows])

    @abc.abstractmethod
    def targets(self, nodes: Index | slice) -> object:
        """Return collocation nodes as the kernels need them."""

    @abc.abstractmethod
    def points(self, x: Array) -> object:
        """Return points (m, d) that are no nodes, as the kernels need them."""


def pieces(mesh: BoundaryMesh, step: int) -> Iterator[Batch]:
    """Yield all elements, at most `step` of one kind at a time."""
    for batch in mesh.batches():
        per_element = len(batch.nodes) // len(batch.elements.index)
        for first in range(0, len(batch.elements.index), step):
            # all of a kind are those of the mesh, which keep what was found out about them
            whole = step >= len(batch.elements.index)
            elements = (
                batch.elements
                if whole
                else mesh.elements(batch.elements.index[first : first + step])
            )
            yield Batch(elements, batch.nodes[first * per_element : (first + step) * per_element])
