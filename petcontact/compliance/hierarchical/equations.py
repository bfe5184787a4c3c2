"""The equations of bodies, solved together with a linear law of contact and with the equilibrium of
free bodies.

With Q an orthonormal basis of the rigid motions that nothing holds, and D the weights by which any
displacement has some of them, DᵀQ = 1, A stands for A - (AQ - Q)Dᵀ: regular, and unlike the
compressed A, or constant elements, exact for these motions. Unknowns β' along Q go with rows for
equilibrium; of A itself β = β' + Dᵀu.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...linalg.row_layout import everywhere, summed
from ...round_off import HALF
from ...runtime.ranks import mpi
from ...runtime.signals import together
from ...runtime.threads import one_blas_thread
from ...untyped import PC, Comm, Mat, Vec, Viewer
from .coupling import Coupling, Relation
from .krylov import FlexibleKrylov
from .linear_problem import Balance, Posed, State
from .preconditioner import Preconditioner
from .rows import BodyRows

ROUGH = 1e-3
"""Reduction of the residual after which the sizes of bodies that lay still are measured."""


class MixedEquations:
    """The equations of bodies with a linear relation of displacements and tractions in contact.

    Every rank has whole vectors and some rows of each body. PETSc's unknowns are those of the
    bodies, and on the last rank those of rigid motions.

    Attributes
    ----------
    krylov : FlexibleKrylov
        The Krylov method, with the iterations of the last solve.
    defect : float
        Residual of the last solve, of each body relative to its solution.
    """

    def __init__(self, rows: Sequence[BodyRows], coupling: Coupling, comm: Comm) -> None:
        self.rows, self.coupling, self.comm = rows, coupling, comm
        self.defect = 0.0
        self.rank, ranks = comm.getRank(), comm.getSize()
        spans = [
            [
                np.arange(*body.bounds[r : r + 2]) + offset
                for offset, body in zip(coupling.first, rows, strict=False)
            ]
            for r in range(ranks)
        ]
        self._order = np.concatenate([span for of_rank in spans for span in of_rank])
        self._mine, self._is_last = np.concatenate(spans[self.rank]), self.rank == ranks - 1
        self._weight = np.ones(coupling.size)
        self.ends = np.cumsum([0, *(body.motions.shape[1] for body in rows)])
        """First motion of each body among those of all."""
        n, r = coupling.size, int(self.ends[-1])
        self.motions, self._dual = np.zeros((n, r)), np.zeros((n, r))
        self._coordinates, self._shift = np.zeros((r, r)), np.zeros((len(self._mine), r))
        for b, body in enumerate(rows):
            motion_slice = slice(self.ends[b], self.ends[b + 1])
            own = slice(coupling.first[b], coupling.first[b + 1]), motion_slice
            self.motions[own], factor = np.linalg.qr(body.motions)
            self._dual[own] = body.gauge @ np.linalg.inv(self.motions[own].T @ body.gauge)
            self._coordinates[motion_slice, motion_slice] = np.linalg.inv(factor)
        if r:
            moved = [self._multiplied(q) for q in coupling.padded(self.motions).T]
            self._shift = self.motions[self._mine] - np.column_stack(moved)
        self.krylov = FlexibleKrylov(comm, self)
        self._used: tuple[Posed, Preconditioner] | None = None
        self.at_rest = State(
            np.zeros(n),
            np.zeros(coupling.shape),
            np.zeros(coupling.shape),
            np.zeros(r),
            np.zeros(r),
        )
        free = Balance.at_rest(coupling.shape, r)
        self._free = coupling.expansion(Relation.given_traction(coupling.shape), free.motion), free
        with one_blas_thread(), together(mpi(comm)):
            self._open = Preconditioner(
                rows,
                coupling,
                (self.motions, self._dual),
                self.sum,
                (self.rank, ranks),
                self._free[0],
            )
            self._laws = self._open.copy()

    # -- problems
    # ----------------------------------------------------------------------------------------------

    def loads(self, shares: Array, only: int | None = None) -> tuple[Array, Array]:
        """Return the factors of all columns and this rank's rows for load states with weights (K,),
        of all bodies or of one."""
        parts = [body.load(shares * (only in (None, b))) for b, body in enumerate(self.rows)]
        factors, rows = (np.concatenate(values) for values in zip(*parts, strict=True))
        return factors, rows

    def elastic(self, loads: tuple[Array, Array], rtol: float) -> State:
        """Solve the bodies alone, without rigid motions; given tractions are among the factors."""
        expansion, balance = self._free
        posed = Posed(expansion, np.zeros(self.coupling.shape), *loads, balance)
        return self.solve(posed, self.at_rest, rtol, 0.0, self._open)

    def solve(
        self,
        posed: Posed,
        start: State,
        rtol: float,
        forcing: float,
        preconditioner: Preconditioner | None = None,
    ) -> State:
        """Solve from a solution that is known.

        The Krylov method reduces the residual to `forcing` of that at the start, but not below rtol
        times the size of the solution.
        """
        preconditioner = preconditioner or self._laws
        relation, count = posed.expansion.relation, posed.balance.count
        factors, sigma = self.coupling.known(relation, posed.offset)
        factors -= posed.factors
        given = factors, sigma, posed.rows, posed.balance.load, posed.balance.amplitude
        if not self.sum(np.array([float(any(values.any() for values in given))])).any():
            self.krylov.iterations, self.defect = 0, 0.0
            return self._state(
                posed, factors, sigma, np.zeros(self.coupling.size + posed.balance.count)
            )
        x, scale = self._start(posed, start), float(np.sqrt(len(self.rows)))
        sizes = self._strained(start.z)
        if not sizes.all():
            self._weight[:] = 1.0
            rest = np.zeros(self.coupling.size + count)
            sizes = np.where(
                sizes > 0.0,
                sizes,
                self._sizes(self.whole(self._residual(posed, factors, sigma, rest))),
            )
        still = (
            sizes <= HALF * sizes.max()
            if preconditioner is not self._open
            else np.zeros(len(sizes), dtype=bool)
        )
        # what lies still until contact moves it is taken for a hundredth of the largest
        left, size = self._weighed(
            np.where(still, 0.01 * sizes.max(), sizes), posed, factors, sigma, x
        )
        # a slender body moves far under small forces: they may be out of balance by more
        target = max(rtol * scale, forcing * size)
        if size <= rtol * scale:
            target = min(
                target,
                posed.balance.share(self.whole(left), self._border_scale(posed.balance), rtol)
                * size,
            )
        self.krylov.iterations = 0
        if size > target:
            with one_blas_thread():
                preconditioner.update(posed.expansion)
                self._used = posed, preconditioner
                self._border = self._eliminated()
            while still.any() and forcing == 0.0 and size > target:
                # how large contact makes what lay still shows first
                x += self._in_order(self.krylov(left, len(x), max(target, ROUGH * size)))
                sizes = self._strained(self._state(posed, factors, sigma, x).z)
                left, size = self._weighed(sizes, posed, factors, sigma, x)
                still &= self._sizes(self.whole(left)) > ROUGH
            if size > target:
                x += self._in_order(self.krylov(left, len(x), target))
                size = target
        self.defect = size / scale
        return self._state(posed, factors, sigma, x)

    def _strained(self, z: Array) -> Array:
        """Return the sizes of the bodies' displacements without rigid motions.

        Rigid motions have no residual but their round-off. Where bodies meet, the equations of both
        have the round-off of the larger one.
        """
        strained = self._sizes(z - self.motions @ (self._dual.T @ z))
        return np.maximum(strained, HALF * self._sizes(z).max(initial=0.0))

    def _weighed(
        self, sizes: Array, posed: Posed, factors: Array, sigma: Array, x: Array
    ) -> tuple[Array, float]:
        """Return this rank's rows of the residual and its norm, each body's over its own size."""
        sizes = np.maximum(sizes, HALF * sizes.max()) if sizes.any() else np.ones(len(sizes))
        self._weight = np.repeat(1.0 / sizes, np.diff(self.coupling.first))
        left = self._residual(posed, factors, sigma, x)
        return left, float(np.sqrt(self.sum(np.array([left @ left]))[0]))

    def _start(self, posed: Posed, start: State) -> Array:
        """Return the unknowns that are nearest to a solution."""
        coupling, motion, bodies = self.coupling, posed.balance.motion, int(self.ends[-1])
        alpha = np.zeros(bodies + motion.shape[2])
        common = min(len(alpha), len(start.alpha))
        alpha[:common] = start.alpha[:common]
        z, v = start.z.copy(), start.v
        held = posed.balance.held
        if len(held):
            # motions that are given: rigid ones leave the equations of bodies as they are, an
            # iteration strains them
            change = np.linalg.lstsq(held, posed.balance.amplitude - held @ alpha, rcond=None)[0]
            alpha += change
            moved = (
                self.motions @ np.linalg.solve(self._coordinates, change[:bodies])
                if bodies
                else np.zeros(len(z))
            )
            z += moved
            v = v + (
                coupling.seen @ moved[coupling.met] + (motion @ change[bodies:]).ravel()
            ).reshape(v.shape)
        opposite = -(coupling.opposite @ z[coupling.met]) - (motion @ alpha[bodies:]).ravel()
        z[coupling.secondary[coupling.leading]] = coupling.nearest(
            posed.expansion.relation, v, start.sigma, opposite
        )[coupling.leading]
        multipliers = (
            np.linalg.solve(self._coordinates, start.beta - start.alpha[:bodies])
            if bodies
            else np.zeros(0)
        )
        return np.concatenate([z, multipliers, alpha[bodies:]])

    def _state(self, posed: Posed, given_factors: Array, sigma: Array, x: Array) -> State:
        coupling, bodies = self.coupling, int(self.ends[-1])
        unknowns, beside = self._split(x)
        factors = posed.expansion.factors @ unknowns + given_factors
        z, obstacles = coupling.of_unknowns(factors), beside[bodies:]
        along = self._dual.T @ z
        v = coupling.seen @ z[coupling.met] + (posed.balance.motion @ obstacles).ravel()
        sigma = (posed.expansion.traction @ unknowns + sigma).reshape(coupling.shape)
        alpha = np.concatenate([self._coordinates @ along, obstacles])
        beta = self._coordinates @ (beside[:bodies] + along)
        return State(z, v.reshape(coupling.shape) + posed.offset, sigma, alpha, beta)

    def _split(self, x: Array) -> tuple[Array, Array]:
        """Return the unknowns of P, and those of rigid motions."""
        n, bodies = self.coupling.size, int(self.ends[-1])
        return np.concatenate([x[:n], x[n + bodies :]]), x[n:]

    # -- the operator
    # ----------------------------------------------------------------------------------------------

    def _multiplied(self, factors: Array) -> Array:
        """Return this rank's rows of all bodies."""
        columns = self.coupling.first_column
        return np.concatenate(
            [body.mult(factors[columns[b] : columns[b + 1]]) for b, body in enumerate(self.rows)]
        )

    def _residual(self, posed: Posed, factors: Array, sigma: Array, x: Array) -> Array:
        """Return this rank's rows of the right-hand side less the left-hand side."""
        rows, border = self._left(posed, x, factors, sigma)
        balance = posed.balance
        wanted = np.concatenate([-balance.load, balance.amplitude]) * self._border_scale(balance)
        return self._local(self._weight[self._mine] * (posed.rows - rows), wanted - border)

    def _left(
        self, posed: Posed, x: Array, given_factors: Array | float = 0.0, sigma: Array | float = 0.0
    ) -> tuple[Array, Array]:
        unknowns, beside = self._split(x)
        factors = posed.expansion.factors @ unknowns + given_factors
        rows = self._multiplied(factors)
        bodies = int(self.ends[-1])
        if bodies:
            along = self._dual.T @ self.coupling.of_unknowns(factors)
            rows = rows + self._shift @ along + self.motions[self._mine] @ beside[:bodies]
        return rows, self._border_rows(posed, unknowns, factors, sigma)

    def _border_rows(
        self, posed: Posed, unknowns: Array, factors: Array, sigma: Array | float = 0.0
    ) -> Array:
        """Return the rows of rigid motions, (r,)."""
        balance = posed.balance
        if not balance.count:
            return np.zeros(0)
        sigma = np.asarray(posed.expansion.traction @ unknowns + sigma)
        along = self._coordinates @ (self._dual.T @ self.coupling.of_unknowns(factors))
        alpha = np.concatenate([along, unknowns[self.coupling.size :]])
        rows = np.concatenate(
            [balance.resultant.reshape(len(balance.load), sigma.size) @ sigma, balance.held @ alpha]
        )
        return np.asarray(rows * self._border_scale(balance))

    def _border_scale(self, balance: Balance) -> Array:
        """Return the scale of the rows of rigid motions, which makes them as large as all rows of
        contact together."""
        root = np.sqrt(len(self.coupling.scale))
        scale = self.coupling.scale
        forces = np.abs(balance.resultant).sum(axis=(1, 2)) * (scale.mean() if scale.size else 1.0)
        root = root * float(self._weight.min())
        return np.asarray(
            root
            * np.concatenate(
                [1.0 / np.where(forces > 0.0, forces, 1.0), np.ones(len(balance.amplitude))]
            )
        )

    # -- Krylov
    # ----------------------------------------------------------------------------------------------

    def mult(self, matrix: Mat, x: Vec, y: Vec) -> None:
        """Multiply by the matrix; PETSc calls this method."""
        assert self._used is not None
        rows, border = self._left(self._used[0], self.whole(x.getArray(readonly=True)))
        y.setArray(self._local(self._weight[self._mine] * rows, border))

    def apply(self, pc: PC, x: Vec, y: Vec) -> None:
        """Apply the preconditioner; PETSc calls this method."""
        assert self._used is not None
        posed, preconditioner = self._used
        r, (columns, inverse) = self.whole(x.getArray(readonly=True)), self._border
        n = self.coupling.size
        z = preconditioner.solve(r[:n] / self._weight, self._product)
        beside = inverse @ (self._border_of(posed, z, np.zeros(posed.balance.count)) - r[n:])
        y.setArray(self._local((z - columns @ beside)[self._mine], beside))

    def _product(self, z: Array, beside: Array | None = None) -> Array:
        """Return the whole equations of the bodies for unknowns of bodies and of rigid motions.
        Collective."""
        assert self._used is not None
        posed = self._used[0]
        beside = np.zeros(posed.balance.count) if beside is None else beside
        rows, _ = self._left(posed, np.concatenate([z, beside]))
        return self.whole(self._local(rows, np.zeros(0)))

    def _eliminated(self) -> tuple[Array, Array]:
        """Return the preconditioned columns of rigid motions (N, r), and the inverse of their
        border block."""
        assert self._used is not None
        posed, preconditioner = self._used
        count, bodies = posed.balance.count, int(self.ends[-1])
        columns, units = np.zeros((self.coupling.size, count)), np.eye(count)
        columns[:, :bodies] = (
            self.coupling.uncoupled(self.motions) if preconditioner is self._open else self.motions
        )
        for number, unit in enumerate(units):
            if number >= bodies:
                columns[:, number] = self._product(np.zeros(self.coupling.size), unit)
            # of bodies that are uncoupled rigid motions solve for themselves
            if preconditioner is not self._open:
                columns[:, number] = preconditioner.solve(columns[:, number], self._product)
        seen = np.array(
            [self._border_of(posed, z, -unit) for z, unit in zip(columns.T, units, strict=True)]
        )
        return columns, np.linalg.pinv(seen.reshape(count, count).T)

    def _border_of(self, posed: Posed, z: Array, beside: Array) -> Array:
        unknowns, _ = self._split(np.concatenate([z, beside]))
        return self._border_rows(posed, unknowns, posed.expansion.factors @ unknowns)

    # -- ranks
    # ----------------------------------------------------------------------------------------------

    def _local(self, rows: Array, border: Array) -> Array:
        """Return this rank's part of a vector."""
        return np.concatenate([rows, border]) if self._is_last else rows

    def whole(self, own: Array) -> Array:
        """Return a whole vector: the unknowns body after body, then those of rigid motions.
        Collective."""
        return self._in_order(everywhere(own, self.comm))

    def _in_order(self, gathered: Array) -> Array:
        """The parts of all ranks, one after another, as a whole vector."""
        result = np.array(gathered)
        result[self._order] = gathered[: len(self._order)]
        return result

    def sum(self, values: Array) -> Array:
        """Return the sum over the ranks."""
        return summed(values, self.comm)

    def _sizes(self, x: Array) -> Array:
        """Return the norm of each body's part of a whole vector."""
        return np.asarray(
            np.sqrt(np.add.reduceat(x[: self.coupling.size] ** 2, self.coupling.first[:-1]))
        )

    def view(self, matrix: Mat, viewer: Viewer) -> None:
        """Print the line of -ksp_view for the matrix and the preconditioner."""
        viewer.printfASCII(
            f"    {self.coupling.size} unknowns of {len(self.rows)} bodies, "
            f"{self.memory() / 1e6:.0f} MB\n"
        )

    def memory(self) -> int:
        """Return the memory on all ranks [bytes]."""
        own = sum(body.nbytes for body in self.rows) + self._open.nbytes + self._laws.nbytes
        return int(self.sum(np.array([own], dtype=np.float64))[0])

    def close(self) -> None:
        """Free the PETSc objects and the matrices."""
        self.krylov.close()
        self._used, self.rows = None, []
