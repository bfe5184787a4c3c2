"""The error of nodal values on each element from what its highest degree adds, in any dimension.

The Legendre tail: on an element of order p the part of degree p (on quadrilaterals along either direction) of a function,
that is what the best polynomial of order p - 1 leaves. It is an estimate of the error from above where coefficients fall
from degree to degree, and near kinks and roots of p, where they hardly do, about the error itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from ...linalg.nearest import nearest
from ...mesh.boundary_mesh import BoundaryMesh

MARGIN = (2.0, 0.7, 1.35, 1.8)
"""Factors of the tail of elements of order 0, 1, 2, and above, measured by scripts/verify_space."""
RIM = 2.0
"""Factor on elements at the rim of a part, where tractions may be infinite and coefficients fall slowly."""
FEW = 6
"""Elements that carry pressure, below which its shape is not seen."""
SMOOTH = 0.5
"""Least cosine between the normals of neighbours on one smooth surface."""


def tail(mesh: BoundaryMesh, nodes: Index, values: Array, margin: Sequence[float] = MARGIN, rim: float = RIM) -> Array:
    """Estimated error (m,) of the polynomials through nodal values: see `Tails`, and `Tails.of`."""
    return Tails(mesh, nodes, margin, rim).of(values)


class Tails:
    """What the error of nodal values on whole elements needs of the mesh, computed once.

    Parameters
    ----------
    mesh : BoundaryMesh
    nodes : (m,) array
        Numbers of the nodes of whole elements, increasing.
    margin : sequence of float
        Factors of the tail of elements of order 0, 1, ..., the last one of all above; by default those of tractions.
    rim : float
        Factor more on elements at the rim of a part.
    """

    def __init__(self, mesh: BoundaryMesh, nodes: Index, margin: Sequence[float] = MARGIN, rim: float = RIM) -> None:
        element = mesh.element[nodes]
        begins = np.diff(element, prepend=-1) != 0
        self._first, self._element = element[begins], np.cumsum(begins) - 1
        kind, order, self._weight = mesh.kind[element], mesh.order[element], mesh.weight[nodes]
        self._lower: list[tuple[Index, Array, Array]] = []
        for number in np.unique(kind[order > 0]).tolist():
            mine = np.flatnonzero(kind == number)
            lower = mesh.lower_degree(number)
            root = np.sqrt(self._weight[mine]).reshape(-1, len(lower), 1)
            self._lower.append((mine, root, np.linalg.qr(root * lower)[0]))
        self._constant = np.flatnonzero(order == 0)
        self._near, self._slope = _slopes(mesh, nodes, self._constant)
        area = np.bincount(mesh.element, mesh.weight)[self._first]
        size, start = area ** (1.0 / (mesh.dim - 1)), np.flatnonzero(begins)
        rim_at = rim_distance(mesh, nodes, float(size.max(initial=0.0)))
        near = np.minimum.reduceat(rim_at, start) if len(start) else rim_at
        factor = np.array(margin)[np.minimum(mesh.order[self._first], len(margin) - 1)]
        factor = np.where(near < size, rim * factor, factor)
        self._factor = factor / np.sqrt(area)

    def of(self, values: Array) -> Array:
        """Estimated error of the polynomials through nodal values, rms over each element.

        Elements of order 0 have no lower degree. Theirs is the slope that the nearest nodes suggest, times the rms distance
        from the middle of a line or a square of their size.

        Parameters
        ----------
        values : (m, c) array
            Of a vector.

        Returns
        -------
        (m,) array
            At the nodes, constant on each element: the sum of its squares with the weights of the nodes is the square of
            the error in L2 [as values].
        """
        square = np.zeros(len(values))
        for mine, root, q in self._lower:
            nodal = root * values[mine].reshape(*root.shape[:2], -1)
            left = nodal - q @ (q.transpose(0, 2, 1) @ nodal)
            square[mine] = np.sum(left**2, axis=2).ravel()
        if len(self._constant):
            gradient = self._slope @ (values[self._near] - values[self._constant, None])
            square[self._constant] = np.sum(gradient**2, axis=(1, 2))
        return np.asarray((self._factor * np.sqrt(np.bincount(self._element, square)))[self._element])

    def of_pressure(self, pressure: Array, opened: Mask) -> Array:
        """Estimated error (m,) of p: `of`, and no less than a share of p where a contact that ends on the part covers few
        (`FEW`) elements: all of it on one, a half on three.

        What no element resolves has no tail: a spot inside of one element of order 1 may have one p at all of its nodes.
        """
        error, element = self.of(pressure[:, None]), self._element
        loaded = np.count_nonzero(np.bincount(element[pressure > 0.0]))
        if opened.any() and 0 < loaded < FEW:
            total = np.bincount(element, self._weight * pressure**2)[element]
            mean = np.sqrt(total / np.bincount(element, self._weight)[element])
            return np.maximum(error, min(1.0, 1.5 / loaded) * mean)
        return error


def rim_distance(mesh: BoundaryMesh, nodes: Index, reach: float = np.inf) -> Array:
    """Distance (m,) from nodes to the nearest node of another part, infinite where there is none within reach [length]."""
    result, part = np.full(len(nodes), np.inf), mesh.node_part
    for number in np.unique(part[nodes]):
        others, mine = np.flatnonzero(part != number), part[nodes] == number
        if len(others):
            result[mine] = nearest(mesh.x[others], mesh.x[nodes[mine]], reach=reach)[0][:, 0]
    return result


def _slopes(mesh: BoundaryMesh, nodes: Index, asked: Index) -> tuple[Index, Array]:
    """Nearest neighbours (q, k) of some nodes, and what differences to them leave on their elements of order 0, (q, t, k).

    The sum of squares of the second times differences is the integral of the squared error over each element.
    """
    if not len(asked):
        return np.empty((0, 0), dtype=np.int64), np.empty((0, 0, 0))
    x, normal = mesh.x[nodes], mesh.normal[nodes]
    near = nearest(x, x[asked], min(4 * mesh.dim - 5, len(x)))[1]
    smooth = (np.einsum("qkd,qd->qk", normal[near], normal[asked]) > SMOOTH)[..., None]
    along = np.einsum("qkd,qtd->qkt", x[near] - x[asked, None], mesh.tangents(nodes[asked])) * smooth
    weight = mesh.weight[nodes[asked]]
    size = weight ** (1.0 / (mesh.dim - 1)) * np.sqrt(weight / 12.0)
    return near, np.linalg.pinv(along, rcond=1e-6) * smooth.transpose(0, 2, 1) * size[:, None, None]
