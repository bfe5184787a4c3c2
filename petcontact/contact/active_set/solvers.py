"""Solvers for S on the components of an active set, with rigid motions.

KSPs have the prefix `stick_`, and `sum_` for T + S. If S is dense and small, they solve dense
blocks; ranks share the factors of large ones. Otherwise they solve matrices of type python with the
surrogate T as preconditioner.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy

from ... import native
from ...arrays import Array, Index, Mask
from ...errors import SingularMatrixError, SolverError
from ...linalg.bordered import BorderedElimination, BorderedKrylov, Map
from ...linalg.dense_solver import DenseSolver
from ...round_off import SOLVED
from ...runtime.petsc import petsc
from ..linearisation import Linearisation
from ..system import ContactSystem, Modes, RigidModeConstraint, Surrogate
from .block_factors import BlockFactors

_BLOCK = native.function("petcontact_active_block", "iiDDDNiNiD")
DIRECT_SIZE = 512
"""Number of contact unknowns up to which LU of a block is faster than iterations with a fast T."""
LARGEST = 12_000
"""Largest number of contact unknowns for a dense S (1.2 GB) where iterations fail."""


class _Counted:
    """Counts of the system's work, by a solver that does the work itself."""

    def __init__(self, system: ContactSystem) -> None:
        self.system = system
        self.ksp_iterations = 0
        self.matrix: Array | None = None

    def apply(self, x: Array) -> Array:
        """Return the product S x."""
        if self.matrix is None:
            return self.system.apply(x)
        self.system.applications += 1
        return np.asarray(self.matrix @ x.ravel()).reshape(x.shape)


class DenseActiveSetSolver(_Counted):
    """Solver with a dense S, by a KSP on its blocks."""

    noise = 1e-11

    def __init__(
        self,
        system: ContactSystem,
        surrogate: Surrogate | None,
        factors: BlockFactors | None = None,
    ) -> None:
        super().__init__(system)
        self._surrogate, self._factors = surrogate, factors or BlockFactors()
        self._dense = np.asfortranarray(system.compliance())
        if system.matrix_free:
            self.matrix = self._dense  # formed by as many products as it has columns
        self._sum: DenseSolver | None = None

    def solve(
        self, linearised: Linearisation, rho: Array, rhs: Array, modes: Modes | None, sigma: Array
    ) -> tuple[Array, Array, Array]:
        """Return δy on the active components, δα, and motions that no active component resists.

        They solve [(I - Π')/ρ + SΠ'] δy + M δα = rhs there and E(σ + Π'δy) + f = 0. The third array
        has combinations (r, q) of motions of unit size, which are not changed.
        """
        self.system.elastic_solves += 1
        active, result = np.flatnonzero(linearised.active), np.zeros(rhs.shape)
        scale = float(np.abs(self._dense.diagonal()[active]).max(initial=0.0))
        constraint = RigidModeConstraint(modes, linearised, sigma, scale)
        block = _block(self._dense, linearised, rho, active, len(constraint.rhs))
        constraint.border(block)
        answer = self._factors.solve(
            self._dense,
            active,
            _marks(linearised, rho, active),
            block,
            np.concatenate([rhs.ravel()[active], constraint.rhs]),
        )
        self.ksp_iterations = self._factors.iterations
        result.flat[active] = answer[: len(active)]
        return result, constraint.motion(answer[len(active) :]), constraint.free

    def sum_solve(
        self, rhs: Array, whole: Linearisation, modes: Modes | None, sigma: Array
    ) -> tuple[Array, Array]:
        """Return δσ and δα with (T + S) δσ + M δα = rhs and E(σ + δσ) + f = 0; the factors are
        kept."""
        constraint = RigidModeConstraint(
            modes, whole, sigma, float(np.abs(np.diag(self._dense)).max(initial=0.0))
        )
        if self._sum is None:
            assert self._surrogate is not None, "T + S needs T"
            self._sum = DenseSolver(petsc().COMM_SELF, "sum_")
            matrix = np.pad(self._surrogate.matrix() + self._dense, (0, len(constraint.rhs)))
            constraint.border(matrix)
            self._sum.take(matrix)
        self.system.elastic_solves += 1
        answer = self._sum.solve(np.concatenate([rhs.ravel(), constraint.rhs]))
        self.ksp_iterations = self._sum.iterations
        result = np.asarray(answer[: rhs.size]).reshape(rhs.shape)
        return result, constraint.motion(answer[rhs.size :])

    def close(self) -> None:
        """Free T + S; the block's KSP belongs to the factors."""
        if self._sum is not None:
            self._sum.close()


def _marks(linearised: Linearisation, rho: Array, active: Index) -> Array:
    """Return what the columns of `_block` depend on beside S, (q, 2k): Π' of the node, and ρ where
    the column has a share of (I - Π')/ρ."""
    node, own = np.divmod(active, rho.shape[1])
    column = linearised.derivative[node, :, own]
    slack = (column != np.eye(rho.shape[1])[own]) & linearised.active[node]
    return np.hstack([column, np.where(slack, rho[node], 0.0)])


def _block(
    dense: Array, linearised: Linearisation, rho: Array, active: Index, border: int = 0
) -> Array:
    """Return (I - Π')/ρ + SΠ' on the active components, with room for rows and columns beyond.

    Only nodes whose Π' is not 0 or 1 change columns of S.
    """
    size, mixed = len(active) + border, np.empty(len(active), dtype=np.int64)
    columns = np.empty((size, size))
    given = [np.ascontiguousarray(a) for a in (dense.T, linearised.derivative, rho)]
    _BLOCK(len(dense), rho.shape[1], *given, active, len(active), mixed, size, columns)
    return columns.T


class KrylovActiveSetSolver(_Counted):
    """Solver with products of S only; every rank of the communicator iterates on whole vectors.

    Rigid motions are unknowns of the iteration, which its preconditioner eliminates.

    Attributes
    ----------
    direct : DenseActiveSetSolver, optional
        Solver that is used after iterations have failed. They fail, for example, if a thin stiff
        coating makes T differ from S.
    """

    noise = 1e-10

    def __init__(self, system: ContactSystem, surrogate: Surrogate) -> None:
        super().__init__(system)
        self.surrogate = surrogate
        self.direct: DenseActiveSetSolver | None = None
        shape, rank = system.u_0.shape, 0 if system.modes is None else len(system.modes.load)
        self._stick = BorderedKrylov(shape, rank, "stick_")
        self._sum = BorderedKrylov(shape, rank, "sum_")
        self._length = float(np.abs(surrogate.apply(np.ones(shape))).max(initial=0.0))

    def solve(
        self, linearised: Linearisation, rho: Array, rhs: Array, modes: Modes | None, sigma: Array
    ) -> tuple[Array, Array, Array]:
        """Return the solution by GMRES on the active components, with the inverse of T's block as
        preconditioner, or near it.

        Off these components the matrix is the identity. If GMRES fails, LU of a dense S is used.
        """
        if self.direct is None:
            try:
                return self._iterated(linearised, rho, rhs, modes, sigma)
            except SolverError:
                if rhs.size > LARGEST:
                    raise
                self.direct = DenseActiveSetSolver(self.system, self.surrogate)
                self.matrix = self.direct.matrix
        solution = self.direct.solve(linearised, rho, rhs, modes, sigma)
        self.ksp_iterations = self.direct.ksp_iterations
        return solution

    def _iterated(
        self, linearised: Linearisation, rho: Array, rhs: Array, modes: Modes | None, sigma: Array
    ) -> tuple[Array, Array, Array]:
        active = linearised.active

        def product(x: Array) -> Array:
            traction = linearised.traction(x)
            slack = np.where(linearised.stick, 0.0, (x - traction) / rho)
            return np.where(active, slack + self.apply(traction), x)

        def inverse(r: Array) -> Array:
            return np.where(active, self.surrogate.stick_solve(active, r, 1.0), r)

        constraint = RigidModeConstraint(modes, linearised, sigma, self._length)
        y, coordinates = self._solved(
            self._stick, product, inverse, constraint, active, np.where(active, rhs, 0.0)
        )
        return np.where(active, y, 0.0), constraint.motion(coordinates), constraint.free

    def sum_solve(
        self, rhs: Array, whole: Linearisation, modes: Modes | None, sigma: Array
    ) -> tuple[Array, Array]:
        """Return the solution with T + S by GMRES, with T⁻¹ as preconditioner."""
        constraint = RigidModeConstraint(modes, whole, sigma, self._length)
        y, coordinates = self._solved(
            self._sum,
            lambda x: self.surrogate.apply(x) + self.apply(x),
            self.surrogate.solve,
            constraint,
            whole.active,
            rhs,
        )
        return y, constraint.motion(coordinates)

    def _solved(
        self,
        krylov: BorderedKrylov,
        product: Map,
        inverse: Map,
        constraint: RigidModeConstraint,
        active: Mask,
        rhs: Array,
    ) -> tuple[Array, Array]:
        base = np.where(active, self.system.u_0, 0.0)
        floor = SOLVED * float(np.linalg.norm(self.surrogate.solve(base)))
        self.system.elastic_solves += 1
        solution = krylov.solve(
            product, inverse, *constraint.spread(active), rhs, constraint.rhs, floor, SOLVED
        )
        self.ksp_iterations = krylov.iterations
        return solution

    def close(self) -> None:
        """Free the solvers."""
        for solver in (self._stick, self._sum, self.direct):
            if solver is not None:
                solver.close()


class SurrogateActiveSetSolver:
    """Solver with T in place of S, for predictions, after T has been scaled."""

    noise, ksp_iterations = 1e-11, 0

    def __init__(self, surrogate: Surrogate) -> None:
        self._surrogate = surrogate

    def apply(self, x: Array) -> Array:
        """Return the product T x."""
        return self._surrogate.apply(x)

    def solve(
        self, linearised: Linearisation, rho: Array, rhs: Array, modes: Modes | None, sigma: Array
    ) -> tuple[Array, Array, Array]:
        """Return the solution by solves on active components, one component after another.

        This is exact where Π' is the identity on them, as it is in the plane: there T does not
        couple shear to pressure. Where it is not, as in slip on disks, LU of a block is used.
        """
        inverse = self._by_component(linearised)
        if (linearised.active != linearised.stick).any():
            inverse = self._by_block(linearised, rho)
        constraint = RigidModeConstraint(
            modes, linearised, sigma, float(np.abs(rhs).max(initial=0.0))
        )
        dy, coordinates = BorderedElimination(inverse, *constraint.spread(linearised.active))(
            rhs, constraint.rhs
        )
        return dy, constraint.motion(coordinates), constraint.free

    @cached_property
    def _whole(self) -> Array:
        return np.asfortranarray(self._surrogate.matrix())

    def _by_component(self, linearised: Linearisation) -> Map:
        def inverse(r: Array) -> Array:
            dy = np.zeros_like(r)
            for _ in range(r.shape[1]):
                left = r if not dy.any() else r - self.apply(linearised.traction(dy))
                dy = dy + self._surrogate.stick_solve(
                    linearised.active, np.where(linearised.active, left, 0.0)
                )
            return dy

        return inverse

    def _by_block(self, linearised: Linearisation, rho: Array) -> Map:
        active = np.flatnonzero(linearised.active)
        block = _block(self._whole, linearised, rho, active)
        lu, pivots, zero = scipy.linalg.lapack.dgetrf(block)
        if zero > 0:
            raise SingularMatrixError("iterate", f"row {zero} of a block of T")

        def inverse(r: Array) -> Array:
            dy = np.zeros_like(r)
            dy.flat[active] = scipy.linalg.lu_solve((lu, pivots), r.ravel()[active])
            return dy

        return inverse


ActiveSetSolver = DenseActiveSetSolver | KrylovActiveSetSolver | SurrogateActiveSetSolver
"""S, or T, with the solves that methods need, for vectors (m, k); `noise` is the relative round-off
of their results."""


def active_set_solver(
    system: ContactSystem, surrogate: Surrogate | None, factors: BlockFactors | None = None
) -> DenseActiveSetSolver | KrylovActiveSetSolver:
    """Return the solver by LU if S is dense and small, or if there is no fast T; else by Krylov
    iterations."""
    if surrogate is not None and (
        system.matrix_free or (surrogate.fast and system.u_0.size > DIRECT_SIZE)
    ):
        return KrylovActiveSetSolver(system, surrogate)
    return DenseActiveSetSolver(system, surrogate, factors)
