"""The surrogate T of an elastic layer, symmetric, positive and known in closed form on every
contact part.

Consider a layer of thickness H on a rigid base. Shear traction on its surface moves that surface by
Tσ, with the kernel T(x, s) = -2(1-ν²)/(πE) · ln tanh(π|x-s|/(4H)); x and s are arc lengths. At
short distance it is Kelvin's logarithm on a half plane; at long distance it decays as for the
layer. The eigenvalues of T⁻¹S are in about [0.8, 1.8] on any mesh. Therefore T⁻¹ can replace ρ, and
I + ρT preconditions I + ρS. Pressure moves a half plane as shear does, so that T serves both
directions. For two bodies T is the sum of their layers.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Index, Mask, ranked
from ...bem.kelvin2d.moments import powers
from ...bem.operators import BoundaryOperators
from ...geometry.arcs import cross
from ...mesh.basis import gauss, product_weights
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...record import record
from ...round_off import TINY, WRITTEN

FAR_POINTS, NEAR_POINTS = 4, 12
"""Numbers of Gauss points in addition to the order of an element: for the kernel at distant points,
and for its smooth part at near ones."""


@record
class Strip:
    """A stretch of contact nodes, coupled to each other by the kernel of a layer.

    Attributes
    ----------
    nodes : (k,) array
        Places among the contact nodes.
    start, length, order : (n,) arrays
        Arc length at the start of each element, its length [length], and its order.
    closed : float
        Length of the loop if the part is closed, else 0 [length]. Distances along a loop are the
        shorter ones.
    layers : tuple of (float, float)
        2(1-ν²)/(πE) [1/stress], see `Kernel.half_space_compliance`, and H [length] of each body
        on which the tractions act.
    ends : (float, float)
        Signs of the reflections at the start and the end. The sign is +1 if the adjacent side is
        free to move in the direction of the tractions, and -1 if its displacement is known.
    component : int
        Component of the contact vectors: the direction of the tractions.
    """

    nodes: Index
    start: Array
    length: Array
    order: Index
    closed: float
    layers: tuple[tuple[float, float], ...]
    ends: tuple[float, float] = (1.0, 1.0)
    component: int = 0

    @functools.cached_property
    def element(self) -> Index:
        """The element of each node, (k,)."""
        return np.repeat(np.arange(len(self.order)), self.order + 1)

    @functools.cached_property
    def first(self) -> Index:
        """The first node of each element, (n,)."""
        return np.concatenate([[0], np.cumsum(self.order + 1)[:-1]])

    @functools.cached_property
    def positions(self) -> Array:
        """Arc length of each node, (k,) [length]."""
        xi = np.empty(len(self.element))
        for order in np.unique(self.order):
            chosen = self.order[self.element] == order
            xi[chosen] = np.tile(gauss(int(order))[0], np.count_nonzero(self.order == order))
        return np.asarray(self.start[self.element] + 0.5 * (1.0 + xi) * self.length[self.element])

    @property
    def uniform(self) -> bool:
        """Whether all elements are equal, so that T is a convolution from element to element."""
        return bool(np.ptp(self.length) <= WRITTEN * self.length[0] and np.ptp(self.order) == 0)


def strips(
    operators: BoundaryOperators,
    nodes: Index,
    directions: Array,
    others: tuple[tuple[float, float], ...] = (),
) -> Iterator[Strip]:
    """Return one strip for each direction and each smooth stretch of contact elements.

    A stretch may extend over several parts.

    Parameters
    ----------
    operators : BoundaryOperators
    nodes : (m,) array
        Contact nodes, increasing.
    directions : (m, k, d) array
        Directions of the tractions at each node.
    others : tuple of (float, float)
        Layers of other bodies on which the same tractions act.
    """
    mesh = as_curve(operators.mesh)
    for elements in smooth_stretches(mesh, nodes):
        owner, local = ranked(mesh.order[elements] + 1)
        node_positions = np.searchsorted(nodes, mesh.first_node[elements][owner] + local)
        first, last = elements[0], elements[-1]
        length = mesh.length[elements]
        closed = float(length.sum()) if _meet(mesh, elements[-1:], elements[:1])[0] else 0.0
        start = np.concatenate([[0.0], np.cumsum(length)[:-1]])
        layers = (
            (operators.kernel.half_space_compliance, body_thickness(mesh, nodes[node_positions])),
            *others,
        )
        for c in range(directions.shape[1]):
            ends = (
                _reflection(
                    operators, mesh.end, mesh.start[first], directions[node_positions[0], c]
                ),
                _reflection(
                    operators, mesh.start, mesh.end[last], directions[node_positions[-1], c]
                ),
            )
            yield Strip(
                node_positions, start, length, mesh.order[elements], closed, layers, ends, c
            )


def smooth_stretches(mesh: CurveMesh, nodes: Index) -> list[Index]:
    """Return the elements of some nodes as stretches without corners, in order along the
    outline."""
    elements = np.unique(mesh.element[nodes])
    runs = np.split(elements, np.flatnonzero(~_meet(mesh, elements[:-1], elements[1:])) + 1)
    if len(runs) > 1 and _meet(mesh, runs[-1][-1:], runs[0][:1])[0]:
        # the outline begins inside a stretch
        runs = [np.concatenate([runs[-1], runs[0]]), *runs[1:-1]]
    return runs


def _meet(mesh: CurveMesh, first: Index, second: Index) -> Mask:
    """Return whether each element ends where the other begins, in about the same direction."""
    gap = np.hypot(*(mesh.end[first] - mesh.start[second]).T)
    turn = np.sum(
        mesh.normal[mesh.first_node[first + 1] - 1] * mesh.normal[mesh.first_node[second]], axis=1
    )
    # neighbours belong to one stretch where their normals turn by less
    return np.asarray((gap <= WRITTEN * mesh.length[first]) & (turn > 0.8))


def _reflection(
    operators: BoundaryOperators, points: Array, corner: Array, direction: Array
) -> float:
    """Return -1 if the element next to a corner has a known displacement in this direction, else 1.

    `points` are the starts or the ends of all elements.
    """
    neighbour = int(np.argmin(np.sum((points - corner) ** 2, axis=1)))
    node = int(operators.mesh.first_node[neighbour])
    held = ~operators.data.traction_known[node]
    return -1.0 if float(held @ (operators.data.frame[node] @ direction) ** 2) > 0.5 else 1.0


def body_thickness(mesh: CurveMesh, nodes: Index) -> float:
    """Return the distance through the body along inward normals, the median of a few rays
    [length]."""
    chosen = nodes[np.unique(np.linspace(0, len(nodes) - 1, 32).astype(int))]
    distances = np.array([_thickness_at(mesh, int(node)) for node in chosen])
    distances = distances[np.isfinite(distances)]
    extent = float(np.ptp(mesh.x, axis=0).max())
    return float(np.median(distances)) if len(distances) else extent


def _thickness_at(mesh: CurveMesh, node: int) -> float:
    """Return the distance along a node's inward normal to the next element [length].

    It is infinite if there is none.
    """
    direction, offset, ray = mesh.end - mesh.start, mesh.start - mesh.x[node], -mesh.normal[node]
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = cross(ray, direction)
        along, where = cross(offset, direction) / determinant, cross(offset, ray) / determinant
    own = mesh.element[node]
    hit = (along > 1e-6 * mesh.length[own]) & (where >= 0.0) & (where <= 1.0)
    hit[own] = False
    return float(along[hit].min(initial=np.inf))


def layer_matrix(strip: Strip, rows: Index | None = None, columns: Index | None = None) -> Array:
    """Return T of one strip by collocation, (k, k) or the given entries [length/stress].

    An open strip is reflected at its ends, because S is softer next to a free side than in a long
    layer.

    Parameters
    ----------
    strip : Strip
    rows, columns : arrays, optional
        Nodes of the strip (numbers from 0); all by default.
    """
    targets = strip.positions if rows is None else strip.positions[rows]
    complete = columns is None or len(columns) == len(strip.nodes)
    wanted = np.arange(len(strip.order)) if complete else np.unique(strip.element[columns])
    first = np.concatenate([[0], np.cumsum(strip.order[wanted] + 1)])
    matrix = np.zeros((len(targets), first[-1]))
    for order in np.unique(strip.order[wanted]):
        group = np.flatnonzero(strip.order[wanted] == order)
        slots = (first[group][:, None] + np.arange(order + 1)).ravel()
        for half_space, thickness in strip.layers:
            values = _columns(strip, thickness, int(order), wanted[group], targets)
            for sign, images_ in images(strip, thickness, targets):
                values += sign * _columns(strip, thickness, int(order), wanted[group], images_)
            matrix[:, slots] -= half_space * values.reshape(len(targets), -1)
    if complete:
        return matrix
    element = strip.element[columns]
    return matrix[:, first[np.searchsorted(wanted, element)] + columns - strip.first[element]]


def images(strip: Strip, thickness: float, targets: Array) -> list[tuple[float, Array]]:
    """Return the signs and the places of the reflections of targets.

    There is one at each end, and more if an end of a short strip is fixed. Reflections of one sign
    keep T positive in any number. Those at a fixed end do so only together.
    """
    if strip.closed:
        return []
    (first, last), origin = strip.ends, strip.start[0]
    length = strip.start[-1] + strip.length[-1] - origin
    x = targets - origin
    count = 0 if first == last == 1.0 else int(np.clip(np.ceil(2.0 * thickness / length), 1, 20))
    mirrored = range(min(-count + 1, 0), max(count, 1) + 1)
    reflections = [
        (first * (first * last) ** (k % 2), origin + 2 * k * length - x) for k in mirrored
    ]
    moved = [k for k in range(-count, count + 1) if k]
    return reflections + [((first * last) ** (k % 2), origin + 2 * k * length + x) for k in moved]


def _columns(strip: Strip, thickness: float, order: int, elements: Index, targets: Array) -> Array:
    """Return ∫ L_b ln tanh(π d/(4H)) over elements of one order, (targets, elements, p+1)."""
    half = 0.5 * strip.length[elements]
    offset = targets[:, None] - (strip.start[elements] + half)
    if strip.closed:
        offset -= strip.closed * np.rint(offset / strip.closed)
    rate = 0.25 * np.pi / thickness
    # ln tanh(ad) = ln d + a smooth function whose nearest singularity is 2iH away: long elements
    # take more points
    more = 4 * int(min(half.max() / thickness, 16.0))
    x = offset / half
    # within four half-lengths in closed form, whose recursion loses digits further out
    near = np.abs(x) < 4.0
    s, product = product_weights(order, order + FAR_POINTS + more)
    distance = _short_way(np.abs(offset[:, :, None] - half[:, None] * s), strip.closed)
    result = np.log(np.tanh(rate * np.maximum(distance, TINY))) @ product.T
    s, product = product_weights(order, order + NEAR_POINTS + more)
    width = np.broadcast_to(half, offset.shape)[near]
    distance = np.maximum(np.abs(offset[near][:, None] - width[:, None] * s), TINY)
    smooth = (
        np.log(np.tanh(rate * _short_way(distance, strip.closed)) / (rate * distance)) @ product.T
    )
    on_line = x[near]
    logarithm, _ = powers(
        order,
        on_line + 1.0,
        on_line - 1.0,
        np.zeros(len(on_line)),
        np.ones(len(on_line), dtype=bool),
        1,
    )
    result[near] = smooth + logarithm.T + np.log(rate * width)[:, None] * product.sum(axis=1)
    return np.asarray(result * half[:, None])


def _short_way(distance: Array, closed: float) -> Array:
    return np.minimum(distance, closed - distance) if closed else distance
