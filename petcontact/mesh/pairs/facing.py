"""Two parts that may touch: gap, directions, and the maps between their nodes, in any dimension.

A point x of the secondary faces the point of the primary that the line from x along the direction n meets (n: the
secondary's outward normal, or one that is given); conversely a point of the primary faces the foot of that line.
J = ds_A/ds_B is the ratio of arc lengths, in space areas, of the secondary and the primary there: t_B = -J t_A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ..boundary_mesh import BoundaryMesh
from .hits import Hits, along

NEAR = 0.1
"""Distance, over the size of the secondary, within which elements have to match."""


@dataclass(frozen=True)
class Facing:
    """What a pair needs to know of two meshes, m nodes of the secondary and k of the primary.

    Attributes
    ----------
    secondary, primary : (m,), (k,) arrays
        Numbers of the nodes in their meshes.
    normal : (m, d) array
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


def face(secondary: BoundaryMesh, part: str, primary: BoundaryMesh, other: str, direction: Array | None) -> Facing:
    """How the nodes of a part face another part, along a direction or the secondary's normals."""
    a, b = secondary.nodes_of(part), primary.nodes_of(other)
    elements_a, own = secondary.faces(part)
    elements_b, opposite = primary.faces(other)
    normal = np.array(along(direction, secondary.normal[a]))
    there = opposite.cast(secondary.x[a], normal)
    back = own.comes_from(primary.x[b], primary.normal[b], direction)
    values = _interpolation(primary, elements_b, there)[:, b]
    loads = _interpolation(secondary, elements_a, back)[:, a]
    met = np.abs(there.distance) < NEAR * float(secondary.weight[a].sum()) ** (1.0 / (secondary.dim - 1))
    couples = np.unique(np.column_stack([secondary.element[a[met]], elements_b[there.face[met]]]), axis=0)
    matched = all(len(np.unique(side)) == len(couples) for side in couples.T)
    # J = |n_B·n| / |n_A·n|, over the stretch where n turns with the secondary
    met = back.face >= 0
    number = np.maximum(back.face, 0)
    n_a = own.at(number, back.place)[1]
    n = along(direction, n_a)
    against, out = (np.abs(np.sum(vectors * n, axis=1)) for vectors in (primary.normal[b], n_a))
    ratio = np.divide(against, out, out=np.zeros(len(out)), where=met & (out > 0.0))
    if direction is None:
        ratio /= own.stretch(number, np.where(met, back.distance, 0.0))
    loads = scipy.sparse.csr_array(scipy.sparse.diags(np.where(met, ratio, 0.0)) @ loads)
    return Facing(a, b, normal, there.distance, values, loads, matched)


def _interpolation(mesh: BoundaryMesh, elements: Index, hits: Hits) -> scipy.sparse.csr_array:
    """Nodal values of a mesh to values at hits on some of its elements, 0 where none is met."""
    met = np.flatnonzero(hits.face >= 0)
    rows = scipy.sparse.csr_array((np.ones(len(met)), (met, np.arange(len(met)))), shape=(len(hits.face), len(met)))
    return scipy.sparse.csr_array(rows @ mesh.basis_at(elements[hits.face[met]], hits.place[met]))
