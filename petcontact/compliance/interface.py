"""Where parts of bodies meet, and the maps between contact directions of bodies and of all interfaces."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy

from ..arrays import Array, Index
from .body.base import ElasticBody


@dataclass(frozen=True)
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
        n, from the secondary to the primary.
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
        To the primary along n, whatever the gap is given as; infinite where nothing is faced [length].
    sag : float
        Height of curved faces over the elements that stand for them, where it is in the gap [length].
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
    sag: float = 0.0
    jump: Array | None = None
    held: bool = False

    @property
    def directions(self) -> Array:
        """Of σ and v, (m, k, d)."""
        return self.tangent if self.held else np.concatenate([self.tangent, self.normal[:, None]], axis=1)


def slices(interfaces: Sequence[Interface]) -> dict[str, slice]:
    """The nodes of each interface by its name among those of all, one after another."""
    ends = itertools.accumulate((len(face.nodes) for face in interfaces), initial=0)
    return {face.name: slice(*bounds) for face, bounds in zip(interfaces, itertools.pairwise(ends), strict=True)}


def directions_looked_for(dim: int, interfaces: Sequence[Interface]) -> int:
    """Components of σ at a node, k: the tangential ones where all normals are held, as where nothing is in contact."""
    return dim - 1 if all(face.held for face in interfaces) else dim


def contact_maps(number: int, bodies: Sequence[ElasticBody], interfaces: Sequence[Interface]) -> ContactMaps:
    """Between the contact directions of a body and those of all interfaces."""
    body, d = bodies[number], bodies[number].mesh.dim
    k = directions_looked_for(d, interfaces)
    if len(bodies) == 1 and all(face.primary is None for face in interfaces):
        place = places(body, interfaces)
        frame = body.data.contact_frame
        if np.array_equal(np.concatenate([frame[:0], *(face.directions for face in interfaces)]), frame[place]):
            return _Reordered((k * place[:, None] + np.arange(k)).ravel())
    none = scipy.sparse.csr_array((0, body.data.contact_directions.size))
    seen, carried = [none], [none]
    for face in interfaces:
        out = _blocks(face.directions, np.arange(len(face.nodes)), len(face.nodes))
        moved, pushed = (scipy.sparse.csr_array((out.shape[0], body.data.contact_directions.size)) for _ in range(2))
        if face.body == number:
            own = out @ _blocks(body.data.contact_frame, np.searchsorted(body.contact, face.nodes), len(body.contact)).T
            moved, pushed = moved + own, pushed + own
        if face.primary == number:
            assert face.values is not None and face.loads is not None and face.primary_nodes is not None
            there = np.searchsorted(body.contact, face.primary_nodes)
            other = _blocks(body.data.contact_frame, there, len(body.contact)).T
            moved = moved - out @ _each(face.values, d) @ other
            pushed = pushed - out @ _each(scipy.sparse.csr_array(face.loads.T), d) @ other
        seen.append(moved)
        carried.append(pushed)
    return _Combined(*(scipy.sparse.csr_array(scipy.sparse.vstack(parts)) for parts in (seen, carried)))


def places(body: ElasticBody, interfaces: Sequence[Interface]) -> Index:
    """Of the nodes of all interfaces among the contact nodes of a body that is the only one."""
    nodes = np.concatenate([body.contact[:0], *(face.nodes for face in interfaces)])
    return np.asarray(np.searchsorted(body.contact, nodes))


class ContactMaps(Protocol):
    """Between vectors in the contact directions of a body (k m_c, ...) and of all interfaces (k M, ...)."""

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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class _Combined:
    """By sparse matrices (k M, k m_c)."""

    displacement: scipy.sparse.csr_array
    traction: scipy.sparse.csr_array

    @property
    def matrices(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        return self.displacement, self.traction

    def seen(self, moved: Array) -> Array:
        return np.asarray(self.displacement @ moved)

    @functools.cached_property
    def _carried(self) -> scipy.sparse.csr_array:
        return scipy.sparse.csr_array(self.traction.T)

    def carried(self, sigma: Array) -> Array:
        return np.asarray(self._carried @ sigma)

    def felt(self, work: Array) -> Array:
        return np.asarray(self.traction @ work)


def _blocks(frame: Array, place: Index, count: int) -> scipy.sparse.csr_array:
    """(k count, d len(place)): cartesian components of vectors to components along `frame` (count, k, d), of vectors at some
    nodes to those at all; its transpose goes back."""
    k, d = frame.shape[1:]
    rows = np.repeat(k * place[:, None] + np.arange(k), d, axis=1)
    columns = np.tile(d * np.arange(len(place))[:, None] + np.arange(d), (1, k))
    return scipy.sparse.csr_array((frame[place].ravel(), (rows.ravel(), columns.ravel())), shape=(k * count, d * len(place)))


def _each(values: scipy.sparse.csr_array, d: int) -> scipy.sparse.csr_array:
    """The matrix of values at nodes applied to each of d components."""
    return scipy.sparse.csr_array(scipy.sparse.kron(values, scipy.sparse.identity(d, format="csr")))
