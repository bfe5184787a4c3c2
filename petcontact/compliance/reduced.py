"""A contact system given by S, dense or by its products, u_0, and the rigid motions that only contact holds."""

from __future__ import annotations

import abc
from collections.abc import Callable

import numpy as np
import scipy

from ..arrays import Array
from ..contact.active_set.rigid_modes import RigidModeConstraint
from ..contact.linearisation import Linearisation
from ..contact.system import Modes, Surrogate
from ..errors import SolverError
from ..linalg.bordered import BorderedKrylov

ROBIN_RTOL = 1e-8
"""Of a Robin solve by products: v = u_0 + S σ + M α and Eσ + f = 0 hold whatever it is."""


class ComposedSystem(abc.ABC):
    """v = u_0 + S σ + M α, E σ + f = 0, as a `ContactSystem`; of bodies, obstacles, or anything else.

    Parameters
    ----------
    u_0 : (m, k) array
        [length]
    weight : (m,) array
    modes : Modes, optional
    surrogate : callable, optional
        Makes T.
    """

    matrix_free = False

    def __init__(
        self, u_0: Array, weight: Array, modes: Modes | None, surrogate: Callable[[], Surrogate | None] | None
    ) -> None:
        self.u_0, self.weight, self._make_surrogate = u_0, weight, surrogate
        self.modes = modes if modes is not None and len(modes.load) else None
        self.ksp_iterations = self.ksp_reason = self.elastic_solves = self.applications = 0

    @abc.abstractmethod
    def apply(self, sigma: Array) -> Array:
        """S σ."""

    @abc.abstractmethod
    def compliance(self) -> Array:
        """S."""

    @abc.abstractmethod
    def _solve(self, rho: Array, r: Array, work: Array) -> tuple[Array, Array]:
        """δv = S δσ + M δα and δσ with δσ + ρ δv = r and E δσ = work; ρ like r."""

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """σ + ρ v = f with equilibrium."""
        load = np.zeros(0) if self.modes is None else -self.modes.load
        dv, sigma = self._solve(np.broadcast_to(rho, f.shape), f - rho * self.u_0, load)
        return self.u_0 + dv, sigma

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """δσ + ρ δv = r with E δσ = 0."""
        return self._solve(np.broadcast_to(rho, r.shape), r, np.zeros(0 if self.modes is None else len(self.modes.load)))

    def surrogate(self) -> Surrogate | None:
        """T, or None."""
        return None if self._make_surrogate is None else self._make_surrogate()

    def amplitudes(self, v: Array, sigma: Array) -> Array:
        """α (r,) of a solution: the least one where contact sees no difference."""
        if self.modes is None:
            return np.zeros(0)
        left = (v - self.u_0 - self.apply(sigma)).ravel()
        return np.asarray(self.modes.fit @ left)


class ReducedSystem(ComposedSystem):
    """S dense.

    Parameters
    ----------
    u_0, weight, modes, surrogate
        As for `ComposedSystem`.
    compliance : (m k, m k) array
        S, component c of node i being k i + c [length/stress].
    """

    def __init__(
        self, u_0: Array, compliance: Array, weight: Array, modes: Modes | None = None,
        surrogate: Callable[[], Surrogate | None] | None = None,
    ) -> None:  # fmt: skip
        super().__init__(u_0, weight, modes, surrogate)
        self._matrix = compliance
        self._factored: tuple[Array, RigidModeConstraint, tuple[Array, Array]] | None = None

    def apply(self, sigma: Array) -> Array:
        """S σ."""
        self.applications += 1
        return np.asarray(self._matrix @ sigma.ravel()).reshape(sigma.shape)

    def compliance(self) -> Array:
        """S."""
        return self._matrix

    def _solve(self, rho: Array, r: Array, work: Array) -> tuple[Array, Array]:
        n, each = r.size, rho.ravel()
        if self._factored is None or not np.array_equal(self._factored[0], each):
            constraint = RigidModeConstraint(self.modes, Linearisation.all_stick(r), np.zeros_like(r), 1.0)
            constraint.columns = each[:, None] * constraint.columns
            matrix = constraint.around(np.eye(n) + each[:, None] * self._matrix)
            self._factored = each, constraint, scipy.linalg.lu_factor(matrix, check_finite=False)
        self.elastic_solves += 1
        _, constraint, factors = self._factored
        answer = scipy.linalg.lu_solve(factors, np.concatenate([r.ravel(), constraint.work(work)]), check_finite=False)
        if not np.isfinite(answer).all():
            raise SolverError("iterate", "a Robin solve is not finite", "look at the data and the mesh")
        sigma = answer[:n].reshape(r.shape)
        dv = self.apply(sigma)
        return dv if self.modes is None else dv + self.modes.motion @ constraint.motion(answer[n:]), sigma


class ProductSystem(ComposedSystem):
    """S by its products alone; T is asked for.

    Parameters
    ----------
    u_0, weight, modes, surrogate
        As for `ComposedSystem`.
    product : callable
        S σ of (m, k) arrays.
    """

    matrix_free = True

    def __init__(
        self, u_0: Array, product: Callable[[Array], Array], weight: Array, modes: Modes | None,
        surrogate: Callable[[], Surrogate | None],
    ) -> None:  # fmt: skip
        super().__init__(u_0, weight, modes, surrogate)
        self._product = product
        self._layer: Surrogate | None = None

    def apply(self, sigma: Array) -> Array:
        """S σ."""
        self.applications += 1
        return self._product(sigma)

    def compliance(self) -> Array:
        """S, a product a column: for tests."""
        return np.column_stack([self._product(e.reshape(self.u_0.shape)).ravel() for e in np.eye(self.u_0.size)])

    def _solve(self, rho: Array, r: Array, work: Array) -> tuple[Array, Array]:
        """GMRES, preconditioned by (I + ρT)⁻¹; motions in units of what the whole traction moves."""
        self._layer = self._layer if self._layer is not None else self.surrogate()
        assert self._layer is not None, "a system by products has a T"
        layer, stuck = self._layer, Linearisation.all_stick(r)
        length = float(np.abs(layer.apply(np.ones_like(r))).max())
        constraint = RigidModeConstraint(self.modes, stuck, np.zeros_like(r), length)
        columns, rows = constraint.spread(stuck.active)
        krylov = BorderedKrylov(r.shape, len(constraint.rhs), "")
        try:
            sigma, coordinates = krylov.solve(
                lambda x: x + rho * self.apply(x), lambda x: layer.solve(x, rho[0]), rho * columns, rows, r,
                constraint.work(work), 0.0, ROBIN_RTOL,
            )  # fmt: skip
            self.ksp_iterations = krylov.iterations
        finally:
            krylov.close()
        self.elastic_solves += 1
        dv = self.apply(sigma)
        return dv if self.modes is None else dv + self.modes.motion @ constraint.motion(coordinates), sigma
