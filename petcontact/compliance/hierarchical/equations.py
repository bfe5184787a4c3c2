"""The integral equations of a body on an H-matrix, solved together with linear relations between u and t in contact."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...bem.operators import BoundaryOperators
from ...compression.hmatrix.block_tree import block_tree, cluster
from ...compression.hmatrix.matrix import HMatrix, predicted_bytes, shared_rows
from ...compression.hmatrix.schwarz import CoarseLevel, LocalSolves
from ...compression.hmatrix.substitution import Substitution
from ...errors import InputError, SolverError
from ...linalg.ksp import LinearSolver
from ...mesh.surface_mesh import SurfaceMesh
from ...runtime.memory import physical_memory
from ...runtime.petsc import petsc
from ...runtime.threads import one_blas_thread, threads_per_rank

LEAF = 64
"""Nodes of the smallest clusters."""
QUADRATURE = 0.1
"""Error of far quadrature over the tolerance of the compression."""
ALLOWED_MISS = 10.0
"""How far a probe of exact rows may lie over the tolerance, which bounds each block by itself."""
RESTART = 200
CHANGED = 0.2
"""Change of a node's combination of columns from which its clusters are inverted anew."""


@dataclasses.dataclass(frozen=True)
class Relation:
    """u = u_0 + N_u y, t = t_0 + N_t y in the contact directions, (m, k)."""

    columns: Substitution
    u_0: Array
    t_0: Array


@dataclasses.dataclass(frozen=True)
class State:
    """Unknowns z of the whole boundary, with u where y stands in solves; u and t in the contact directions, (m, k)."""

    z: Array
    u: Array
    t: Array


class MixedEquations:
    """The discrete integral equations of a body with a relation between displacement and traction in contact.

    Vectors are whole on every rank, in the order of the tree; a rank has the rows of a range of nodes. The unknowns of the
    PETSc matrix are d a node: known tractions' displacements [length], tractions over `traction_scale` [length], and y.
    """

    def __init__(self, operators: BoundaryOperators, comm: Any, tolerance: float, progress: Callable[[float], None]) -> None:
        mesh = operators.mesh
        assert isinstance(mesh, SurfaceMesh)
        self.tolerance, self.comm, self._mpi = tolerance, comm, comm.tompi4py() if comm.getSize() > 1 else None
        tree = cluster(*mesh.boxes, np.diff(mesh.first_node), LEAF)
        counts = np.diff(mesh.first_node)[tree.order]
        # the nodes in the order of the tree
        self.nodes = np.repeat(mesh.first_node[tree.order] - np.cumsum(counts) + counts, counts) + np.arange(mesh.n_nodes)
        kernel: Any = operators.kernel
        self._operators = BoundaryOperators(mesh.reordered(tree.order), operators.data.reordered(self.nodes),
                                            dataclasses.replace(kernel, tolerance=QUADRATURE * tolerance))  # fmt: skip
        self.entries = OperatorEntries(self._operators)
        d = self.entries.components
        self.size = d * mesh.n_nodes
        blocks = block_tree(tree)
        memory = predicted_bytes(tree, blocks, tolerance, d)
        needed, there = float(memory.sum()), physical_memory()
        if needed > there:
            raise InputError(f"mesh: the compressed operator of {mesh.n_nodes} nodes takes about {needed / 1e9:.0f} GB, "
                             f"this machine has {there / 1e9:.0f}; use larger elements or bem.hmatrix_tol")  # fmt: skip
        self._bounds = d * shared_rows(tree, memory, comm.getSize())
        mine = self._bounds[comm.getRank()], self._bounds[comm.getRank() + 1]
        self.own = slice(*mine)
        rows = int(mine[0]) // d, int(mine[1]) // d
        threads = threads_per_rank() if self.entries.compiled is not None else 1
        self.matrix = HMatrix(self.entries, tree, blocks, tolerance, rows, threads=threads, progress=progress)
        self._check()
        self._tree, self._rows = tree, rows
        place = np.argsort(self.nodes)[operators.data.contact_nodes]
        self._node, self._slot = place, d * place[:, None] + operators.data.contact_directions
        self._beside = self.entries.beside[place][:, None] + np.arange(self._slot.shape[1])
        self._count = int(self.entries.beside[-1])
        self._loads = self._operators.amplitudes
        layout = (int(mine[1] - mine[0]), self.size)
        self._petsc_matrix = petsc().Mat().createPython((layout, layout), context=self, comm=comm)
        self._petsc_matrix.setUp()
        self.solver = LinearSolver(comm, "", "iterate", ksp_type="fgmres", pc_type="python", context=self)
        self._columns = self.given_traction(np.zeros(self._slot.shape)).columns

    def _check(self) -> None:
        worst = self.matrix.error_estimate(np.random.default_rng(2019))
        worst = worst if self._mpi is None else max(self._mpi.allgather(worst))
        if not worst <= ALLOWED_MISS * self.tolerance:
            raise SolverError(
                "assemble", f"the compressed operator is off by {worst:.1e}, its tolerance is {self.tolerance:g}",
                "use another -bem_hmatrix_tol or -bem_mat_type dense",
            )  # fmt: skip

    def factor(self) -> None:
        """Both levels of the preconditioner."""
        self._local = LocalSolves(self.entries, self._tree, self._operators.mesh.x, self._rows)
        self._coarse = CoarseLevel(self.matrix, self._tree, self._operators.mesh.node_part)
        self._sums = self._sum(self._coarse.gather(self._columns))
        self._local.update(self._columns)
        self._coarse.factor(self._sums, self._columns)

    # -- relations --------------------------------------------------------------------------------------------------

    def given_traction(self, t: Array) -> Relation:
        """t in contact is known."""
        return Relation(Substitution.displacement(self._node, self._slot, self._beside), np.zeros_like(t), t)

    def related(self, n_u: Array, n_t: Array, u_0: Array, t_0: Array) -> Relation:
        """u = u_0 + N_u y, t = t_0 + N_t y with y in such units that its columns are of unit size."""
        size = np.sqrt(np.sum(n_u**2 + n_t**2, axis=1, keepdims=True))
        size = np.where(size > 0.0, size, 1.0)
        return Relation(Substitution(self._node, self._slot, self._beside, n_u / size, n_t / size), u_0, t_0)

    def by_nodes(self, z: Array) -> Array:
        """Unknowns in the order of the mesh's nodes."""
        result = np.empty((len(self.nodes), self.entries.components))
        result[self.nodes] = z.reshape(result.shape)
        return result.ravel()

    # -- solves -----------------------------------------------------------------------------------------------------

    def at_rest(self) -> State:
        """Nothing moves."""
        return State(np.zeros(self.size), np.zeros(self._slot.shape), np.zeros(self._slot.shape))

    def solve(self, relation: Relation, start: State, shares: Array, rtol: float, forcing: float) -> tuple[State, float]:
        """The solution for load states weighted by `shares` (K,), and the residual left, relative to the right-hand side.

        The Krylov method reduces the residual at the start to `forcing` of it, but not below rtol of the right-hand side.
        """
        columns, z = relation.columns, start.z.copy()
        # of the relation what is nearest to the displacements and tractions before
        both = np.concatenate([columns.n_u, columns.n_t], axis=1)
        before = np.concatenate([start.u - relation.u_0, start.t - relation.t_0], axis=1)
        z[self._slot] = np.einsum("mij,mj->mi", np.linalg.pinv(both), before)
        known = self.matrix.mult(self._right_hand_side(relation, shares))
        if self._operators.data.point.size:
            known = known + self._operators.point_loads[self.own] @ shares
        residual = known - self._product(columns, z)
        scale, left = self._norm(known), self._norm(residual)
        target = max(rtol * scale, forcing * left)
        if left > target:
            self._use(columns)
            z += self._krylov(residual, target)
            left = target
        y = z[self._slot]
        u, t = relation.u_0 + np.einsum("mij,mj->mi", columns.n_u, y), relation.t_0 + np.einsum("mij,mj->mi", columns.n_t, y)
        z[self._slot] = u
        return State(z, u, t), left / scale if scale > 0.0 else 0.0

    def _right_hand_side(self, relation: Relation, shares: Array) -> Array:
        """Factors of all columns whose product is what does not depend on the unknowns."""
        factors = np.zeros(self.matrix.shape[1])
        factors[self._slot] = -relation.u_0
        factors[self.size :] = self._loads @ shares
        factors[self.size + self._beside] = relation.t_0
        return factors

    def _krylov(self, residual: Array, target: float) -> Array:
        rhs = petsc().Vec().createMPI((len(residual), self.size), comm=self.comm)
        rhs.setArray(residual)
        solution = rhs.duplicate()
        solution.set(0.0)
        if not self.solver.kind:
            self.solver.ksp.setGMRESRestart(RESTART)
            self.solver.set_operator(self._petsc_matrix)
        self.solver.ksp.setTolerances(rtol=1e-14, atol=target)
        self.solver.solve(rhs, solution)
        whole = self._whole(solution.getArray(readonly=True))
        rhs.destroy()
        solution.destroy()
        return whole

    def _use(self, columns: Substitution) -> None:
        if columns is not self._columns:
            with one_blas_thread():
                self._local.update(columns, CHANGED)
                self._coarse.factor(self._sums, columns)
            self._columns = columns

    def _product(self, columns: Substitution, z: Array) -> Array:
        return self.matrix.mult(columns.expanded(z, self._count))

    def _norm(self, own: Array) -> float:
        return float(np.sqrt(self._sum(np.array([own @ own]))[0]))

    def _sum(self, values: Array) -> Array:
        return values if self._mpi is None else np.asarray(self._mpi.allreduce(values))

    def _whole(self, own: Array) -> Array:
        if self._mpi is None:
            return np.array(own)
        result = np.empty(self.size)
        self._mpi.Allgatherv(np.ascontiguousarray(own), (result, np.diff(self._bounds)))
        return result

    # -- what PETSc calls ---------------------------------------------------------------------------------------------

    def mult(self, matrix: Any, x: Any, y: Any) -> None:
        """The matrix of type python."""
        y.setArray(self._product(self._columns, self._whole(x.getArray(readonly=True))))

    def apply(self, pc: Any, x: Any, y: Any) -> None:
        """The preconditioner of type python: coarse level, then clusters."""
        r = x.getArray(readonly=True)
        coarse = self._coarse.solve(self._whole(r))
        left = self._whole(r - self._product(self._columns, coarse))
        y.setArray(coarse[self.own] + self._local.solve(left))

    def view(self, matrix: Any, viewer: Any) -> None:
        """The line of -ksp_view, of the matrix and of the preconditioner."""
        viewer.printfASCII(f"    {self.describe()}\n")

    def describe(self) -> str:
        """Tolerance and memory."""
        return f"hmatrix {self.tolerance:g} of {self.memory() / 1e6:.0f} MB"

    def memory(self) -> int:
        """Bytes on all ranks."""
        return int(self._sum(np.array([self.matrix.nbytes + self._local.nbytes], dtype=np.float64))[0])

    def close(self) -> None:
        """Free the PETSc objects."""
        self.solver.close()
        self._petsc_matrix.destroy()
        del self.matrix, self._local, self._coarse


class OperatorEntries:
    """Columns of A_0, and beside them those of G_Ct and of the load, as `compression.hmatrix` asks for them."""

    def __init__(self, operators: BoundaryOperators) -> None:
        self._operators, self.components = operators, operators.kernel.dim
        rhs = operators.right_hand_sides
        self.beside: Index = np.append(rhs.first, len(rhs.node))
        self.compiled = operators.compiled

    def fill(self, rows: Index, columns: Index, system: Array | None, beside: Array | None) -> None:
        """As in `Entries`."""
        self._operators.fill_columns(rows, columns, system, beside)
