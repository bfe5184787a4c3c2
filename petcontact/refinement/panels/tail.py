"""The error of nodal values on each element from what its highest degree adds, in any dimension.

The Legendre tail: on an element of order p the part of degree p (on quadrilaterals along either
direction) of a function, that is what the best polynomial of order p - 1 leaves. It is an estimate
of the error from above where coefficients fall from degree to degree, and near kinks and roots of
p, where they hardly do, about the error itself.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from ...linalg.nearest import nearest, within
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.sag import SMOOTH

MARGIN = (2.0, 0.7, 1.35, 1.8)
"""Factors of the tail of elements of order 0, 1, 2, and above, measured by scripts/verify_space."""
RIM = 2.0
"""Factor on elements at the rim of a part, where tractions may be infinite and coefficients fall
slowly."""
FADE = 0.02
"""Share of a part along its rim, and beside other places where tractions may be infinite, over
which errors fade out."""
PIECES = 4
"""Of the sides of elements, whose distance is that of the rim."""
TINY = 1e-300
"""Least square of a length."""
FEW = 6
"""Elements that carry pressure, below which its shape is not seen."""


def tail(mesh: BoundaryMesh, nodes: Index, values: Array) -> Array:
    """Estimated error (m,) of the polynomials through nodal values: see `Tails`, and `Tails.of`."""
    return Tails(mesh, nodes).of(values)


class Tails:
    """What the error of nodal values on whole elements needs of the mesh, computed once.

    Parameters
    ----------
    mesh : BoundaryMesh
    nodes : (m,) array
        Numbers of the nodes of whole elements, increasing.
    """

    def __init__(self, mesh: BoundaryMesh, nodes: Index) -> None:
        element = mesh.element[nodes]
        begins = np.diff(element, prepend=-1) != 0
        self._first, self._element = element[begins], np.cumsum(begins) - 1
        kind, order, self._weight = mesh.kind[element], mesh.order[element], mesh.weight[nodes]
        self._lower: list[tuple[Index, Index, list[Array]]] = []
        for number in np.unique(kind[order > 0]).tolist():
            mine = np.flatnonzero(kind == number)
            lower = [mesh.lower_degree(number, less) for less in (1, 2)]
            root = np.sqrt(self._weight[mine]).reshape(-1, len(lower[0]), 1)
            bases = (np.linalg.qr(root * basis)[0] for basis in lower)
            left = [
                (np.eye(root.shape[1]) - q @ q.transpose(0, 2, 1)) * root.transpose(0, 2, 1)
                for q in bases
            ]
            self._lower.append((mine, self._element[mine[:: root.shape[1]]], left))
        self._constant = np.flatnonzero(order == 0)
        self._near, self._slope = _slopes(mesh, nodes, self._constant)
        self._area = np.bincount(mesh.element, mesh.weight)[self._first]
        size, start = self._area ** (1.0 / (mesh.dim - 1)), np.flatnonzero(begins)
        rim_at = rim_distance(mesh, nodes, 2.0 * size[self._element])
        near = np.minimum.reduceat(rim_at, start) if len(start) else rim_at
        self._order, self._rim = mesh.order[self._first], near < size

    def of(self, values: Array, margin: Sequence[float] = MARGIN, rim: float = RIM) -> Array:
        """Estimated error of the polynomials through nodal values, rms over each element.

        Elements of order 0 have no lower degree. Theirs is the slope that the nearest nodes
        suggest, times the rms distance from the middle of a line or a square of their size.

        Parameters
        ----------
        values : (m, c) array
            Of a vector.
        margin : sequence of float
            Factors of the tail of elements of order 0, 1, ..., the last one of all above; by
            default those of tractions.
        rim : float
            Factor more on elements at the rim of a part.

        Returns
        -------
        (m,) array
            At the nodes, constant on each element: the sum of its squares with the weights of the
            nodes is the square of the error in L2 [as values].
        """
        return np.asarray(
            (self._by_order(margin) * np.where(self._rim, rim, 1.0) * self.left(values, 1))[
                self._element
            ]
        )

    def _by_order(self, factors: Sequence[float]) -> Array:
        return np.asarray(np.array(factors)[np.minimum(self._order, len(factors) - 1)])

    def left(self, values: Array, less: int) -> Array:
        """What the last degree or the last two (`less`) add to nodal values, rms over each element,
        (n_elements,)."""
        square = np.zeros(len(self._area))
        for mine, element, left in self._lower:
            each = left[less - 1] @ values[mine].reshape(len(element), -1, values.shape[1])
            square[element] = np.einsum("enc,enc->e", each, each)
        if len(self._constant):
            gradient = self._slope @ (values[self._near] - values[self._constant, None])
            square[self._element[self._constant]] = np.sum(gradient**2, axis=(1, 2))
        return np.asarray(np.sqrt(square / self._area))

    def of_pressure(self, pressure: Array, opened: Mask) -> Array:
        """Estimated error (m,) of p: `of`, and no less than a share of p where a contact that ends
        on the part (open at some nodes, (m,)) covers few (`FEW`) elements: all of it on one, a half
        on three.

        What no element resolves has no tail: a spot inside of one element of order 1 may have one p
        at all of its nodes.
        """
        error, element = self.of(pressure[:, None]), self._element
        loaded = np.count_nonzero(np.bincount(element[pressure > 0.0]))
        if opened.any() and 0 < loaded < FEW:
            total = np.bincount(element, self._weight * pressure**2)[element]
            mean = np.sqrt(total / np.bincount(element, self._weight)[element])
            return np.maximum(error, min(1.0, 1.5 / loaded) * mean)
        return error


def rim_distance(mesh: BoundaryMesh, nodes: Index, reach: Array | float = np.inf) -> Array:
    """Distance (m,) from nodes to the rims of their parts, where sides of elements of other parts
    are.

    Infinite where there is none within reach, a number or (m,) [length]. Sides that curve count as
    chords of their pieces.
    """
    result, part, reach = (
        np.full(len(nodes), np.inf),
        mesh.node_part[nodes],
        np.broadcast_to(reach, len(nodes)),
    )
    for number in np.unique(part):
        # a closed part, as a disc, has no others
        others = _pieces(mesh, [name for k, name in enumerate(mesh.part_names) if k != number])
        mine = np.flatnonzero(part == number)
        middle, along, x = (
            0.5 * (others[:, 0] + others[:, 1]),
            others[:, 1] - others[:, 0],
            mesh.x[nodes[mine]],
        )
        half = 0.5 * np.linalg.norm(along, axis=1).max(initial=0.0)
        place, side = within(middle, x, reach[mine] + half)
        from_start, vector = x[place] - others[side, 0], along[side]
        square = np.maximum(np.sum(vector**2, axis=1), TINY)
        share = np.clip(np.sum(from_start * vector, axis=1) / square, 0.0, 1.0)
        distance = np.linalg.norm(from_start - share[:, None] * vector, axis=1)
        np.minimum.at(result, mine[place], distance)
    return np.where(result <= reach, result, np.inf)


def _pieces(mesh: BoundaryMesh, parts: Sequence[str]) -> Array:
    """Ends (n, 2, d) of straight pieces of the sides of the elements of parts."""
    elements, faces = mesh.faces(*parts)
    if not len(elements):
        return np.empty((0, 2, mesh.dim))
    number, start, end = faces.rims()
    pieces = PIECES if np.any(start != end) else 1  # in the plane sides are points
    points = [
        faces.at(number, start + share * (end - start))[0]
        for share in np.linspace(0.0, 1.0, pieces + 1)
    ]
    return np.concatenate([np.stack(pair, axis=1) for pair in itertools.pairwise(points)])


def _slopes(mesh: BoundaryMesh, nodes: Index, asked: Index) -> tuple[Index, Array]:
    """Nearest neighbours (q, k) of some nodes, and what differences to them leave on their elements
    of order 0, (q, t, k).

    The sum of squares of the second times differences is the integral of the squared error over
    each element.
    """
    if not len(asked):
        return np.empty((0, 0), dtype=np.int64), np.empty((0, 0, 0))
    x, normal = mesh.x[nodes], mesh.normal[nodes]
    near = nearest(x, x[asked], min(4 * mesh.dim - 5, len(x)))[1]
    smooth = (np.einsum("qkd,qd->qk", normal[near], normal[asked]) > SMOOTH)[..., None]
    along = (
        np.einsum("qkd,qtd->qkt", x[near] - x[asked, None], mesh.tangents(nodes[asked])) * smooth
    )
    weight = mesh.weight[nodes[asked]]
    size = weight ** (1.0 / (mesh.dim - 1)) * np.sqrt(weight / 12.0)
    return near, np.linalg.pinv(along, rcond=1e-6) * smooth.transpose(0, 2, 1) * size[:, None, None]
