"""Meshes of curves: elements of any order on straight sides and arcs, their nodes, weights and
normals."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
import scipy

from ..arrays import Array, Index
from ..errors import InputError
from ..geometry.arcs import arc_lengths, half_angles, on_arcs
from ..geometry.outline import hull_scale, round_loops
from ..geometry.rotation import PLANE, Motions
from ..record import field, record
from .basis import COINCIDE, gauss, lagrange, legendre
from .boundary_mesh import Batch, BoundaryMesh
from .elements import Elements, Targets
from .pairs.intersections import Curves


@record
class CurveMesh(BoundaryMesh):
    """Discontinuous elements on an outline, collocated at their Gauss points: the `BoundaryMesh` of
    a plane body.

    Attributes
    ----------
    start, end : (n_elements, 2) arrays
        End points, the body on the left [length].
    curvature : (n_elements,) array
        Signed curvature, 0 for straight elements [1/length].
    order : (n_elements,) array
        Order p of each element: p+1 nodes.
    part, line : (n_elements,) arrays
        Number of the part in `part_names`; number of the straight line that the element lies on, -1
        on arcs.
    side_start : (n_elements,) array
        Arc length along the part at the start of the element [length].
    part_names : tuple of str
    unit_length : float
        Length that the kernel's logarithm is measured in (`Outline.log_length`); where it is not
        known, that of the nodes, since any will do where the boundary tractions are in equilibrium
        [length].
    direction : (n_elements, 2) array
        Unit vectors along the chords. Those of tiny elements lose digits in the difference of their
        ends: they are better known from the side, and by default from the ends.
    power : (n_elements,) array
        λ > 0 of constant elements at a corner whose unknown displacements are r^λ, and tractions
        r^(λ-1), r being the distance from their start, -λ from their end; 0 of polynomials, and by
        default (`bem.kelvin2d.corner_elements`).
    thickness : float
        Of the body, by which weights are multiplied; 0 where it is not given, as forces are per
        length then [length].
    x, normal : (n, 2) arrays
        Nodes and outward unit normals.
    weight : (n,) array
        Quadrature weights: the sum of weight·f(x) is the integral of f over the boundary [length;
        area with a thickness].
    element, xi : (n,) arrays
        The element of a node and the node's coordinate on it, in (-1, 1).
    first_node : (n_elements + 1,) array
    half_angle : (n_elements,) array
        Half the angle through which each element turns, signed like the curvature [rad].
    """

    start: Array
    end: Array
    curvature: Array
    order: Index
    part: Index
    line: Index
    side_start: Array
    part_names: tuple[str, ...]
    unit_length: float = 0.0
    direction: Array = field(default_factory=lambda: np.empty((0, 2)))
    power: Array = field(default_factory=lambda: np.empty(0))
    thickness: float = 0.0
    dim: ClassVar[int] = 2
    components: ClassVar[int] = 2
    motions: ClassVar[Motions] = PLANE
    stresses: ClassVar[tuple[str, ...]] = ("xx", "yy", "xy")
    x: Array = field(init=False)
    normal: Array = field(init=False)
    weight: Array = field(init=False)
    element: Index = field(init=False)
    xi: Array = field(init=False)
    first_node: Index = field(init=False)
    half_angle: Array = field(init=False)
    length: Array = field(init=False)

    def __post_init__(self) -> None:
        counts = self.order + 1
        element = np.repeat(np.arange(len(counts)), counts)
        first = np.concatenate([[0], np.cumsum(counts)])
        xi, reference_weight = np.empty(len(element)), np.empty(len(element))
        for order in np.unique(self.order).tolist():
            nodes = first[:-1][self.order == order, None] + np.arange(order + 1)
            xi[nodes], reference_weight[nodes] = gauss(order)
        power = (
            np.where(self.order == 0, self.power, 0.0) if len(self.power) else np.zeros(len(counts))
        )
        corner = np.flatnonzero(power)
        xi[first[corner]] = np.sign(power[corner]) * (
            2.0 * corner_node(np.abs(power[corner])) - 1.0
        )
        chord = self.end - self.start
        size = np.hypot(*chord.T)
        angle = half_angles(size, self.curvature)
        length = arc_lengths(size, angle)
        direction = self.direction if len(self.direction) else chord / size[:, None]
        x, normal = on_arcs(
            self.start[element], self.end[element], angle[element], xi, direction[element]
        )
        values = {
            "direction": direction,
            "power": power,
            "element": element,
            "first_node": first,
            "xi": xi,
            "half_angle": angle,
            "length": length,
            "x": x,
            "normal": normal,
            "weight": 0.5 * self.depth * length[element] * reference_weight,
        }
        vars(self).update(values)
        if self.unit_length == 0.0:
            object.__setattr__(self, "unit_length", hull_scale(np.vstack([self.start, self.x])))

    @property
    def weight_power(self) -> int:
        """1, as forces are per length, or 2 with a thickness."""
        return 2 if self.thickness else 1

    @property
    def of_forces(self) -> str:
        """As in `BoundaryMesh`."""
        return "whole forces" if self.thickness else "forces per length"

    @property
    def depth(self) -> float:
        """As in `BoundaryMesh`."""
        return self.thickness or 1.0

    @property
    def measure(self) -> Array:
        """As in `BoundaryMesh`."""
        return self.weight / self.depth if self.thickness else self.weight

    @functools.cached_property
    def corner_nodes(self) -> Index:
        """As in `BoundaryMesh`."""
        return np.asarray(self.first_node[np.flatnonzero(self.power)])

    @property
    def corners(self) -> Array:
        """Both ends of each element, (n_elements, 2, 2) [length]."""
        return np.stack([self.start, self.end], axis=1)

    @functools.cached_property
    def spheres(self) -> tuple[Array, Array]:
        """As in `BoundaryMesh`; the radius is half the length."""
        middle = self.at(np.arange(self.n_elements), np.full(self.n_elements, 0.5))[0]
        return middle, 0.5 * self.length

    @staticmethod
    def normals_through(x: Array, direction: Array) -> Array:
        """As in `BoundaryMesh`, from one point to the next; of one point alone, the direction."""
        if len(x) < 2:
            return np.broadcast_to(direction, x.shape)
        steps = np.gradient(x, axis=0)
        return np.column_stack([steps[:, 1], -steps[:, 0]])

    @property
    def kind(self) -> Index:
        """The order of each element, (n_elements,)."""
        return self.order

    @property
    def arc_length(self) -> Array:
        """Arc length of each node along its part, (n,) [length]."""
        return self.side_start[self.element] + self.places * self.length[self.element]

    @staticmethod
    def tangents_to(normal: Array) -> Array:
        """Return unit vectors (m, 2) turned by +90°, (m, 1, 2)."""
        return np.asarray(np.stack([-normal[:, 1], normal[:, 0]], axis=1)[:, None])

    @property
    def places(self) -> Array:
        """Fractions of the arc lengths of their elements at which nodes lie, (n,)."""
        return np.asarray(0.5 * (1.0 + self.xi))

    def at(self, element: Index, place: Array) -> tuple[Array, Array]:
        """See `BoundaryMesh.at`; places are fractions (q,) of the arc lengths of elements."""
        return on_arcs(
            self.start[element],
            self.end[element],
            self.half_angle[element],
            2.0 * place - 1.0,
            self.direction[element],
        )

    def arc_lengths(self, element: Index, place: Array) -> Array:
        """Return the arc lengths along their parts of positions on elements (q,) [length]."""
        return np.asarray(self.side_start[element] + place * self.length[element])

    def faces(self, *parts: str) -> tuple[Index, Curves]:
        """Return the numbers of the elements of parts, and these elements as curves for contact
        search."""
        numbers = self.elements_of(*parts)
        return numbers, Curves(self.start[numbers], self.end[numbers], self.curvature[numbers])

    @staticmethod
    def lower_degree(kind: int, less: int = 1) -> Array:
        """See `BoundaryMesh.lower_degree`."""
        return legendre(max(kind - less, 0), gauss(kind)[0]).T

    def basis_at(self, element: Index, place: Array) -> scipy.sparse.csr_array:
        """Return the sparse matrix (q, n) from nodal values to values at fractions (q,) of elements
        (q,).

        The fractions are those of the arc length.
        """
        xi, orders = 2.0 * place - 1.0, self.order[element]
        ends = np.concatenate([[0], np.cumsum(orders + 1)])
        columns, entries = np.empty(ends[-1], dtype=np.int64), np.empty(ends[-1])
        for order in np.unique(orders).tolist():
            chosen, k = np.flatnonzero(orders == order), np.arange(order + 1)
            nodes, row = self.first_node[element[chosen]][:, None] + k, ends[chosen][:, None] + k
            near = np.abs(xi[chosen][:, None] - self.xi[nodes]) < COINCIDE
            columns[row] = nodes
            entries[row] = np.where(
                near.any(axis=1, keepdims=True), near, lagrange(order, xi[chosen]).T
            )
        result = scipy.sparse.csr_array(
            (entries, columns, ends), shape=(len(element), self.n_nodes)
        )
        result.eliminate_zeros()
        return result

    def elements(self, numbers: Index) -> Elements:
        """Return elements of one order as the kernels need them."""
        return Elements(
            start=self.start[numbers],
            end=self.end[numbers],
            curvature=self.curvature[numbers],
            order=int(self.order[numbers[0]]),
            line=self.line[numbers],
            index=numbers,
        )

    def targets(self, nodes: Index | slice) -> Targets:
        """Return collocation nodes as the kernels need them."""
        element = self.element[nodes]
        before, after = self._even_arcs[:, element]
        return Targets(self.x[nodes], self.line[element], element, self.xi[nodes], before, after)

    def points(self, x: Array) -> Targets:
        """Return points (m, 2) that are no nodes, as the kernels need them."""
        nowhere = np.full(len(x), -1)
        return Targets(point=x, line=nowhere, element=nowhere, xi=np.zeros(len(x)))

    def batches(self) -> Iterator[Batch]:
        """Yield all elements, grouped by order."""
        for order in np.unique(self.order):
            group = np.flatnonzero(self.order == order)
            nodes = (self.first_node[group][:, None] + np.arange(order + 1)).ravel()
            yield Batch(self.elements(group), nodes)

    def loops(self) -> list[Index]:
        """Return the numbers of the elements of each closed loop, in order, the outer loop
        first."""
        ends = np.flatnonzero(np.any(self.end[:-1] != self.start[1:], axis=1)) + 1
        return list(np.split(np.arange(self.n_elements), ends))

    def neighbours(self) -> tuple[Index, Index]:
        """Return the elements before and after each one in its loop, two (n_elements,) arrays."""
        return round_loops([len(loop) for loop in self.loops()])

    @functools.cached_property
    def _even_arcs(self) -> Index:
        """Return the elements before and after each constant arc between two equal ones, -2 for
        other elements."""
        if not ((self.order == 0) & (self.curvature != 0.0)).any():
            return np.full((2, self.n_elements), -2)
        pair = np.array(self.neighbours())
        even = np.all(
            (self.order == 0)
            & (self.curvature != 0.0)
            & (self.order[pair] == 0)
            & np.isclose(self.curvature[pair], self.curvature, rtol=1e-6, atol=0.0)
            & np.isclose(self.length[pair], self.length, rtol=1e-6, atol=0.0)
            & (pair != np.arange(self.n_elements)),
            axis=0,
        )
        return np.where(even, pair, -2)

    def on_elements(self, numbers: Index, xi: Array) -> tuple[Array, Array]:
        """Return points (m, k, 2) of m elements at k values of ξ, and outward normals there."""
        elements, shape = np.repeat(numbers, len(xi)), (len(numbers), len(xi), 2)
        points, normals = on_arcs(
            self.start[elements],
            self.end[elements],
            self.half_angle[elements],
            np.tile(xi, len(numbers)),
            self.direction[elements],
        )
        return points.reshape(shape), normals.reshape(shape)


def corner_node(power: Array | float) -> Array:
    """Return the distance of the node of a corner element with power λ from the corner, over its
    length.

    It is λ^(1/(1-λ)), where r^(λ-1) equals its mean over the element.
    """
    return np.asarray(power ** (1.0 / (1.0 - power)))


def as_curve(mesh: BoundaryMesh) -> CurveMesh:
    """Return the mesh as a `CurveMesh`, which has arc lengths and neighbours.

    Raises
    ------
    InputError
        If it is no curve.
    """
    if not isinstance(mesh, CurveMesh):
        raise InputError(f"this is for plane bodies, the mesh has {mesh.dim} dimensions")
    return mesh
