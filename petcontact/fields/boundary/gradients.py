"""Derivatives of nodal values along the boundary, by the basis of each element."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...mesh.surface_mesh import SurfaceMesh


def surface_gradient(mesh: SurfaceMesh, values: Array, element: Index, place: Array) -> Array:
    """Return the derivatives of nodal values along the boundary of a body in space.

    Parameters
    ----------
    mesh : SurfaceMesh
        n nodes.
    values : (n, k) array
    element : (q,) array
        Numbers of elements.
    place : (q, 2) array
        Places on the elements (see `Hits`): local coordinates of panels.

    Returns
    -------
    (q, k, 3) array
        Gradient of each value in the tangent plane, along the coordinate axes [1/length].
    """
    result = np.empty((len(element), values.shape[1], 3))
    for rows, panels in mesh.by_kind(element):
        local = place[rows][:, None]
        nodes = mesh.first_node[element[rows]][:, None] + np.arange(panels.n_nodes)
        by_place = np.einsum("qbc,qbk->qkc", panels.basis_slopes(local)[:, 0], values[nodes])
        vectors = panels.tangent_vectors(local)[:, 0]
        # the dual of two vectors: g^ab t_b
        metric = np.einsum("qac,qbc->qab", vectors, vectors)
        result[rows] = by_place @ np.linalg.solve(metric, vectors)
    return result
