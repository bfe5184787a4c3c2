"""Gap, directions and maps between the nodes of two parts that may touch, in any dimension.

A point x of the secondary faces the point of the primary on the line from x along n. Here n is the
secondary's outward normal or a given direction. The maps of values and of tractions are adjoint, so
that action equals reaction.
"""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...record import record
from ...round_off import SINGLE
from ..boundary_mesh import BoundaryMesh
from .mortar import balanced, projection, rounded
from .ray_casting import Faces, FacingSegments, along
from .sag import sag

NEAR = 0.1
"""Distance over the size of the secondary within which elements should match [-]."""
CLOSE = 0.01
"""Distance over the size of the secondary within which its end inside an element matters [-]."""


@record
class Facing:
    """How two meshes face one another: m nodes of the secondary, k nodes of the primary.

    Attributes
    ----------
    secondary, primary : (m,), (k,) arrays
        Numbers of the nodes in their meshes.
    normal : (m, d) array
        n, from the secondary to the primary.
    distance : (m,) array
        Distance to the primary along n, infinite where n does not meet it [length].
    values : (m, k) sparse array
        V, from values at the primary's nodes to values at the points that the secondary's nodes
        face (see `mortar`).
    loads : (k, m) sparse array
        W_B⁻¹ Vᵀ W_A, W the nodes' weights: traction at the secondary's nodes to J times it at the
        primary's nodes, J being the ratio of arc lengths, in space areas, of the secondary and the
        primary.
    matched : bool
        Whether each element of the secondary that is near the primary faces one of its elements.
    sizes : (float, float)
        Mean length, in space area, of the elements of the secondary and the primary near each
        other.
    ends_within : bool
        Whether the secondary ends within an element of the primary that it is near to.
    sag : (m,) array
        Height of curved faces over the elements that stand for them there, of either side; 0 where
        elements match [length].
    """

    secondary: Index
    primary: Index
    normal: Array
    distance: Array
    values: scipy.sparse.csr_array
    loads: scipy.sparse.csr_array
    matched: bool
    sizes: tuple[float, float]
    ends_within: bool
    sag: Array

    @property
    def met(self) -> Mask:
        """Which nodes of the secondary meet the primary."""
        return np.isfinite(self.distance)


def face(
    secondary: BoundaryMesh, part: str, primary: BoundaryMesh, other: str, direction: Array | None
) -> Facing:
    """Return how the nodes of a part face another part, along a direction or the secondary's
    normals."""
    a, b = secondary.nodes_of(part), primary.nodes_of(other)
    elements, own = secondary.faces(part)
    opposite_elements, opposite = primary.faces(other)
    normal = np.array(along(direction, secondary.smooth_normal[a]))
    there = opposite.cast(secondary.x[a], normal)
    segments = own.segments(
        opposite, secondary.order[elements], primary.order[opposite_elements], direction
    )
    y = opposite.at(segments.other, segments.opposite)[0]
    values = projection(secondary, elements, primary, opposite_elements, segments, y)[a][:, b]
    # what looks past the other part carries nothing, though its element may face some of it
    met = (there.face >= 0) & (np.diff(values.indptr) > 0)
    values.data *= np.repeat(met, np.diff(values.indptr))
    values.eliminate_zeros()
    distance = np.where(met, there.distance, np.inf)
    values = rounded(
        balanced(
            values,
            primary.x[b],
            secondary.x[a] + np.where(met, distance, 0.0)[:, None] * normal,
            secondary.tangents_to(normal),
            primary.measure[b],
        )
    )
    far = np.linalg.norm(y - own.at(segments.face, segments.place)[0], axis=1)
    size = float(secondary.measure[a].sum()) ** (1.0 / (secondary.dim - 1))
    close = np.unique(segments.other[far < CLOSE * size])
    matched, sizes = _matched(
        segments.take(far < NEAR * size), (secondary, elements), (primary, opposite_elements)
    )
    missed = np.zeros(len(a))
    if not matched:
        own_sag = sag(own)[np.searchsorted(elements, secondary.element[a])]
        missed = np.where(met, np.maximum(own_sag, sag(opposite)[there.face]), 0.0)
    return Facing(
        a,
        b,
        normal,
        distance,
        values,
        _pushed(values, secondary.weight[a], primary.weight[b]),
        matched,
        sizes,
        not matched and _ends_within(own, opposite, close, direction),
        missed,
    )


def _pushed(
    values: scipy.sparse.csr_array, weight: Array, primary_weight: Array
) -> scipy.sparse.csr_array:
    """Return the map from tractions on the secondary to those on the primary with equal forces."""
    pushed = values.data * np.repeat(weight, np.diff(values.indptr))
    pushed /= primary_weight[values.indices]
    loads = scipy.sparse.csr_array((pushed, values.indices, values.indptr), shape=values.shape).T
    return scipy.sparse.csr_array(loads)


def _matched(
    near: FacingSegments, *sides: tuple[BoundaryMesh, Index]
) -> tuple[bool, tuple[float, float]]:
    """Return whether elements that are near face one each, and their mean sizes on both sides.

    A side is a mesh and the numbers of its elements on the part [length, in space area].
    """
    measure = [
        np.asarray(np.bincount(mesh.element, mesh.measure), dtype=float)[some]
        for mesh, some in sides
    ]
    couples = _couples(near, measure[0])
    numbers = [np.unique(column) for column in couples.T]
    first, second = (
        float(every[some].sum()) / max(1, len(some))
        for every, some in zip(measure, numbers, strict=True)
    )
    return all(len(some) == len(couples) for some in numbers), (first, second)


def _ends_within(own: Faces, opposite: Faces, numbers: Index, direction: Array | None) -> bool:
    """Return whether an element of the primary faces the secondary only in part."""
    line = (np.arange(opposite.SAMPLES) + 0.5) / opposite.SAMPLES
    share = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    number = np.repeat(numbers, len(share))
    y, normal = opposite.at(number, opposite.spread(number, np.tile(share, (len(numbers), 1))))
    met = own.cast(y, along(None if direction is None else -direction, normal)).face >= 0
    met = met.reshape(len(numbers), len(share))
    return bool(np.any(met.any(axis=1) & ~met.all(axis=1)))


def _couples(segments: FacingSegments, size: Array) -> Index:
    """Return the facing pairs of faces of the secondary, of sizes (n,), and of the primary, (k,
    2)."""
    many = int(segments.other.max(initial=0)) + 1
    couples, number = np.unique(segments.face * many + segments.other, return_inverse=True)
    couples = couples[
        np.bincount(number, segments.weight, len(couples)) > SINGLE * size[couples // many]
    ]
    return np.column_stack(np.divmod(couples, many))
