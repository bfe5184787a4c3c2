"""What fills columns of the boundary operators: a compiled function and what it knows of a mesh, or
a kernel's integrals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from .. import native
from ..arrays import Array, Index
from ..frozen import frozen
from ..mesh.boundary_mesh import BoundaryMesh
from .kernel import ColumnData, Kernel

ROWS = 512
"""Targets whose kernels are held at a time."""


@frozen
class PlainFiller:
    """A `ColumnFiller` for any kernel."""

    kernel: Kernel
    mesh: BoundaryMesh
    data: ColumnData
    compiled: ClassVar[None] = None

    def fill(
        self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None
    ) -> None:
        """As in `ColumnFiller`."""
        mesh, data, element = self.mesh, self.data, self.mesh.element[columns]
        count = np.diff(data.rhs_first)[columns]
        start, kind = np.cumsum(count) - count, mesh.kind[element]
        for number in np.unique(kind):
            places = np.flatnonzero(kind == number)
            nodes = columns[places]
            elements, own = np.unique(element[places], return_inverse=True)
            per_element = mesh.first_node[elements[0] + 1] - mesh.first_node[elements[0]]
            column = own * per_element + nodes - mesh.first_node[element[places]]
            # right-hand sides: the node of each, its number among all and its place among those of
            # the columns
            owner = np.repeat(np.arange(len(nodes)), count[places])
            within = np.arange(len(owner)) - np.searchsorted(owner, owner)
            mine, beside = data.rhs_first[nodes][owner] + within, start[places][owner] + within
            for first in range(0, len(rows), ROWS):
                here = slice(first, first + ROWS)
                kernel_g, kernel_h = self.kernel.integrals(
                    mesh.targets(rows[here]), mesh.elements(elements)
                )
                g, h = kernel_g[:, :, column], kernel_h[:, :, column]
                _, at, same = np.intersect1d(
                    rows[here], nodes, assume_unique=True, return_indices=True
                )
                for a in range(self.kernel.dim):
                    h[a, a, same, at] += 0.5  # the free term
                if system is not None:
                    frame, known = data.frame[nodes], data.traction_known[nodes][:, :, None]
                    system[places, :, here] = _times(h, frame * known) - _times(g, frame * ~known)
                if right_hand_sides is not None:
                    pushed, moved = data.rhs_traction[mine, None], data.rhs_displacement[mine, None]
                    sides = _times(g[:, :, owner], pushed) - _times(h[:, :, owner], moved)
                    right_hand_sides[beside, here] = sides[:, 0]

    def of(self, data: ColumnData) -> PlainFiller:
        """As in `ColumnFiller`."""
        return replace(self, data=data)


def _times(kernel: Array, vectors: Array) -> Array:
    """A kernel (d, d, k, m) times some vectors (k, c, d) a column: (k, c, m, d)."""
    found = [
        sum(part[j] * vectors[:, :, j, None] for j in range(len(part)))
        for part in kernel[:, :, :, None]
    ]
    return np.stack(found, axis=-1)


class CompiledFiller:
    """A function of C and the struct that it reads.

    Parameters
    ----------
    name : str
        Of a function of the library with the arguments `native.FILLER`.
    mesh : list
        The first members of the struct: what it knows of a kernel and a mesh.
    data : ColumnData
        For its last ones.
    kept : object
        What the struct points to beyond its members.
    """

    def __init__(self, name: str, mesh: list[Any], data: ColumnData, kept: object = None) -> None:
        function, address = native.function(name, native.FILLER), native.address(name)
        self._name, self._function, self._members, self._kept = name, function, mesh, kept
        self._record = native.Record(
            *mesh,
            native.contiguous(data.traction_known, np.int64),
            native.contiguous(data.frame),
            native.contiguous(data.rhs_first, np.int64),
            native.contiguous(data.rhs_traction),
            native.contiguous(data.rhs_displacement),
        )
        self.compiled: tuple[int, int] | None = address, self._record.address

    def of(self, data: ColumnData) -> CompiledFiller:
        """As in `ColumnFiller`."""
        return CompiledFiller(self._name, self._members, data, self._kept)

    def fill(
        self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None
    ) -> None:
        """As in `ColumnFiller`."""
        rows, columns = native.contiguous(rows, np.int64), native.contiguous(columns, np.int64)
        self._function(
            self._record.address,
            len(rows),
            native.pointer(rows),
            len(columns),
            native.pointer(columns),
            native.pointer(system),
            native.pointer(right_hand_sides),
        )
