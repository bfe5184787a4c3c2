"""S over all contact nodes, dense or by its products: kept through all load steps, methods and ρ
that use it."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Array
from ..contact.system import Linearisation, Modes, RigidModeConstraint, Surrogate
from ..errors import InputError
from ..linalg.bordered import BorderedKrylov
from ..linalg.dense_solver import DenseSolver
from ..round_off import SOLVED

MakeSurrogate = Callable[[], Surrogate | None]


class ContactCompliance(abc.ABC):
    """S, and Robin problems with it; vectors are (m, k) arrays, the same on every rank.

    Attributes
    ----------
    matrix_free : bool
        Whether S is known by its products: `matrix` is then a product a column.
    surrogate : callable
        Makes T, or None.
    ksp_iterations, ksp_reason : int
        Of the last Robin solve.
    """

    matrix_free = False

    def __init__(self, surrogate: MakeSurrogate) -> None:
        self.surrogate, self.ksp_iterations, self.ksp_reason = surrogate, 0, 0

    @abc.abstractmethod
    def apply(self, sigma: Array) -> Array:
        """The product S σ; collective."""

    @abc.abstractmethod
    def matrix(self) -> Array:
        """S, (m k, m k)."""

    @abc.abstractmethod
    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """δv = S δσ + M δα and δσ with δσ + ρ δv = r and E δσ = work (r,); ρ is of the shape of r.
        Collective."""

    def softened(self, layer: Array) -> ContactCompliance:
        """S of contacts with a layer that gives way to the pressure of each node, by `layer` (m,)
        [length/stress] times it.

        Raises
        ------
        InputError
            If the storage has no way to.
        """
        raise InputError('bem.mat_type: wear is not solved on these operators; choose "dense"')

    @property
    def kind(self) -> str:
        """KSP and PC of Robin solves by their types."""
        return ""

    def close(self) -> None:  # noqa: B027 (some have none)
        """Free every PETSc object."""


class DenseCompliance(ContactCompliance):
    """S as a matrix on every rank; I + ρS is factorised for each ρ by the KSP without a prefix."""

    def __init__(self, matrix: Array, comm: Any, surrogate: MakeSurrogate) -> None:
        super().__init__(surrogate)
        self._matrix, self._comm = np.asfortranarray(matrix), comm
        self._solver: DenseSolver | None = None
        self._of: tuple[Array, Modes | None, RigidModeConstraint | None] | None = None

    def apply(self, sigma: Array) -> Array:
        """The product S σ."""
        return np.asarray(self._matrix @ sigma.ravel()).reshape(sigma.shape)

    def matrix(self) -> Array:
        """The compliance S as a matrix."""
        return self._matrix

    def softened(self, layer: Array) -> ContactCompliance:
        """With the layer on the diagonal of the normal components."""
        k, soft = len(self._matrix) // len(layer), self._matrix.copy()
        normal = k * np.arange(len(layer)) + k - 1
        soft[normal, normal] += layer
        return DenseCompliance(soft, self._comm, self.surrogate)

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """A new ρ costs a factorisation of I + ρS, bordered by the motions."""
        solver = self._solver = self._solver or DenseSolver(self._comm, "")
        border = self._bordered(solver, rho, r, modes)
        whole = solver.solve(
            r.ravel() if border is None else np.concatenate([r.ravel(), border.work(work)])
        )
        self.ksp_iterations, self.ksp_reason = solver.iterations, solver.reason
        sigma = whole[: r.size].reshape(r.shape)
        dv = self.apply(sigma)
        if modes is not None and border is not None:
            dv = dv + modes.motion @ border.motion(whole[r.size :])
        return dv, sigma

    def _bordered(
        self, solver: DenseSolver, rho: Array, r: Array, modes: Modes | None
    ) -> RigidModeConstraint | None:
        """The border, where there are motions; the solver's matrix is that of ρ."""
        each = rho.ravel()
        if self._of is not None and self._of[1] is modes and np.array_equal(self._of[0], each):
            return self._of[2]
        n, border = r.size, None
        if modes is not None and self._of is not None and self._of[1] is modes:
            border = self._of[2]
        elif modes is not None:
            border = RigidModeConstraint(modes, Linearisation.all_stick(r), np.zeros_like(r), 1.0)
        rows, first = solver.rows(n if border is None else n + len(border.rhs))
        last = first + len(rows)
        inner = slice(first, min(last, n))
        count = max(inner.stop - inner.start, 0)
        # (4.11) in u = u_0 + Sσ, which (4.12) and (4.13) give: (I + ρS) σ' = σ + ρ(u - u_0) - ωR_ρ
        np.multiply(self._matrix[inner], each[inner, None], out=rows[:count, :n])
        rows[np.arange(count), np.arange(inner.start, inner.start + count)] += 1.0
        if border is not None:
            rows[:count, n:] = each[inner, None] * border.columns[inner]
            rows[count:, :n], rows[count:, n:] = (
                border.rows[max(first - n, 0) : max(last - n, 0)],
                0.0,
            )
        solver.factor()
        self._of = each.copy(), modes, border
        return border

    @property
    def kind(self) -> str:
        """Of the KSP without a prefix; empty as long as nothing was solved."""
        return "" if self._solver is None else self._solver.kind

    def close(self) -> None:
        """Free factors and every PETSc object."""
        if self._solver is not None:
            self._solver.close()
        self._solver = self._of = None


class ProductCompliance(ContactCompliance):
    """S by its products alone; T, which there has to be, preconditions I + ρS.

    Parameters
    ----------
    product : callable
        S σ of (m, k) arrays, collective.
    shape : (m, k)
    motions : int
        Most rigid motions there may be.
    comm : PETSc.Comm
    surrogate : callable
    text : str
        What `-ksp_view` says of S.
    """

    matrix_free = True

    def __init__(
        self,
        product: Callable[[Array], Array],
        shape: tuple[int, int],
        motions: int,
        comm: Any,
        surrogate: MakeSurrogate,
        text: str,
    ) -> None:
        super().__init__(surrogate)
        self._product, self._shape, self._others = product, shape, (motions, comm, surrogate, text)
        self._krylov = BorderedKrylov(shape, motions, "", comm, f"I + rho S, S by {text}")
        self._layer: Surrogate | None = None
        self._products: list[tuple[Array, Array]] = []

    def apply(self, sigma: Array) -> Array:
        """The product S σ."""
        return self._product(sigma)

    def softened(self, layer: Array) -> ContactCompliance:
        """With the layer added to products."""
        add = np.zeros(self._shape)
        add[:, -1] = layer
        return ProductCompliance(
            lambda sigma: self._product(sigma) + add * sigma, self._shape, *self._others
        )

    def matrix(self) -> Array:
        """S, a product a column: for tests, and for many Robin solves."""
        return np.column_stack(
            [
                self.apply(e.reshape(self._shape)).ravel()
                for e in np.eye(self._shape[0] * self._shape[1])
            ]
        )

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """GMRES, preconditioned by (I + ρT)⁻¹; motions in units of what the whole traction
        moves."""
        if self._layer is None:
            self._layer = self.surrogate()
        assert self._layer is not None, "a system by products has a T"
        layer, stuck = self._layer, Linearisation.all_stick(r)
        length = 1.0 if modes is None else float(np.abs(layer.apply(np.ones_like(r))).max())
        border = RigidModeConstraint(modes, stuck, np.zeros_like(r), length)
        columns, rows = border.spread(stuck.active)
        self._products = []
        # v = u_0 + S σ + M α and E σ + f = 0 hold whatever this residual is: the iteration ends
        # where it would with 1e-12, in as many steps, at a third of the price
        sigma, coordinates = self._krylov.solve(
            self._noted(rho),
            lambda x: layer.solve(x, rho[0]),
            rho * columns,
            rows,
            r,
            border.work(work),
            0.0,
            1e-4,
        )
        self.ksp_iterations, self.ksp_reason = self._krylov.iterations, self._krylov.reason
        dv = self._product_of(sigma)
        return (dv if modes is None else dv + modes.motion @ border.motion(coordinates)), sigma

    def _noted(self, rho: Array) -> Callable[[Array], Array]:
        def product(x: Array) -> Array:
            moved = self.apply(x)
            self._products.append((x.copy(), moved))
            return x + rho * moved

        return product

    def _product_of(self, sigma: Array) -> Array:
        """S σ from the products of the KSP, whose solution is a combination of the vectors that it
        multiplied."""
        if self._products:
            vectors, products = (
                np.column_stack([pair[i].ravel() for pair in self._products]) for i in (0, 1)
            )
            weights = np.linalg.lstsq(vectors, sigma.ravel(), rcond=None)[0]
            if np.linalg.norm(vectors @ weights - sigma.ravel()) <= SOLVED * np.linalg.norm(sigma):
                return np.asarray(products @ weights).reshape(sigma.shape)
        return self.apply(sigma)

    @property
    def kind(self) -> str:
        """Of the KSP without a prefix."""
        return self._krylov.kind

    def close(self) -> None:
        """Free every PETSc object."""
        self._krylov.close()
