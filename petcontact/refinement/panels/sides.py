"""Pressure that is missed where contact ends at sides of elements, in any dimension.

All nodes of one element are closed there, and those of the next one are open. The true edge of
contact lies between these nodes, and no tail shows where.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, Mask
from ...linalg.nearest import nearest
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import TINY


class Sides:
    """The n sides of the elements of parts, in the plane their ends.

    Parameters
    ----------
    mesh : BoundaryMesh
    nodes : (m,) array
        Numbers of the nodes of whole parts, increasing.
    """

    def __init__(self, mesh: BoundaryMesh, nodes: Index) -> None:
        self._x, self._weight = mesh.x[nodes], mesh.weight[nodes]
        first, self._row = np.unique(mesh.element[nodes], return_inverse=True)
        self._area = np.bincount(self._row, self._weight)
        parts = [mesh.part_names[k] for k in np.unique(mesh.node_part[nodes])]
        numbers, faces = mesh.faces(*parts)
        number, start, end = faces.rims()
        self._element = np.searchsorted(first, numbers[number])
        self._middle = faces.at(number, 0.5 * (start + end))[0]
        along = faces.at(number, end)[0] - faces.at(number, start)[0]
        square = np.sum(along**2, axis=1)
        # in the plane a side is a point, on a ring a circle
        self._length = np.where(square > 0.0, np.sqrt(square), mesh.around(self._middle))
        load = [np.bincount(self._row, self._weight * column) for column in self._x.T]
        outward = self._middle - (np.array(load) / self._area).T[self._element]
        share = np.sum(outward * along, axis=1) / np.maximum(square, TINY)
        outward -= share[:, None] * along
        self._outward = outward / np.linalg.norm(outward, axis=1)[:, None]
        count = min(len(nodes), 1 + int(np.bincount(self._row).max()))
        near = nearest(self._x, self._middle, count)[1]
        other = np.argmax(self._row[near] != self._element[:, None], axis=1)
        self._next = near[np.arange(len(near)), other]
        self._reach = np.sum((self._x[self._next] - self._middle) * self._outward, axis=1)

    def missed_squares(self, pressure: Array, closed: Mask, faced: Mask) -> Array:
        """Return the squared error of p from each element with p beyond its sides, (n_elements,)
        [stress² · area].

        By the edge of contact p² is proportional to the distance from it. The line through p² of an
        element shows where p ends; the integral of p² beyond the side is the squared error. It is
        taken no farther than to the next node, which is open. Where p² grows towards the side it
        has no bound there, and nothing is missed.

        Parameters
        ----------
        pressure : (m,) array
            [stress]
        closed, faced : (m,) arrays
            Which nodes are closed, and which ones face something.
        """
        result = np.zeros(len(self._area))
        whole = np.bincount(self._row, ~closed) == 0
        edge = whole[self._element] & (~closed & faced)[self._next] & (self._reach > 0.0)
        sides = np.flatnonzero(edge)
        own = self._element[sides]
        side, node = np.nonzero(own[:, None] == self._row)
        share = self._weight[node] / self._area[own[side]]

        def mean(values: Array) -> Array:
            return np.asarray(np.bincount(side, share * values, len(sides)), dtype=float)

        away = np.sum(
            (self._x[node] - self._middle[sides][side]) * self._outward[sides][side], axis=1
        )
        middle, square = mean(away), pressure[node] ** 2
        apart = away - middle[side]
        slope = -mean(apart * square) / np.maximum(mean(apart**2), TINY)
        at_side = np.maximum(mean(square) + slope * middle, 0.0)
        ends = np.divide(at_side, slope, out=np.zeros(len(sides)), where=slope > 0.0)
        width = np.minimum(ends, self._reach[sides])
        np.add.at(result, own, (at_side - 0.5 * slope * width) * width * self._length[sides])
        return result
