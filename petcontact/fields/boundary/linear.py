"""The linear field next to each element, whose slopes along curved elements the elements'
polynomials do not hold.

An element of order p interpolates u in its own coordinates. On a curved one that is not exact for u
= A x: a rigid rotation would have strains, of the rotation times the error of the interpolated
position. What is interpolated, and fitted, is therefore u - A x, and A times the exact position is
added to it: linear fields are exact on every element of every shape, and what is left to the
polynomials is smaller. A is a fit and need not be accurate where the element is flat: it drops out.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import scipy

from ...arrays import Array, Mask
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...round_off import HALF, SUMMED
from .places import middles


def linear_parts(mesh: BoundaryMesh, x: Array, values: Array) -> Array:
    """Slopes A of linear fields through nodal values, each fitted to the nodes of an element and to
    those around it.

    Parameters
    ----------
    mesh : BoundaryMesh
        n nodes.
    x : (n, d) array
        Position that goes with the values: that of the nodes, or made smooth as they are [length].
    values : (n, k) array

    Returns
    -------
    (n_elements, k, d) array
        Exact where the values are linear, up to the slope across a plane, which is 0 where the
        nodes lie on one; 0 on elements whose polynomials hold linear fields [1/length].
    """
    elements, d = np.flatnonzero(_bent(mesh, x)), mesh.dim
    result = np.zeros((mesh.n_elements, values.shape[1], d))
    if not len(elements):
        return result
    counts = np.diff(mesh.first_node)[elements]
    at = mesh.variables_at(elements, middles(mesh)[1][elements])
    middle, normal = (np.column_stack([at[f"{n}{axis}"] for axis in "xyz"[:d]]) for n in ("", "n"))
    # five nodes for each coefficient; those of the element come on top
    count = min(5 * (d + 1), mesh.n_nodes)
    near = scipy.spatial.cKDTree(mesh.x).query(middle, k=count)[1].reshape(len(elements), -1)
    own = np.arange(int(counts.max(initial=0)))
    nodes = np.hstack(
        [mesh.first_node[elements][:, None] + np.minimum(own, counts[:, None] - 1), near]
    )
    # nodes of the other side of a slit or of a thin part have a normal that turns by more
    weight = np.hstack(
        [own < counts[:, None], np.einsum("qcd,qd->qc", mesh.normal[near], normal) > -0.5]
    )[..., None]
    far, change = (
        field[nodes]
        - (weight * field[nodes]).sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True)
        for field in (x, values)
    )
    result[elements] = (np.linalg.pinv(weight * far, rcond=HALF) @ (weight * change)).transpose(
        0, 2, 1
    )
    return result


@functools.singledispatch
def _bent(mesh: Any, x: Array) -> Mask:
    """Elements that need linear parts, or whose neighbours do, (n_elements,)."""
    return np.full(mesh.n_elements, True)


@_bent.register
def _(mesh: CurveMesh, x: Array) -> Mask:
    moved = np.abs(x - mesh.x).max(axis=1) > SUMMED * np.abs(x).max()
    bent = (mesh.curvature != 0.0) | np.logical_or.reduceat(moved, mesh.first_node[:-1])
    before, after = mesh.neighbours()
    return np.asarray(bent | bent[before] | bent[after])
