"""S as methods with an active set use it: products, solves on the sticking nodes, and solves with T + S.

Dense and small: LAPACK on the blocks. Large, or matrix-free: a PETSc KSP of prefix `stick_` or `sum_` on a matrix of type
python, preconditioned by the layer operator T.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import scipy.linalg

from ..arrays import Array, Mask
from ..errors import SolverError
from ..linalg.matrix_free import Krylov
from .system import ContactSystem, Surrogate

DIRECT_SIZE = 512
"""Contact nodes up to which LU on a block beats Krylov iterations on it (with a fast T)."""
STICK_RTOL = 1e-12
"""Of a stick solve, relative to u_0: also where a later step has little left to solve for."""


class ContactCompliance(Protocol):
    """S with the solves that methods need, vectors (m, k)."""

    noise: float
    ksp_iterations: int

    def apply(self, x: Array) -> Array: ...
    def stick_solve(self, stick: Mask, rhs: Array) -> Array: ...
    def sum_solve(self, rhs: Array) -> Array: ...
    def close(self) -> None: ...


class _Counted:
    """Counts of the system, kept by whoever does the work in its place."""

    def __init__(self, system: ContactSystem) -> None:
        self.system = system
        self.ksp_iterations = 0
        self.matrix: Array | None = None
        if not system.matrix_free:
            self.matrix = system.compliance()

    def apply(self, x: Array) -> Array:
        """S x."""
        if self.matrix is None:
            return self.system.apply(x)
        self.system.applications += 1
        return np.asarray(self.matrix @ x.ravel()).reshape(x.shape)


class DirectCompliance(_Counted):
    """S dense, solves by LU."""

    noise = 1e-13

    def __init__(self, system: ContactSystem, layer: Surrogate | None) -> None:
        super().__init__(system)
        self._layer = layer
        assert self.matrix is not None
        self._dense: Array = self.matrix
        self._sum: Any = None

    def stick_solve(self, stick: Mask, rhs: Array) -> Array:
        """x with S x = rhs on the stick nodes and x = 0 off them."""
        nodes = np.flatnonzero(stick)
        self.system.elastic_solves += 1
        result = np.zeros_like(rhs)
        block = self._dense if len(nodes) == rhs.size else self._dense[nodes[:, None], nodes]
        result.flat[nodes] = np.linalg.solve(block, rhs.ravel()[nodes])
        _check(result)
        return result

    def sum_solve(self, rhs: Array) -> Array:
        """(T + S)⁻¹ rhs, factored once."""
        if self._sum is None:
            assert self._layer is not None, "T + S needs T"
            self._sum = scipy.linalg.lu_factor(self._layer.matrix() + self._dense, check_finite=False)
        self.system.elastic_solves += 1
        result = np.asarray(scipy.linalg.lu_solve(self._sum, rhs.ravel(), check_finite=False)).reshape(rhs.shape)
        _check(result)
        return result

    def close(self) -> None:
        """Nothing of PETSc's is held."""


class KrylovCompliance(_Counted):
    """S by its products alone; every rank of the communicator iterates on whole vectors."""

    noise = 1e-10

    def __init__(self, system: ContactSystem, layer: Surrogate) -> None:
        super().__init__(system)
        self.layer = layer
        self._stick, self._sum = Krylov(system.u_0.shape, "stick_"), Krylov(system.u_0.shape, "sum_")

    def stick_solve(self, stick: Mask, rhs: Array) -> Array:
        """GMRES on the stick block of S (identity off it), preconditioned by the stick block of T⁻¹."""
        self.system.elastic_solves += 1
        result = self._stick.solve(
            lambda x: np.where(stick, self.apply(np.where(stick, x, 0.0)), x),
            lambda r: np.where(stick, self.layer.solve(np.where(stick, r, 0.0)), r),
            np.where(stick, rhs, 0.0), self._floor(stick), STICK_RTOL,
        )  # fmt: skip
        self.ksp_iterations = self._stick.iterations
        return np.where(stick, result, 0.0)

    def sum_solve(self, rhs: Array) -> Array:
        """GMRES on T + S, preconditioned by T⁻¹."""
        self.system.elastic_solves += 1
        result = self._sum.solve(
            lambda x: self.layer.apply(x) + self.apply(x), self.layer.solve, rhs, self._floor(), STICK_RTOL
        )
        self.ksp_iterations = self._sum.iterations
        return result

    def _floor(self, stick: Mask | None = None) -> float:
        """Norm of a preconditioned residual that is STICK_RTOL of that of u_0."""
        base = self.system.u_0
        return STICK_RTOL * float(np.linalg.norm(self.layer.solve(base if stick is None else np.where(stick, base, 0.0))))

    def close(self) -> None:
        """Free the solvers."""
        self._stick.close()
        self._sum.close()


def contact_compliance(system: ContactSystem, layer: Surrogate | None) -> ContactCompliance:
    """S by LU where it is dense and small, or T is not given or has no fast form; else by Krylov iterations."""
    if layer is not None and (system.matrix_free or (layer.fast and system.u_0.size > DIRECT_SIZE)):
        return KrylovCompliance(system, layer)
    return DirectCompliance(system, layer)


def _check(x: Array) -> None:
    if not np.isfinite(x).all():
        raise SolverError("iterate", "a solve with S is not finite", "look at the data and the mesh")
