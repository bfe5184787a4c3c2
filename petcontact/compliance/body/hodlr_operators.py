"""HODLR operators of a plane body over all ranks; no array of size n x n is ever stored."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, scattered
from ...bem.operators import BoundaryOperators
from ...compression.hodlr import HODLR, compress, factor
from ...errors import SolverError
from ...given.tables.solver_options import Bem
from ...linalg.row_layout import everywhere
from ...mesh.curve_mesh import as_curve
from ...runtime.memory import trim_heap
from ...runtime.petsc import stage
from ...runtime.ranks import mpi
from ...runtime.threads import one_blas_thread, threads_per_rank
from ...untyped import Comm
from .stretches import stretches_of


class CompressedOperators:
    """A_0, compressed and factorised, and the compressed columns of G_Ct and of the loads.

    All methods are collective.

    Parameters
    ----------
    operators : BoundaryOperators
    comm : PETSc.Comm
    bem : Bem
    border : pair of (d n, r) and (r, d n) arrays, optional
        Two factors whose product has rank r. It is added to A_0, which is singular without it.

    Raises
    ------
    SolverError
        If a compressed operator misses its tolerance on a random probe of exact rows.
    """

    def __init__(
        self,
        operators: BoundaryOperators,
        comm: Comm,
        bem: Bem,
        border: tuple[Array, Array] | None = None,
    ) -> None:
        self.operators, self.comm, self.bem = operators, comm, bem
        self._units = column_units(operators)
        # the compression has its own threads: each works on a subtree, with one BLAS thread
        with one_blas_thread():
            with stage("assemble"):
                self._system, self._rhs_columns = self._compress(border)
                own = self._rhs_columns.first_node, self._rhs_columns.last_node
                self._beside = slice(
                    *np.cumsum([0, *operators.right_hand_sides.count])[list(own)].tolist()
                )
                self._is_contact = operators.of_contact[self._beside]
                self.loads = self.loads_by(operators.amplitudes)
            with stage("factor"):
                self._factor = factor(self._system, use_up=True)
                self._spare()
        d, data = operators.kernel.dim, operators.data
        self._here, self.here = slice(*own), slice(d * own[0], d * own[1])
        first, last = np.searchsorted(data.contact_nodes, own).tolist()
        self._contact = slice(*(data.contact_shape[1] * place for place in (first, last)))
        self._local = data.contact_unknowns[self._contact] - d * own[0]

    def _spare(self) -> None:
        # with this many nodes saved memory is worth the page faults when it is needed again
        if self.operators.mesh.n_nodes >= 200_000:
            trim_heap()

    def loads_by(self, amplitudes: Array) -> Array:
        """Return the load of each state on this rank's nodes, from the amplitudes (q, K) of the
        right-hand sides."""
        return np.asarray(self._rhs_columns @ amplitudes[self._beside])

    def traction_to_rhs(self, sigma: Array) -> Array:
        """Return G_Ct σ on this rank's nodes, for one σ (m k,) or several (m k, s)."""
        scaled = sigma[self._contact] / self.operators.traction_scale
        return np.asarray(
            self._rhs_columns @ scattered(scaled, self._is_contact, len(self._is_contact))
        )

    def solve(self, rhs: Array) -> Array:
        """Return this rank's part of A_0⁻¹ times one right-hand side or several."""
        unknowns = np.asarray(self._factor(rhs))
        return unknowns if self._units is None else (unknowns.T * self._units[self._here].ravel()).T

    def on_contact(self, unknowns: Array) -> Array:
        """Return u along the contact directions, (m k,) or (m k, s), from each rank's unknowns."""
        return everywhere(unknowns[self._local], self.comm)

    def _compress(self, border: tuple[Array, Array] | None) -> tuple[HODLR, HODLR]:
        # samples use some rows and columns, a random probe uses all. If the probe misses the
        # tolerance by a factor of 100, a tenth of the tolerance is tried
        for tolerance in (self.bem.hodlr_tol, 0.1 * self.bem.hodlr_tol):
            *both, worst = self._compressed_to(tolerance, border)
            if worst <= 100.0 * self.bem.hodlr_tol:
                return both[0], both[1]
        raise SolverError(
            "assemble",
            f"the compressed operator is off by {worst:.1e}, its tolerance is "
            f"{self.bem.hodlr_tol:g}",
            "use another -bem_hodlr_tol or -bem_mat_type dense",
        )

    def _compressed_to(
        self, tolerance: float, border: tuple[Array, Array] | None
    ) -> tuple[HODLR, HODLR, float]:
        operators, mesh = self.operators, as_curve(self.operators.mesh)
        d = operators.kernel.dim

        def bordered(entries: Array, rows: Index, columns: Index) -> Array:
            if border is None:
                return entries
            left, right = (part.reshape(mesh.n_nodes, d, -1) for part in (border[0], border[1].T))
            return (
                entries
                + left[rows].reshape(d * len(rows), -1)
                @ right[columns].reshape(d * len(columns), -1).T
            )

        def scaled(entries: Array, rows: Index, columns: Index) -> Array:
            whole = bordered(entries, rows, columns)
            return whole if self._units is None else whole * self._units[columns].ravel()

        def system_entries(rows: Index, columns: Index) -> Array:
            return scaled(operators.system_entries(rows, columns), rows, columns)

        def all_entries(rows: Index, columns: Index) -> list[Array]:
            system, outer = operators.all_entries(rows, columns)
            return [scaled(system, rows, columns), outer]

        sides = (
            np.flatnonzero(np.diff(mesh.part[mesh.element]) | np.diff(mesh.line[mesh.element])) + 1
        )
        apart = (
            np.unique(np.nonzero(border[1])[1] // d)
            if border is not None
            else np.empty(0, dtype=np.int64)
        )
        # with fewer nodes a second thread would mostly wait for Python's lock
        threads = threads_per_rank() if mesh.n_nodes >= 20_000 else 1
        pairs = d * np.arange(mesh.n_nodes + 1)
        single = np.concatenate([[0], np.cumsum(operators.right_hand_sides.count)])
        system = compress(
            system_entries,
            mesh.x,
            pairs,
            pairs,
            tolerance,
            self.bem.hodlr_leaf,
            breaks=np.union1d(
                sides, np.concatenate([apart, np.minimum(apart + 1, mesh.n_nodes - 1)])
            ),
            threads=threads,
            comm=mpi(self.comm),
            serve=(all_entries, [pairs, single]),
            stretches=stretches_of(mesh, operators, apart),
        )
        self._spare()
        outer = system.with_columns(operators.outer_entries, single)
        errors = [
            matrix.error_estimate(entries, np.random.default_rng(2019))
            for matrix, entries in ((system, system_entries), (outer, operators.outer_entries))
        ]
        return system, outer, float(np.max(errors))


def column_units(operators: BoundaryOperators) -> Array | None:
    """Return powers of two (n, d) that scale the columns of unknown tractions, or None.

    With them the unknowns are roughly forces. They are None if all elements have about one size. G
    of a tiny element is tiny compared with H. Blocks are accurate relative to their rows, so that
    its columns would lose their digits and the factorisation would fail.
    """
    mesh = as_curve(operators.mesh)
    length = mesh.length[mesh.element]
    units = np.exp2(np.round(np.log2(length.max() / length)))
    if np.all(units == 1.0):
        return None
    return np.where(operators.data.traction_known, 1.0, units[:, None])
