"""The boundary integral equations (4.10) as columns of G and H, reached by blocks of exact entries.

Unknown d·i + c belongs to node i and direction c: a displacement [length] where the traction is known, else a traction
over the kernel's `traction_scale` [length]. Equation d·i + a is component a of (4.10) at node i. With that scaling every
entry is a pure number, and none depends on the units of length and stress.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..mesh.boundary_mesh import Batch, BoundaryMesh
from .boundary_data import BoundaryData
from .column_blocks import ColumnBlock, as_slice, columns_of, common, contract, put
from .kernel import ColumnData, ColumnFiller, Kernel
from .kernels import column_filler
from .right_hand_sides import RightHandSides, columns_beside

BLOCK = (512, 96)
"""Targets and nodes of one block: its temporaries fit a core's second-level cache."""
SMALL = 1000
"""Nodes of meshes whose blocks reach over all parts: there the calls cost more than kernels that are not needed."""
RESIDUAL_NODES = 4096
"""Nodes whose kernels a residual holds at a time."""


@dataclass(frozen=True)
class BoundaryOperators:
    """The mixed operator A_0, the contact columns G_Ct and the load, reached by blocks of exact entries.

    Attributes
    ----------
    mesh : BoundaryMesh
    data : BoundaryData
    kernel : Kernel
        Of the mesh's dimension d.
    """

    mesh: BoundaryMesh
    data: BoundaryData
    kernel: Kernel

    def __getstate__(self) -> dict[str, Any]:
        """Addresses of compiled code mean nothing in another process."""
        return {key: value for key, value in vars(self).items() if key != "_filler"}

    @property
    def traction_scale(self) -> float:
        """Tractions are unknowns times it [stress/length]."""
        return self.kernel.traction_scale

    @property
    def n_unknowns(self) -> int:
        """Number of unknowns: d for each node."""
        return self.kernel.dim * self.mesh.n_nodes

    def system_entries(self, rows: Index, columns: Index) -> Array:
        """Entries of A_0, (d len(rows), d len(columns)), between collocation nodes in increasing order."""
        return self._blocks(rows, columns, outer=False)[0]

    def outer_entries(self, rows: Index, columns: Index) -> Array:
        """Entries of the `right_hand_sides` of some nodes, (d len(rows), number of them)."""
        return self._blocks(rows, columns, system=False)[0]

    def all_entries(self, rows: Index, columns: Index) -> list[Array]:
        """`system_entries` and `outer_entries` at the price of one."""
        return self._blocks(rows, columns)

    def _blocks(self, rows: Index, columns: Index, *, system: bool = True, outer: bool = True) -> list[Array]:
        d, rhs = self.kernel.dim, self.right_hand_sides
        a_0 = np.empty((len(columns), d, len(rows), d)) if system else None
        beside = np.empty((rhs.count[columns].sum(), len(rows), d)) if outer else None
        self.fill_columns(rows, columns, a_0, beside)
        return [entries.reshape(-1, d * len(rows)).T for entries in (a_0, beside) if entries is not None]

    def fill_columns(self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None) -> None:
        """As `ColumnFiller.fill`: columns of A_0 and of the `right_hand_sides`."""
        if self._filler is not None:
            self._filler.fill(rows, columns, system, right_hand_sides)
        else:
            if right_hand_sides is not None:
                right_hand_sides[:] = 0.0
            for block in self.blocks(columns):
                self.fill(rows, block, system=system, right_hand_sides=right_hand_sides)
        if system is not None:
            self.add_corners(rows, columns, system)

    def add_corners(self, rows: Index, columns: Index, system: Array) -> None:
        """What columns of A_0 gain where elements at corners are powers, into system[column, direction, row, component]."""
        corners = np.intersect1d(self.mesh.corner_nodes, columns)
        for node, gain_g, gain_h in self.kernel.corner_columns(self.mesh, rows, corners):
            place = np.flatnonzero(columns == node)
            for c, (known, frame) in enumerate(zip(self.data.traction_known[node], self.data.frame[node], strict=True)):
                system[place, c] += np.tensordot(gain_h if known else -gain_g, frame, (1, 0)).T

    @property
    def is_compiled(self) -> bool:
        """Whether compiled code fills whole columns."""
        return self._filler is not None

    @property
    def compiled(self) -> tuple[int, int] | None:
        """Addresses of a C function that does what `fill_columns` does, and of its context (see native/hmatrix.c)."""
        return None if self._filler is None or len(self.mesh.corner_nodes) else self._filler.compiled

    @functools.cached_property
    def _filler(self) -> ColumnFiller | None:
        """Compiled code for A_0 and the `right_hand_sides`; None where `fill` has to do."""
        rhs = self.right_hand_sides
        data = ColumnData(
            self.data.traction_known, self.data.frame, np.append(rhs.first, len(rhs.node)), rhs.traction, rhs.displacement
        )
        return column_filler(self.kernel, self.mesh, data)

    @functools.cached_property
    def _columns(self) -> tuple[RightHandSides, Array]:
        return columns_beside(self.data, self.traction_scale)

    @property
    def right_hand_sides(self) -> RightHandSides:
        """Columns beside A_0: one for each contact node and direction, and what known data and volume loads add to the
        load."""
        return self._columns[0]

    @property
    def amplitudes(self) -> Array:
        """Right-hand sides to the load of each state, (q, K)."""
        return self._columns[1]

    @functools.cached_property
    def of_contact(self) -> Mask:
        """Which right-hand sides are those of contact directions, (q,)."""
        rhs, data = self.right_hand_sides, self.data
        # of a node the contact directions come first
        return np.arange(len(rhs.node)) - rhs.first[rhs.node] < np.where(
            np.isin(rhs.node, data.contact_nodes), data.contact_shape[1], 0)  # fmt: skip

    @functools.cached_property
    def point_loads(self) -> Array:
        """What point forces add to the load of each state, (d n, K)."""
        mesh, loads = self.mesh, np.zeros((self.n_unknowns, self.data.states))
        if self.data.point.size:
            for state, force in enumerate(self.data.force):
                loads[:, state] = self.point_displacement(np.arange(mesh.n_nodes), force).ravel()
        return loads

    def point_displacement(self, nodes: Index, force: Array) -> Array:
        """Displacement (len(nodes), d) of the infinite plane or space at some nodes by forces (f, d) at the points."""
        return self.kernel.point_displacement(self.mesh.x[nodes], self.data.point, force)

    def residual(self, rows: Index, u: Array, traction: Array) -> Array:
        """½u + Hu - Gt at some nodes, (len(rows), d) [length], from exact entries: zero for the discrete solution."""
        result = 0.5 * u[rows]
        targets, scaled = self.mesh.targets(rows), traction / self.traction_scale
        for batch in self.mesh.batches():
            count = len(batch.elements.index)
            per_element = len(batch.nodes) // count
            step = max(1, RESIDUAL_NODES // per_element)
            for first in range(0, count, step):
                elements = self.mesh.elements(batch.elements.index[first : first + step])
                nodes = batch.nodes[first * per_element : (first + step) * per_element]
                kernel_g, kernel_h = self.kernel.integrals(targets, elements)
                assert kernel_g is not None and kernel_h is not None
                for a, j in itertools.product(range(self.kernel.dim), repeat=2):
                    result[:, a] += u[nodes, j] @ kernel_h[a, j] - scaled[nodes, j] @ kernel_g[a, j]
        for node, gain_g, gain_h in self.kernel.corner_columns(self.mesh, rows, self.mesh.corner_nodes):
            known, frame = self.data.traction_known[node], self.data.frame[node]
            for vectors, gain, chosen in ((u[node], gain_h, known), (-scaled[node], gain_g, ~known)):
                result += np.tensordot(gain, np.where(chosen, frame @ vectors, 0.0) @ frame, (1, 0)).T
        return result

    def split(self, unknowns: Array, shares: Array, sigma: Array) -> tuple[Array, Array]:
        """Displacement and traction (n, d) on the whole boundary from the unknowns (d n,), for load states weighted by
        `shares` (K,) and the tractions in the contact directions (m, k)."""
        data = self.data
        coefficients, value = unknowns.reshape(-1, self.kernel.dim), np.tensordot(shares, data.value, 1)
        u = np.where(data.traction_known, coefficients, value)
        traction = np.where(data.traction_known, value, coefficients * self.traction_scale)
        traction[data.contact_nodes[:, None], data.contact_directions] = sigma
        u = data.vectors(u)
        return u if data.rigid is None else u + np.tensordot(shares, data.rigid, 1), data.vectors(traction)

    # -- blocks of columns ----------------------------------------------------------------------------------------

    def blocks(self, columns: Index | None = None) -> list[ColumnBlock]:
        """Columns (all nodes, or some in increasing order) cut into pieces of one part and kind, with right-hand sides.

        All nodes of a small mesh come in one piece a kind, else in pieces of about BLOCK[1]; some, asked for by a
        compression, in as few pieces as can be, since there the calls cost more than the numbers.
        """
        whole, rhs = columns is None, self.right_hand_sides
        nodes = np.arange(self.mesh.n_nodes) if columns is None else columns
        group, places = self._group[nodes], np.arange(len(nodes))
        small = whole and len(nodes) <= SMALL
        first_rhs = rhs.first[nodes]
        if not whole:
            first_rhs = np.cumsum(rhs.count[nodes]) - rhs.count[nodes]
        elif small:
            group = self.mesh.kind[self.mesh.element]
        if whole:
            # kinds may change from element to element
            places = np.argsort(group, kind="stable")
            nodes, group, first_rhs = nodes[places], group[places], first_rhs[places]
        cuts = np.flatnonzero(group[1:] != group[:-1]) + 1
        result = []
        for first, last in itertools.pairwise([0, *cuts.tolist(), len(nodes)]):
            per_element = int(self._per_element[nodes[first]])
            step = max(1, BLOCK[1] // per_element) * per_element if whole and not small else last - first
            for start in range(first, last, step):
                piece = slice(start, min(start + step, last))
                place = as_slice(places[piece]) if whole else piece
                result.append(self._block(nodes[piece], place, rhs, first_rhs[piece]))
        return result

    def _block(self, nodes: Index, place: Any, rhs: RightHandSides, first_rhs: Index) -> ColumnBlock:
        """Nodes of one part and kind, where their columns go, and where the first right-hand side of each goes."""
        elements, subset, per_element = self.mesh.element[nodes], None, int(self._per_element[nodes[0]])
        if per_element > 1:
            new = np.concatenate([[True], elements[1:] != elements[:-1]])
            elements = elements[new]
            if len(nodes) < per_element * len(elements):
                subset = (np.cumsum(new) - 1) * per_element + nodes - self.mesh.first_node[self.mesh.element[nodes]]
        columns, owner = rhs.of(nodes)
        displacement = rhs.displacement[columns]
        return ColumnBlock(
            batch=Batch(self.mesh.elements(elements), nodes), place=place, subset=subset,
            traction_known=self.data.traction_known[nodes], frame=self.data.frame[nodes],
            owner=owner, rhs_place=as_slice(first_rhs[owner] + columns - rhs.first[nodes][owner]),
            rhs_traction=rhs.traction[columns], rhs_displacement=displacement if displacement.any() else None,
        )  # fmt: skip

    @functools.cached_property
    def _per_element(self) -> Index:
        """Number of nodes of each node's element."""
        return np.asarray(np.diff(self.mesh.first_node)[self.mesh.element])

    @functools.cached_property
    def _group(self) -> Index:
        """Nodes of one part and kind of element have one number."""
        return np.asarray((self.mesh.part * (self.mesh.kind.max() + 1) + self.mesh.kind)[self.mesh.element])

    def _kernels(self, rows: Index, block: ColumnBlock, displacement: bool, traction: bool) -> list[Array | None]:
        kernels = self.kernel.integrals(
            self.mesh.targets(rows), block.batch.elements, displacement=displacement, traction=traction
        )
        return [k if k is None or block.subset is None else k[:, :, block.subset] for k in kernels]

    def fill(
        self, rows: Index, block: ColumnBlock, *, system: Array | None = None, right_hand_sides: Array | None = None
    ) -> None:
        """One block into what is given of system[column, direction, row, component] and right_hand_sides[column, row,
        component] (zero before)."""
        beside = right_hand_sides if len(block.owner) else None
        beside_g = beside is not None and bool(block.rhs_traction.any())
        shifts = block.rhs_displacement if beside is not None else None
        needs_g = beside_g or (system is not None and not block.traction_known.all())
        needs_h = shifts is not None or (system is not None and bool(block.traction_known.any()))
        if not (needs_g or needs_h):
            return
        kernel_g, kernel_h = self._kernels(rows, block, needs_g, needs_h)
        if system is not None:
            for c in range(self.kernel.dim):
                put(system, (block.place, c), kernel_h, block.frame[:, c], block.traction_known[:, c])
                put(system, (block.place, c), kernel_g, -block.frame[:, c], ~block.traction_known[:, c])
        if beside is not None and beside_g:
            every = np.ones(len(block.owner), dtype=bool)
            put(beside, (block.rhs_place,), columns_of(kernel_g, block.owner), block.rhs_traction, every)
        if beside is not None and shifts is not None:
            kernel = columns_of(kernel_h, block.owner)
            for a in range(self.kernel.dim):
                beside[block.rhs_place, :, a] -= contract(kernel, shifts, a)
        self._add_free_term(rows, block, system, beside)

    def _add_free_term(self, rows: Index, block: ColumnBlock, system: Array | None, beside: Array | None) -> None:
        """½ I, where a node of the block is its own target."""
        nodes = block.batch.nodes
        if nodes[-1] < rows[0] or nodes[0] > rows[-1]:
            return
        row, column = common(rows, nodes)
        if not len(row):
            return
        if system is not None:
            place = np.arange(len(system))[block.place][column]
            for c in range(self.kernel.dim):
                system[place, c, row] += 0.5 * block.traction_known[column, c, None] * block.frame[column, c]
        if beside is not None and block.rhs_displacement is not None:
            mine, own = common(nodes[block.owner], rows)
            beside[np.arange(len(beside))[block.rhs_place][mine], own] -= 0.5 * block.rhs_displacement[mine]
