"""Stick and slip zones on the contact part of a plane body, as intervals of arc length."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from ..arrays import Array, Index
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..record import record


@record
class Zone:
    """Interval of one contact part in arc length [length]; sign 0 sticks, ±1 slips along
    ±tangent."""

    part: str
    start: float
    end: float
    sign: int

    @property
    def name(self) -> str:
        """The name of the state: "stick" or "slip"."""
        return "slip" if self.sign else "stick"


@functools.singledispatch
def zones_of(mesh: BoundaryMesh, nodes: Index, sign: Array) -> Iterator[Zone]:
    """Yield the intervals of contact nodes with equal sign (0 stick, ±1 slip).

    On surfaces there is none: the field `state` shows the zones there.
    """
    return iter(())


@zones_of.register
def _(mesh: CurveMesh, nodes: Index, sign: Array) -> Iterator[Zone]:
    """Yield zones that end between two elements, or half-way between nodes of one element."""
    arc_length, parts = mesh.arc_length[nodes], mesh.node_part[nodes]
    for part in dict.fromkeys(parts.tolist()):
        chosen = np.flatnonzero(parts == part)
        element = mesh.element[nodes[chosen]]
        s, signs = arc_length[chosen], sign[chosen]
        cuts = np.flatnonzero(np.diff(signs) != 0)
        inside = element[cuts] == element[cuts + 1]
        borders = np.where(
            inside, 0.5 * (s[cuts] + s[cuts + 1]), mesh.side_start[element[cuts + 1]]
        )
        total = mesh.side_start[element[-1]] + mesh.length[element[-1]]
        ends = np.concatenate([[0.0], borders, [total]])
        for k, first in enumerate([0, *(cuts + 1)]):
            yield Zone(mesh.part_names[part], float(ends[k]), float(ends[k + 1]), int(signs[first]))
