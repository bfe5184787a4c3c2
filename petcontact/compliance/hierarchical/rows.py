"""The discrete equations of one body, on an H-matrix or eliminated, as rows that are multiplied and
sampled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Array, Index, scattered
from ...bem.operators import BoundaryOperators
from ...compression.hmatrix.block_tree import block_tree, cluster
from ...compression.hmatrix.entries import block
from ...compression.hmatrix.matrix import HMatrix, predicted_bytes, shared_rows
from ...errors import InaccurateOperator, InputError
from ...mesh.surface_mesh import as_surface
from ...runtime.memory import physical_memory
from ...runtime.ranks import mpi
from ...runtime.signals import breaking_point, together
from ...runtime.threads import threads_per_rank
from ...untyped import Comm
from ..body.eliminated import ElasticBody, gauge

LEAF = 32
"""Number of nodes of the smallest clusters."""


class CompressedRows:
    """The integral equations on an H-matrix; each rank has the rows of a range of nodes.

    See `BodyRows`.

    Parameters
    ----------
    operators : BoundaryOperators
        On a `SurfaceMesh`.
    modes : (n, 3, r) array
        Rigid motions that no condition holds.
    comm : PETSc.Comm
    tolerance : float
    progress : callable
        Function that is called with the share of the matrix that is built.

    Raises
    ------
    InputError
        If the machine's memory will not do.
    InaccurateOperator
        If the compressed operator misses its tolerance on random exact rows.
    """

    def __init__(
        self,
        operators: BoundaryOperators,
        modes: Array,
        comm: Comm,
        tolerance: float,
        progress: Callable[[float], None],
    ) -> None:
        mesh, data = as_surface(operators.mesh), operators.data
        low, high = mesh.boxes
        self.tree = tree = cluster(low, high, np.diff(mesh.first_node), LEAF)
        counts = np.diff(mesh.first_node)[tree.order]
        self.nodes = np.repeat(
            mesh.first_node[tree.order] - np.cumsum(counts) + counts, counts
        ) + np.arange(mesh.n_nodes)
        """The nodes of the mesh in the order of the tree."""
        kernel: Any = operators.kernel
        # far quadrature is ten times as exact as the compression
        self._operators = BoundaryOperators(
            mesh.reordered(tree.order),
            data.reordered(self.nodes),
            dataclasses.replace(kernel, tolerance=0.1 * tolerance),
        )
        self.x, self.part = self._operators.mesh.x, self._operators.mesh.node_part
        self.frame, self._entries = self._operators.data.frame, OperatorEntries(self._operators)
        self.components = d = self._entries.components
        blocks = block_tree(tree)
        memory = predicted_bytes(tree, blocks, tolerance, d)
        needed, there = float(memory.sum()), physical_memory()
        if needed > there:
            raise InputError(
                f"mesh: the compressed operator of {mesh.n_nodes} nodes takes about "
                f"{needed / 1e9:.0f} GB, this machine has {there / 1e9:.0f}; use larger elements "
                "or bem.hmatrix_tol"
            )
        self.bounds = d * shared_rows(tree, memory, comm.getSize())
        first, last = (int(bound) // d for bound in self.bounds[comm.getRank() :][:2])
        self._own = slice(d * first, d * last)

        def built(share: float) -> None:
            breaking_point()
            progress(share)

        with together(mpi(comm)):
            self.matrix = HMatrix(
                self._entries,
                tree,
                blocks,
                tolerance,
                (first, last),
                threads=threads_per_rank() if self._entries.compiled is not None else 1,
                progress=built,
            )
        worst = self.matrix.error_estimate(np.random.default_rng(2019))
        worst = max(mpi(comm).allgather(worst)) if comm.getSize() > 1 else worst
        # a probe of exact rows may lie ten times over the tolerance, which bounds each block by
        # itself
        if not worst <= 10.0 * tolerance:
            raise InaccurateOperator(
                "assemble",
                f"the compressed operator is off by {worst:.1e}, its tolerance is {tolerance:g}",
                "use another -bem_hmatrix_tol or -bem_mat_type dense",
            )
        self.columns, size = self.matrix.shape[1], d * mesh.n_nodes
        position, k = np.argsort(self.nodes)[data.contact_nodes], data.contact_shape[1]
        self.slot = d * position[:, None] + data.contact_directions
        self.beside = size + self._entries.beside[position][:, None] + np.arange(k)
        self.scale = operators.traction_scale
        moved = data.components(modes) * data.traction_known[:, :, None]
        self.motions = moved[self.nodes].reshape(size, -1)
        self.gauge = gauge(mesh, data, modes).T.reshape(moved.shape)[self.nodes].reshape(size, -1)

    def mult(self, factors: Array) -> Array:
        """Return this rank's rows of [A B] times the factors of all columns."""
        return self.matrix.mult(factors)

    def block(self, nodes: Index) -> tuple[Array, Index]:
        """Return the exact entries between some nodes by columns, (c, components k), and the
        numbers of these columns."""
        breaking_point()
        d, beside = self.components, self._entries.beside
        more = [np.arange(beside[i], beside[i + 1]) for i in nodes.tolist()]
        columns = np.concatenate(
            [(d * nodes[:, None] + np.arange(d)).ravel(), d * len(self.x) + np.concatenate(more)]
        )
        return block(self._entries, nodes, nodes), columns

    def coarse(self, row_group: Index, column_group: Index, groups: tuple[int, int]) -> Array:
        """Return the sums of this rank's entries by groups of rows and columns, by products with
        the factors of the blocks; -1 is no group."""
        return self.matrix.coarse(row_group[self._own], column_group, groups)

    def load(self, shares: Array) -> tuple[Array, Array]:
        """Return what load states add on the right by their weights (K,): factors of the columns,
        of known data and volume loads, and this rank's rows, of point forces."""
        factors = np.zeros(self.columns)
        factors[self.components * len(self.x) :] = self._operators.amplitudes @ shares
        if not self._operators.data.point.size:
            return factors, np.zeros(self._own.stop - self._own.start)
        return factors, self._operators.point_loads[self._own] @ shares

    def by_nodes(self, z: Array) -> Array:
        """Return unknowns (size, ...) in the order of the mesh's nodes."""
        by_node = z.reshape(len(self.nodes), self.components, *z.shape[1:])
        return scattered(by_node, self.nodes, len(self.nodes)).reshape(z.shape)

    @property
    def nbytes(self) -> int:
        """Memory of the H-matrix on this rank [bytes]."""
        return self.matrix.nbytes


class CondensedRows:
    """The equations u = u_0 + S t of an eliminated body on its contact nodes.

    Parameters
    ----------
    body : ElasticBody
        With a dense compliance.
    comm : PETSc.Comm
        Communicator whose ranks share the rows.
    """

    def __init__(self, body: ElasticBody, comm: Comm) -> None:
        x, (m, k) = body.mesh.x[body.contact], body.data.contact_shape
        self.components, self.scale = k, body.operators.traction_scale
        self.tree = cluster(x, x, np.ones(m, dtype=np.int64), LEAF)
        order = self.tree.order
        self.x, self.part = x[order], body.mesh.node_part[body.contact][order]
        self.frame = body.data.contact_frame[order]
        components = (k * order[:, None] + np.arange(k)).ravel()
        self._matrix = body.compliance[components[:, None], components] * self.scale
        self._rest = (body.u_0 - body.data.sliding).reshape(-1, m * k)[:, components]
        ranks = comm.getSize()
        self.bounds = k * (m * np.arange(ranks + 1) // ranks)
        self._own = slice(*self.bounds[comm.getRank() :][:2].tolist())
        self.columns = 2 * m * k
        self.slot = k * np.argsort(order)[:, None] + np.arange(k)
        self.beside = m * k + self.slot
        self.motions = self.gauge = body.contact_modes[components]

    def mult(self, factors: Array) -> Array:
        """Return the product u + S t."""
        u, t = np.split(factors, 2)
        return np.asarray(u[self._own] + self._matrix[self._own] @ t)

    def block(self, nodes: Index) -> tuple[Array, Index]:
        """Return the identity and entries of S."""
        k = self.components
        some = (k * nodes[:, None] + np.arange(k)).ravel()
        values = np.concatenate([np.eye(len(some)), self._matrix[some[:, None], some].T])
        return values, np.concatenate([some, self.columns // 2 + some])

    def coarse(self, row_group: Index, column_group: Index, groups: tuple[int, int]) -> Array:
        """Return the sums by groups: of columns first, then of rows."""
        result, own = np.zeros(groups), np.arange(self._own.start, self._own.stop)
        of_u, of_t = np.split(column_group, 2)
        both = own[(row_group[own] >= 0) & (of_u[own] >= 0)]
        np.add.at(result, (row_group[both], of_u[both]), 1.0)
        some, rows = np.flatnonzero(of_t >= 0), own[row_group[own] >= 0]
        sums = np.zeros((len(rows), groups[1]))
        np.add.at(sums.T, of_t[some], self._matrix[rows][:, some].T)
        np.add.at(result, row_group[rows], sums)
        return result

    def load(self, shares: Array) -> tuple[Array, Array]:
        """Return the displacement u_0 without contact tractions."""
        return np.zeros(self.columns), (shares @ self._rest)[self._own]

    @property
    def nbytes(self) -> int:
        """Memory of S, which belongs to the body [bytes]."""
        return 0


class OperatorEntries:
    """The columns of A_0, then those of G_Ct and of the load, for `compression.hmatrix`."""

    def __init__(self, operators: BoundaryOperators) -> None:
        self._operators, self.components = operators, operators.kernel.dim
        rhs = operators.right_hand_sides
        self.beside: Index = np.append(rhs.first, len(rhs.node))
        self.compiled = operators.compiled

    def fill(self, rows: Index, columns: Index, system: Array | None, beside: Array | None) -> None:
        """Fill in entries as in `Entries`."""
        self._operators.fill_columns(rows, columns, system, beside)


BodyRows = CompressedRows | CondensedRows
"""The equations A z = B t + loads of a body, in the order of a cluster tree.

The columns of the unknowns z come first, then those of the tractions in contact t and of loads.

components : int
    Number of unknowns, and of equations, a node.
tree : Clusters
x, part : (n, 3), (n,) arrays
    Nodes [length], and the part of the boundary of each.
frame : (n, components, 3) array
    Directions of the unknowns.
bounds : (ranks + 1,) array
    First equation of each rank.
columns : int
    Number of all columns.
slot, beside : (m, k) arrays
    Columns of u and of t of the contact nodes, in the contact directions.
scale : float
    Unit of tractions: they are factors times it [stress/length].
motions, gauge : (size, r) arrays
    Rigid motions that nothing holds, in terms of the unknowns, and weights. Unknowns without such
    motions have weighted sums of 0.
"""
