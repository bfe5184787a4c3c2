"""The contact system on hierarchically compressed operators: nothing of size n x n is ever stored.

S is never formed: a product with it is G_Ct, a solve with the factored A_0, and the rows of u_t. The operators are PETSc
matrices of type python, so that every KSP works on them and `-ksp_view` names them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..bem.operators import BoundaryOperators
from ..compression.hodlr import HODLR, compress, factor
from ..errors import SolverError
from ..linalg.ksp import LinearSolver
from ..mesh.curve_mesh import as_curve
from ..model.solver_options import Bem
from ..runtime.malloc import give_back
from ..runtime.petsc import petsc, stage
from ..runtime.threads import one_blas_thread, threads_per_rank
from .base import EliminatedSystem
from .contact_vectors import ContactVectors
from .layer.operator import RobinPreconditioner, robin_preconditioner

ALLOWED_MISS = 100.0
"""How far a random probe may lie over the tolerance: it is a bound on samples, and the probe sees all rows."""
ROBIN_RTOL = 1e-4
"""Of the residual of a Robin increment: u = u_0 + S σ holds whatever it is, so that the iteration ends where it would with
1e-12, in as many steps, at a third of the price."""
SPANNED = 1e-12
"""Part of a solution that may lie outside of the vectors whose products with S are known."""
SCARCE = 200_000
"""Nodes from which memory is worth the page faults of asking for it again."""
THREADED = 20_000
"""Nodes from which a second thread pays: below, the threads mostly wait for Python's lock."""


class CompressedOperators:
    """A_0 compressed and factored, and beside it the columns of G_Ct and of the loads. All methods are collective.

    Parameters
    ----------
    operators : BoundaryOperators
    comm : PETSc.Comm
    bem : Bem
    border : pair of (d n, r) and (r, d n) arrays, optional
        Their product is added to an A_0 that is singular without it.

    Raises
    ------
    SolverError
        If a compressed operator misses its tolerance on a random probe of exact rows.
    """

    def __init__(
        self, operators: BoundaryOperators, comm: Any, bem: Bem, border: tuple[Array, Array] | None = None
    ) -> None:
        self.operators, self.comm, self.bem = operators, comm, bem
        self.contact = ContactVectors(operators, comm)
        self._contact_here = slice(*self.contact.by_node[comm.getRank()])
        self._units = column_units(operators)
        # the threads are the compression's own: each works on a subtree, with one BLAS thread
        with one_blas_thread():
            with stage("assemble"):
                self._system, self._outer = self._compress(border)
                own = self._outer.first_node, self._outer.last_node
                first, last = np.cumsum([0, *operators.right_hand_sides.count])[list(own)]
                self._is_contact = operators.of_contact[first:last]
                self.loads = self._outer @ operators.amplitudes[first:last]
            with stage("factor"):
                self._factor = factor(self._system, use_up=True)
                self._spare()
        self._here, self.here = slice(*own), slice(operators.kernel.dim * own[0], operators.kernel.dim * own[1])

    def _spare(self) -> None:
        if self.operators.mesh.n_nodes >= SCARCE:
            give_back()

    def push(self, sigma: Array) -> Array:
        """G_Ct σ on this rank's nodes for σ (m k,) or several (m k, s)."""
        padded = np.zeros((len(self._is_contact), *sigma.shape[1:]))
        padded[self._is_contact] = sigma[self._contact_here] / self.operators.traction_scale
        return np.asarray(self._outer @ padded)

    def solve(self, rhs: Array) -> Array:
        """A_0⁻¹ times this rank's share of a right-hand side, or of several."""
        unknowns = np.asarray(self._factor.solve(rhs))
        return unknowns if self._units is None else (unknowns.T * self._units[self._here].ravel()).T

    def everywhere(self, unknowns: Array) -> Array:
        """All unknowns from each rank's."""
        return self.contact.everywhere(unknowns)

    def on_contact(self, unknowns: Array) -> Array:
        """u in the contact directions, (m k,) or (m k, s), out of each rank's unknowns."""
        return self.contact.everywhere(unknowns[self.contact.local_unknowns])

    @property
    def nbytes(self) -> int:
        """Of the compressed operators and the factorisation, on all ranks."""
        return int(self._system.nbytes + self._outer.nbytes + self._factor.nbytes)

    def describe(self) -> str:
        """Tolerance, leaf, ranks, memory."""
        rank = max((level.most for level in self._system.ranks()), default=0)
        return (
            f"hodlr, tolerance {self.bem.hodlr_tol:g}, leaf {self.bem.hodlr_leaf}, largest rank {rank}, "
            f"{self.nbytes / 1e6:.1f} MB"
        )

    def _compress(self, border: tuple[Array, Array] | None) -> tuple[HODLR, HODLR]:
        operators, mesh = self.operators, as_curve(self.operators.mesh)
        d = operators.kernel.dim

        def bordered(entries: Array, rows: Index, columns: Index) -> Array:
            if border is None:
                return entries
            left, right = (part.reshape(mesh.n_nodes, d, -1) for part in (border[0], border[1].T))
            return entries + left[rows].reshape(d * len(rows), -1) @ right[columns].reshape(d * len(columns), -1).T

        def scaled(entries: Array, rows: Index, columns: Index) -> Array:
            whole = bordered(entries, rows, columns)
            return whole if self._units is None else whole * self._units[columns].ravel()

        def system_entries(rows: Index, columns: Index) -> Array:
            return scaled(operators.system_entries(rows, columns), rows, columns)

        def all_entries(rows: Index, columns: Index) -> list[Array]:
            system, outer = operators.all_entries(rows, columns)
            return [scaled(system, rows, columns), outer]

        sides = np.flatnonzero(np.diff(mesh.part[mesh.element]) | np.diff(mesh.line[mesh.element])) + 1
        threads = threads_per_rank() if mesh.n_nodes >= THREADED else 1
        pairs = d * np.arange(mesh.n_nodes + 1)
        single = np.concatenate([[0], np.cumsum(operators.right_hand_sides.count)])
        system = compress(
            system_entries, mesh.x, pairs, pairs, self.bem.hodlr_tol, self.bem.hodlr_leaf, breaks=sides,
            threads=threads, comm=self.comm.tompi4py() if self.comm.getSize() > 1 else None,
            serve=(all_entries, [pairs, single]),
        )  # fmt: skip
        self._spare()
        outer = system.beside(operators.outer_entries, single)
        for matrix, entries in ((system, system_entries), (outer, operators.outer_entries)):
            missed = matrix.error_estimate(entries, np.random.default_rng(2019))
            worst = max(missed.product, missed.entry)
            if not worst <= ALLOWED_MISS * self.bem.hodlr_tol:
                raise SolverError(
                    "assemble", f"the compressed operator is off by {worst:.1e}, its tolerance is {self.bem.hodlr_tol:g}",
                    "use another -bem_hodlr_tol or -bem_mat_type dense",
                )  # fmt: skip
        return system, outer


def column_units(operators: BoundaryOperators) -> Array | None:
    """Powers of two (n, d) that make unknown tractions forces, about; None where all elements are of one size.

    G of a tiny element is tiny beside H: where blocks are accurate relative to their rows, the digits of its columns would
    be lost, and the factorisation would fail.
    """
    mesh = as_curve(operators.mesh)
    length = mesh.length[mesh.element]
    units = np.exp2(np.round(np.log2(length.max() / length)))
    if np.all(units == 1.0):
        return None
    return np.where(operators.data.traction_known, 1.0, units[:, None])


class CompressedSystem(EliminatedSystem):
    """u_t = u_0 + S σ_t with HODLR operators; a Robin solve is a Krylov iteration on I + ρS.

    Raises
    ------
    SolverError
        As `CompressedOperators`.
    """

    matrix_free = True

    def __init__(self, operators: BoundaryOperators, comm: Any, bem: Bem) -> None:
        super().__init__(operators, comm)
        self.compressed = CompressedOperators(operators, comm, bem)
        self._load = self.compressed.loads[:, 0]
        with one_blas_thread(), stage("factor"):
            self._at_rest = self.compressed.solve(self._load)
        self.u_0 = self._contact_part(self._at_rest) + operators.data.sliding
        self._shell = Shell(self.contact.layout, comm, self._apply_local, self.compressed.describe())
        self._products: list[tuple[Array, Array]] = []
        self._solver = LinearSolver(comm, "", "iterate", ksp_type="gmres", pc_type="python", rtol=ROBIN_RTOL)
        self._preconditioner: RobinPreconditioner | None = None

    def apply(self, sigma_t: Array) -> Array:
        """S σ_t: a product with G_Ct, a solve with A_0."""
        self.applications += 1
        return self._contact_part(self.compressed.solve(self.compressed.push(sigma_t.ravel())))

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """(I + ρS) δσ = r; δu = S δσ, so that both belong together whatever the KSP left."""
        self._shell.rho = float(rho)
        self._products = []
        if not self._solver.kind:
            if self._solver.ksp.getPC().getType() == "python":
                self._preconditioner = robin_preconditioner(self, float(rho), self._solver.ksp.getPC())
            self._solver.set_operator(self._shell.matrix)
        if self._preconditioner is not None:
            self._preconditioner.rho = float(rho)
        rhs = self.contact.vector(r)
        solution = rhs.duplicate()
        solution.set(0.0)
        self._solver.solve(rhs, solution)
        rhs.destroy()
        sigma_t = self.contact.gather(solution)
        self.elastic_solves += 1
        self.ksp_iterations, self.ksp_reason = self._solver.iterations, self._solver.reason
        return self._product_from_others(sigma_t), sigma_t

    def _product_from_others(self, sigma_t: Array) -> Array:
        """S σ_t from the products of the KSP, whose solution is a combination of the vectors that it multiplied."""
        if self._products:
            vectors, products = (np.column_stack([pair[i].ravel() for pair in self._products]) for i in (0, 1))
            weights = np.linalg.lstsq(vectors, sigma_t.ravel(), rcond=None)[0]
            if np.linalg.norm(vectors @ weights - sigma_t.ravel()) <= SPANNED * np.linalg.norm(sigma_t):
                return np.asarray(products @ weights).reshape(sigma_t.shape)
        return self.apply(sigma_t)

    def compliance(self) -> Array:
        """S as a dense array, a block of columns at a time: for small problems and tests."""
        m, operators = self.contact.size, self.compressed
        blocks = [operators.push(np.eye(m, min(64, m - k), -k)) for k in range(0, m, 64)]
        return np.hstack([operators.on_contact(operators.solve(block)) for block in blocks])

    def boundary(self, sigma_t: Array) -> tuple[Array, Array]:
        """One solve with A_0."""
        unknowns = self.compressed.solve(self._load + self.compressed.push(sigma_t.ravel()))
        return self.operators.split(self.compressed.everywhere(unknowns), sigma_t)

    def memory(self) -> int:
        """Bytes of the compressed operators and the factorisation, on all ranks."""
        return self.compressed.nbytes

    def describe(self) -> str:
        """Formulation, operator and solver."""
        return "; ".join(filter(None, [f"condensed, hodlr {self.compressed.bem.hodlr_tol:g}", self._solver.kind]))

    def close(self) -> None:
        """Free the PETSc objects and let go of the compressed operators."""
        self._solver.close()
        self._shell.matrix.destroy()
        del self.compressed

    def _contact_part(self, unknowns: Array) -> Array:
        return self.compressed.on_contact(unknowns).reshape(-1, 1)

    def _apply_local(self, x: Array) -> Array:
        whole = self.contact.everywhere(x).reshape(-1, 1)
        product = self.apply(whole)
        self._products.append((whole, product))
        return product[self.contact.owned, 0]


class Shell:
    """I + ρS as a PETSc matrix of type python; ρ may change between solves.

    Parameters
    ----------
    layout : (local, global) size
    comm : PETSc.Comm
    apply : callable
        S times this rank's part of a vector, collective.
    text : str
        What `-ksp_view` and `-mat_view` say of it.
    """

    def __init__(self, layout: tuple[int, int], comm: Any, apply: Callable[[Array], Array], text: str) -> None:
        self.rho, self._apply, self._text = 0.0, apply, text
        self.matrix = petsc().Mat().createPython((layout, layout), context=self, comm=comm)
        self.matrix.setUp()

    def mult(self, matrix: Any, x: Any, y: Any) -> None:
        """y = x + ρ S x."""
        values = x.getArray(readonly=True)
        y.setArray(values + self.rho * self._apply(values))

    def view(self, matrix: Any, viewer: Any) -> None:
        """The line of -ksp_view."""
        viewer.printfASCII(f"    I + rho S, S by {self._text}\n")
