"""Exponents of the singularities along the edges of a body in space.

They follow from the angle at an edge and the conditions on both sides. Across a straight edge the
strongest singularity is that of a corner in plane strain (`corner_exponent`), or of shear along the
edge (`shear_exponent`).
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from ...arrays import Array, Index
from ...given.bodies import Body
from ...linalg.nearest import within
from ...mesh.surface_mesh import SurfaceMesh
from ..corner_exponents import CLAMPED, corner_exponent, shear_exponent
from ..singular_points import kinds_of

TOGETHER = 0.02
"""Distance of the middle of a panel's side from another side up to which both are one edge, over
the length of the shorter one and the width of the narrower panel [-]. A step of this share from the
middle towards the centre of the panel gives the inward direction."""
SMOOTH = math.radians(15.0)
"""Angle between panels with equal conditions up to which they may be pieces of one curved surface
[rad]."""


def edge_exponent(mesh: SurfaceMesh, body: Body) -> float:
    """Return the least λ in (0, 1] along the edges of a body; displacements behave like r^λ there.

    Parameters
    ----------
    mesh : SurfaceMesh
    body : Body
        A body with conditions on its parts.

    Examples
    --------
    >>> from petcontact import Problem
    >>> from petcontact.refinement.meshes import mesh_of
    >>> problem = Problem.model_validate({
    ...     "material": {"young_modulus": 1.0, "poisson_ratio": 0.3}, "mesh": {"element_size": 1.0},
    ...     "geometry": {"shape": "box", "lower": [0, 0, 0], "upper": [1, 1, 1]},
    ...     "boundary": [{"part": "top", "condition": "displacement", "value": [0, 0, 0]}]})
    >>> body = problem.bodies[0]
    >>> round(edge_exponent(mesh_of(body, problem.outline()), body), 3)
    0.711
    """
    conditions = {condition.part: condition for condition in body.boundary}
    kind = [kinds_of(conditions.get(name)) for name in mesh.part_names]
    kappa = 3.0 - 4.0 * body.material.plane_strain_ratio
    first_panel, second_panel, angle = edges(mesh)[:3]
    meeting = np.column_stack(
        [mesh.part[first_panel], mesh.part[second_panel], np.rint(np.degrees(angle)).astype(int)]
    )
    corners = {(kind[a], kind[b], number) for a, b, number in np.unique(meeting, axis=0).tolist()}
    exponents = [
        min(
            corner_exponent(math.radians(number), kappa, first, second),
            shear_exponent(math.radians(number), first == CLAMPED, second == CLAMPED),
        )
        for ones, others, number in corners
        if ones != others or abs(math.radians(number) - math.pi) > SMOOTH
        for first, second in itertools.product(ones, others)
    ]
    return min(exponents, default=1.0)


def edges(mesh: SurfaceMesh) -> tuple[Index, Index, Array, Array]:
    """Return the pairs of panels that meet at an edge, the interior angle there, in (0, 2π) [rad],
    and the ends of the edge.

    Sides of panels need not coincide: a side is paired with those on which its middle lies.

    Returns
    -------
    one, other : (k,) arrays
        Numbers of panels.
    angle : (k,) array
    ends : (k, 2, 3) array
        Of what both have of the edge [length].
    """
    numbers, faces = mesh.faces(*mesh.part_names)
    panel, start, end = faces.rims()
    middle = 0.5 * (start + end)
    (a, _), (b, _), (x, normal) = (faces.at(panel, points) for points in (start, end, middle))
    inside = (
        faces.at(panel, middle + TOGETHER * (faces.polygon[panel].mean(axis=1) - middle))[0] - x
    )
    length = np.linalg.norm(b - a, axis=1)
    j, i = within(x, x, (0.5 + TOGETHER) * length)
    i, j = i[panel[i] != panel[j]], j[panel[i] != panel[j]]
    width = np.minimum(length, 2.0 / TOGETHER * np.linalg.norm(inside, axis=1))
    near = np.minimum(
        _distance(x[i], a[j], x[j]), _distance(x[i], x[j], b[j])
    ) < TOGETHER * np.minimum(width[i], width[j])
    # the middle of a side may also be a corner of smaller panels, where their sides end
    near &= np.abs(np.sum((x[i] - x[j]) * (b - a)[j], axis=1)) < length[j] * (
        0.5 * length[j] - np.minimum(TOGETHER * length[j], 0.25 * length[i])
    )
    i, j = i[near], j[near]
    inside -= (np.sum(inside * (b - a), axis=1) / length**2)[:, None] * (b - a)
    inside /= np.linalg.norm(inside, axis=1, keepdims=True)
    between = np.arccos(np.clip(np.sum(inside[i] * inside[j], axis=1), -1.0, 1.0))
    convex = np.sum(inside[i] * normal[j], axis=1) <= 0.0
    between = np.where(convex, between, 2.0 * math.pi - between)
    return numbers[panel[i]], numbers[panel[j]], between, _shorter(a, b, i, j)


def _shorter(start: Array, end: Array, one: Index, other: Index) -> Array:
    """The ends of the shorter of two sides each, (k, 2, 3)."""
    length = np.linalg.norm(end - start, axis=1)
    shorter = np.where(length[one] < length[other], one, other)
    return np.asarray(np.stack([start, end], axis=1)[shorter])


def _distance(x: Array, start: Array, end: Array) -> Array:
    """Return the distance of points (k, 3) from segments [length]."""
    along = end - start
    share = np.clip(np.sum((x - start) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(x - start - share[:, None] * along, axis=1))
