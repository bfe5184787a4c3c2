"""Removal of the stress that discontinuous elements cause at their ends.

If the displacement jumps at the joint of two elements, the stress grows like 1/distance, as at a
dislocation. If its slope or the traction jumps, the stress grows like the logarithm. Both jumps are
errors of the boundary data. Next to a joint the data of its two elements are therefore made
continuous before the fields are evaluated. That is done up to a fifth of the shorter element away.
At other points the original data are better, because nodal values are more accurate than values at
the ends.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from ..arrays import Array, Index, Mask
from ..geometry.arcs import end_tangents
from ..linalg.nearest import Nearest
from ..mesh.basis import gauss, lagrange, lagrange_coefficients
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.elements import Elements
from ..mesh.grading import CORNER

KEPT_JUMP, KEPT_SHARE = 0.5, 0.1
"""Jump of a traction over its range on both elements, and over its mean size on the boundary [-].
If it exceeds both, the traction is taken to jump in reality; errors of the data are smaller."""
CUBIC = 3
"""Order of elements that can have a given value and slope at one end and zeros at the other."""


Neighbourhood = tuple[Index, Array, Elements, Array, Array]
"""Points next to one joint, and the change of the data on its two elements: the numbers of the
points (k,), the share of the change that each receives, from 1 at the joint to 0 at the rim of its
neighbourhood (k,) [-], the element that ends at the joint and the one that begins there, of order
3, and the change of the displacement [length] and of the traction at their nodes, (8, 2, s)."""


class Joints:
    """The joints of the elements of a mesh, and the jumps of boundary data there.

    Parameters
    ----------
    mesh : CurveMesh
        n nodes.
    u, traction : (n, 2, s) arrays
        Displacement [length] and traction, in any unit, at the nodes, in s states.
    """

    def __init__(self, mesh: CurveMesh, u: Array, traction: Array) -> None:
        self._mesh = mesh
        _, after = mesh.neighbours()
        self._after, self._nearest = after, Nearest(mesh.end)
        # the neighbourhood of a joint is a fifth of its shorter element
        self._reach = 0.2 * np.minimum(mesh.length, mesh.length[after])
        (u_start, u_end), (slope_start, slope_end) = _at_ends(mesh, u)
        (t_start, t_end), _ = _at_ends(mesh, traction)
        jump = t_start[after] - t_end
        size = np.linalg.norm(jump, axis=1)
        mean = np.sqrt(
            mesh.weight @ np.sum(traction**2, axis=1) / mesh.weight.sum()
        )  # of each state
        in_truth = size > np.maximum(KEPT_JUMP * _range(mesh, traction, after), KEPT_SHARE * mean)
        # at corners, and where the traction jumps in reality, only u is continuous
        smooth = (runs_on(mesh)[:, None] & ~in_truth)[:, None]
        # nothing jumps on the axis, where an element is its own neighbour
        own = (after == np.arange(len(after)))[:, None, None]
        self._u = np.where(own, 0.0, u_start[after] - u_end)
        self._slope = np.where(smooth, slope_start[after] - slope_end, 0.0)
        self._traction = np.where(smooth, jump, 0.0)

    def near(self, points: Array) -> list[Neighbourhood]:
        """Return the neighbourhoods that contain some of the points (m, 2)."""
        joint = self._nearest(points)[:, 0]
        ratio = np.linalg.norm(points - self._mesh.end[joint], axis=1) / self._reach[joint]
        inside = np.flatnonzero(ratio < 1.0)
        share = np.where(
            ratio <= 0.5, 1.0, 0.5 - 0.5 * np.cos(2.0 * np.pi * np.minimum(ratio, 1.0))
        )
        order = inside[np.argsort(joint[inside], kind="stable")]
        groups = np.split(order, np.flatnonzero(np.diff(joint[order])) + 1) if len(order) else []
        return [self._neighbourhood(int(joint[rows[0]]), rows, share[rows]) for rows in groups]

    def _neighbourhood(self, joint: int, rows: Index, share: Array) -> Neighbourhood:
        mesh = self._mesh
        pair = np.array([joint, self._after[joint]])
        elements = Elements(
            mesh.start[pair], mesh.end[pair], mesh.curvature[pair], CUBIC, mesh.line[pair], pair
        )
        # both ends move to a weighted mean, in which the shorter element counts more
        weight = mesh.length[pair] / mesh.length[pair].sum()
        x = gauss(CUBIC)[0][:, None, None]
        value, slope = 0.25 * (2.0 + 3.0 * x - x**3), 0.25 * (x**3 + x**2 - x - 1.0)
        changes_u, changes_t = [], []
        for share_of, half, turn in (
            (weight[0], 0.5 * mesh.length[joint], 1),
            (-weight[1], 0.5 * mesh.length[pair[1]], -1),
        ):
            changes_u.append(
                share_of
                * (value * self._u[joint] + turn * half * slope * self._slope[joint])[::turn]
            )
            changes_t.append(share_of * (0.5 * (1.0 + x) * self._traction[joint])[::turn])
        return rows, share, elements, np.concatenate(changes_u), np.concatenate(changes_t)


@functools.singledispatch
def joints_of(
    mesh: BoundaryMesh, u: Array, traction: Array
) -> Callable[[Array], list[Neighbourhood]]:
    """Return what finds the neighbourhoods of points (m, d); surfaces have none."""
    return lambda points: []


@joints_of.register
def _(mesh: CurveMesh, u: Array, traction: Array) -> Callable[[Array], list[Neighbourhood]]:
    return Joints(mesh, u, traction).near


def runs_on(mesh: CurveMesh) -> Mask:
    """Return whether the boundary is smooth from each element to the next one, (n_elements,).

    On the axis of a body of revolution an element has no next one.
    """
    _, after = mesh.neighbours()
    first, last = end_tangents(mesh.start, mesh.end, mesh.half_angle)
    smooth = np.sum(last * first[after], axis=1) > np.cos(CORNER)
    return np.asarray(smooth & (after != np.arange(mesh.n_elements)))


def _at_ends(mesh: CurveMesh, values: Array) -> tuple[Array, Array]:
    """Return values and their derivatives by arc length at the starts and ends of elements.

    Each array is (2, n_elements, 2, s).
    """
    ends, slopes = (np.empty((2, mesh.n_elements, *values.shape[1:])) for _ in range(2))
    for p in np.unique(mesh.order).tolist():
        numbers, k = np.flatnonzero(mesh.order == p), np.arange(p + 1)
        nodes = mesh.first_node[numbers][:, None] + k
        # P_k'(±1) = (±1)^(k+1) k(k+1)/2
        slope = 0.5 * k * (k + 1) * np.array([(-1.0) ** (k + 1), np.ones(p + 1)])
        ends[:, numbers] = np.einsum(
            "be,nbcs->encs", lagrange(p, np.array([-1.0, 1.0])), values[nodes]
        )
        slopes[:, numbers] = np.einsum(
            "ek,bk,nbcs->encs", slope, lagrange_coefficients(p), values[nodes]
        )
    return ends, slopes / (0.5 * mesh.length[:, None, None])


def _range(mesh: CurveMesh, values: Array, after: Index) -> Array:
    """Return the range of nodal values over each element and the next one, (n_elements, s).

    It is the diagonal of the box that holds the values.
    """
    low, high = (ufunc.reduceat(values, mesh.first_node[:-1]) for ufunc in (np.minimum, np.maximum))
    return np.asarray(
        np.linalg.norm(np.maximum(high, high[after]) - np.minimum(low, low[after]), axis=1)
    )
