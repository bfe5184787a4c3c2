"""A contact system given by its numbers: S dense, u_0, and the rigid motions that only contact holds."""

from __future__ import annotations

import numpy as np
import scipy

from ..arrays import Array
from ..contact.system import Modes, Surrogate
from ..errors import SolverError


class ReducedSystem:
    """v = u_0 + S σ + M α, E σ + f = 0, as a `ContactSystem`; of bodies, obstacles, or anything else.

    Parameters
    ----------
    u_0 : (m, k) array
        [length]
    compliance : (m k, m k) array
        S, component c of node i being k i + c [length/stress].
    weight : (m,) array
    modes : Modes, optional
    """

    matrix_free = False

    def __init__(self, u_0: Array, compliance: Array, weight: Array, modes: Modes | None = None) -> None:
        self.u_0, self._matrix, self.weight = u_0, compliance, weight
        self.modes = modes if modes is not None and len(modes.load) else None
        self.ksp_iterations = self.ksp_reason = self.elastic_solves = self.applications = 0
        self._factored: tuple[Array, tuple[Array, Array]] | None = None

    def apply(self, sigma: Array) -> Array:
        """S σ."""
        self.applications += 1
        return np.asarray(self._matrix @ sigma.ravel()).reshape(sigma.shape)

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """σ + ρ v = f with equilibrium."""
        load = None if self.modes is None else -self.modes.load
        dv, sigma = self._solve(rho, f - rho * self.u_0, load)
        return self.u_0 + dv, sigma

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """δσ + ρ δv = r with E δσ = 0."""
        return self._solve(rho, r, None)

    def _solve(self, rho: float | Array, r: Array, load: Array | None) -> tuple[Array, Array]:
        n, each = r.size, np.broadcast_to(rho, r.shape).ravel()
        motion, resultant = np.zeros((n, 0)), np.zeros((0, n))
        if self.modes is not None:
            motion, resultant = self.modes.motion.reshape(n, -1), self.modes.resultant.reshape(-1, n)
        if self._factored is None or not np.array_equal(self._factored[0], each):
            rank = motion.shape[1]
            matrix = np.block([[np.eye(n) + each[:, None] * self._matrix, each[:, None] * motion],
                               [resultant, np.zeros((rank, rank))]])  # fmt: skip
            self._factored = each, scipy.linalg.lu_factor(matrix, check_finite=False)
        self.elastic_solves += 1
        rhs = np.concatenate([r.ravel(), np.zeros(len(resultant)) if load is None else load])
        answer = scipy.linalg.lu_solve(self._factored[1], rhs, check_finite=False)
        if not np.isfinite(answer).all():
            raise SolverError("iterate", "a Robin solve is not finite", "look at the data and the mesh")
        sigma = answer[:n].reshape(r.shape)
        return self.apply(sigma) + (motion @ answer[n:]).reshape(r.shape), sigma

    def compliance(self) -> Array:
        """S."""
        return self._matrix

    def surrogate(self) -> Surrogate | None:
        """None."""
        return None

    def amplitudes(self, v: Array, sigma: Array) -> Array:
        """α (r,) of a solution: the least one where contact sees no difference."""
        if self.modes is None:
            return np.zeros(0)
        left = (v - self.u_0 - self.apply(sigma)).ravel()
        return np.asarray(self.modes.fit @ left)
