"""The mortar projection: displacement of the primary as polynomials of the secondary's elements, in
any dimension.

On each element of the secondary, u_B at the points that are faced is projected in L2, segment by
segment, onto the element's polynomials: V = M_A⁻¹ C with M_A = ∫ L_A L_A and C = ∫ L_A L_B
(Bernardi, Maday and Patera, 1994; Puso and Laursen, CMAME 193, 2004). V keeps constants and
positions across the direction; the transpose, weighted, therefore hands on force and moment of the
normal tractions exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from ...arrays import Array, Index
from ...round_off import SOLVED
from ..boundary_mesh import BoundaryMesh
from .ray_casting import Segments
from .sag import SMOOTH

LARGEST = 1.0
"""Change of an entry of V, of all those that sum to 1, beyond which the centre of what it sees
stays where it is."""


def projection(
    secondary: BoundaryMesh,
    elements: Index,
    primary: BoundaryMesh,
    others: Index,
    segments: Segments,
    y: Array,
) -> scipy.sparse.csr_array:
    """V, (n_A, n_B): values at the nodes of the primary to values at those of the secondary that
    face it, else no entries.

    Parameters
    ----------
    secondary, primary : BoundaryMesh
    elements, others : (k,), (l,) arrays
        Numbers of the elements that the faces of `segments` are.
    segments : Segments
    y : (q, d) array
        Points that are faced [length].
    """
    order = np.argsort(segments.face, kind="stable")
    element = elements[segments.face[order]]
    basis = _blocks(secondary, element, segments.place[order])
    weight = segments.weight[order]
    root = np.sqrt(np.abs(weight))
    size = np.bincount(secondary.element, secondary.measure, secondary.n_elements)
    start = np.flatnonzero(np.diff(element, prepend=-1))
    count, nodes = (
        np.diff(np.append(start, len(element))),
        np.diff(secondary.first_node)[element[start]],
    )
    # on an element that faces something almost whole all polynomials are determined, else affine
    # ones
    whole = (
        np.add.reduceat(weight, start) >= 0.9 * size[element[start]]
        if len(start)
        else np.zeros(0, dtype=bool)
    )
    # elements alike are projected at once, those that face something in part one by one
    signed = np.minimum.reduceat(weight, start) < 0.0 if len(start) else whole
    alike = np.column_stack([count, nodes, signed, np.where(whole, -1, np.arange(len(start)))])
    rows, columns, entries = (
        [np.empty(0, dtype=np.int64)],
        [np.empty(0, dtype=np.int64)],
        [np.empty(0)],
    )
    for points, p, negative, one in np.unique(alike, axis=0).tolist():
        chosen = np.flatnonzero((alike == (points, p, negative, one)).all(axis=1))
        place = start[chosen][:, None] + np.arange(points)
        node = secondary.first_node[element[start[chosen]]][:, None] + np.arange(p)
        factor = root[place][:, :, None] * basis[place][:, :, :p]
        if negative:
            found = np.stack(
                [
                    _signed(
                        inside,
                        sign,
                        [*([np.eye(p)] if one < 0 else []), _affine(x), np.ones((p, 1))],
                    )
                    for inside, sign, x in zip(
                        factor, np.sign(weight[place]), secondary.x[node], strict=True
                    )
                ]
            )
        else:
            trial = np.eye(p) if one < 0 else _affine(secondary.x[node[0]])
            found = trial @ np.linalg.pinv(factor @ trial)
        found *= root[place][:, None, :]
        kept = found.any(axis=(1, 2))
        rows.append(np.broadcast_to(node[kept, :, None], found[kept].shape).ravel())
        columns.append(np.broadcast_to(place[kept, None], found[kept].shape).ravel())
        entries.append(found[kept].ravel())
    triples = np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))
    project = scipy.sparse.csr_array(triples, shape=(secondary.n_nodes, len(element)))
    seen = _seen(primary, others[segments.other[order]], segments.opposite[order], y[order])
    return scipy.sparse.csr_array(project @ seen)


def _signed(factor: Array, sign: Array, trials: Sequence[Array]) -> Array:
    """The inverse (p, q) of a factor (q, p) in least squares with signs (q,), of the first trial
    functions (p, r) that they determine; zero where nothing is: what lies beside the other side,
    but for slivers that cancel."""
    for trial in trials:
        along, size, across = np.linalg.svd(factor @ trial, full_matrices=False)
        known = size > SOLVED * size[0]
        along, across = along[:, known], across[known].T / size[known]
        gram = along.T @ (sign[:, None] * along)
        # polynomials that pieces determine worse are left out
        if np.linalg.eigvalsh(gram)[0] >= 0.02:
            return np.asarray(trial @ across @ np.linalg.solve(gram, along.T * sign))
    return np.zeros(factor.T.shape)


def _seen(mesh: BoundaryMesh, element: Index, place: Array, x: Array) -> scipy.sparse.csr_array:
    """Nodal values of the primary to values at points x (q, d) of its elements, (q, n).

    Constant elements are given the slopes that their neighbours suggest, so that they, too, know
    linear functions; their means stay what they are.
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
    """Derivatives (n, n) along the axes at some of the nodes, tangential ones, from values at their
    nearest neighbours."""
    n, d = mesh.x.shape
    same = np.flatnonzero(np.isin(mesh.node_part, mesh.node_part[nodes]))
    tree = scipy.spatial.cKDTree(mesh.x[same])
    near = same[tree.query(mesh.x[nodes], k=min(4 * d - 5, len(same)))[1].reshape(len(nodes), -1)]
    away = mesh.x[near] - mesh.x[nodes, None]
    # neighbours round a corner are none
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
    """The basis (q, k) of the elements that points lie on, k being the most nodes of one."""
    values = mesh.basis_at(element, place)
    result = np.zeros((len(element), int(np.diff(mesh.first_node).max())))
    row = np.repeat(np.arange(len(element)), np.diff(values.indptr))
    result[row, values.indices - mesh.first_node[element[row]]] = values.data
    return result


def _affine(x: Array) -> Array:
    """Nodal values (k, r) of the affine functions along an element, by its nodes (k, d)."""
    away = x - x.mean(axis=0)
    along, size, _ = np.linalg.svd(away / (np.abs(away).max() or 1.0), full_matrices=False)
    return np.column_stack(
        [np.ones(len(x)), along[:, : x.shape[1] - 1][:, size[: x.shape[1] - 1] > SOLVED]]
    )


def balanced(
    values: scipy.sparse.csr_array, x: Array, faced: Array, tangent: Array, weight: Array
) -> scipy.sparse.csr_array:
    """V with the centre of the points that it takes its values from where it belongs, across the
    direction.

    On curved elements, and on constant ones that face something in part, that centre lies beside
    the line along which a node looks: the smallest change of V, by linear functions, moves it
    there.

    Parameters
    ----------
    values : (m, k) sparse array
        V.
    x, weight : (k, d), (k,) arrays
        Nodes of the primary [length], and their weights.
    faced : (m, d) array
        Points that the nodes of the secondary face [length].
    tangent : (m, d-1, d) array
        Across the directions.
    """
    off = np.einsum("mtd,md->mt", tangent, values @ x - faced)
    entries = values.data.copy()
    for i in np.flatnonzero(
        (np.abs(off).max(axis=1) > SOLVED * np.abs(x).max()) & (np.diff(values.indptr) > 0)
    ):
        mine = slice(values.indptr[i], values.indptr[i + 1])
        nodes = values.indices[mine]
        share = weight[nodes] / weight[nodes].sum()
        away = (x[nodes] - share @ x[nodes]) @ tangent[i].T
        spread = away.T * share @ away
        change = share * (away @ np.linalg.lstsq(spread, -off[i], rcond=1e-10)[0])
        # nodes that lie behind one another have no centre to move
        if np.abs(change).max() < LARGEST:
            entries[mine] += change
    return scipy.sparse.csr_array((entries, values.indices, values.indptr), shape=values.shape)


def rounded(values: scipy.sparse.csr_array) -> scipy.sparse.csr_array:
    """V with entries that are 0 or 1 to round-off made so."""
    whole = np.rint(values.data)
    values.data = np.where(
        (np.abs(values.data - whole) < SOLVED) & (np.abs(whole) <= 1.0), whole, values.data
    )
    values.eliminate_zeros()
    return values
