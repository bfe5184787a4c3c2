"""Derivatives of nodal values along the boundary, by the basis of each element."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...mesh.basis import lagrange_slopes
from ...mesh.curve_mesh import CurveMesh
from ...mesh.surface_mesh import SurfaceMesh


@functools.singledispatch
def surface_gradient(mesh: Any, values: Array, element: Index, place: Array) -> Array:
    """Return the derivatives of nodal values along the boundary.

    Parameters
    ----------
    mesh : BoundaryMesh
        n nodes.
    values : (n, k) array
    element : (q,) array
        Numbers of elements.
    place : (q,) or (q, 2) array
        Places on the elements (see `Hits`): fractions of the arc length, or local coordinates of
        panels.

    Returns
    -------
    (q, k, d) array
        Gradient of each value in the tangent plane, along the coordinate axes [1/length].
    """
    raise TypeError(f"no gradients on {type(mesh).__name__}")


@surface_gradient.register
def _(mesh: CurveMesh, values: Array, element: Index, place: Array) -> Array:
    slope, xi = np.empty((len(element), values.shape[1])), 2.0 * place - 1.0
    for order in np.unique(mesh.order[element]).tolist():
        mine = np.flatnonzero(mesh.order[element] == order)
        nodes = mesh.first_node[element[mine]][:, None] + np.arange(order + 1)
        slope[mine] = np.einsum("bq,qbk->qk", lagrange_slopes(order, xi[mine]), values[nodes])
    slope /= 0.5 * mesh.length[element][:, None]
    return np.asarray(slope[:, :, None] * tangents(mesh, element, place)[:, None])


@surface_gradient.register
def _(mesh: SurfaceMesh, values: Array, element: Index, place: Array) -> Array:
    result = np.empty((len(element), values.shape[1], 3))
    for kind in np.unique(mesh.kind[element]):
        mine = np.flatnonzero(mesh.kind[element] == kind)
        panels, local = mesh.elements(element[mine]), place[mine][:, None]
        nodes = mesh.first_node[element[mine]][:, None] + np.arange(panels.n_nodes)
        by_place = np.einsum("qbc,qbk->qkc", panels.basis_slopes(local)[:, 0], values[nodes])
        vectors = panels.tangent_vectors(local)[:, 0]
        # the dual of two vectors: g^ab t_b
        metric = np.einsum("qac,qbc->qab", vectors, vectors)
        result[mine] = by_place @ np.linalg.solve(metric, vectors)
    return result


def tangents(mesh: CurveMesh, element: Index, place: Array) -> Array:
    """Return unit vectors (q, 2) along curves, with the body on their left."""
    variables = mesh.variables_at(element, place)
    return np.column_stack([-variables["ny"], variables["nx"]])
