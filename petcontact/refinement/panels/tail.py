"""The error of nodal values on each element from what its highest degree adds, in any dimension.

The Legendre tail: on an element of order p the part of degree p (on quadrilaterals along either
direction) of a function, that is what the best polynomial of order p - 1 leaves. It is an estimate
of the error from above where coefficients fall from degree to degree, and near kinks and roots of
p, where they hardly do, about the error itself.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...linalg.nearest import nearest, within
from ...mesh.basis import gauss, lagrange
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.panels import monomials, reference_nodes

MARGIN = (2.0, 0.7, 1.35, 1.8)
"""Factors of the tail of elements of order 0, 1, 2, and above, measured by scripts/verify_space."""
RIM = 2.0
"""Factor on elements at the rim of a part, where tractions may be infinite and coefficients fall
slowly."""
EDGE = (2.0, 0.9, 0.6, 1.4)
"""Factors of what the last two degrees add on elements at whose edge contact begins, by order. p is
a root √(x - c)₊ there: its highest coefficient alone vanishes for some c, where the error over it
is 37 (order 2) and 25 (order 3)."""
SINGULAR = 2.7
"""Factor of `rim_shares` for elements closed to the rim, measured: nodal values have errors,
too."""
POWER = 0.4
"""α of tractions r^-α at the rim of a part, in the plane."""
WEAKEST = 0.2
"""The least power that counts: where the strongest one is weaker, others beside it are no
smaller."""
STRIPS = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64)
"""d/H of `rim_shares`."""
BASED = 0.6
"""Mean over largest distance of a triangle's nodes from the rim, below which a side of it is there,
.37 to .5, not a corner alone, .7 to .8."""
SMALLER = 0.5
"""Area of an element over that of one at the rim beside it, up to which its slope is not that of p
there."""
NEXT = 0.05
"""Of the distance of an element's nearest node from the rim, by which others that are next to it
may be further away."""
FINE = 60
"""Points of the rule by which they are integrated."""
FADE = 0.02
"""Share of a part along its rim, and beside other places where tractions may be infinite, over
which errors fade out."""
PIECES = 4
"""Of the sides of elements, whose distance is that of the rim."""
TINY = 1e-300
"""Least square of a length."""
FEW = 6
"""Elements that carry pressure, below which its shape is not seen."""
SMOOTH = 0.5
"""Least cosine between the normals of neighbours on one smooth surface."""


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
    powers : (2,) floats
        α of tractions r^-α at the rim where it sticks, and where it slips, see `rim_powers`.
    """

    def __init__(
        self, mesh: BoundaryMesh, nodes: Index, powers: tuple[float, float] = (POWER, POWER)
    ) -> None:
        self._powers, self._x = powers, mesh.x[nodes]
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
        near, far = (
            each.reduceat(rim_at, start) if len(start) else rim_at
            for each in (np.minimum, np.maximum)
        )
        self._part = mesh.part[self._first]
        self._order, self._rim, count = (
            mesh.order[self._first],
            near < size,
            np.bincount(self._element),
        )
        triangle = count < (self._order + 1) ** (mesh.dim - 1)
        self._next_to_rim = rim_at <= (1.0 + NEXT) * near[self._element]
        self._based = triangle & ~(np.bincount(self._element, rim_at) > BASED * count * far)
        parts = np.bincount(mesh.node_part, mesh.weight)[mesh.part[self._first]] ** (
            1.0 / (mesh.dim - 1)
        )
        # a triangle is √2 times as high as a square of its area if its base is as long as that
        self._strip = np.log(FADE * parts / size / np.where(self._based, math.sqrt(2.0), 1.0))

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

    def of_contact(self, values: Array, opened: Mask, slips: Mask | None = None) -> Array:
        """As `of`, (m,), of tractions in a contact that is open at some nodes (m,), and slips at
        others.

        Elements that are open in part have the edge of contact in them, see EDGE. Of those that are
        closed up to the rim of the part, see `rim_shares`, the nodes next to it tell which of the
        two powers is theirs; a fall of p towards the rim, seen on the elements beside, may hide its
        rise there from linear ones.
        """
        margin, stuck, slipping, edge, nodes = self._of_contact
        count = np.bincount(self._element, opened)
        held = self._next_to_rim if slips is None else self._next_to_rim & ~slips
        closed = np.where(np.bincount(self._element, held) > 0.0, stuck, slipping)
        tails, cut = self.left(values, 1), (count > 0.0) & (count < nodes)
        bent = np.maximum(tails, self.left(values - self._steady @ values, 1))
        smooth = np.where(count == 0.0, closed * bent, margin * tails)
        return np.asarray(
            (np.where(cut, edge * self.left(values, 2), smooth) if cut.any() else smooth)[
                self._element
            ]
        )

    @property
    def based_squares(self) -> Array:
        """Squares (n_elements,) of what triangles with a side on the rim miss of a power, over
        squares that are as large."""
        shares = [
            [rim_shares(p, POWER, based)[0] for p in range(len(MARGIN))] for based in (False, True)
        ]
        more = 2.0 * (np.array(shares[1]) / shares[0]) ** 2
        return np.where(
            self._based & self._rim, more[np.minimum(self._order, len(MARGIN) - 1)], 1.0
        )

    @cached_property
    def _steady(self) -> scipy.sparse.csr_array:
        """Nodal values (m, c) to what the slope on the nearest element off the rim is on linear
        ones at it, (m, c).

        That of a much smaller element says nothing: over more than its own size it is that of its
        errors.
        """
        count = np.bincount(self._element)
        start = np.cumsum(count) - count
        middle = np.add.reduceat(self._x, start) / count[:, None] if len(start) else self._x
        rows, columns, entries = (
            [np.empty(0, dtype=np.int64)],
            [np.empty(0, dtype=np.int64)],
            [np.empty(0)],
        )
        for part in np.unique(self._part):
            mine = self._part == part
            at, others = (
                np.flatnonzero(mine & each)
                for each in (self._rim & (self._order == 1), ~self._rim & (self._order > 0))
            )
            if not (len(at) and len(others)):
                continue
            beside = others[nearest(middle[others], middle[at], 1)[1][:, 0]]
            for sizes in np.unique(np.stack([count[at], count[beside]]), axis=1).T:
                k = np.flatnonzero((count[at] == sizes[0]) & (count[beside] == sizes[1]))
                to, of = (
                    start[each[k], None] + np.arange(size)
                    for each, size in zip((at, beside), sizes, strict=True)
                )
                away = self._x[to] - middle[at[k], None]
                known = (self._area[beside[k]] > SMALLER * self._area[at[k]])[:, None, None]
                slope = known * (
                    away @ np.linalg.pinv(self._x[of] - middle[beside[k], None], rcond=1e-6)
                )
                rows.append(np.repeat(to, sizes[1], axis=1).ravel())
                columns.append(np.repeat(of[:, None], sizes[0], axis=1).ravel())
                entries.append(slope.ravel())
        triples = np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))
        return scipy.sparse.csr_array(
            scipy.sparse.coo_array(triples, shape=(len(self._x), len(self._x)))
        )

    def of_shear(
        self, sigma_t: Array, pressure: Array, pressure_error: Array, opened: Mask, slips: Mask
    ) -> Array:
        """Estimated error (m,) of q: `of_contact`, but on elements at the rim that slip in part the
        tail of its kink, and the share q/p of what p lacks there, which alone has the singularity
        of the rim.
        """
        error, count = self.of_contact(sigma_t, opened, slips), np.bincount(self._element, slips)
        kinked = (
            self._rim
            & (count > 0.0)
            & (count < self._of_contact[-1])
            & (np.bincount(self._element, opened) == 0.0)
        )
        if not kinked.any():
            return error
        size = np.linalg.norm(sigma_t, axis=1)
        q, p = (
            np.bincount(self._element, self._weight * slips * each) for each in (size, pressure)
        )
        share = np.divide(q, p, out=np.zeros(len(p)), where=p > 0.0)[self._element]
        smooth = (self._of_contact[0] * self.left(sigma_t, 1))[self._element]
        return np.where(kinked[self._element], np.hypot(smooth, share * pressure_error), error)

    @cached_property
    def _of_contact(self) -> tuple[Array, Array, Array, Array, Index]:
        """Factors of elements that are open, closed and stick, closed and slip, open in part, and
        their numbers of nodes."""
        margin, strips = self._by_order(MARGIN), np.log(STRIPS)
        order, rim = np.minimum(self._order, len(MARGIN) - 1), self._rim
        stuck, slipping = np.tile(margin, (2, 1))
        for closed, power in zip((stuck, slipping), self._powers, strict=True):
            for p, based in np.unique(np.stack([order, self._based])[:, rim], axis=1).T.tolist():
                mine = rim & (order == p) & (self._based == based)
                share = np.interp(
                    self._strip[mine], strips, rim_shares(p, round(power, 2), bool(based))
                )
                closed[mine] = np.maximum(margin[mine], SINGULAR * share)
        return margin, stuck, slipping, self._by_order(EDGE), np.bincount(self._element)

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

    def of_pressure(self, pressure: Array, opened: Mask, slips: Mask | None = None) -> Array:
        """Estimated error (m,) of p: `of_contact`, and no less than a share of p where a contact
        that ends on the part covers few (`FEW`) elements: all of it on one, a half on three.

        What no element resolves has no tail: a spot inside of one element of order 1 may have one p
        at all of its nodes.
        """
        error, element = self.of_contact(pressure[:, None], opened, slips), self._element
        loaded = np.count_nonzero(np.bincount(element[pressure > 0.0]))
        if opened.any() and 0 < loaded < FEW:
            total = np.bincount(element, self._weight * pressure**2)[element]
            mean = np.sqrt(total / np.bincount(element, self._weight)[element])
            return np.maximum(error, min(1.0, 1.5 / loaded) * mean)
        return error


@functools.cache
def rim_shares(order: int, power: float, triangle: bool = False) -> Array:
    """Error over tail of the interpolation of x^-power by the nodes of an element, by `STRIPS`,
    (7,); 1.5 for order 0.

    Of the Gauss points of (0, H), and of squares on one of their sides, or of a triangle of height
    H on one of its sides: more of that one is where the function is infinite. Both are weighted by
    min(1, x/d)²: what is infinite at a rim costs the more the narrower the strip is in which it is
    left out.

    Examples
    --------
    >>> last = lambda power, triangle: round(float(rim_shares(2, power, triangle)[2]), 2)
    >>> [[last(power, triangle) for power in (0.2, 0.4)] for triangle in (False, True)]
    [[0.9, 1.16], [1.11, 1.42]]
    """
    power = max(power, WEAKEST)
    if order == 0:
        return np.full(len(STRIPS), 1.5)
    (at, weight), (even, each) = (
        (0.5 + 0.5 * points, 0.5 * weights) for points, weights in map(gauss, (order, FINE))
    )
    fine, each = even**6, 6.0 * even**5 * each  # dense where the function is infinite
    x, basis, lower = at, lagrange(order, 2.0 * fine - 1.0), np.vander(at, order)
    if triangle:
        nodes, exponents = reference_nodes(3, order)
        x, smaller = nodes[:, 1], reference_nodes(3, order - 1)[1]
        points = np.stack(
            [np.outer(even, 1.0 - fine), np.broadcast_to(fine, (FINE + 1, FINE + 1))], axis=-1
        ).reshape(-1, 2)
        each = np.outer(0.5 * gauss(FINE)[1], each * (1.0 - fine)).ravel()
        basis = np.linalg.solve(monomials(nodes, exponents).T, monomials(points, exponents).T)
        fine, weight, lower = points[:, 1], basis @ each, monomials(nodes, smaller)
    missed = (x**-power @ basis - fine**-power) ** 2
    lower = np.linalg.qr(np.sqrt(weight)[:, None] * lower)[0]
    root = np.sqrt(weight) * x**-power
    left = np.sum((root - lower @ (lower.T @ root)) ** 2)
    mean = [(weight @ np.minimum(1.0, x / d) ** 2) / weight.sum() for d in STRIPS]
    ratios = [
        (each * np.minimum(1.0, fine / d) ** 2) @ missed / share
        for d, share in zip(STRIPS, mean, strict=True)
    ]
    return np.asarray(np.sqrt(np.array(ratios) / left))


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
