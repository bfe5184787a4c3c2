"""Contacts that are smaller than a panel: where Hertz' theory expects them, and which panels are
too large for them."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Index, Mask
from ...frozen import frozen
from ...mesh.surface_mesh import CURVED, SurfaceMesh
from .axes import NARROWEST, sides

NEIGHBOURS = 24
"""Nodes whose gaps the surfaces are fitted to."""
ACROSS = 0.5
"""Largest panel over the half-width of a contact."""
REACH = 1.5
"""Part of the half-widths within which panels are that small: the estimate of them is off by a few
per cent of a Hertzian contact, by more where surfaces are not parabolic."""
SMALL = 0.75
"""Half-width of a contact over a panel there up to which it is small."""
LINE = 0.05
"""The smaller over the larger curvature of a gap between nodes up to which contact is along a
line."""
STRAY = 2.5
"""Panels by which nodes in contact may lie farther off than its edge: farther ones are another
contact."""


@frozen
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
        """Along which coordinates panels of a part near the contact are too long for it,
        (n_elements, 2)."""
        corners = mesh.corners - self.centre
        local = np.einsum("ecd,ad->eca", corners, self.axes / self.half[:, None])
        low, high = np.nanmin(local, axis=1), np.nanmax(local, axis=1)
        away = np.linalg.norm(np.maximum(0.0, np.maximum(low, -high)), axis=1)
        vectors = sides(mesh)
        length = np.linalg.norm(vectors, axis=2)
        # the same place on the far side of a body is no part of the contact
        height = np.nanmin(np.abs(corners @ self.normal), axis=1)
        here = (
            (mesh.part == mesh.part_names.index(part))
            & (away < REACH)
            & (height < length.max(axis=1) + self.half[0])
        )
        along = np.einsum("ekd,ad->eka", vectors, self.axes / self.half[:, None])
        wide = np.linalg.norm(along, axis=2) > ACROSS
        narrow = np.where(mesh.kind & CURVED > 0, NARROWEST[True], NARROWEST[False])[:, None]
        wide |= (length > 0.75 * narrow * length[:, ::-1]) & wide.any(axis=1, keepdims=True)
        return np.asarray(here[:, None] & wide)


def small_contact(
    mesh: SurfaceMesh, nodes: Index, pressure: Array, gap: Array, modulus: float
) -> SmallContact | None:
    """The contact that Hertz expects of the force and of the surfaces about it; None where it is
    not smaller than panels.

    The gap about the contact is fitted by a parabola; ½(k_1 x² + k_2 y²) with k_1 >= k_2 and a
    force F give half-widths c (k_2/k_1)^⅓ and c (k_1/k_2)^⅓ about, with c³ = 3 F/(4 E* √(k_1 k_2)),
    and where the longer one ends beyond the contact that there is, of length L, √(4 F/(π E* L k_1))
    (Johnson, Contact Mechanics, 1985, 4.2).

    Parameters
    ----------
    mesh : SurfaceMesh
        Of the secondary.
    nodes : (m,) int array
        Those of the contact.
    pressure, gap : (m,) arrays
        [stress]; the gap that is left, infinite where nothing is faced [length].
    modulus : float
        E* of both bodies [stress].
    """
    x, weight, closed = mesh.x[nodes], mesh.weight[nodes], pressure > 0.0
    load = weight * pressure
    force = float(load.sum())
    if (
        not force > 0.0
        or (found := _parabola(mesh, nodes, gap, load @ x / force, load @ mesh.normal[nodes]))
        is None
    ):
        return None
    lengths = found.lengths(mesh, mesh.element[nodes[closed]])
    reach = (x[closed] - mesh.x[nodes].mean(axis=0)) @ found.axes[1]
    extent = float(np.ptp(reach) + lengths[:, 1].mean())
    k_1, k_2 = found.curvatures
    scale, ratio = math.cbrt(0.75 * force / (modulus * math.sqrt(k_1 * k_2))), math.cbrt(k_2 / k_1)
    half = np.array([scale * ratio, scale / ratio])
    if 2.0 * half[1] > extent:
        half = np.array([math.sqrt(4.0 * force / (math.pi * modulus * extent * k_1)), 0.5 * extent])
        half = np.sort(half)
    off = np.abs((x[closed] - found.centre) @ found.axes[0])
    if half[0] > SMALL * lengths[:, 0].min() or np.any(off > half[0] + STRAY * lengths[:, 0].max()):
        return None
    return SmallContact(found.centre, found.normal, found.axes, half)


def overlapping_contact(
    mesh: SurfaceMesh, nodes: Index, gap: Array, depth: float
) -> SmallContact | None:
    """The contact that Hertz expects about where the gap is least, of surfaces that overlap by some
    depth there, between their nodes; None where it is not smaller than panels.

    Half-widths are √(δ/k_1) and √(δ/k_2) about, which of spheres is √(R δ) (Johnson, Contact
    Mechanics, 1985, 4.2).
    """
    low = nodes[int(np.argmin(gap))]
    found = _parabola(mesh, nodes, gap, mesh.x[low], mesh.normal[low])
    if found is None or found.off > depth:
        return None
    k_1, k_2 = found.curvatures
    half, along = np.sqrt(depth / found.curvatures), (mesh.x[nodes] - found.centre) @ found.axes[1]
    reach = np.inf if k_2 < LINE * k_1 else half[1]  # a line as long as the face
    ends = np.clip([along.min(), along.max()], -reach, reach)
    centre = found.centre + 0.5 * ends.sum() * found.axes[1]
    expected = SmallContact(
        centre, found.normal, found.axes, np.array([half[0], 0.5 * np.ptp(ends)])
    )
    return expected if half[0] <= SMALL * found.lengths(mesh, mesh.element[[low]])[0, 0] else None


@frozen
class _Parabola:
    """½(k_1 x² + k_2 y²) beyond its lowest value, k_1 >= k_2 > 0 [1/length], axes along x and y,
    (2, 3), and how far it is off the gap [length]."""

    centre: Array
    normal: Array
    axes: Array
    curvatures: Array
    off: float

    def lengths(self, mesh: SurfaceMesh, panels: Index) -> Array:
        """Of panels along the axes, (q, 2) [length]."""
        return np.asarray(
            np.abs(np.einsum("ekd,ad->eka", sides(mesh)[panels], self.axes)).max(axis=1)
        )


def _parabola(
    mesh: SurfaceMesh, nodes: Index, gap: Array, centre: Array, normal: Array
) -> _Parabola | None:
    """Fitted to the gap about a place; None where it is none."""
    if np.count_nonzero(np.isfinite(gap)) < NEIGHBOURS:
        return None
    x, normal = mesh.x[nodes], normal / (np.linalg.norm(normal) or 1.0)
    distance = np.where(np.isfinite(gap), np.linalg.norm(x - centre, axis=1), np.inf)
    near = np.argsort(distance)[:NEIGHBOURS]
    plane = np.linalg.svd(normal[None])[2][1:]
    z, size = (x[near] - centre) @ plane.T, float(distance[near[-1]])
    one, two = z.T / size
    terms = np.column_stack([np.ones_like(one), one, two, 0.5 * one**2, one * two, 0.5 * two**2])
    found = np.linalg.lstsq(terms, gap[near], rcond=None)[0]
    curvatures, vectors = np.linalg.eigh(
        np.array([[found[3], found[4]], [found[4], found[5]]]) / size**2
    )
    (k_2, k_1), off = curvatures, float(np.abs(terms @ found - gap[near]).max())
    if not k_1 * size**2 > off:
        return None
    axes = vectors[:, ::-1].T @ plane
    # where the parabola is lowest, along what is curved
    slope = vectors[:, ::-1].T @ found[1:3] / size
    lowest = np.where(
        curvatures[::-1] > 0.1 * k_1, -slope / np.maximum(curvatures[::-1], 0.1 * k_1), 0.0
    )
    centre = centre + np.clip(lowest, -size, size) @ axes
    return _Parabola(centre, normal, axes, np.array([k_1, max(k_2, 1e-6 * k_1)]), off)
