"""Functions on a part of a mesh: polynomials on its elements, and what these leave of them, by
samples that are finer than the nodes, and the finer where two samplings differ."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Hashable
from typing import Any

import numpy as np
import scipy

from ..arrays import Array, Index
from ..frozen import frozen
from .boundary_mesh import BoundaryMesh
from .pairs.ray_casting import Faces

WITHIN = 1.0 - 2e-7
"""Part of a cell that its points span. A function that jumps where an element ends has the value of
the element there, and not that of its neighbour; coordinates have the digits for it."""
POINTS = 0.5 + WITHIN * np.sqrt(0.05) * np.array([-math.sqrt(5.0), -1.0, 1.0, math.sqrt(5.0)])
WEIGHTS = np.array([1.0, 5.0, 5.0, 1.0]) / 12.0
"""Lobatto's rule along each direction of a cell, its ends among the points: a jump that lies close
to an end is between two of them."""
ACROSS = 24
"""Cells across a part, at least, before any is cut."""
ENOUGH = 2e-3
"""Sum of the differences of two samplings over the integral of the function that is enough; they
are differences of the coarser one, and of opposite signs along a jump."""
MOST = 8000
"""Cells that are cut at once; more of them are a function that is rough everywhere."""
NUDGE = 1e-5
"""Share of a face over which its tangents are differences: their errors are 1e-10."""
WHOLE, EACH = 1e-3, 5e-2
"""Integral of a function that its values at the nodes may miss, over that of its size, on a part,
and summed up over elements: a tenth of the errors that are asked for by default, and what moves
within elements with loads as smooth as these have."""

Function = Callable[[Index, Array, Array, Array], Array]
"""Values (q, c) at places of elements, with their points and normals (q, d)."""


@frozen
class Samples:
    """Quadrature points on a part, and the values of a function there.

    Attributes
    ----------
    mesh : BoundaryMesh
    element : (q,) array
    place : (q,) or (q, 2) array
        As `Hits` has them.
    weight : (q,) array
        [length, in space area]
    values : (q, c) array
    """

    mesh: BoundaryMesh
    element: Index
    place: Array
    weight: Array
    values: Array

    @functools.cached_property
    def basis(self) -> scipy.sparse.csr_array:
        """Values at all nodes of the mesh to values at the points, (q, n)."""
        return scipy.sparse.csr_array(self.mesh.basis_at(self.element, self.place))

    def over_elements(self, values: Array) -> Array:
        """Integrals of values (q,) over each element of the mesh, (n_elements,)."""
        found = np.bincount(self.element, self.weight * values, self.mesh.n_elements)
        return np.asarray(found, dtype=float)

    def norms(self, values: Array) -> Array:
        """Of values (q,) in L2 over each element, (n_elements,)."""
        return np.sqrt(self.over_elements(values**2))

    def around_mean(self, values: Array) -> Array:
        """Values (q,) less their means over each element."""
        area = self.over_elements(np.ones(len(values)))
        mean = self.over_elements(values) / np.where(area > 0.0, area, 1.0)
        return np.asarray(values - mean[self.element])

    def left(self, nodal: Array) -> Array:
        """What polynomials through values (n, c) at all nodes leave, (q, c)."""
        return np.asarray(self.values - self.basis @ nodal)

    def share(self, values: Array, others: Array) -> float:
        """Integral of the size of values (q, c) over that of others, 0 where these vanish."""
        one, other = (self.weight @ np.linalg.norm(each, axis=1) for each in (values, others))
        return float(one / other) if other > 0.0 else 0.0

    def projected(self, nodes: Index) -> Array:
        """Values (m, c) at the nodes of the part of the polynomials that are nearest in L2: their
        integrals are those of the function."""
        basis = self.basis[:, nodes]
        weighted = basis.T.multiply(self.weight).tocsr()
        found = scipy.sparse.linalg.spsolve((weighted @ basis).tocsc(), weighted @ self.values)
        return np.asarray(found).reshape(len(nodes), -1)

    def misses(self, nodal: Array) -> bool:
        """Whether integrals of the polynomials through nodal values (n, c) miss those of the
        function."""
        left = self.left(nodal)
        lost = np.stack([self.over_elements(column) for column in left.T])
        size = float(self.weight @ np.linalg.norm(self.values, axis=1))
        whole, each = np.linalg.norm(lost.sum(axis=1)), np.linalg.norm(lost, axis=0).sum()
        return bool(whole > WHOLE * size or each > EACH * size)

    def rough(self, values: Array) -> Array:
        """What polynomials of the degrees of the elements leave of values (q, c) at the points."""
        result, local = np.zeros_like(values), self.place.reshape(len(self.place), -1)
        order = np.argsort(self.element, kind="stable")
        for mine in np.split(order, np.flatnonzero(np.diff(self.element[order])) + 1):
            degree = int(self.mesh.order[self.element[mine[0]]])
            at = local[mine] - local[mine].mean(axis=0)
            at /= np.abs(at).max()
            powers = itertools.product(range(degree + 1), repeat=at.shape[1])
            columns = [np.prod(at**power, axis=1) for power in powers if sum(power) <= degree]
            root = np.sqrt(self.weight[mine])[:, None]
            basis = np.column_stack(columns)
            found = np.linalg.lstsq(root * basis, root * values[mine], rcond=None)[0]
            result[mine] = values[mine] - basis @ found
        return result


def sampled(mesh: BoundaryMesh, part: str, function: Function, name: Hashable) -> Samples:
    """Samples of a function on a part: cells of its elements, cut in halves where the integral of
    the function, or of its square, differs from that over the halves.

    Parameters
    ----------
    mesh : BoundaryMesh
    part : str
    function : callable
        See `Function`.
    name : hashable
        Of the function on this part: a mesh knows its samples.
    """
    samples: Samples | None = mesh.functions.get((part, name))
    if samples is None:
        samples = mesh.functions[part, name] = _sampled(mesh, part, function)
    return samples


def _sampled(mesh: BoundaryMesh, part: str, function: Function) -> Samples:
    elements, faces = mesh.faces(part)
    rule = functools.partial(_rule, mesh, faces, elements, function)
    cells, done = _first(len(elements), mesh.dim - 1, rule), list[Cells]()
    scale = math.sqrt(cells.integrals[:, -1].sum() / cells.weight.sum()) or 1.0
    # a cell is halved 14 times along each direction
    for _ in range(14 * (mesh.dim - 1)):
        halves, error = _halved(cells, rule, scale)
        enough = ENOUGH * float(sum(each.integrals[:, -2].sum() for each in (*done, halves)))
        cut = error > 0.25 * enough / len(error)
        if error.sum() <= enough or cut.sum() > MOST:
            cut[:] = False
        done.append(halves.take(np.repeat(~cut, 2)))
        cells = halves.take(np.repeat(cut, 2))
        if not len(cells.number):
            break
    return Cells.joined([*done, cells]).samples(mesh, elements)


def _first(count: int, d: int, rule: Callable[..., Any]) -> Cells:
    """Of so many elements, `ACROSS` of all of them."""
    across = max(1, math.ceil(ACROSS / count ** (1.0 / d)))
    grid = np.array(list(itertools.product(range(across), repeat=d))) / across
    low, number = np.tile(grid, (count, 1)), np.repeat(np.arange(count), len(grid))
    size = np.full_like(low, 1.0 / across)
    return Cells(number, low, size, *rule(number, low, size))


def approximated(samples: Samples, nodes: Index, nodal: Array) -> Array:
    """Values (m, c) at the nodes of a part that stand for a function: its own where their integrals
    are those of the function, else those of the nearest polynomials.

    Parameters
    ----------
    samples : Samples
        Of the function.
    nodes : (m,) array
        Of the part.
    nodal : (m, c) array
        The function there.
    """
    every = np.zeros((samples.mesh.n_nodes, nodal.shape[1]))
    every[nodes] = nodal
    return samples.projected(nodes) if samples.misses(every) else nodal


@frozen
class Cells:
    """Boxes of the shares of faces, and a function at points of each.

    Attributes
    ----------
    number : (k,) array
        Of the face.
    low, size : (k, d-1) arrays
        Least shares, and how far the cell reaches.
    place, weight, values : (k, q) arrays and more
        Of the points.
    """

    number: Index
    low: Array
    size: Array
    place: Array
    weight: Array
    values: Array

    def take(self, chosen: Any) -> Cells:
        """Some of the cells."""
        return Cells(*(getattr(self, key)[chosen] for key in Cells.__annotations__))

    @staticmethod
    def joined(every: list[Cells]) -> Cells:
        """The cells of some lists."""
        keys = Cells.__annotations__
        return Cells(*(np.concatenate([getattr(each, key) for each in every]) for key in keys))

    def samples(self, mesh: BoundaryMesh, elements: Index) -> Samples:
        """All points, `elements` the numbers of the faces in their mesh."""
        count, points = self.weight.shape
        place, values = (
            each.reshape(count * points, *each.shape[2:]) for each in (self.place, self.values)
        )
        element = np.repeat(elements[self.number], points)
        return Samples(mesh, element, place, self.weight.ravel(), values)

    @property
    def integrals(self) -> Array:
        """Of the function, its size and its square, (k, c + 2)."""
        size = np.linalg.norm(self.values, axis=2)[..., None]
        every = np.concatenate([self.values, size, size**2], axis=2)
        return np.asarray(np.einsum("kq,kqc->kc", self.weight, every))


def _halved(cells: Cells, rule: Callable[..., Any], scale: float) -> tuple[Cells, Array]:
    """Halves of cells (2k,) along the direction in which their integrals differ most, and by how
    much (k,)."""
    ways, errors, count = list[Cells](), list[Array](), len(cells.number)
    for axis in range(cells.low.shape[1]):
        size, low = cells.size.repeat(2, axis=0), cells.low.repeat(2, axis=0)
        number = cells.number.repeat(2)
        size[:, axis] *= 0.5
        low[1::2, axis] += size[1::2, axis]
        ways.append(Cells(number, low, size, *rule(number, low, size)))
        apart = ways[-1].integrals.reshape(count, 2, -1).sum(axis=1) - cells.integrals
        errors.append(
            np.maximum(np.linalg.norm(apart[:, :-2], axis=1), np.abs(apart[:, -1]) / scale)
        )
    best = np.argmax(errors, axis=0)
    chosen = (2 * count * best[:, None] + 2 * np.arange(count)[:, None] + [0, 1]).ravel()
    return Cells.joined(ways).take(chosen), np.max(errors, axis=0)


def _rule(
    mesh: BoundaryMesh,
    faces: Faces,
    elements: Index,
    function: Function,
    number: Index,
    low: Array,
    size: Array,
) -> tuple[Array, Array, Array]:
    """Places, weights and values, (k, q) and more, at points of cells of faces."""
    d = low.shape[1]
    points = np.array(list(itertools.product(POINTS, repeat=d)))
    weights = np.array([np.prod(each) for each in itertools.product(WEIGHTS, repeat=d)])
    share = (low[:, None] + size[:, None] * points).reshape(-1, d)
    face = np.repeat(number, len(points))

    def at(share: Array) -> Array:
        return faces.at(face, faces.spread(face, share))[0]

    nudges = NUDGE * np.eye(d)
    along = np.stack([at(share + each) - at(share - each) for each in nudges], axis=1)
    area = np.sqrt(np.linalg.det(along @ along.transpose(0, 2, 1))) / (2.0 * NUDGE) ** d
    place = faces.spread(face, share)
    x, normal = faces.at(face, place)
    values, area = function(elements[face], place, x, normal), area * mesh.around(x)
    shape = len(number), len(points)
    return (
        place.reshape(*shape, *place.shape[1:]),
        area.reshape(shape) * weights * size.prod(axis=1)[:, None],
        values.reshape(*shape, -1),
    )
