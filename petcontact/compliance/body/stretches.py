"""Straight stretches of equal elements under equal conditions, which need only one set of
compressed blocks."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, Mask
from ...bem.operators import BoundaryOperators
from ...compression.hodlr import Stretch
from ...mesh.curve_mesh import CurveMesh
from ...round_off import WRITTEN

NONE = np.empty(0, dtype=np.int64)
COMPARED = 8
"""Number of elements at each end of a stretch whose entries are compared."""


def repeated(mesh: CurveMesh) -> Mask:
    """Return whether each element's successor has the same shape, (n_elements - 1,)."""
    plain = (mesh.curvature == 0.0) & (mesh.power == 0.0)
    same = plain[1:] & plain[:-1] & (np.abs(np.diff(mesh.length)) <= WRITTEN * mesh.length[1:])
    for label in (mesh.order, mesh.line, mesh.part):
        same &= label[1:] == label[:-1]
    return np.asarray(same)


def runs(mesh: CurveMesh, same: Mask) -> list[tuple[int, int]]:
    """Return the first and the last element (exclusive) of each run of equal elements.

    A run has more than twice `COMPARED` elements, evenly spaced.
    """
    ends = np.flatnonzero(~same) + 1
    pairs = zip(np.append(0, ends).tolist(), np.append(ends, mesh.n_elements).tolist(), strict=True)
    # shorter runs are not worth it
    return [
        (first, last)
        for first, last in pairs
        if last - first > 2 * COMPARED and _even(mesh, first, last)
    ]


def stretches_of(
    mesh: CurveMesh, operators: BoundaryOperators, apart: Index = NONE
) -> list[Stretch]:
    """Return the stretches of equal elements under equal conditions.

    Elements with nodes of `apart` are excluded. The entries at both ends of a stretch are compared.
    """
    nodes, element = np.arange(mesh.n_nodes), mesh.element
    following = np.minimum(nodes + mesh.order[element] + 1, mesh.n_nodes - 1)
    data, rhs = operators.data, operators.right_hand_sides
    alike = np.all(data.traction_known == data.traction_known[following], axis=1) & (
        rhs.count == rhs.count[following]
    )
    alike &= _near(data.frame, following) & ~np.isin(nodes, apart) & ~np.isin(following, apart)
    beside = np.ones(mesh.n_nodes, dtype=bool)
    for c in range(int(rhs.count.max(initial=0))):
        column = np.minimum(rhs.first + c, len(rhs.node) - 1)
        for vectors in (rhs.traction[column], rhs.displacement[column]):
            beside &= (rhs.count <= c) | _near(vectors, following)
    equal, same = (
        np.logical_and.reduceat(which, mesh.first_node[:-1])[:-1] for which in (alike, beside)
    )
    return [
        Stretch(
            int(mesh.first_node[first]),
            int(mesh.first_node[last]),
            int(mesh.order[first]) + 1,
            bool(same[first : last - 1].all()),
        )
        for first, last in runs(mesh, repeated(mesh) & equal)
        if _repeats(mesh, operators, first, last)
    ]


def _near(vectors: Array, following: Index) -> Mask:
    """Return whether each node's vectors equal those of the next node up to round-off, (n,)."""
    difference = np.abs(vectors - vectors[following]).reshape(len(vectors), -1)
    return np.asarray(
        difference.max(axis=1, initial=0.0) <= WRITTEN * np.abs(vectors).max(initial=0.0)
    )


def _even(mesh: CurveMesh, first: int, last: int) -> bool:
    """Return whether the elements begin at equal distances."""
    step = (mesh.end[last - 1] - mesh.start[first]) / (last - first)
    missed = mesh.start[first:last] - mesh.start[first] - np.arange(last - first)[:, None] * step
    return bool(np.abs(missed).max() <= WRITTEN * np.abs(step).max())


def _repeats(mesh: CurveMesh, operators: BoundaryOperators, first: int, last: int) -> bool:
    """Return whether the entries between the first elements equal those between the last ones."""
    count = COMPARED * (int(mesh.order[first]) + 1)
    head, tail = (
        np.arange(a, a + count) for a in (mesh.first_node[first], mesh.first_node[last] - count)
    )
    entries, others = operators.system_entries(head, head), operators.system_entries(tail, tail)
    return bool(np.abs(entries - others).max() <= 10.0 * WRITTEN * np.abs(entries).max())
