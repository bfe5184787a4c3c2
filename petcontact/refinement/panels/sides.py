"""Pressure that is missed where contact ends at sides of elements, in any dimension.

All nodes of one element are closed there, and those of the next one are open. The true edge of
contact lies between these nodes, and no tail shows where.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, Mask
from ...linalg.nearest import Nearest
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import SINGLE, TINY


class Sides:
    """The sides of the elements of parts, in the plane their ends.

    Parameters
    ----------
    mesh : BoundaryMesh
    nodes : (m,) array
        Numbers of the nodes of whole parts, increasing.
    """

    def __init__(self, mesh: BoundaryMesh, nodes: Index) -> None:
        self._x, self._weight = mesh.x[nodes], mesh.weight[nodes]
        first, self._row = np.unique(mesh.element[nodes], return_inverse=True)
        numbers, faces = mesh.faces(*(mesh.part_names[k] for k in set(mesh.node_part[nodes])))
        number, start, end = faces.rims()
        self._element = np.searchsorted(first, numbers[number])
        self._middle = faces.at(number, 0.5 * (start + end))[0]
        self._along = faces.at(number, end)[0] - faces.at(number, start)[0]
        # in the plane a side is a point, on a ring a circle
        length = np.linalg.norm(self._along, axis=1)
        self._length = np.where(length > 0.0, length, mesh.around(self._middle))
        near = Nearest(self._x)(self._middle, 1 + int(np.bincount(self._row).max()))
        other = np.argmax(self._row[near] != self._element[:, None], axis=1)
        self._next = near[np.arange(len(near)), other]

    def missed_squares(self, pressure: Array, closed: Mask, faced: Mask) -> Array:
        """Return the squared error of p from each element with p beyond its sides, (n_elements,)
        [stress² · area].

        By the edge of contact p² is proportional to the distance from it. The line through p² of an
        element shows where p ends; the integral of p² beyond the side is the squared error. It is
        taken no farther than to the next node, which is open. Where p² is the same at all nodes the
        edge may be anywhere up to there. Where p² grows towards the side it has no bound there, and
        nothing is missed.

        Parameters
        ----------
        pressure : (m,) array
            [stress]
        closed, faced : (m,) arrays
            Which nodes are closed, and which ones face something.
        """
        open_nodes = np.bincount(self._row, ~closed)
        result = np.zeros(len(open_nodes))
        ends = (open_nodes[self._element] == 0) & (faced & ~closed)[self._next]
        for side in np.flatnonzero(ends):
            rows = np.flatnonzero(self._row == self._element[side])
            from_side, along = self._x[rows] - self._middle[side], self._along[side]
            outward = -from_side.mean(axis=0)
            outward -= along * (outward @ along) / max(along @ along, TINY)
            outward /= np.linalg.norm(outward)
            reach = outward @ (self._x[self._next[side]] - self._middle[side])
            if len(rows) == 1 or reach < 0.0:
                continue
            root = np.sqrt(self._weight[rows])
            slope, left = np.polyfit(from_side @ outward, pressure[rows] ** 2, 1, w=root)
            if left > 0.0 and slope * reach < SINGLE * left:
                width = reach if slope * reach > -left else -left / slope
                missed = (left + 0.5 * slope * width) * width * self._length[side]
                result[self._element[side]] += missed
        return result
