"""Two ways to fill columns of the boundary operators: a compiled function with its struct of the
mesh, or a kernel's integrals."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from .. import native
from ..arrays import Array, Index, ranked
from ..mesh.boundary_mesh import BoundaryMesh
from ..record import record, replace
from .kernel import ColumnData, Kernel

ROWS = 512
"""Number of targets whose kernels are in memory at a time."""


@record
class PlainFiller:
    """A `ColumnFiller` that calls the integrals of any kernel."""

    kernel: Kernel
    mesh: BoundaryMesh
    data: ColumnData
    compiled: ClassVar[None] = None

    def fill(
        self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None
    ) -> None:
        """As in `ColumnFiller`."""
        for first in range(0, len(rows), ROWS):
            chunk = slice(first, first + ROWS)
            g, h = self._kernels(rows[chunk], columns)
            if system is not None:
                frame = self.data.frame[columns]
                traction_known = self.data.traction_known[columns][:, :, None]
                system[:, :, chunk] = _times(h, frame * traction_known) - _times(
                    g, frame * ~traction_known
                )
            if right_hand_sides is not None:
                starts = self.data.rhs_first
                owner, within = ranked(np.diff(starts)[columns])
                number = starts[columns][owner] + within
                pushed = self.data.rhs_traction[number, None]
                moved = self.data.rhs_displacement[number, None]
                sides = _times(g[:, :, owner], pushed) - _times(h[:, :, owner], moved)
                right_hand_sides[:, chunk] = sides[:, 0]

    def _kernels(self, rows: Index, columns: Index) -> tuple[Array, Array]:
        """Return G and ½ + H of some nodes, (d, d, k, m) each."""
        mesh, element = self.mesh, self.mesh.element[columns]
        shape = self.kernel.dim, self.kernel.dim, len(columns), len(rows)
        targets, g, h = mesh.targets(rows), np.empty(shape), np.empty(shape)
        for number in np.unique(mesh.kind[element]):
            of_kind = np.flatnonzero(mesh.kind[element] == number)
            elements, own = np.unique(element[of_kind], return_inverse=True)
            per_element = mesh.first_node[elements[0] + 1] - mesh.first_node[elements[0]]
            column = own * per_element + columns[of_kind] - mesh.first_node[element[of_kind]]
            for whole, part in zip(
                (g, h), self.kernel.integrals(targets, mesh.elements(elements)), strict=True
            ):
                whole[:, :, of_kind] = part[:, :, column]
        free = 0.5 * (columns[:, None] == rows)
        np.einsum("iikm->ikm", h)[:] += free  # the free term
        return g, h

    def with_data(self, data: ColumnData) -> PlainFiller:
        """As in `ColumnFiller`."""
        return replace(self, data=data)


def _times(kernel: Array, vectors: Array) -> Array:
    """Multiply a kernel (d, d, k, m) by some vectors (k, c, d) a column. The result is (k, c, m,
    d)."""
    products = [
        sum(part[j] * vectors[:, :, j, None] for j in range(len(part)))
        for part in kernel[:, :, :, None]
    ]
    return np.stack(products, axis=-1)


class CompiledFiller:
    """A `ColumnFiller` that calls a function of C with the struct that it reads.

    Parameters
    ----------
    name : str
        Of a function of the library with the arguments `native.FILLER`.
    letters : str
        Kinds of the members of `mesh`, as `native.function` has them.
    mesh : list
        The first members of the struct: what it knows of a kernel and a mesh.
    data : ColumnData
        For its last ones.
    kept : object
        What the struct points to beyond its members.
    """

    def __init__(
        self,
        name: str,
        letters: str,
        mesh: list[native.Member],
        data: ColumnData,
        kept: object = None,
    ) -> None:
        self._struct, self._kept = (name, letters, mesh), kept
        self._function = native.function(name, native.FILLER)
        self._record = native.Struct(
            letters + "NDNDD",
            *mesh,
            native.contiguous(data.traction_known, np.int64),
            native.contiguous(data.frame),
            native.contiguous(data.rhs_first, np.int64),
            native.contiguous(data.rhs_traction),
            native.contiguous(data.rhs_displacement),
        )
        self.compiled: tuple[int, int] | None = native.address(name), self._record.address

    def with_data(self, data: ColumnData) -> CompiledFiller:
        """As in `ColumnFiller`."""
        return CompiledFiller(*self._struct, data, self._kept)

    def fill(
        self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None
    ) -> None:
        """As in `ColumnFiller`."""
        rows, columns = native.contiguous(rows, np.int64), native.contiguous(columns, np.int64)
        self._function(
            self._record.address, len(rows), rows, len(columns), columns, system, right_hand_sides
        )
