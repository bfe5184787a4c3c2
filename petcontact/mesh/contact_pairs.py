"""Two parts that may touch: matching elements by projection, gap, directions, and the maps between their nodes.

A point x of the secondary faces the point of the primary that the line from x along the direction n meets (n: the
secondary's outward normal, or one that is given); conversely a point of the primary faces the foot of that line.
J = ds_A/ds_B is the ratio of arc lengths of the secondary and the primary there: t_B = -J t_A.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ..arrays import Array, Index, Mask
from ..geometry.outline import Outline
from .basis import lagrange
from .curve_mesh import CurveMesh, build_mesh
from .projection import Curves, Hits, cast, foot

SAME = 1e-9
"""Joints closer than this fraction of a side are one."""
CLOSE = 0.3
"""A joint of the secondary closer to one that the primary needs than this fraction of its elements gives way."""
GROWTH = 2.5
"""Ratio of neighbouring elements of the primary from where the secondary ends."""
NEAR = 0.1
"""Distance, over the length of the secondary, within which elements have to match."""
COINCIDE = 1e-7
"""Local coordinates that differ by less are one node."""


@dataclass
class SideMesh:
    """Joints of one side while meshes are being matched.

    Attributes
    ----------
    breaks : (n + 1,) array
        Fractions of the side, from 0 to 1.
    order : (n,) array
        Orders of its elements.
    """

    breaks: Array
    order: Index


def side_meshes(outline: Outline, mesh: CurveMesh) -> list[SideMesh]:
    """The joints of each side of a mesh of the outline."""
    result, first = [], 0
    for side in outline.sides:
        last = first + 1
        while not np.array_equal(mesh.end[last - 1], side.end):
            last += 1
        joints = np.concatenate([[0.0], np.cumsum(mesh.length[first:last])])
        result.append(SideMesh(joints / joints[-1], mesh.order[first:last]))
        first = last
    return result


def mesh_of_sides(outline: Outline, sides: Sequence[SideMesh]) -> CurveMesh:
    """The boundary mesh with these joints."""
    return build_mesh(outline, [side.breaks for side in sides], [side.order for side in sides])


@dataclass(frozen=True)
class PairSides:
    """The sides of two parts that face one another: numbers of body and sides, and the direction if it is given."""

    secondary: tuple[int, Index]
    primary: tuple[int, Index]
    direction: Array | None

    def to_primary(self, x: Array, normal: Array, primary: Curves) -> Hits:
        """Where points of the secondary meet the primary."""
        return cast(x, _along(self.direction, normal), primary)

    def to_secondary(self, x: Array, normal: Array, secondary: Curves) -> Hits:
        """Where points of the primary come from; the distance is from the secondary to the primary."""
        if self.direction is None:
            return foot(x, normal, secondary)
        return cast(x, -_along(self.direction, normal), secondary)


def _along(direction: Array | None, normal: Array) -> Array:
    if direction is None:
        return normal
    return np.broadcast_to(direction / np.hypot(*direction), normal.shape)


def sides_of(outline: Outline, numbers: Index) -> Curves:
    """Some sides of an outline."""
    sides = [outline.sides[k] for k in numbers]
    return Curves(
        np.array([s.start for s in sides]), np.array([s.end for s in sides]), np.array([s.curvature for s in sides])
    )


def match(outlines: Sequence[Outline], meshes: list[list[SideMesh]], pairs: Sequence[PairSides]) -> None:
    """Give the primaries the joints of their secondaries, in place; joints that a primary cannot do without go back."""
    imposed: dict[tuple[int, int], Array] = {}
    for _ in range(4):
        before = sum(map(len, imposed.values()))
        for pair in pairs:
            _carry_back(outlines, meshes, pair, imposed)
            _carry_over(outlines, meshes, pair, imposed)
        if sum(map(len, imposed.values())) == before:
            break
    for pair in pairs:
        _take_orders(outlines, meshes, pair)


def _joints(curves: Curves, sides: Sequence[SideMesh]) -> tuple[Array, Array]:
    """Points and normals at both ends of every element of some sides."""
    number = np.concatenate([np.full(len(s.breaks), k) for k, s in enumerate(sides)])
    return curves.at(number, np.concatenate([s.breaks for s in sides]))


def _carry_back(
    outlines: Sequence[Outline], meshes: list[list[SideMesh]], pair: PairSides, imposed: dict[tuple[int, int], Array]
) -> None:
    """Corners of the primary, and what other pairs impose on it, become joints of the secondary."""
    (a, a_sides), (b, b_sides) = pair.secondary, pair.primary
    own, other = sides_of(outlines[a], a_sides), sides_of(outlines[b], b_sides)
    for k, side in enumerate(b_sides):
        needed = np.union1d([0.0, 1.0], imposed.get((b, int(side)), np.empty(0)))
        hits = pair.to_secondary(*other.at(np.full(len(needed), k), needed), own)
        for number in np.unique(hits.curve[hits.curve >= 0]):
            target = int(a_sides[number])
            fraction = hits.fraction[hits.curve == number]
            key = (a, target)
            imposed[key] = _distinct(np.concatenate([imposed.get(key, np.empty(0)), fraction]))
            meshes[a][target] = _with_joints(meshes[a][target], imposed[key])


def _carry_over(
    outlines: Sequence[Outline], meshes: list[list[SideMesh]], pair: PairSides, imposed: dict[tuple[int, int], Array]
) -> None:
    """The joints of the secondary become those of the primary where they face one another."""
    (a, a_sides), (b, b_sides) = pair.secondary, pair.primary
    own, other = sides_of(outlines[a], a_sides), sides_of(outlines[b], b_sides)
    hits = pair.to_primary(*_joints(own, [meshes[a][k] for k in a_sides]), other)
    for k, side in enumerate(b_sides):
        key = (b, int(side))
        given = _distinct(np.concatenate([imposed.get(key, np.empty(0)), hits.fraction[hits.curve == k]]))
        if len(given) == 0:
            continue
        imposed[key] = given
        old = meshes[b][side]

        def faced(fraction: Array, k: int = k) -> Mask:
            return pair.to_secondary(*other.at(np.full(len(fraction), k), fraction), own).curve >= 0

        breaks = _distinct(np.concatenate([[0.0, 1.0], given]))
        kept = old.breaks[1:-1][~faced(old.breaks[1:-1])]
        breaks = _filled(breaks, kept, faced(0.5 * (breaks[1:] + breaks[:-1])))
        meshes[b][side] = SideMesh(breaks, _orders_at(old, breaks))


def _filled(breaks: Array, own: Array, faced: Mask) -> Array:
    """Stretches that nothing faces keep their own joints, graded from the size of the faced element beside them."""
    size = np.where(faced, np.diff(breaks), np.inf)
    pieces = [breaks]
    for k in np.flatnonzero(~faced):
        low, high = float(breaks[k]), float(breaks[k + 1])
        inner = own[(own > low) & (own < high)]
        largest = float(np.diff(np.concatenate([[low], inner, [high]])).max())
        up = _growing(float(size[k - 1]) if k > 0 else np.inf, high - low, largest)
        down = _growing(float(size[k + 1]) if k + 1 < len(size) else np.inf, high - low, largest)
        # own joints begin where elements are as large as theirs
        first = low + (1.5 * up[-1] if len(up) else 0.0)
        last = high - (1.5 * down[-1] if len(down) else 0.0)
        pieces += [low + up, high - down, inner[(inner > first) & (inner < last)]]
    return _distinct(np.concatenate(pieces))


def _growing(first: float, length: float, largest: float) -> Array:
    """Distances from an end at which elements that grow from the size `first` meet, in the nearer half of `length`."""
    steps, size, reach = list[float](), GROWTH * first, 0.0
    while size < 0.7 * largest and reach + size < 0.5 * length:
        reach += size
        steps.append(reach)
        size *= GROWTH
    return np.array(steps)


def _take_orders(outlines: Sequence[Outline], meshes: list[list[SideMesh]], pair: PairSides) -> None:
    """Elements of the primary take the order of the one that they face."""
    (a, a_sides), (b, b_sides) = pair.secondary, pair.primary
    own, other = sides_of(outlines[a], a_sides), sides_of(outlines[b], b_sides)
    for k, side in enumerate(b_sides):
        mesh = meshes[b][side]
        middle = 0.5 * (mesh.breaks[1:] + mesh.breaks[:-1])
        hits = pair.to_secondary(*other.at(np.full(len(middle), k), middle), own)
        order = mesh.order.copy()
        for j in np.flatnonzero(hits.curve >= 0):
            facing = meshes[a][a_sides[hits.curve[j]]]
            order[j] = _orders_at(facing, np.array([hits.fraction[j], hits.fraction[j]]))[0]
        meshes[b][side] = SideMesh(mesh.breaks, order)


def _distinct(fractions: Array) -> Array:
    """Increasing fractions without those that are one to round-off."""
    values: Array = np.unique(fractions)
    if len(values) == 0:
        return values
    values = values[np.append(True, np.diff(values) > SAME)]
    values[np.abs(values) <= SAME] = 0.0
    values[np.abs(values - 1.0) <= SAME] = 1.0
    return np.unique(values)


def _with_joints(side: SideMesh, needed: Array) -> SideMesh:
    """A side with further joints; its own give way where they are close, but not its ends."""
    old = side.breaks
    size = np.minimum(np.append(np.diff(old), np.inf), np.insert(np.diff(old), 0, np.inf))
    apart = np.abs(old[:, None] - needed[None]).min(axis=1) if len(needed) else np.full(len(old), np.inf)
    kept = old[(apart > CLOSE * size) | (old == 0.0) | (old == 1.0)]
    breaks = _distinct(np.concatenate([kept, needed]))
    return SideMesh(breaks, _orders_at(side, breaks))


def _orders_at(side: SideMesh, breaks: Array) -> Index:
    """Orders (n,) of a side's elements at the middles of others, given by their breaks (n + 1,)."""
    middle = 0.5 * (breaks[1:] + breaks[:-1])
    return np.asarray(side.order[np.clip(np.searchsorted(side.breaks, middle) - 1, 0, len(side.order) - 1)])


@dataclass(frozen=True)
class Facing:
    """What a pair needs to know of two meshes, m nodes of the secondary and k of the primary.

    Attributes
    ----------
    secondary, primary : (m,), (k,) arrays
        Numbers of the nodes in their meshes.
    normal : (m, 2) array
        n, from the secondary to the primary.
    distance : (m,) array
        To the primary along n, infinite where it is not met [length].
    values : (m, k) sparse array
        Values at the primary's nodes to values at the points that the secondary's nodes face.
    loads : (k, m) sparse array
        Traction at the secondary's nodes to J times it at the primary's nodes.
    matched : bool
        Whether each element of the secondary that is near the primary faces one of its elements.
    """

    secondary: Index
    primary: Index
    normal: Array
    distance: Array
    values: scipy.sparse.csr_array
    loads: scipy.sparse.csr_array
    matched: bool

    @property
    def met(self) -> Mask:
        """Which nodes of the secondary meet the primary."""
        return np.isfinite(self.distance)


def face(secondary: CurveMesh, part: str, primary: CurveMesh, other: str, sides: PairSides) -> Facing:
    """How the nodes of a part face another part."""
    a, b = secondary.nodes_of(part), primary.nodes_of(other)
    elements_a, own = _elements(secondary, part)
    elements_b, opposite = _elements(primary, other)
    normal = np.array(_along(sides.direction, secondary.normal[a]))
    there = sides.to_primary(secondary.x[a], secondary.normal[a], opposite)
    back = sides.to_secondary(primary.x[b], primary.normal[b], own)
    values = _interpolation(primary, elements_b, there, b)
    loads = _interpolation(secondary, elements_a, back, a)
    met = np.abs(there.distance) < NEAR * float(secondary.weight[a].sum())
    couples = np.unique(np.column_stack([secondary.element[a[met]], elements_b[there.curve[met]]]), axis=0)
    matched = all(len(np.unique(side)) == len(couples) for side in couples.T)
    # J = |n_B·n| / |n_A·n|, over 1 + κg where n turns with the secondary
    met = back.curve >= 0
    curve = np.maximum(back.curve, 0)
    n_a = own.at(curve, back.fraction)[1]
    n = _along(sides.direction, n_a)
    ratio = np.abs(np.sum(primary.normal[b] * n, axis=1)) / np.abs(np.sum(n_a * n, axis=1))
    if sides.direction is None:
        ratio /= 1.0 + own.curvature[curve] * np.where(met, back.distance, 0.0)
    loads = scipy.sparse.csr_array(scipy.sparse.diags(np.where(met, ratio, 0.0)) @ loads)
    return Facing(a, b, normal, there.distance, values, loads, matched)


def _elements(mesh: CurveMesh, part: str) -> tuple[Index, Curves]:
    numbers = np.flatnonzero(mesh.part == mesh.part_names.index(part))
    return numbers, Curves(mesh.start[numbers], mesh.end[numbers], mesh.curvature[numbers])


def _interpolation(mesh: CurveMesh, elements: Index, hits: Hits, nodes: Index) -> scipy.sparse.csr_array:
    """Nodal values of a part to values at hits."""
    place = np.full(mesh.n_nodes, -1)
    place[nodes] = np.arange(len(nodes))
    rows, columns, entries = [], [], []
    met = np.flatnonzero(hits.curve >= 0)
    element = elements[hits.curve[met]]
    xi = 2.0 * hits.fraction[met] - 1.0
    for order in np.unique(mesh.order[element]):
        chosen = np.flatnonzero(mesh.order[element] == order)
        first = mesh.first_node[element[chosen]]
        own = mesh.xi[first[:, None] + np.arange(order + 1)]
        gap = np.abs(xi[chosen][:, None] - own)
        hit = gap.min(axis=1) < COINCIDE
        basis = lagrange(int(order), xi[chosen])
        basis[:, hit] = np.where(gap[hit] < COINCIDE, 1.0, 0.0).T
        rows.append(np.repeat(met[chosen], order + 1))
        columns.append(place[(first[:, None] + np.arange(order + 1)).ravel()])
        entries.append(basis.T.ravel())
    shape = (len(hits.curve), len(nodes))
    if not rows:
        return scipy.sparse.csr_array(shape)
    triples = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    result = scipy.sparse.csr_array(scipy.sparse.coo_array(triples, shape=shape))
    result.eliminate_zeros()
    return result
