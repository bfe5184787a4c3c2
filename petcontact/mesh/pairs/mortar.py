"""The mortar projection of the primary's displacement onto the secondary's polynomials.

It works in any dimension. On each element of the secondary, u_B at the opposite points is projected
in L2 onto the element's polynomials, segment by segment. V = M_A⁻¹ C with M_A = ∫ L_A L_A and C = ∫
L_A L_B (Bernardi, Maday and Patera, 1994; Puso and Laursen, CMAME 193, 2004). V is exact for
constants and for positions across the direction. Therefore its weighted transpose transmits force
and moment of the normal tractions exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from ...arrays import AnyArray, Array, Index
from ...round_off import SOLVED
from ..boundary_mesh import BoundaryMesh
from .ray_casting import FacingSegments
from .sag import SMOOTH

LARGEST = 1.0
"""Largest change of an entry of V, over the sum of all, that moves the centre of a node's values
[-]. With a larger one the centre is not moved."""


def projection(
    secondary: BoundaryMesh,
    elements: Index,
    primary: BoundaryMesh,
    others: Index,
    segments: FacingSegments,
    y: Array,
) -> scipy.sparse.csr_array:
    """Return V, (n_A, n_B), from values at the primary's nodes to values at the secondary's.

    Nodes of the secondary that face nothing have no entries.

    Parameters
    ----------
    secondary, primary : BoundaryMesh
    elements, others : (k,), (l,) arrays
        Numbers of the elements that the faces of `segments` are.
    segments : FacingSegments
    y : (q, d) array
        Opposite points [length].
    """
    order = np.argsort(segments.face, kind="stable")
    element = elements[segments.face[order]]
    basis = _blocks(secondary, element, segments.place[order])
    project = _projector(secondary, element, basis, segments.weight[order])
    seen = _seen(primary, others[segments.other[order]], segments.opposite[order], y[order])
    return scipy.sparse.csr_array(project @ seen)


def _projector(
    secondary: BoundaryMesh, element: Index, basis: Array, weight: Array
) -> scipy.sparse.csr_array:
    """Return the projection (n_A, q) from values at points to values at the secondary's nodes; the
    points lie element after element, with the basis of each (q, p) and weights (q,)."""
    start, alike = _alike(secondary, element, weight)
    root = np.sqrt(np.abs(weight))
    parts: list[tuple[AnyArray, ...]] = [(*np.empty((2, 0), dtype=np.int64), np.empty(0))]
    for kind in np.unique(alike, axis=0):
        points, p, negative, one = kind.tolist()
        first = start[(alike == kind).all(axis=1)]
        place = first[:, None] + np.arange(points)
        node = secondary.first_node[element[first]][:, None] + np.arange(p)
        factor = root[place][:, :, None] * basis[place][:, :, :p]
        sign = np.sign(weight[place]) if negative else None
        inverse = _inverses(factor, sign, secondary.x[node], one < 0) * root[place][:, None, :]
        kept = inverse.any(axis=(1, 2))
        triples = np.broadcast_arrays(node[kept, :, None], place[kept, None], inverse[kept])
        parts.append(tuple(map(np.ravel, triples)))
    rows, columns, entries = map(np.concatenate, zip(*parts, strict=True))
    return scipy.sparse.csr_array(
        (entries, (rows, columns)), shape=(secondary.n_nodes, len(element))
    )


def _alike(secondary: BoundaryMesh, element: Index, weight: Array) -> tuple[Index, Index]:
    """Return the first point of each element that has points, and of what kind it is, (e, 4):
    numbers of points and of nodes, whether a weight is negative, and -1, or its own number.

    Elements of one kind are projected together, those that face something only in part one by one:
    only on an element that faces something almost whole all polynomials are determined.
    """
    size = np.bincount(secondary.element, secondary.measure, secondary.n_elements)
    start = np.flatnonzero(np.diff(element, prepend=-1))
    count = np.diff(np.append(start, len(element)))
    nodes = np.diff(secondary.first_node)[element[start]]
    whole = signed = np.zeros(0, dtype=bool)
    if len(start):
        whole = np.add.reduceat(weight, start) >= 0.9 * size[element[start]]
        signed = np.minimum.reduceat(weight, start) < 0.0
    own = np.where(whole, -1, np.arange(len(start)))
    return start, np.column_stack([count, nodes, signed, own])


def _inverses(factor: Array, sign: Array | None, x: Array, whole: bool) -> Array:
    """Return the least-squares inverses (e, p, q) of factors (e, q, p) of elements with nodes (e,
    p, d), on affine functions where they are not whole; `sign` (e, q) where weights are negative,
    too."""
    p = factor.shape[2]
    if sign is None:
        trial = np.eye(p) if whole else _affine(x[0])
        return np.asarray(trial @ np.linalg.pinv(factor @ trial))
    every = [np.eye(p)] if whole else []
    trials = ([*every, _affine(nodes), np.ones((p, 1))] for nodes in x)
    return np.stack([_signed(*each) for each in zip(factor, sign, trials, strict=True)])


def _signed(factor: Array, sign: Array, trials: Sequence[Array]) -> Array:
    """Return the least-squares inverse (p, q) of a factor (q, p) with signs (q,).

    It is taken on the first trial functions (p, r) that the factor determines. It is zero if none
    is: then the element lies next to the opposite side, except for slivers that cancel.
    """
    for trial in trials:
        along, size, across = np.linalg.svd(factor @ trial, full_matrices=False)
        determined = size > SOLVED * size[0]
        along, across = along[:, determined], across[determined].T / size[determined]
        gram = along.T @ (sign[:, None] * along)
        # polynomials that pieces determine worse are left out
        if np.linalg.eigvalsh(gram)[0] >= 0.02:
            return np.asarray(trial @ across @ np.linalg.solve(gram, along.T * sign))
    return np.zeros(factor.T.shape)


def _seen(mesh: BoundaryMesh, element: Index, place: Array, x: Array) -> scipy.sparse.csr_array:
    """Return the matrix (q, n) from nodal values of the primary to values at points x (q, d) of its
    elements.

    Constant elements get slopes from their neighbours, so that they reproduce linear functions.
    Their means do not change.
    """
    values = mesh.basis_at(element, place)
    constant = np.unique(element[mesh.order[element] == 0])
    if not len(constant):
        return values
    node = mesh.first_node[element]
    for c, slope in enumerate(_slopes(mesh, mesh.first_node[constant])):
        values = values + scipy.sparse.diags(x[:, c] - mesh.x[node, c]) @ slope[node]
    return scipy.sparse.csr_array(values)


def _slopes(mesh: BoundaryMesh, nodes: Index) -> list[scipy.sparse.csr_array]:
    """Return matrices (n, n) of the tangential derivatives along the axes at some nodes.

    They use values at the nearest neighbours.
    """
    n, d = mesh.x.shape
    same = np.flatnonzero(np.isin(mesh.node_part, mesh.node_part[nodes]))
    tree = scipy.spatial.cKDTree(mesh.x[same])
    near = same[tree.query(mesh.x[nodes], k=min(4 * d - 5, len(same)))[1].reshape(len(nodes), -1)]
    away = mesh.x[near] - mesh.x[nodes, None]
    # nodes beyond a corner are no neighbours
    smooth = np.einsum("mkd,md->mk", mesh.normal[near], mesh.normal[nodes]) > SMOOTH
    tangent = mesh.tangents(nodes)
    inverse = np.linalg.pinv(
        np.einsum("mkd,mtd->mkt", away, tangent) * smooth[..., None], rcond=1e-6
    )
    slope = np.einsum("mtk,mtd->mdk", inverse, tangent)
    rows = np.broadcast_to(nodes[:, None], near.shape)
    place = np.stack([rows, rows]).ravel(), np.stack([near, rows]).ravel()
    return [
        scipy.sparse.csr_array(
            scipy.sparse.coo_array((np.stack([part, -part]).ravel(), place), shape=(n, n))
        )
        for part in slope.transpose(1, 0, 2)
    ]


def _blocks(mesh: BoundaryMesh, element: Index, place: Array) -> Array:
    """Return the basis (q, k) of the elements at points, with k for the element with most nodes."""
    values = mesh.basis_at(element, place)
    result = np.zeros((len(element), int(np.diff(mesh.first_node).max())))
    row = np.repeat(np.arange(len(element)), np.diff(values.indptr))
    result[row, values.indices - mesh.first_node[element[row]]] = values.data
    return result


def _affine(x: Array) -> Array:
    """Return nodal values (k, r) of the affine functions along an element with nodes (k, d)."""
    away = x - x.mean(axis=0)
    along, size, _ = np.linalg.svd(away / (np.abs(away).max() or 1.0), full_matrices=False)
    return np.column_stack(
        [np.ones(len(x)), along[:, : x.shape[1] - 1][:, size[: x.shape[1] - 1] > SOLVED]]
    )


def balanced(
    values: scipy.sparse.csr_array, x: Array, faced: Array, tangent: Array, weight: Array
) -> scipy.sparse.csr_array:
    """Return V, changed so that each node's values come from the right centre across the direction.

    On curved elements, and on constant ones that face something only in part, this centre lies off
    the line from the node. The smallest change of V, by linear functions, moves it there.

    Parameters
    ----------
    values : (m, k) sparse array
        V.
    x, weight : (k, d), (k,) arrays
        Nodes of the primary [length], and their weights.
    faced : (m, d) array
        Points that the nodes of the secondary face [length].
    tangent : (m, d-1, d) array
        Directions across the given ones.
    """
    off = np.einsum("mtd,md->mt", tangent, values @ x - faced)
    entries = values.data.copy()
    for i in np.flatnonzero(
        (np.abs(off).max(axis=1) > SOLVED * np.abs(x).max()) & (np.diff(values.indptr) > 0)
    ):
        row = slice(values.indptr[i], values.indptr[i + 1])
        nodes = values.indices[row]
        share = weight[nodes] / weight[nodes].sum()
        away = (x[nodes] - share @ x[nodes]) @ tangent[i].T
        spread = away.T * share @ away
        change = share * (away @ np.linalg.lstsq(spread, -off[i], rcond=1e-10)[0])
        # the centre of nodes that lie on one line along the direction cannot be moved
        if np.abs(change).max() < LARGEST:
            entries[row] += change
    return scipy.sparse.csr_array((entries, values.indices, values.indptr), shape=values.shape)


def rounded(values: scipy.sparse.csr_array) -> scipy.sparse.csr_array:
    """Return V with entries that are 0 or ±1 up to round-off set to these values."""
    whole = np.rint(values.data)
    values.data = np.where(
        (np.abs(values.data - whole) < SOLVED) & (np.abs(whole) <= 1.0), whole, values.data
    )
    values.eliminate_zeros()
    return values
