"""The compliance S of all contact nodes, as a dense matrix or by its products.

One S serves all load steps, methods and ρ.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..contact.system import Linearisation, Modes, RigidModeConstraint, Surrogate
from ..errors import InputError
from ..linalg.bordered import BorderedKrylov
from ..linalg.dense_solver import ALONE, DenseSolver
from ..linalg.ksp import SolverFront, is_asked_for
from ..linalg.row_layout import even_ranges, everywhere
from ..round_off import SOLVED
from ..runtime.petsc import petsc
from ..untyped import Comm

MakeSurrogate = Callable[[], Surrogate | None]
BLOCK = 64
"""Columns of S that are read or left out together: a product by such blocks takes 1.1 times as long
as one of all columns (3000 and 6000 unknowns)."""
LU_OVER_ITERATION = 20
"""Unknowns for which a LU takes as long as one iteration of GMRES with another LU: 16 and 15 were
measured at 640 and 720 unknowns, 20 at 1280 and 25 at 2000."""


class ContactCompliance(SolverFront, abc.ABC):
    """S and the solution of Robin problems with it; vectors are (m, k) arrays, equal on every rank.

    It reports the KSP without a prefix, which solves Robin problems.

    Attributes
    ----------
    matrix_free : bool
        Whether S is known only by its products; `matrix` then takes one product for each column.
    surrogate : callable
        Returns T or None.
    """

    matrix_free = False
    _shape: tuple[int, int]

    def __init__(self, surrogate: MakeSurrogate) -> None:
        self.surrogate = surrogate

    @abc.abstractmethod
    def apply(self, sigma: Array) -> Array:
        """Return the product S σ, (m, k) [length]. Collective."""

    def matrix(self) -> Array:
        """Return S as a matrix (m k, m k), by one product for each column [length/stress]."""
        units = np.eye(math.prod(self._shape))
        return np.column_stack([self.apply(unit.reshape(self._shape)).ravel() for unit in units])

    @abc.abstractmethod
    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """Return δv = S δσ + M δα and the δσ for which δσ + ρ δv = r and E δσ = work. Collective.

        `rho` has the shape of `r`; `work` has one value for each motion.
        """

    def softened(self, layer: Array) -> ContactCompliance:
        """Return S with a layer that yields at each node by `layer` (m,) times the pressure
        [length/stress].

        Raises
        ------
        InputError
            If this storage of S cannot add a layer.
        """
        raise InputError('bem.mat_type: wear is not solved on these operators; choose "dense"')

    def close(self) -> None:
        """Free every PETSc object."""


def _robin_border(
    modes: Modes | None, r: Array, apply: Callable[[Array], Array]
) -> RigidModeConstraint:
    """Return the rigid motions that border I + ρS, by products with S or T; ρ is still to multiply
    the columns.

    Columns are as large as what unit tractions at all nodes displace, rows as I.
    """
    length = 1.0 if modes is None else float(np.abs(apply(np.ones_like(r))).max())
    return RigidModeConstraint(modes, Linearisation.all_stick(r), np.zeros_like(r), length, 1.0)


def _moved(
    dv: Array, modes: Modes | None, border: RigidModeConstraint, coordinates: Array
) -> Array:
    """Return S δσ + M δα."""
    return dv if modes is None else dv + modes.motion @ border.motion(coordinates)


class DenseCompliance(ContactCompliance):
    """S as a matrix on every rank; ranks share its products by rows. The KSP without a prefix
    factorises I + ρS for each ρ."""

    def __init__(self, matrix: Array, comm: Comm, surrogate: MakeSurrogate) -> None:
        super().__init__(surrogate)
        shared = comm.getSize() == 1 or len(matrix) > ALONE or is_asked_for()
        self._comm = comm if shared else petsc().COMM_SELF
        self._matrix = np.asfortranarray(matrix)
        first, last = even_ranges(len(matrix), self._comm.getSize())[self._comm.getRank()]
        self._rows = self._matrix[first:last]
        self._of: tuple[Array, Modes | None, RigidModeConstraint] | None = None
        self._factored: Array | None = None

    def apply(self, sigma: Array) -> Array:
        """Return the product S σ, (m, k) [length]. Collective.

        Blocks of columns at which no traction acts, most of those of open nodes, are not read.
        """
        whole = sigma.ravel()
        product = self._rows @ whole if whole.all() else self._by_blocks(whole)
        return everywhere(product, self._comm).reshape(sigma.shape)

    def _by_blocks(self, whole: Array) -> Array:
        product = np.zeros(len(self._rows))
        acts = np.logical_or.reduceat(whole != 0.0, np.arange(0, len(whole), BLOCK))
        ends = BLOCK * np.flatnonzero(np.diff(acts, prepend=False, append=False))
        for first, last in ends.reshape(-1, 2).tolist():
            product += self._rows[:, first:last] @ whole[first:last]
        return product

    def matrix(self) -> Array:
        """Return S as a matrix (m k, m k) [length/stress]."""
        return self._matrix

    def softened(self, layer: Array) -> ContactCompliance:
        """Return S with the layer added to the diagonal of the normal components."""
        k, soft = len(self._matrix) // len(layer), self._matrix.copy()
        normal = k * np.arange(len(layer)) + k - 1
        soft[normal, normal] += layer
        return DenseCompliance(soft, self._comm, self.surrogate)

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """Return δv and δσ. A new ρ costs a factorisation of I + ρS, bordered by the motions."""
        solver = self._solver = self._solver or DenseSolver(self._comm, "")
        border = self._bordered(solver, rho, r, modes)
        whole = solver.solve(np.concatenate([r.ravel(), border.work(work)]))
        sigma = whole[: r.size].reshape(r.shape)
        return _moved(self.apply(sigma), modes, border, whole[r.size :]), sigma

    def _bordered(
        self, solver: DenseSolver, rho: Array, r: Array, modes: Modes | None
    ) -> RigidModeConstraint:
        """Factorise the matrix for this ρ unless the solver has it; return the border."""
        factors, n = rho.ravel(), r.size
        if self._of is not None and self._of[1] is modes:
            border = self._of[2]
            if np.array_equal(self._of[0], factors):
                return border
        else:
            border, self._factored = _robin_border(modes, r, self.apply), None
        rows, first = solver.rows(n + len(border.rhs))
        last = first + len(rows)
        inner = slice(first, min(last, n))
        count = max(inner.stop - inner.start, 0)
        # (4.11) in u = u_0 + Sσ, which (4.12) and (4.13) give: (I + ρS) σ' = σ + ρ(u - u_0) - ωR_ρ
        np.multiply(self._matrix[inner], factors[inner, None], out=rows[:count, :n])
        rows[np.arange(count), np.arange(inner.start, inner.start + count)] += 1.0
        rows[:count, n:] = factors[inner, None] * border.columns[inner]
        rows[count:, :n] = border.rows[max(first - n, 0) : max(last - n, 0)]
        rows[count:, n:] = 0.0
        corrected = self._factored is not None and _is_near(factors, self._factored)
        solver.factor(corrected=corrected)
        self._of = factors.copy(), modes, border
        if not corrected:
            self._factored = self._of[0]
        return border

    def close(self) -> None:
        """Free factors and every PETSc object."""
        if self._solver is not None:
            self._solver.close()
        self._solver = self._of = self._factored = None


def _is_near(rho: Array, factored: Array) -> bool:
    """Whether GMRES with the LU of I + ρS for another ρ costs less than a new LU.

    With S symmetric and positive, the eigenvalues of (I + ρ'S)(I + ρS)⁻¹ lie between 1 and the
    ratios ρ'/ρ. With κ the largest over the smallest, k iterations leave 2 q^k of the residual,
    q = (√κ - 1)/(√κ + 1) = tanh(ln(κ)/4).
    """
    spread = np.ptp(np.append(np.log(rho) - np.log(factored), 0.0))
    left = 2.0 * math.tanh(spread / 4.0) ** (len(rho) / LU_OVER_ITERATION)
    return left < SOLVED and not is_asked_for()


class ProductCompliance(ContactCompliance):
    """S that is known only by its products. T must exist, and preconditions I + ρS.

    Parameters
    ----------
    product : callable
        Returns S σ of an (m, k) array. Collective.
    shape : (m, k)
    motions : int
        Largest possible number of rigid motions.
    comm : PETSc.Comm
    surrogate : callable
    text : str
        Description of S that `-ksp_view` prints.
    """

    matrix_free = True

    def __init__(
        self,
        product: Callable[[Array], Array],
        shape: tuple[int, int],
        motions: int,
        comm: Comm,
        surrogate: MakeSurrogate,
        text: str,
    ) -> None:
        super().__init__(surrogate)
        self._product, self._shape, self._others = product, shape, (motions, comm, surrogate, text)
        self._solver = BorderedKrylov(shape, motions, "", comm, f"I + rho S, S by {text}")
        self._layer: Surrogate | None = None
        self._products: list[tuple[Array, Array]] = []

    def apply(self, sigma: Array) -> Array:
        """Return the product S σ, (m, k) [length]."""
        return self._product(sigma)

    def softened(self, layer: Array) -> ContactCompliance:
        """Return S with the layer added to its products."""
        add = layer[:, None] * np.eye(self._shape[1])[-1]
        return ProductCompliance(
            lambda sigma: self._product(sigma) + add * sigma, self._shape, *self._others
        )

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """Return δv and δσ by GMRES, preconditioned by (I + ρT)⁻¹."""
        if self._layer is None:
            self._layer = self.surrogate()
        assert self._layer is not None, "a system by products has a T"
        layer = self._layer
        border = _robin_border(modes, r, layer.apply)
        columns, rows = border.spread(np.ones(r.shape, dtype=bool))
        self._products = []
        # v = u_0 + S σ + M α and E σ + f = 0 hold whatever this residual is. With 1e-4 the contact
        # method takes as many steps to the same result as with 1e-12, at a third of the cost
        sigma, coordinates = self._solver.solve(
            self._noted(rho),
            lambda x: layer.solve(x, rho[0]),
            rho * columns,
            rows,
            r,
            border.work(work),
            0.0,
            1e-4,
        )
        return _moved(self._product_of(sigma), modes, border, coordinates), sigma

    def _noted(self, rho: Array) -> Callable[[Array], Array]:
        def product(x: Array) -> Array:
            moved = self.apply(x)
            self._products.append((x.copy(), moved))
            return x + rho * moved

        return product

    def _product_of(self, sigma: Array) -> Array:
        """Return S σ (m, k) from the products that the KSP computed.

        Its solution is a combination of the vectors that it multiplied by S.
        """
        if self._products:
            vectors, products = (
                np.column_stack([pair[i].ravel() for pair in self._products]) for i in (0, 1)
            )
            weights = np.linalg.lstsq(vectors, sigma.ravel(), rcond=None)[0]
            if np.linalg.norm(vectors @ weights - sigma.ravel()) <= SOLVED * np.linalg.norm(sigma):
                return np.asarray(products @ weights).reshape(sigma.shape)
        return self.apply(sigma)

    def close(self) -> None:
        """Free every PETSc object."""
        self._solver.close()
