"""Edges of a body in space: where panels meet, and at which angles."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Index
from ...geometry.quadratic import on_side
from ...linalg.nearest import within
from ...mesh.surface_mesh import SurfaceMesh

TOGETHER = 0.02
"""Distance of the middle of a panel's side from another side up to which both are one edge, over
the length of the shorter one and the width of the narrower panel [-]. A step of this share from the
middle towards the centre of the panel says on which side of the other panel it lies."""
SMOOTH = math.radians(15.0)
"""Angle between panels with equal conditions up to which they may be pieces of one curved surface
[rad]."""


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
    off = _distance(x[i], a[j], x[j], b[j])
    near = off < TOGETHER * np.minimum(width[i], width[j])
    # the middle of a side may also be a corner of smaller panels, where their sides end
    near &= np.abs(np.sum((x[i] - x[j]) * (b - a)[j], axis=1)) < length[j] * (
        0.5 * length[j] - np.minimum(TOGETHER * length[j], 0.25 * length[i])
    )
    i, j = i[near], j[near]
    turn = np.arccos(np.clip(np.sum(normal[i] * normal[j], axis=1), -1.0, 1.0))
    turn *= np.where(np.sum(inside[i] * normal[j], axis=1) <= 0.0, -1.0, 1.0)  # convex ones
    return numbers[panel[i]], numbers[panel[j]], math.pi + turn, _shorter(a, b, i, j)


def _shorter(start: Array, end: Array, one: Index, other: Index) -> Array:
    """The ends of the shorter of two sides each, (k, 2, 3)."""
    length = np.linalg.norm(end - start, axis=1)
    shorter = np.where(length[one] < length[other], one, other)
    return np.asarray(np.stack([start, end], axis=1)[shorter])


def _distance(x: Array, start: Array, middle: Array, end: Array) -> Array:
    """Return the distance of points (k, 3) from quadratic sides, across their chords [length]."""
    along = end - start
    share = np.clip(np.sum((x - start) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(x - on_side(start, middle, end, share[:, None]), axis=1))
