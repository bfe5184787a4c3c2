"""Error estimates for nodal values from the highest degree on each element, in any dimension.

The Legendre tail of a function on an element of order p is its part of degree p, on quadrilaterals
in either direction. It is the error of the best polynomial of order p - 1. It overestimates the
error if coefficients fall from degree to degree. Near kinks and roots of p they hardly fall, and
the tail is about the error.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from ...linalg.nearest import Nearest, within
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.sag import SMOOTH
from ...round_off import TINY
from .edges import SMOOTH as BENT
from .sides import Sides

MARGIN = (2.0, 0.7, 1.35, 1.8)
"""Factors on the tail of elements of order 0, 1, 2 and above [-], measured by
scripts/verify_space."""
RIM = 2.0
"""Factor on elements at the rim of a part [-]. Tractions may be infinite there, so that
coefficients fall slowly."""
FADE = 0.02
"""Share of a part next to its rim, or next to other points with infinite tractions, over which
errors fade out [-]."""


class Tails:
    """Error estimates for nodal values on whole elements; the matrices of a mesh are computed once.

    Parameters
    ----------
    mesh : BoundaryMesh
    nodes : (m,) array
        Numbers of the nodes of whole elements, increasing.
    mirrors : sequence of str, optional
        Parts in planes of symmetry.
    """

    def __init__(self, mesh: BoundaryMesh, nodes: Index, mirrors: Sequence[str] = ()) -> None:
        self._mesh, self._nodes = mesh, nodes
        element = mesh.element[nodes]
        begins = np.diff(element, prepend=-1) != 0
        self._first, self._element = element[begins], np.cumsum(begins) - 1
        kind, order, self._weight = mesh.kind[element], mesh.order[element], mesh.weight[nodes]
        self._lower: list[tuple[Index, Index, list[Array]]] = []
        for number in np.unique(kind[order > 0]).tolist():
            members = np.flatnonzero(kind == number)
            lower = [mesh.lower_degree(number, less) for less in (1, 2)]
            root = np.sqrt(self._weight[members]).reshape(-1, len(lower[0]), 1)
            bases = (np.linalg.qr(root * basis)[0] for basis in lower)
            left = [
                (np.eye(root.shape[1]) - q @ q.transpose(0, 2, 1)) * root.transpose(0, 2, 1)
                for q in bases
            ]
            self._lower.append((members, self._element[members[:: root.shape[1]]], left))
        self._constant = np.flatnonzero(order == 0)
        self._near, self._slope = _slopes(mesh, nodes, self._constant)
        self._area = np.bincount(mesh.element, mesh.weight)[self._first]
        size, start = self._area ** (1.0 / (mesh.dim - 1)), np.flatnonzero(begins)
        rim_at = rim_distance(mesh, nodes, 2.0 * size[self._element], mirrors)
        near = np.minimum.reduceat(rim_at, start) if len(start) else rim_at
        self._order, self._rim = mesh.order[self._first], near < size

    def errors(self, values: Array, margin: Sequence[float] = MARGIN, rim: float = RIM) -> Array:
        """Return the estimated error of the polynomials through nodal values, rms over each
        element.

        Elements of order 0 have no lower degree. Their error is the slope from the nearest nodes,
        times the rms distance from the centre of a line or a square of their size.

        Parameters
        ----------
        values : (m, c) array
            Values of a vector.
        margin : sequence of float
            Factors on the tail of elements of order 0, 1, ...; the last one holds for all higher
            orders. The default is that of tractions.
        rim : float
            Further factor on elements at the rim of a part.

        Returns
        -------
        (m,) array
            Values at the nodes, constant on each element [as values]. The sum of their squares with
            the nodes' weights is the squared L2 error.
        """
        factors = np.array(margin)[np.minimum(self._order, len(margin) - 1)]
        return np.asarray(
            (factors * np.where(self._rim, rim, 1.0) * self.left(values, 1))[self._element]
        )

    def left(self, values: Array, less: int) -> Array:
        """Return the part of the last one or two degrees (`less`) of nodal values, rms over each
        element, (n_elements,)."""
        square = np.zeros(len(self._area))
        for members, element, left in self._lower:
            coefficients = left[less - 1] @ values[members].reshape(
                len(element), -1, values.shape[1]
            )
            square[element] = np.einsum("enc,enc->e", coefficients, coefficients)
        if len(self._constant):
            gradient = self._slope @ (values[self._near] - values[self._constant, None])
            square[self._element[self._constant]] = np.sum(gradient**2, axis=(1, 2))
        return np.asarray(np.sqrt(square / self._area))

    def pressure_errors(self, pressure: Array, opened: Mask, faced: Mask) -> Array:
        """Return the estimated error (m,) of p.

        It is `errors` and what p misses beyond sides at which contact ends. Where contact ends
        within an element p is a root, which no order above 2 follows better: the error is at least
        the last two degrees there, since the last one alone may vanish. `opened` are the open nodes
        (m,), `faced` those that face something.
        """
        element, missed = self._element, self._sides.missed_squares(pressure, ~opened, faced)
        ends = np.bincount(element, opened) * np.bincount(element, ~opened) > 0.0
        least = np.where(ends & (self._order > 2), self.left(pressure[:, None], 2), 0.0)
        error = np.maximum(self.errors(pressure[:, None]), least[element])
        error = np.hypot(error, np.sqrt(missed / self._area)[element])
        return np.asarray(error)

    @functools.cached_property
    def _sides(self) -> Sides:
        return Sides(self._mesh, self._nodes)


def rim_distance(
    mesh: BoundaryMesh,
    nodes: Index,
    reach: Array | float = np.inf,
    mirrors: Sequence[str] = (),
) -> Array:
    """Return the distance (m,) of nodes from the rims of their parts [length].

    A rim consists of sides of elements of other parts. The distance is infinite if no rim is within
    `reach`, a number or (m,) [length]. Curved sides count as chords of their pieces. A part that
    meets a plane of symmetry at a right angle goes on with its image, and has no rim there.
    """
    result, reach = np.empty(len(nodes)), np.broadcast_to(reach, len(nodes))
    part = mesh.node_part[nodes]
    for number in np.unique(part).tolist():
        members = np.flatnonzero(part == number)
        segments = rim_of(mesh, nodes[members], number, mirrors)
        result[members] = distances(segments, mesh.x[nodes[members]], reach[members])
    return result


def distances(segments: Array, x: Array, reach: Array) -> Array:
    """Return the distances (m,) of places (m, d) from the nearest of segments (n, 2, d) [length];
    infinite beyond a reach (m,)."""
    result = np.full(len(x), np.inf)
    middle = 0.5 * (segments[:, 0] + segments[:, 1])
    along = segments[:, 1] - segments[:, 0]
    half = 0.5 * np.linalg.norm(along, axis=1).max(initial=0.0)
    point, side = within(middle, x, reach + half)
    from_start, vector = x[point] - segments[side, 0], along[side]
    square = np.maximum(np.sum(vector**2, axis=1), TINY)
    share = np.clip(np.sum(from_start * vector, axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(from_start - share[:, None] * vector, axis=1)
    np.minimum.at(result, point, distance)
    return np.where(result <= reach, result, np.inf)


def rim_of(mesh: BoundaryMesh, nodes: Index, number: int, mirrors: Sequence[str]) -> Array:
    """Return the ends (n, 2, d) of pieces of sides of other parts than that of nodes.

    Those in a plane of symmetry count only where the nearest node says that the part meets the
    plane at another than a right angle.
    """
    # the surface of a whole body has no other part
    others = {name for k, name in enumerate(mesh.part_names) if k != number}
    result = [_pieces(mesh, sorted(others - {*mirrors}))]
    for name in sorted(others & {*mirrors}):
        pieces, plane = _pieces(mesh, [name]), mesh.normal[mesh.nodes_of(name)][:1]
        near = nodes[Nearest(mesh.x[nodes])(pieces.mean(axis=1))[:, 0]]
        corner = np.abs(mesh.normal[near] @ plane.T).max(axis=1, initial=0.0) > math.sin(BENT)
        result.append(pieces[corner])
    return np.concatenate(result)


def _pieces(mesh: BoundaryMesh, parts: Sequence[str]) -> Array:
    """Return the ends (n, 2, d) of straight pieces of the sides of elements of parts."""
    elements, faces = mesh.faces(*parts)
    if not len(elements):
        return np.empty((0, 2, mesh.dim))
    number, start, end = faces.rims()
    pieces = 4 if np.any(start != end) else 1  # in the plane sides are points
    points = [
        faces.at(number, start + share * (end - start))[0]
        for share in np.linspace(0.0, 1.0, pieces + 1)
    ]
    return np.concatenate([np.stack(pair, axis=1) for pair in itertools.pairwise(points)])


def _slopes(mesh: BoundaryMesh, nodes: Index, asked: Index) -> tuple[Index, Array]:
    """Return the nearest neighbours (q, k) of nodes on elements of order 0, and matrices (q, t, k).

    A matrix acts on the differences to the neighbours. The sum of squares of the product is the
    integral of the squared error over the element.
    """
    if not len(asked):
        return np.empty((0, 0), dtype=np.int64), np.empty((0, 0, 0))
    x, normal = mesh.x[nodes], mesh.normal[nodes]
    near = Nearest(x)(x[asked], 4 * mesh.dim - 5)
    smooth = (np.einsum("qkd,qd->qk", normal[near], normal[asked]) > SMOOTH)[..., None]
    along = (
        np.einsum("qkd,qtd->qkt", x[near] - x[asked, None], mesh.tangents(nodes[asked])) * smooth
    )
    weight = mesh.weight[nodes[asked]]
    size = weight ** (1.0 / (mesh.dim - 1)) * np.sqrt(weight / 12.0)
    return near, np.linalg.pinv(along, rcond=1e-6) * smooth.transpose(0, 2, 1) * size[:, None, None]
