"""Smooth boundary data from those of constant elements, for fields close to the boundary.

A displacement that is constant on each element jumps at their ends like a row of dislocations.
Their stress decays only at a distance of one or two elements. The nodal values are accurate at the
middle of the elements. Fields inside are therefore evaluated from a continuous interpolation of
these values, which is quadratic on each element.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from ..arrays import Array, Index, Mask
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from .joints import runs_on


@functools.singledispatch
def smoothed(mesh: BoundaryMesh, u: Array, traction: Array) -> tuple[BoundaryMesh, Array, Array]:
    """Return the mesh and the data with constant elements made smooth; surfaces do not change."""
    return mesh, u, traction


@smoothed.register
def _(mesh: CurveMesh, u: Array, traction: Array) -> tuple[CurveMesh, Array, Array]:
    """Return the mesh with its constant elements made quadratic, and the boundary data on it.

    The data of other elements do not change.

    Parameters
    ----------
    mesh : CurveMesh
        n nodes.
    u, traction : (n, k), (n, l) arrays
        Displacement, or another field as smooth [length], and traction [stress] at the nodes.

    Returns
    -------
    mesh : CurveMesh
    u, traction : (N, k), (N, l) arrays
        Data at the N nodes of the new mesh. The displacement is continuous, also at corners. The
        traction is continuous inside parts where the outline is smooth.
    """
    constant = mesh.order == 0
    if not constant.any():
        return mesh, u, traction
    finer = replace(mesh, order=np.where(constant, 2, mesh.order))
    joined_before, joined_after, before, after = _neighbours(mesh)
    u_ends = _end_values(mesh, u, joined_before, joined_after, before, after)
    t_ends = _end_values(mesh, traction, joined_before, joined_after, before, after)
    u_ends = _continuous(u_ends, before, after)
    numbers = np.flatnonzero(constant)
    nodes = finer.first_node[numbers][:, None] + np.arange(3)
    new_u, new_t = (np.empty((finer.n_nodes, values.shape[1])) for values in (u, traction))
    kept_new, kept_old = ~constant[finer.element], ~constant[mesh.element]
    new_u[kept_new], new_t[kept_new] = u[kept_old], traction[kept_old]
    s = finer.xi[nodes[0]]
    # the quadratic through both ends and the middle
    basis = np.stack([0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)])
    for values, ends, out in ((u, u_ends, new_u), (traction, t_ends, new_t)):
        three = [ends[0][numbers], values[mesh.first_node[numbers]], ends[1][numbers]]
        out[nodes] = np.einsum("ks,kec->esc", basis, np.stack(three))
    return finer, new_u, new_t


def _neighbours(mesh: CurveMesh) -> tuple[Mask, Mask, Index, Index]:
    """Return whether the data are smooth to the element before and to the one after each element,
    and the numbers of both neighbours."""
    before, after = mesh.neighbours()
    smooth = (mesh.part == mesh.part[after]) & runs_on(mesh)
    # on the axis an element is its own neighbour
    return smooth[before] & (before != np.arange(mesh.n_elements)), smooth, before, after


def _end_values(
    mesh: CurveMesh,
    values: Array,
    joined_before: Mask,
    joined_after: Mask,
    before: Index,
    after: Index,
) -> tuple[Array, Array]:
    """Return values at the start and at the end of each element, (n_elements, k) each.

    They are interpolated between smooth neighbours, and extrapolated elsewhere.
    """
    middle = mesh.basis_at(np.arange(mesh.n_elements), np.full(mesh.n_elements, 0.5)) @ values
    half = 0.5 * mesh.length
    slope_after = (middle[after] - middle) / (half + half[after])[:, None]
    slope_before = slope_after[before]
    both = joined_before & joined_after
    # derivative at the middle, of the parabola through three middles or the line through two
    share = ((half + half[before]) / (half[after] + 2.0 * half + half[before]))[:, None]
    central = share * slope_after + (1.0 - share) * slope_before
    curve = np.where(
        both[:, None],
        (slope_after - slope_before) / (half[after] + 2.0 * half + half[before])[:, None],
        0.0,
    )
    slope = np.where(
        both[:, None],
        central,
        np.where(
            joined_after[:, None], slope_after, np.where(joined_before[:, None], slope_before, 0.0)
        ),
    )
    # an element with one smooth neighbour takes its second derivative, so that extrapolation is of
    # second order
    for joined, neighbour, sign in ((joined_after, after, -1.0), (joined_before, before, 1.0)):
        only = joined & ~both & both[neighbour]
        curve[only] = curve[neighbour][only]
        slope[only] += (sign * (half + half[neighbour])[:, None] * curve)[only]
    h = half[:, None]
    start, end = middle - h * slope + h * h * curve, middle + h * slope + h * h * curve
    # the value at the joint of two smooth neighbours is the mean of both
    start_mean, end_mean = 0.5 * (start + end[before]), 0.5 * (end + start[after])
    return np.where(joined_before[:, None], start_mean, start), np.where(
        joined_after[:, None], end_mean, end
    )


def _continuous(ends: tuple[Array, Array], before: Index, after: Index) -> tuple[Array, Array]:
    start, end = ends
    own = np.arange(len(before))
    return (
        np.where((before == own)[:, None], start, 0.5 * (start + end[before])),
        np.where((after == own)[:, None], end, 0.5 * (end + start[after])),
    )
