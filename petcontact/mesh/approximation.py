"""Polynomials that stand for functions on a part of a mesh, and their errors.

The samples are finer than the nodes. They are refined where two samplings differ.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Hashable, Sequence

import numpy as np
import scipy

from ..arrays import Array, Index, Rows, scattered
from ..given.values import Given
from ..record import record
from .boundary_mesh import BoundaryMesh
from .pairs.ray_casting import Faces
from .rough_places import rough_places

WITHIN = 1.0 - 2e-7
"""Share of a cell that its points span. If a function jumps at the end of an element, the points
see only the element's own value; coordinates have enough digits for that."""
POINTS = 0.5 + WITHIN * np.sqrt(0.05) * np.array([-math.sqrt(5.0), -1.0, 1.0, math.sqrt(5.0)])
WEIGHTS = np.array([1.0, 5.0, 5.0, 1.0]) / 12.0
"""Weights of Lobatto's rule along each direction of a cell. Its points include the ends, so that a
jump near an end lies between two points."""
HALVES = np.stack(
    [np.vander(0.5 * (POINTS + half), len(POINTS)) for half in (0.0, 1.0)]
) @ np.linalg.inv(np.vander(POINTS))
"""Values at the points of both halves of a cell of the cubic through its own points, (2, 4, 4)."""
ACROSS = 24
"""Least number of cells across a part before any is cut."""
ENOUGH = 4e-3
"""Accepted integral of what the cubics of cells miss over that of the function [-]. Along a jump it
has opposite signs: integrals of 8 discs are off by at most 2e-4."""
MOST_CELLS = 8000
"""Largest number of cells that are cut at once; a function with more is rough everywhere."""
AT_ONCE = 2**14
"""Number of points that are looked at at once. Each takes a copy of its element, about a kilobyte,
of which a tenth stays as its sample."""
TOTAL, MEAN, EACH = 1e-6, 1e-3, 5e-2
"""Accepted error of a function's integral by its nodal values, over the integral of its size [-].
`TOTAL` bounds that of a load on a part, to the digits that are printed; `MEAN` that of a
displacement, whose integral acts on nothing: rigid rotations of curved elements are right at their
nodes. `EACH` bounds the sum over elements, in which smooth loads move within elements."""

Function = Callable[[Index, Array, Array, Array], Array]
"""Function that returns values (q, c) at positions on elements, from points and normals (q, d)."""


@record
class Samples:
    """Quadrature points on a part, and the values of a function there.

    Attributes
    ----------
    mesh : BoundaryMesh
    element : (q,) array
    place : (q,) or (q, 2) array
        Positions on the elements as in `Hits`.
    weight : (q,) array
        [length, in space area]
    values : (q, c) array
    doubt : float
        Twice the standard deviation of the function's integral by these points, with errors of
        cells that are independent of one another.
    """

    mesh: BoundaryMesh
    element: Index
    place: Array
    weight: Array
    values: Array
    doubt: float

    @functools.cached_property
    def basis(self) -> scipy.sparse.csr_array:
        """Matrix from values at all nodes of the mesh to values at the points, (q, n)."""
        some = (
            self.mesh.basis_at(self.element[k : k + AT_ONCE], self.place[k : k + AT_ONCE])
            for k in range(0, max(len(self.element), 1), AT_ONCE)
        )
        return scipy.sparse.csr_array(scipy.sparse.vstack([*some]))

    def over_elements(self, values: Array) -> Array:
        """Return the integrals of values (q,) over each element of the mesh, (n_elements,)."""
        integrals = np.bincount(self.element, self.weight * values, self.mesh.n_elements)
        return np.asarray(integrals, dtype=float)

    def norms(self, values: Array) -> Array:
        """Return the L2 norms of values (q,) on each element, (n_elements,)."""
        return np.sqrt(self.over_elements(values**2))

    def around_mean(self, values: Array) -> Array:
        """Return values (q,) minus their means over each element."""
        area = self.over_elements(np.ones(len(values)))
        mean = self.over_elements(values) / np.where(area > 0.0, area, 1.0)
        return np.asarray(values - mean[self.element])

    def left(self, nodal: Array) -> Array:
        """Return the function minus the polynomials through values (n, c) at all nodes, (q, c)."""
        return np.asarray(self.values - self.basis @ nodal)

    def share(self, values: Array, others: Array) -> float:
        """Return the integral of the size of values (q, c) over that of others, 0 if these
        vanish."""
        size, divisor = (self.weight @ np.linalg.norm(each, axis=1) for each in (values, others))
        return float(size / divisor) if divisor > 0.0 else 0.0

    def projected(self, nodes: Index) -> Array:
        """Return nodal values (m, c) on the part of the polynomials nearest in L2.

        Their integrals are those of the function.
        """
        basis = self.basis[:, nodes]
        weighted = basis.T.multiply(self.weight).tocsr()
        solution = scipy.sparse.linalg.spsolve((weighted @ basis).tocsc(), weighted @ self.values)
        return np.asarray(solution).reshape(len(nodes), -1)

    def misses(self, nodal: Array, accepted: float) -> bool:
        """Return whether polynomials through nodal values (n, c) have wrong integrals."""
        left = self.left(nodal)
        lost = np.stack([self.over_elements(column) for column in left.T])
        size = float(self.weight @ np.linalg.norm(self.values, axis=1))
        whole, each = np.linalg.norm(lost.sum(axis=1)), np.linalg.norm(lost, axis=0).sum()
        return bool(whole > accepted * size or each > EACH * size)

    def rough(self, values: Array) -> Array:
        """Return values (q, c) minus their best polynomials of each element's degree."""
        result, local = np.zeros_like(values), self.place.reshape(len(self.place), -1)
        order = np.argsort(self.element, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(self.element[order])) + 1):
            degree = int(self.mesh.order[self.element[rows[0]]])
            at = local[rows] - local[rows].mean(axis=0)
            at /= np.abs(at).max()
            powers = itertools.product(range(degree + 1), repeat=at.shape[1])
            columns = [np.prod(at**power, axis=1) for power in powers if sum(power) <= degree]
            root = np.sqrt(self.weight[rows])[:, None]
            basis = np.column_stack(columns)
            coefficients = np.linalg.lstsq(root * basis, root * values[rows], rcond=None)[0]
            result[rows] = values[rows] - basis @ coefficients
        return result


def sampled(
    mesh: BoundaryMesh, part: str, function: Function, data: Sequence[Given], name: Hashable
) -> Samples:
    """Return samples of a function on a part.

    They lie in cells of its elements, which end where data may be rough. A cell is halved where the
    function differs from the cubic through its points.

    Parameters
    ----------
    mesh : BoundaryMesh
    part : str
    function : callable
        See `Function`.
    data : sequence of Given
        What the function is made of.
    name : hashable
        Name of the function on this part, by which the mesh stores the samples.
    """
    return mesh.once(("samples", part, name), lambda: _sampled(mesh, part, function, data))


def _sampled(mesh: BoundaryMesh, part: str, function: Function, data: Sequence[Given]) -> Samples:
    elements, faces = mesh.faces(part)
    rule = functools.partial(_in_turn, functools.partial(_rule, mesh, faces, elements, function))
    cells, done = _first(len(elements), rough_places(mesh, part, data), rule), list[Cells]()
    square = 0.0
    # a cell is halved 14 times along each direction
    for _ in range(14 * (mesh.dim - 1)):
        halves, error = _halved(cells, rule)
        enough = ENOUGH * sum(each.magnitude for each in (*done, halves))
        cut = error > 0.25 * enough / len(error)
        if error.sum() <= enough or cut.sum() > MOST_CELLS:
            cut[:] = False
        square += float(np.sum(error[~cut] ** 2))
        done.append(halves.take(np.repeat(~cut, 2)))
        cells = halves.take(np.repeat(cut, 2))
        if not len(cells.number):
            break
    return Cells.joined([*done, cells]).samples(mesh, elements, 2.0 * math.sqrt(square))


def _first(
    count: int, places: Sequence[tuple[Index, Array]], rule: Callable[..., tuple[Array, ...]]
) -> Cells:
    """Return the first cells of elements: about `ACROSS` across all of them, which end at places
    along each direction of an element."""
    across = max(1, math.ceil(ACROSS / count ** (1.0 / len(places))))
    grid, cut = np.linspace(0.0, 1.0, across + 1), np.zeros(count, dtype=bool)
    for row, _ in places:
        cut[row] = True
    boxes = [_boxes([grid for _ in places], np.flatnonzero(~cut))]
    for k in np.flatnonzero(cut):
        ends = [np.union1d(grid, share[row == k]) for row, share in places]
        boxes.append(_boxes(ends, np.array([k])))
    number, low, size = (np.concatenate(each) for each in zip(*boxes, strict=True))
    return Cells(number, low, size, *rule(number, low, size))


def _boxes(ends: Sequence[Array], elements: Index) -> tuple[Index, Array, Array]:
    """Return the boxes between ends along each direction, for each of some elements: the element,
    the least coordinates and the extents."""
    low, size = (
        np.stack(np.meshgrid(*each, indexing="ij"), axis=-1).reshape(-1, len(ends))
        for each in ([e[:-1] for e in ends], [np.diff(e) for e in ends])
    )
    many = len(elements), 1
    return np.repeat(elements, len(low)), np.tile(low, many), np.tile(size, many)


def approximated(samples: Samples, nodes: Index, nodal: Array, accepted: float) -> Array:
    """Return nodal values (m, c) that stand for a function on a part.

    They are those of the function if their integrals are right, else those of the nearest
    polynomials.

    Parameters
    ----------
    samples : Samples
        Samples of the function.
    nodes : (m,) array
        Nodes of the part.
    nodal : (m, c) array
        Values of the function there.
    accepted : float
        Accepted error of the integral over all elements, `TOTAL` or `MEAN` [-].
    """
    on_mesh = scattered(nodal, nodes, samples.mesh.n_nodes)
    return samples.projected(nodes) if samples.misses(on_mesh, accepted) else nodal


@record
class Cells(Rows):
    """Boxes in the reference coordinates of faces, and a function at points of each.

    Attributes
    ----------
    number : (k,) array
        Number of the face.
    low, size : (k, d-1) arrays
        Least coordinates, from 0 to 1, and extents of the cell.
    place, weight, values : (k, q) arrays and more
        Positions, weights and values at the points.
    """

    number: Index
    low: Array
    size: Array
    place: Array
    weight: Array
    values: Array

    def samples(self, mesh: BoundaryMesh, elements: Index, doubt: float) -> Samples:
        """Return all points; `elements` are the numbers of the faces in their mesh."""
        count, points = self.weight.shape
        place, values = (
            each.reshape(count * points, *each.shape[2:]) for each in (self.place, self.values)
        )
        element = np.repeat(elements[self.number], points)
        return Samples(mesh, element, place, self.weight.ravel(), values, doubt)

    @property
    def magnitude(self) -> float:
        """Integral of the size of the function."""
        return float(np.sum(self.weight * np.linalg.norm(self.values, axis=2)))


def _halved(cells: Cells, rule: Callable[..., tuple[Array, ...]]) -> tuple[Cells, Array]:
    """Return halves of cells (2k,) and the integral of what the cubics of each cell miss (k,).

    Each cell is halved along the direction with the largest one. Where a jump crosses a cell, its
    integral and those of its halves may agree by chance.
    """
    ways, errors, (count, d) = list[Cells](), list[Array](), cells.low.shape
    values = cells.values.reshape(count, *d * [len(POINTS)], -1)
    for axis in range(d):
        size, low = cells.size.repeat(2, axis=0), cells.low.repeat(2, axis=0)
        number = cells.number.repeat(2)
        size[:, axis] *= 0.5
        low[1::2, axis] += size[1::2, axis]
        ways.append(Cells(number, low, size, *rule(number, low, size)))
        cubic = np.einsum("hqp,kp...->khq...", HALVES, np.moveaxis(values, 1 + axis, 1))
        apart = ways[-1].values - np.moveaxis(cubic, 2, 2 + axis).reshape(ways[-1].values.shape)
        off = ways[-1].weight * np.linalg.norm(apart, axis=2)
        errors.append(off.reshape(count, -1).sum(axis=1))
    best = np.argmax(errors, axis=0)
    chosen = (2 * count * best[:, None] + 2 * np.arange(count)[:, None] + [0, 1]).ravel()
    return Cells.joined(ways).take(chosen), np.max(errors, axis=0)


def _in_turn(
    rule: Callable[..., tuple[Array, ...]], number: Index, low: Array, size: Array
) -> tuple[Array, ...]:
    """Return what a rule gives for cells, of which it sees some at once."""
    step = max(1, AT_ONCE // len(POINTS) ** low.shape[1])
    some = (slice(k, k + step) for k in range(0, max(len(number), 1), step))
    each = [rule(number[rows], low[rows], size[rows]) for rows in some]
    return tuple(map(np.concatenate, zip(*each, strict=True)))


def _rule(
    mesh: BoundaryMesh,
    faces: Faces,
    elements: Index,
    function: Function,
    number: Index,
    low: Array,
    size: Array,
) -> tuple[Array, Array, Array]:
    """Return positions, weights and values, (k, q) and more, at points of cells of faces."""
    d = low.shape[1]
    points = np.array(list(itertools.product(POINTS, repeat=d)))
    weights = np.array([np.prod(each) for each in itertools.product(WEIGHTS, repeat=d)])
    share = (low[:, None] + size[:, None] * points).reshape(-1, d)
    face = np.repeat(number, len(points))
    place, area = faces.spread(face, share), faces.area(face, share)
    x, normal = faces.at(face, place)
    values, area = function(elements[face], place, x, normal), area * mesh.around(x)
    shape = len(number), len(points)
    return (
        place.reshape(*shape, *place.shape[1:]),
        area.reshape(shape) * weights * size.prod(axis=1)[:, None],
        values.reshape(*shape, -1),
    )
