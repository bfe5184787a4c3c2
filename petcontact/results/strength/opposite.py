"""The point of another body that a corner faces."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...fields.boundary.places import meeting
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record
from ...round_off import SINGLE
from .touching import Touching


@record
class Opposite:
    """The point of another body that a corner faces.

    Attributes
    ----------
    foot : (d,) array
        The point [length].
    elements : (k,) array
        The elements that meet there.
    off : float
        How far it lies beside the normal through the corner: its part ends before [length].
    """

    foot: Array
    elements: Index
    off: float


def opposite(mesh: BoundaryMesh, x: Array, closed: Touching) -> Opposite:
    """Return the point on the part of a body that a corner (d,) of another one touches."""
    part, normal = closed.partner.part, closed.normal
    key = "opposite", part, x.tobytes(), normal.tobytes()
    return mesh.once(key, lambda: _opposite(mesh, x, part, normal))


def _opposite(mesh: BoundaryMesh, x: Array, part: str, normal: Array) -> Opposite:
    near = (1.0 + SINGLE) * float(np.linalg.norm(mesh.x[mesh.nodes_of(part)] - x, axis=1).min())
    across, point = meeting(mesh, x, near, part)[0] - x, x
    if along := float(across @ normal):
        point = x + normal * float(across @ across) / along
    foot, elements = meeting(mesh, point, near, part)
    beside = foot - x - ((foot - x) @ normal) * normal
    return Opposite(foot, elements, float(np.linalg.norm(beside)))
