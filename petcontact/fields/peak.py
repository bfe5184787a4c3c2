"""The largest stress in a body: where it is, and whether that is a place where stresses have no
bound."""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array
from ..frozen import frozen
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh

PERCENT = 99.0
"""What is left out by the stress that a picture's colours reach to."""
NEAR = 0.02
"""Distance to a corner, over the body's diagonal, within which a largest stress is the corner's."""
SMOOTH = float(np.cos(np.radians(10.0)))


@frozen
class Peak:
    """The largest of a stress among the points of a field.

    Attributes
    ----------
    stress, usual : float
        The largest, and the one that 99 % of the points stay below [stress].
    place : (d,) array
        [length]
    corner : str
        The parts that meet there, where it is a corner or a change of conditions; else empty.
        Stress may be infinite at such places, so that the largest value says how near to them the
        points are, and no more.
    """

    stress: float
    usual: float
    place: Array
    corner: str

    def __str__(self) -> str:
        place = ", ".join(f"{component:.4g}" for component in self.place)
        where = f" where {self.corner} meet and stress may be infinite" if self.corner else ""
        return (
            f"{self.stress:.4g} at ({place}){where}; {PERCENT:g} % of the points stay below "
            f"{self.usual:.4g}"
        )


def peak_of(mesh: BoundaryMesh, points: Array, stress: Array) -> Peak:
    """The largest of stresses (n,) at points (n, d) of a body."""
    place = points[int(np.argmax(stress))]
    return Peak(
        float(stress.max()), float(np.percentile(stress, PERCENT)), place, corner_at(mesh, place)
    )


@functools.singledispatch
def corner_at(mesh: object, place: Array) -> str:
    """The parts that meet at the corner, or the end of a part, next to a place (d,), in words;
    empty where none is. Corners are looked for in the plane."""
    return ""


@corner_at.register
def _(mesh: CurveMesh, place: Array) -> str:
    vertex, names = corners(mesh)
    distance = np.hypot(*(vertex - place).T)
    near = len(distance) > 0 and distance.min() < NEAR * float(
        np.hypot(*np.ptp(mesh.start, axis=0))
    )
    return names[int(np.argmin(distance))] if near else ""


def corners(mesh: CurveMesh) -> tuple[Array, list[str]]:
    """Where the outline turns or one part ends and another begins, (k, 2) [length], and the parts
    that meet there."""
    before, _ = mesh.neighbours()
    first, last = mesh.on_elements(np.arange(mesh.n_elements), np.array([-1.0, 1.0]))[1].transpose(
        1, 0, 2
    )
    turns = np.sum(last[before] * first, axis=1) < SMOOTH
    turns &= before != np.arange(mesh.n_elements)
    found = np.flatnonzero(turns | (mesh.part != mesh.part[before]))
    names = [[mesh.part_names[mesh.part[j]] for j in (before[k], k)] for k in found]
    return mesh.start[found], [f"two sides of {a}" if a == b else f"{a} and {b}" for a, b in names]
