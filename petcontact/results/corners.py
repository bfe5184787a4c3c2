"""Corners of the outline of a body, or edges of its surface, where parts end or sides turn."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..mesh.surface_mesh import SurfaceMesh
from ..refinement.panels.edges import SMOOTH, edges


@dataclass(frozen=True)
class Corners:
    """Corners of an outline, or edges of a surface.

    Attributes
    ----------
    ends : (k, 2, d) array
        Of each; a corner is both its ends [length].
    element : (k, 2) array
        The elements that meet there.
    angle : (k,) array
        Of the body, in (0, 2π) [rad].
    leaving : (k, 2) array
        Direction of the two sides away from a corner of the plane [rad].
    """

    ends: Array
    element: Index
    angle: Array
    leaving: Array

    @property
    def x(self) -> Array:
        """The middle of each (k, d) [length]."""
        return np.asarray(self.ends.mean(axis=1))

    @property
    def points(self) -> Array:
        """Those that are points, not edges (k', d) [length]."""
        return np.asarray(self.ends[(self.ends[:, 0] == self.ends[:, 1]).all(axis=1), 0])


@functools.singledispatch
def corners_of(mesh: Any) -> Corners:
    """Where the sides of a body turn, or one part ends and another begins."""
    before, _ = mesh.neighbours()
    normal = mesh.on_elements(np.arange(mesh.n_elements), np.array([-1.0, 1.0]))[1]
    ends = normal[..., ::-1] * [-1.0, 1.0]
    arriving, leaving = ends[before, 1], ends[:, 0]
    turn = np.arctan2(
        arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0],
        np.sum(arriving * leaving, axis=1),
    )
    chosen = np.flatnonzero((np.abs(turn) > SMOOTH) | (mesh.part != mesh.part[before]))
    away = np.stack([leaving[chosen], -arriving[chosen]], axis=1)
    return Corners(
        mesh.start[chosen][:, None].repeat(2, axis=1),
        np.column_stack([chosen, before[chosen]]),
        math.pi - turn[chosen],
        np.arctan2(away[..., 1], away[..., 0]),
    )


@corners_of.register
def _(mesh: SurfaceMesh) -> Corners:
    one, other, angle, ends = edges(mesh)
    chosen = (one < other) & (
        (np.abs(angle - math.pi) > SMOOTH) | (mesh.part[one] != mesh.part[other])
    )
    element = np.column_stack([one[chosen], other[chosen]])
    return Corners(ends[chosen], element, angle[chosen], np.zeros(element.shape))
