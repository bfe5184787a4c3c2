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
        self._of: tuple[Array, Modes | None, RigidModeConstraint | None] | None = None

    def apply(self, sigma: Array) -> Array:
        """Return the product S σ, (m, k) [length]. Collective."""
        return everywhere(self._rows @ sigma.ravel(), self._comm).reshape(sigma.shape)

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
        whole = solver.solve(
            r.ravel()
            if border is None
            else np.concatenate([r.ravel(), border.work(work) / border.length])
        )
        sigma = whole[: r.size].reshape(r.shape)
        dv = self.apply(sigma)
        if modes is not None and border is not None:
            dv = dv + modes.motion @ border.motion(whole[r.size :])
        return dv, sigma

    def _bordered(
        self, solver: DenseSolver, rho: Array, r: Array, modes: Modes | None
    ) -> RigidModeConstraint | None:
        """Factorise the matrix for this ρ unless the solver has it; return the border.

        The border is None if there are no motions.
        """
        factors = rho.ravel()
        if self._of is not None and self._of[1] is modes and np.array_equal(self._of[0], factors):
            return self._of[2]
        n, border = r.size, None
        if modes is not None and self._of is not None and self._of[1] is modes:
            border = self._of[2]
        elif modes is not None:
            length = float(np.abs(self.apply(np.ones_like(r))).max())
            stuck = Linearisation.all_stick(r)
            border = RigidModeConstraint(modes, stuck, np.zeros_like(r), length)
        rows, first = solver.rows(n if border is None else n + len(border.rhs))
        last = first + len(rows)
        inner = slice(first, min(last, n))
        count = max(inner.stop - inner.start, 0)
        # (4.11) in u = u_0 + Sσ, which (4.12) and (4.13) give: (I + ρS) σ' = σ + ρ(u - u_0) - ωR_ρ
        np.multiply(self._matrix[inner], factors[inner, None], out=rows[:count, :n])
        rows[np.arange(count), np.arange(inner.start, inner.start + count)] += 1.0
        if border is not None:
            rows[:count, n:] = factors[inner, None] * border.columns[inner]
            rows[count:, :n] = border.rows[max(first - n, 0) : max(last - n, 0)] / border.length
            rows[count:, n:] = 0.0
        solver.factor()
        self._of = factors.copy(), modes, border
        return border

    def close(self) -> None:
        """Free factors and every PETSc object."""
        if self._solver is not None:
            self._solver.close()
        self._solver = self._of = None


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
        add = np.zeros(self._shape)
        add[:, -1] = layer
        return ProductCompliance(
            lambda sigma: self._product(sigma) + add * sigma, self._shape, *self._others
        )

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """Return δv and δσ by GMRES, preconditioned by (I + ρT)⁻¹.

        The unit of the motions is the displacement that unit tractions at all nodes cause.
        """
        if self._layer is None:
            self._layer = self.surrogate()
        assert self._layer is not None, "a system by products has a T"
        layer, stuck = self._layer, Linearisation.all_stick(r)
        length = 1.0 if modes is None else float(np.abs(layer.apply(np.ones_like(r))).max())
        border = RigidModeConstraint(modes, stuck, np.zeros_like(r), length)
        columns, rows = border.spread(stuck.active)
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
        dv = self._product_of(sigma)
        return (dv if modes is None else dv + modes.motion @ border.motion(coordinates)), sigma

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
