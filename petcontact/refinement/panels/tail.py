"""The error of nodal values on each element from what its highest degree adds, in any dimension.

The Legendre tail: on an element of order p the part of degree p (on quadrilaterals along either direction) of a function,
that is what the best polynomial of order p - 1 leaves. It is an estimate of the error from above where coefficients fall
from degree to degree, and near kinks and roots of p, where they hardly do, about the error itself.
"""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...mesh.boundary_mesh import BoundaryMesh

MARGIN = (2.0, 0.7, 1.2, 1.5)
"""Factors of the tail of elements of order 0, 1, 2, and above, measured by scripts/verify_space."""
RIM = 2.0
"""Factor on elements at the rim of a part, where tractions may be infinite and coefficients fall slowly."""
FEW = 6
"""Elements that carry pressure, below which its shape is not seen."""
SMOOTH = 0.5
"""Least cosine between the normals of neighbours on one smooth surface."""


def tail(mesh: BoundaryMesh, nodes: Index, values: Array) -> Array:
    """Estimated error of the polynomials through nodal values, rms over each element.

    Elements of order 0 have no lower degree. Theirs is the slope that the nearest nodes suggest, times the rms distance from
    the middle of a line or a square of their size.

    Parameters
    ----------
    mesh : BoundaryMesh
    nodes : (m,) array
        Numbers of the nodes of whole elements, increasing.
    values : (m, c) array
        Of a vector.

    Returns
    -------
    (m,) array
        At the nodes, constant on each element: the sum of its squares with the weights of the nodes is the square of the
        error in L2 [as values].
    """
    element = mesh.element[nodes]
    kind, order, weight = mesh.kind[element], mesh.order[element], mesh.weight[nodes]
    square = np.zeros(len(nodes))
    for number in np.unique(kind[order > 0]).tolist():
        mine = np.flatnonzero(kind == number)
        lower = mesh.lower_degree(number)
        root = np.sqrt(weight[mine]).reshape(-1, len(lower), 1)
        q = np.linalg.qr(root * lower)[0]
        nodal = root * values[mine].reshape(*root.shape[:2], -1)
        left = nodal - q @ (q.transpose(0, 2, 1) @ nodal)
        square[mine] = np.sum(left**2, axis=2).ravel()
    constant = np.flatnonzero(order == 0)
    if len(constant):
        square[constant] = weight[constant] * _spread(mesh, nodes, values, constant)
    area = np.bincount(mesh.element, mesh.weight)
    total = np.bincount(element, square, mesh.n_elements) / area
    near = np.full(mesh.n_elements, np.inf)
    np.minimum.at(near, element, rim_distance(mesh, nodes))
    margin = np.array(MARGIN)[np.minimum(mesh.order, len(MARGIN) - 1)]
    margin = np.where(near < area ** (1.0 / (mesh.dim - 1)), RIM * margin, margin)
    return np.asarray((margin * np.sqrt(total))[element])


def pressure_tail(mesh: BoundaryMesh, nodes: Index, pressure: Array, opened: Mask) -> Array:
    """Estimated error (m,) of p: `tail`, and all of p where a contact that ends on the part covers less than `FEW` elements.

    What no element resolves has no tail: a spot inside of one element of order 1 may have the same p at all of its nodes.
    """
    error, element = tail(mesh, nodes, pressure[:, None]), mesh.element[nodes]
    if opened.any() and np.count_nonzero(np.bincount(element[pressure > 0.0])) < FEW:
        total = np.bincount(element, mesh.weight[nodes] * pressure**2)[element]
        return np.maximum(error, np.sqrt(total / np.bincount(element, mesh.weight[nodes])[element]))
    return error


def rim_distance(mesh: BoundaryMesh, nodes: Index) -> Array:
    """Distance (m,) from nodes to the nearest node of another part, infinite where there is none [length]."""
    result, part = np.full(len(nodes), np.inf), mesh.node_part
    for number in np.unique(part[nodes]):
        others, mine = np.flatnonzero(part != number), part[nodes] == number
        if len(others):
            result[mine] = scipy.spatial.cKDTree(mesh.x[others]).query(mesh.x[nodes[mine]])[0]
    return result


def _spread(mesh: BoundaryMesh, nodes: Index, values: Array, asked: Index) -> Array:
    """Mean square (q,) of what slopes add on elements of order 0, from values at the nearest neighbours of their nodes."""
    x, normal = mesh.x[nodes], mesh.normal[nodes]
    near = scipy.spatial.cKDTree(x).query(x[asked], k=min(4 * mesh.dim - 5, len(x)))[1].reshape(len(asked), -1)
    smooth = (np.einsum("qkd,qd->qk", normal[near], normal[asked]) > SMOOTH)[..., None]
    along = np.einsum("qkd,qtd->qkt", x[near] - x[asked, None], mesh.tangents(nodes[asked])) * smooth
    gradient = np.linalg.pinv(along, rcond=1e-6) @ ((values[near] - values[asked, None]) * smooth)
    size = mesh.weight[nodes[asked]] ** (1.0 / (mesh.dim - 1))
    return np.asarray(np.sum(gradient**2, axis=(1, 2)) * size**2 / 12.0)
