"""The linear part of a field near each element, which makes linear fields exact on curved elements.

An element of order p interpolates u in its own coordinates. On a curved element that is not exact
for u = A x. A rigid rotation would cause strains: the rotation times the error of the interpolated
position. Therefore u - A x is interpolated or fitted, and A times the exact position is added.
Linear fields are then exact on elements of any shape, and the polynomials have less to represent. A
is a fit; on flat elements it cancels, so that its accuracy does not matter there.
"""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Mask
from ...linalg.nearest import Nearest
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...round_off import HALF, SUMMED
from .places import middles


def linear_parts(mesh: BoundaryMesh, x: Array, values: Array) -> Array:
    """Return the slopes A of linear fields, each fitted to the nodes of an element and around it.

    Parameters
    ----------
    mesh : BoundaryMesh
        n nodes.
    x : (n, d) array
        Positions that belong to the values: the nodes, or positions made smooth like the values
        [length].
    values : (n, k) array

    Returns
    -------
    (n_elements, k, d) array
        Slopes, exact for linear values [1/length]. If the nodes lie on a plane, the slope across it
        is 0. All slopes are 0 on elements whose polynomials represent linear fields exactly.
    """
    elements, d = np.flatnonzero(_bent(mesh, x)), mesh.dim
    result = np.zeros((mesh.n_elements, values.shape[1], d))
    if not len(elements):
        return result
    counts = np.diff(mesh.first_node)[elements]
    middle, normal = mesh.at(elements, middles(mesh)[1][elements])
    # five nodes for each coefficient, in addition to those of the element
    near = Nearest(mesh.x)(middle, 5 * (d + 1))
    own = np.arange(int(counts.max(initial=0)))
    nodes = np.hstack(
        [mesh.first_node[elements][:, None] + np.minimum(own, counts[:, None] - 1), near]
    )
    # nodes on the other side of a slit or of a thin part have nearly opposite normals
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
def _bent(mesh: BoundaryMesh, x: Array) -> Mask:
    """Return whether each element or one of its neighbours needs a linear part, (n_elements,)."""
    return np.full(mesh.n_elements, True)


@_bent.register
def _(mesh: CurveMesh, x: Array) -> Mask:
    moved = np.abs(x - mesh.x).max(axis=1) > SUMMED * np.abs(x).max()
    bent = (mesh.curvature != 0.0) | np.logical_or.reduceat(moved, mesh.first_node[:-1])
    before, after = mesh.neighbours()
    return np.asarray(bent | bent[before] | bent[after])
