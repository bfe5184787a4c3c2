"""Where parts of bodies meet, and the maps between contact directions of bodies and of all
interfaces."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import scipy

from ..arrays import Array, Index
from ..frozen import frozen
from ..geometry.rotation import lifted
from .body.base import ElasticBody


@frozen
class Interface:
    """Where one part of a body meets a part of another body, an obstacle, or fixed rigid ground.

    Attributes
    ----------
    name : str
    body : int
        Of the secondary.
    nodes : (m,) array
        Of its mesh.
    normal : (m, d) array
        n, from the secondary to the primary; with torsion as points are, in the half section.
    tangent : (m, d-1, d) array
        τ, orthonormal and normal to n.
    gap : (m,) array
        Initial gap, infinite where nothing is faced [length].
    primary : int, optional
        Number of the body of the primary.
    primary_nodes : (k,) array, optional
    values : (m, k) sparse array, optional
        Values at the primary's nodes to values at the points that are faced.
    loads : (k, m) sparse array, optional
        Traction at the secondary's nodes to J times it at the primary's.
    obstacle : int, optional
        Number of the obstacle; with neither a body nor an obstacle the primary is fixed.
    distance : (m,) array, optional
        To the primary along n, whatever the gap is given as; infinite where nothing is faced
        [length].
    sag : (m,) array, optional
        Height of curved faces over the elements that stand for them, where it is in the gap
        [length].
    jump : (K, d) array, optional
        What the primary is displaced beyond the secondary in each load state [length].
    held : bool
        Whether u_n = gap is data of the body, and the tangents alone are contact directions.
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

    @property
    def directions(self) -> Array:
        """Of σ and v, (m, k, d)."""
        return (
            self.tangent
            if self.held
            else np.concatenate([self.tangent, self.across[:, None]], axis=1)
        )

    @property
    def across(self) -> Array:
        """n as displacements and tractions are, (m, d)."""
        return lifted(self.normal, self.tangent.shape[2])


def slices(interfaces: Sequence[Interface]) -> dict[str, slice]:
    """The nodes of each interface by its name among those of all, one after another."""
    ends = itertools.accumulate((len(face.nodes) for face in interfaces), initial=0)
    return {
        face.name: slice(*bounds)
        for face, bounds in zip(interfaces, itertools.pairwise(ends), strict=True)
    }


def directions_looked_for(dim: int, interfaces: Sequence[Interface]) -> int:
    """Components of σ at a node, k: the tangential ones where all normals are held, as where
    nothing is in contact."""
    return dim - 1 if all(face.held for face in interfaces) else dim


def contact_maps(
    number: int, bodies: Sequence[ElasticBody], interfaces: Sequence[Interface]
) -> ContactMaps:
    """Between the contact directions of a body and those of all interfaces."""
    body, d = bodies[number], bodies[number].mesh.components
    k = directions_looked_for(d, interfaces)
    if len(bodies) == 1 and all(face.primary is None for face in interfaces):
        place = places(body, interfaces)
        frame = body.data.contact_frame
        once = len(place) == len(body.contact)  # a part may be the secondary of two contacts
        if once and np.array_equal(
            np.concatenate([frame[:0], *(face.directions for face in interfaces)]), frame[place]
        ):
            return _Reordered((k * place[:, None] + np.arange(k)).ravel())
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
            node, other = _places_of(face.values)
            seen.append(
                _triples(face, where, body, node, face.primary_nodes[other], -face.values.data)
            )
            other, node = _places_of(face.loads)
            carried.append(
                _triples(face, where, body, node, face.primary_nodes[other], -face.loads.data)
            )
    shape = (k * sum(len(face.nodes) for face in interfaces), body.data.contact_directions.size)
    displacement = _sum_of(seen, shape)
    alike = all(face.primary != number for face in interfaces)
    return _Combined(displacement, displacement if alike else _sum_of(carried, shape))


_Triples = tuple[Array, Index, Index]
"""Entries, rows and columns of a sparse matrix."""


def _triples(
    face: Interface, where: slice, body: ElasticBody, node: Index, own: Index, share: Array
) -> _Triples:
    """Shares (q,) that nodes `own` of a body have in nodes of an interface, (q,) each, as what they
    are along the contact directions of both."""
    place, k = np.searchsorted(body.contact, own), face.directions.shape[1]
    entries = share[:, None, None] * np.einsum(
        "qac,qbc->qab", face.directions[node], body.data.contact_frame[place]
    )
    rows, columns = (k * each[:, None] + np.arange(k) for each in (where.start + node, place))
    rows, columns = (
        np.broadcast_to(each, entries.shape).ravel()
        for each in (rows[:, :, None], columns[:, None])
    )
    return entries.ravel(), rows, columns


def _places_of(matrix: scipy.sparse.csr_array) -> tuple[Index, Index]:
    """Rows and columns of the entries of a sparse matrix."""
    return np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr)), matrix.indices


def _sum_of(parts: list[_Triples], shape: tuple[int, int]) -> scipy.sparse.csr_array:
    """The sparse matrix of some triples, added up where they are of one place, without zeros."""
    if not parts:
        return scipy.sparse.csr_array(shape)
    entries, rows, columns = (np.concatenate(each) for each in zip(*parts, strict=True))
    there = np.flatnonzero(entries)
    return scipy.sparse.csr_array((entries[there], (rows[there], columns[there])), shape=shape)


def places(body: ElasticBody, interfaces: Sequence[Interface]) -> Index:
    """Of the nodes of all interfaces among the contact nodes of a body that is the only one."""
    nodes = np.concatenate([body.contact[:0], *(face.nodes for face in interfaces)])
    return np.asarray(np.searchsorted(body.contact, nodes))


class ContactMaps(Protocol):
    """Between vectors in the contact directions of a body (k m_c, ...) and of all interfaces (k M,
    ...)."""

    @property
    def matrices(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        """`seen`, and the transpose of `carried`, (k M, k m_c)."""
        ...

    def seen(self, moved: Array) -> Array:
        """v of a displacement of the body."""
        ...

    def carried(self, sigma: Array) -> Array:
        """Tractions on the body of σ."""
        ...

    def felt(self, work: Array) -> Array:
        """The transpose of `carried`: from components on the body to those that σ is in."""
        ...


@frozen
class _Reordered:
    """Of a body that is the only one, and whose directions those of the interfaces are."""

    order: Index

    @property
    def matrices(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        ones = scipy.sparse.identity(len(self.order), format="csr")[self.order]
        return scipy.sparse.csr_array(ones), scipy.sparse.csr_array(ones)

    def seen(self, moved: Array) -> Array:
        return moved[self.order]

    def carried(self, sigma: Array) -> Array:
        result = np.empty_like(sigma)
        result[self.order] = sigma
        return result

    felt = seen


@frozen
class _Combined:
    """By sparse matrices (k M, k m_c)."""

    displacement: scipy.sparse.csr_array
    traction: scipy.sparse.csr_array

    @property
    def matrices(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        return self.displacement, self.traction

    @functools.cached_property
    def _onto_body(self) -> scipy.sparse.csc_array:
        return scipy.sparse.csc_array(self.traction.T)

    def seen(self, moved: Array) -> Array:
        return np.asarray(self.displacement @ moved)

    def carried(self, sigma: Array) -> Array:
        return np.asarray(self._onto_body @ sigma)

    def felt(self, work: Array) -> Array:
        return np.asarray(self.traction @ work)
