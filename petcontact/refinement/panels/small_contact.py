"""Contacts that are smaller than a panel: Hertz' theory gives their size, and panels are cut to
it."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Index, Mask
from ...mesh.surface_mesh import SurfaceMesh
from ...record import record
from .cut_directions import sides, too_narrow

NEIGHBOURS = 24
"""Number of nodes to whose gaps a parabola is fitted."""
ACROSS = 0.5
"""Largest panel over the half-width of a contact [-]."""
REACH = 1.5
"""Distance from the centre over the half-widths up to which panels are so small [-]. The estimated
half-width of a Hertzian contact is wrong by a few per cent, more if surfaces are not parabolic."""
SMALL = 0.75
"""Half-width of a contact over the size of its panels up to which it counts as small [-]."""
STRAY = 2.5
"""Distance of a closed node beyond the edge, in panels, above which it belongs to another
contact."""


@record
class SmallContact:
    """An ellipse in which contact is expected.

    Attributes
    ----------
    centre, normal : (3,) arrays
        [length], [-].
    axes : (2, 3) array
        Unit vectors along the short and the long axis.
    half : (2,) array
        Half the widths along them [length].
    """

    centre: Array
    normal: Array
    axes: Array
    half: Array

    def too_large(self, mesh: SurfaceMesh, part: str) -> Mask:
        """Return along which coordinates panels of a part near the contact are too long,
        (n_elements, 2)."""
        corners = mesh.corners - self.centre
        local = np.einsum("ecd,ad->eca", corners, self.axes / self.half[:, None])
        low, high = np.nanmin(local, axis=1), np.nanmax(local, axis=1)
        away = np.linalg.norm(np.maximum(0.0, np.maximum(low, -high)), axis=1)
        vectors = sides(mesh)
        length = np.linalg.norm(vectors, axis=2)
        # leave out panels on the opposite side of a thin body
        height = np.nanmin(np.abs(corners @ self.normal), axis=1)
        near = (
            (mesh.part == mesh.part_names.index(part))
            & (away < REACH)
            & (height < length.max(axis=1) + self.half[0])
        )
        along = np.einsum("ekd,ad->eka", vectors, self.axes / self.half[:, None])
        wide = np.linalg.norm(along, axis=2) > ACROSS
        wide |= too_narrow(mesh) & wide.any(axis=1, keepdims=True)
        return np.asarray(near[:, None] & wide)


def small_contact(
    mesh: SurfaceMesh, nodes: Index, pressure: Array, gap: Array, modulus: float
) -> SmallContact | None:
    """Return the contact that Hertz' theory expects from the force, or None if it is not smaller
    than panels.

    A parabola ½(k_1 x² + k_2 y²) with k_1 >= k_2 is fitted to the gap. A force F gives half-widths
    of about c (k_2/k_1)^⅓ and c (k_1/k_2)^⅓ with c³ = 3 F/(4 E* √(k_1 k_2)). If the longer one ends
    beyond the present contact, of length L, the half-width is √(4 F/(π E* L k_1)). Source: Johnson,
    Contact Mechanics, 1985, 4.2.

    Parameters
    ----------
    mesh : SurfaceMesh
        Mesh of the secondary.
    nodes : (m,) int array
        Nodes of the contact.
    pressure, gap : (m,) arrays
        Pressure [stress], and gap after the solve, infinite where nothing is opposite [length].
    modulus : float
        E* of both bodies [stress].
    """
    x, weight, closed = mesh.x[nodes], mesh.weight[nodes], pressure > 0.0
    load = weight * pressure
    force = float(load.sum())
    if (
        not force > 0.0
        or (fit := _parabola(mesh, nodes, gap, load @ x / force, load @ mesh.normal[nodes])) is None
    ):
        return None
    lengths = fit.lengths(mesh, mesh.element[nodes[closed]])
    reach = (x[closed] - mesh.x[nodes].mean(axis=0)) @ fit.axes[1]
    extent = float(np.ptp(reach) + lengths[:, 1].mean())
    k_1, k_2 = fit.curvatures
    scale, ratio = math.cbrt(0.75 * force / (modulus * math.sqrt(k_1 * k_2))), math.cbrt(k_2 / k_1)
    half = np.array([scale * ratio, scale / ratio])
    if 2.0 * half[1] > extent:
        half = np.array([math.sqrt(4.0 * force / (math.pi * modulus * extent * k_1)), 0.5 * extent])
        half = np.sort(half)
    off = np.abs((x[closed] - fit.centre) @ fit.axes[0])
    if half[0] > SMALL * lengths[:, 0].min() or np.any(off > half[0] + STRAY * lengths[:, 0].max()):
        return None
    return SmallContact(fit.centre, fit.normal, fit.axes, half)


def overlapping_contact(
    mesh: SurfaceMesh, nodes: Index, gap: Array, depth: float
) -> SmallContact | None:
    """Return the contact expected around the least gap of surfaces that overlap between nodes, or
    None.

    The result is None if the contact is not smaller than panels. For the overlap δ (`depth`) the
    half-widths are about √(δ/k_1) and √(δ/k_2), which is √(R δ) for spheres. Source: Johnson,
    Contact Mechanics, 1985, 4.2.
    """
    low = nodes[int(np.argmin(gap))]
    fit = _parabola(mesh, nodes, gap, mesh.x[low], mesh.normal[low])
    if fit is None or fit.off > depth:
        return None
    half, along = np.sqrt(depth / fit.curvatures), (mesh.x[nodes] - fit.centre) @ fit.axes[1]
    ends = np.clip([along.min(), along.max()], -half[1], half[1])
    centre = fit.centre + 0.5 * ends.sum() * fit.axes[1]
    expected = SmallContact(centre, fit.normal, fit.axes, np.array([half[0], 0.5 * np.ptp(ends)]))
    return expected if half[0] <= SMALL * fit.lengths(mesh, mesh.element[[low]])[0, 0] else None


@record
class _Parabola:
    """The parabola ½(k_1 x² + k_2 y²) around its lowest point, k_1 >= k_2 > 0 [1/length].

    `axes` (2, 3) are the directions x and y, `off` is its largest difference from the gap [length].
    """

    centre: Array
    normal: Array
    axes: Array
    curvatures: Array
    off: float

    def lengths(self, mesh: SurfaceMesh, panels: Index) -> Array:
        """Return the lengths of panels along the axes, (q, 2) [length]."""
        return np.asarray(
            np.abs(np.einsum("ekd,ad->eka", sides(mesh)[panels], self.axes)).max(axis=1)
        )


def _parabola(
    mesh: SurfaceMesh, nodes: Index, gap: Array, centre: Array, normal: Array
) -> _Parabola | None:
    """Return the parabola fitted to the gap around a point, or None if the gap is not convex."""
    if np.count_nonzero(np.isfinite(gap)) < NEIGHBOURS:
        return None
    x, normal = mesh.x[nodes], normal / (np.linalg.norm(normal) or 1.0)
    distance = np.where(np.isfinite(gap), np.linalg.norm(x - centre, axis=1), np.inf)
    near = np.argsort(distance)[:NEIGHBOURS]
    plane = np.linalg.svd(normal[None])[2][1:]
    z, size = (x[near] - centre) @ plane.T, float(distance[near[-1]])
    first, second = z.T / size
    terms = np.column_stack(
        [np.ones_like(first), first, second, 0.5 * first**2, first * second, 0.5 * second**2]
    )
    coefficients = np.linalg.lstsq(terms, gap[near], rcond=None)[0]
    curvatures, vectors = np.linalg.eigh(
        np.array([[coefficients[3], coefficients[4]], [coefficients[4], coefficients[5]]]) / size**2
    )
    (k_2, k_1), off = curvatures, float(np.abs(terms @ coefficients - gap[near]).max())
    if not k_1 * size**2 > off:
        return None
    axes = vectors[:, ::-1].T @ plane
    # move the centre to the lowest point, along directions with curvature
    slope = vectors[:, ::-1].T @ coefficients[1:3] / size
    lowest = np.where(
        curvatures[::-1] > 0.1 * k_1, -slope / np.maximum(curvatures[::-1], 0.1 * k_1), 0.0
    )
    centre = centre + np.clip(lowest, -size, size) @ axes
    return _Parabola(centre, normal, axes, np.array([k_1, max(k_2, 1e-6 * k_1)]), off)
