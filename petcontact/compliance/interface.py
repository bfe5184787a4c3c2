"""Contact interfaces, and the maps between the contact directions of bodies and those of all
interfaces."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence

import numpy as np
import scipy

from ..arrays import Array, Index
from ..geometry.rotation import lifted
from ..mesh.pairs.mortar import rounded
from ..record import record
from .body.eliminated import ElasticBody

SLAB = 256
"""Rows of S of which copies are made at a time. For 3000 contact unknowns they take 6 MB each, and
with 64 to 1024 rows they take as long."""


@record
class Interface:
    """The contact of a part of a body with a part of another body, an obstacle, or fixed ground.

    Attributes
    ----------
    name : str
    body : int
        Number of the secondary's body.
    nodes : (m,) array
        Nodes of the secondary in the mesh of its body.
    normal : (m, d) array
        n, from the secondary to the primary. With torsion it lies in the half section, as points
        do.
    tangent : (m, d-1, d) array
        τ, orthonormal and normal to n.
    gap : (m,) array
        Initial gap, infinite where no primary is opposite [length].
    primary : int, optional
        Number of the primary's body.
    primary_nodes : (k,) array, optional
        Nodes of the primary in the mesh of its body.
    values : (m, k) sparse array, optional
        Map from values at the primary's nodes to those at the points opposite the nodes.
    loads : (k, m) sparse array, optional
        Map from tractions at the secondary's nodes to J times them at the primary's nodes.
    obstacle : int, optional
        Number of the obstacle. With neither a body nor an obstacle the primary is fixed.
    distance : (m,) array, optional
        Geometric distance to the primary along n, also if the input gives the gap. It is infinite
        where no primary is opposite [length].
    sag : (m,) array, optional
        Height of the curved surfaces over their elements, if the gap includes it [length].
    jump : (K, d) array, optional
        Displacement that the primary has in addition to the secondary, in each load state
        [length].
    overlap : (K, m) array, optional
        Overlap that is given to the parts in each load state, beyond the gap [length].
    preloaded : bool
        Whether a force says how large a uniform overlap is, besides.
    held : bool
        Whether u_n = gap is boundary data of the body. Only the tangents are then contact
        directions.
    """

    name: str
    body: int
    nodes: Index
    normal: Array
    tangent: Array
    gap: Array
    primary: int | None = None
    primary_nodes: Index | None = None
    values: scipy.sparse.csr_array | None = None
    loads: scipy.sparse.csr_array | None = None
    obstacle: int | None = None
    distance: Array | None = None
    sag: Array | None = None
    jump: Array | None = None
    held: bool = False
    overlap: Array | None = None
    preloaded: bool = False

    @property
    def directions(self) -> Array:
        """Directions of σ and v, (m, k, d)."""
        return (
            self.tangent
            if self.held
            else np.concatenate([self.tangent, self.across[:, None]], axis=1)
        )

    @property
    def across(self) -> Array:
        """n with as many components as a displacement, (m, d)."""
        return lifted(self.normal, self.tangent.shape[2])


def slices(interfaces: Sequence[Interface]) -> dict[str, slice]:
    """Return, by the name of each interface, the slice of its nodes among those of all
    interfaces."""
    ends = itertools.accumulate((len(face.nodes) for face in interfaces), initial=0)
    return {
        face.name: slice(*bounds)
        for face, bounds in zip(interfaces, itertools.pairwise(ends), strict=True)
    }


def directions_looked_for(dim: int, interfaces: Sequence[Interface]) -> int:
    """Return k, the number of components of σ at a node.

    It is dim - 1, for the tangents alone, if all normals are held or there is no interface.
    """
    return dim - 1 if all(face.held for face in interfaces) else dim


def contact_maps(
    number: int, bodies: Sequence[ElasticBody], interfaces: Sequence[Interface]
) -> ContactMaps:
    """Return the maps between the contact directions of one body and those of all interfaces."""
    body, d = bodies[number], bodies[number].mesh.components
    k = directions_looked_for(d, interfaces)
    seen, carried = list[_Triples](), list[_Triples]()
    for face, where in zip(interfaces, slices(interfaces).values(), strict=True):
        if face.body == number:
            own = np.arange(len(face.nodes))
            seen.append(_triples(face, where, body, own, face.nodes, np.ones(len(own))))
            carried.append(seen[-1])
        if face.primary == number:
            assert (
                face.values is not None
                and face.loads is not None
                and face.primary_nodes is not None
            )
            node, opposite = _places_of(face.values)
            seen.append(
                _triples(face, where, body, node, face.primary_nodes[opposite], -face.values.data)
            )
            opposite, node = _places_of(face.loads)
            carried.append(
                _triples(face, where, body, node, face.primary_nodes[opposite], -face.loads.data)
            )
    shape = (k * sum(len(face.nodes) for face in interfaces), body.data.contact_directions.size)
    displacement = _sum_of(seen, shape)
    alike = all(face.primary != number for face in interfaces)
    return ContactMaps(displacement, displacement if alike else _sum_of(carried, shape))


_Triples = tuple[Array, Index, Index]
"""Entries, rows and columns of a sparse matrix."""


def _triples(
    face: Interface, where: slice, body: ElasticBody, node: Index, own: Index, share: Array
) -> _Triples:
    """Return the entries of a map from a body's contact directions to those of an interface.

    `share` (q,) is the part that node `own` (q,) of the body has in `node` (q,) of the interface.
    """
    position, k = np.searchsorted(body.contact, own), face.directions.shape[1]
    entries = share[:, None, None] * np.einsum(
        "qac,qbc->qab", face.directions[node], body.data.contact_frame[position]
    )
    rows, columns = (
        k * numbers[:, None] + np.arange(k) for numbers in (where.start + node, position)
    )
    rows, columns = (
        np.broadcast_to(numbers, entries.shape).ravel()
        for numbers in (rows[:, :, None], columns[:, None])
    )
    return entries.ravel(), rows, columns


def _places_of(matrix: scipy.sparse.csr_array) -> tuple[Index, Index]:
    """Return the rows and the columns of the entries of a sparse matrix."""
    return np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr)), matrix.indices


def _sum_of(parts: list[_Triples], shape: tuple[int, int]) -> scipy.sparse.csr_array:
    """Return the sparse matrix of these triples; entries at one place are added.

    Cosines of equal directions are 0 or ±1 without round-off.
    """
    if not parts:
        return scipy.sparse.csr_array(shape)
    entries, rows, columns = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return rounded(scipy.sparse.csr_array((entries, (rows, columns)), shape=shape))


def places(body: ElasticBody, interfaces: Sequence[Interface]) -> Index:
    """Return the places of the nodes of all interfaces among the contact nodes of the only body."""
    nodes = np.concatenate([body.contact[:0], *(face.nodes for face in interfaces)])
    return np.asarray(np.searchsorted(body.contact, nodes))


@record
class ContactMaps:
    """Maps between vectors along a body's contact directions (k m_c, ...) and along those of all
    interfaces (k M, ...).

    Attributes
    ----------
    displacement, traction : (k M, k m_c) sparse matrices
        Matrices of `seen`, and of the transpose of `carried`.
    """

    displacement: scipy.sparse.csr_array
    traction: scipy.sparse.csr_array

    @functools.cached_property
    def _onto_body(self) -> scipy.sparse.csc_array:
        return scipy.sparse.csc_array(self.traction.T)

    @property
    def is_identity(self) -> bool:
        """Whether the contact directions of the body are those of all interfaces."""
        unit = scipy.sparse.csr_array(scipy.sparse.eye(*self.displacement.shape))
        return all((m != unit).nnz == 0 for m in (self.displacement, self.traction))

    def add_compliance(self, own: Array, total: Array) -> None:
        """Add a body's compliance (k m_c, k m_c) to that of all interfaces (k M, k M), transposed.

        Of many bodies S takes GB: it is stored by columns from the start, as LU wants it, and
        copies are made of `SLAB` rows at a time. Only rows of interfaces that the body has are
        touched: of many bodies each has a few.
        """
        rows = np.flatnonzero(np.diff(self.displacement.indptr) + np.diff(self.traction.indptr))
        traction = self.traction[rows]
        # runs of neighbouring rows: slices are added several times as fast as single entries
        number = np.arange(len(rows))
        starts = number[(np.diff(rows, prepend=-2) > 1) | (number % SLAB == 0)].tolist()
        runs = [slice(*ends) for ends in itertools.pairwise([*starts, len(rows)])]
        there = [slice(int(rows[run.start]), int(rows[run.stop - 1]) + 1) for run in runs]
        for other, columns in zip(there, runs, strict=True):
            seen = self.displacement[rows[columns]]
            used = np.unique(seen.indices)
            block = traction @ np.ascontiguousarray((seen[:, used] @ own[used]).T)
            for one, own_rows in zip(there, runs, strict=True):
                total[one, other] += block[own_rows]

    def seen(self, moved: Array) -> Array:
        """Return the v that a displacement of the body causes."""
        return np.asarray(self.displacement @ moved)

    def carried(self, sigma: Array) -> Array:
        """Return the tractions on the body that σ causes."""
        return np.asarray(self._onto_body @ sigma)

    def felt(self, work: Array) -> Array:
        """Return the transpose of `carried` times a vector on the body."""
        return np.asarray(self.traction @ work)
