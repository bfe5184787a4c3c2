"""What every layer above may ask of a boundary mesh, a curve's or a surface's."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Iterator
from typing import Any, Protocol

import numpy as np

from ..arrays import Array, Index
from ..frozen import frozen
from ..geometry.rotation import Motions
from .pairs.ray_casting import Faces


@frozen
class Batch:
    """Elements of one kind as the kernels see them, with the numbers of their nodes (element after
    element)."""

    elements: Any
    nodes: Index


class BoundaryMesh(Protocol):
    """Elements on the boundary of a body in d dimensions, collocated at nodes inside of them.

    Attributes
    ----------
    dim : int
        Of points; also d where bodies do not turn about an axis.
    components : int
        d of displacements and tractions: with torsion one more than points have.
    x, normal : (n, d) arrays
        Nodes [length] and outward unit normals.
    smooth_normal : (n, d) array
        Normals of the smooth surface that the elements stand for, along which bodies touch.
    weight : (n,) array
        Quadrature weights: the sum of weight·f(x) is the integral of f over the boundary
        [length^weight_power].
    weight_power : int
        1 of plane bodies, whose forces are those of a unit of thickness, else 2.
    measure : (n,) array
        The same weights for integrals over the elements themselves: of rings over their generating
        curve [length^(d-1)].
    functions : dict
        What is known of functions on parts, by the part and the function: looked at once.
    motions : Motions
        The rigid motions of such bodies.
    stresses : tuple of str
        Components of the stress that are reported.
    element : (n,) array
        The element of each node.
    first_node : (n_elements + 1,) array
        The nodes of element e are first_node[e] to first_node[e + 1] - 1.
    kind : (n_elements,) array
        Elements of one kind go into one call of the kernels: one shape, one order.
    order : (n_elements,) array
        Order p of each element.
    part : (n_elements,) array
        Number of the part in `part_names`.
    unit_length : float
        Length that makes the arguments of the kernels pure numbers [length].
    """

    @property
    def dim(self) -> int: ...
    @property
    def components(self) -> int: ...
    @property
    def x(self) -> Array: ...
    @property
    def normal(self) -> Array: ...
    @property
    def smooth_normal(self) -> Array: ...
    @property
    def weight(self) -> Array: ...
    @property
    def weight_power(self) -> int: ...
    @property
    def measure(self) -> Array: ...
    @property
    def functions(self) -> dict[Hashable, Any]: ...
    @property
    def motions(self) -> Motions: ...
    @property
    def stresses(self) -> tuple[str, ...]: ...
    @property
    def element(self) -> Index: ...
    @property
    def first_node(self) -> Index: ...
    @property
    def kind(self) -> Index: ...
    @property
    def order(self) -> Index: ...
    @property
    def part(self) -> Index: ...
    @property
    def part_names(self) -> tuple[str, ...]: ...
    @property
    def unit_length(self) -> float: ...
    @property
    def n_nodes(self) -> int: ...
    @property
    def n_elements(self) -> int: ...
    @property
    def node_part(self) -> Index: ...
    @property
    def corner_nodes(self) -> Index: ...
    @property
    def corners(self) -> Array:
        """Of each element, (n_elements, c, d) [length]; NaN where it has fewer than others."""
        ...

    @staticmethod
    def around(x: Array) -> Array:
        """What integrals over elements count at points (q, d)."""
        ...

    def nodes_of(self, part: str) -> Index:
        """Numbers of the nodes of a part, increasing."""
        ...

    def tangents(self, nodes: Index) -> Array:
        """Orthonormal tangents at nodes, (m, d-1, d)."""
        ...

    def tangents_to(self, normal: Array) -> Array:
        """Orthonormal tangents to unit vectors (m, d), (m, d-1, d) by the axes of points."""
        ...

    def slip_directions(self, normal: Array) -> Array:
        """Orthonormal directions (m, d-1, d) of slip where unit vectors are normal, by the
        components of displacements: the tangents, and with torsion θ."""
        ...

    def variables(self, nodes: Index) -> dict[str, Array]:
        """What expressions may name at nodes, (m,) each: x, y (and z), nx, ny (and nz), and s on
        curves."""
        ...

    def variables_at(self, element: Index, place: Array) -> dict[str, Array]:
        """What expressions may name at places, as `Hits` has them, of elements (q,)."""
        ...

    def faces(self, *parts: str) -> tuple[Index, Faces]:
        """Numbers of the elements of parts, increasing, and these as what may be faced."""
        ...

    def basis_at(self, element: Index, place: Array) -> Any:
        """Nodal values to values at places, as `Hits` has them, of elements (q,): a sparse array
        (q, n)."""
        ...

    def lower_degree(self, kind: int, less: int = 1) -> Array:
        """Polynomials of one degree `less`, or of two, at least constants: a basis (k, r), at the k
        nodes of an element of a kind; of order 1 or more."""
        ...

    def with_hoop(self, stress: Array, across: Array) -> Array:
        """Stress (m, d(d+1)/2), of bodies of revolution with the normal stress `across` (m,) the
        half section as third component."""
        ...

    def images(self, x: Array) -> list[Array]:
        """Points (m, d), and their images from which a half section is seen as its image is."""
        ...

    def strained(self, x: Array, u: Array, gradient: Array) -> tuple[Array, Array]:
        """Surface gradients (m, d, d) of displacements (m, d) at points, and the strain (m,) across
        the plane that they do not have, both with what a body of revolution has round the axis; of
        gradients (m, d, k) along the axes of points [-]."""
        ...

    def on_axis(self, u: Array) -> Array:
        """Nodal displacements (n, k), of a body of revolution such that u_r is 0 on the axis."""
        ...

    def batches(self) -> list[Batch]:
        """All elements, grouped by kind."""
        ...

    def elements(self, numbers: Index) -> Any:
        """The kernels' view of elements of one kind; its `index` holds their numbers."""
        ...

    def targets(self, nodes: Index | slice) -> Any:
        """The kernels' view of collocation nodes."""
        ...

    def points(self, x: Array) -> Any:
        """The kernels' view of points (m, d) that are nodes of no element."""
        ...


class Collocated:
    """What follows from the elements' order and part and the nodes' element, in any dimension."""

    order: Index
    part: Index
    part_names: tuple[str, ...]
    element: Index
    normal: Array
    weight: Array
    tangents_to: Callable[[Array], Array]

    @property
    def measure(self) -> Array:
        """The weights."""
        return self.weight

    @functools.cached_property
    def functions(self) -> dict[Hashable, Any]:
        """What is known of functions on parts, by the part and the function: looked at once."""
        return {}

    def slip_directions(self, normal: Array) -> Array:
        """The tangents."""
        return self.tangents_to(normal)

    def strained(self, x: Array, u: Array, gradient: Array) -> tuple[Array, Array]:
        """The gradients, and no strain across."""
        return gradient, np.zeros(len(x))

    def on_axis(self, u: Array) -> Array:
        """The displacements: there is no axis."""
        return u

    @staticmethod
    def with_hoop(stress: Array, across: Array) -> Array:
        """Stress (m, d(d+1)/2) with what is reported besides: nothing."""
        return stress

    @staticmethod
    def images(x: Array) -> list[Array]:
        """The points (m, d) from which the whole boundary is seen as this mesh is: themselves."""
        return [x]

    @staticmethod
    def around(x: Array) -> Array:
        """What integrals over elements count at points (q, d): 1, of bodies of revolution 2πr."""
        return np.ones(len(x))

    @property
    def smooth_normal(self) -> Array:
        """The normals themselves, where elements know them exactly."""
        return self.normal

    @property
    def n_nodes(self) -> int:
        """Number of collocation nodes; the elastic system has as many unknowns a node as a
        displacement has components."""
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
        """Numbers of the elements of parts, increasing."""
        return np.flatnonzero(np.isin(self.part, [self.part_names.index(part) for part in parts]))

    def nodes_of(self, part: str) -> Index:
        """Numbers of the nodes of a part, increasing."""
        return np.flatnonzero(self.node_part == self.part_names.index(part))


def pieces(mesh: BoundaryMesh, step: int) -> Iterator[Batch]:
    """All elements, `step` of one kind at a time."""
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
