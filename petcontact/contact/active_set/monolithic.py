"""Linear equations of a law solved together with those of the body, where a system offers that."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ..linearisation import Linearisation
from ..system import MonolithicSystem, RigidModeConstraint


class MonolithicSolver:
    """A system that solves the equations of the body together with those of the law: S and its
    blocks are never applied.

    `tolerance` is the criterion's.
    """

    noise = 1e-10

    def __init__(self, system: MonolithicSystem, tolerance: float) -> None:
        self.system, self._tolerance = system, tolerance

    @property
    def defect(self) -> float:
        """Relative residual of the body's equations that the last solve left."""
        return self.system.defect

    @property
    def ksp_iterations(self) -> int:
        """Number of KSP iterations of the last solve."""
        return self.system.ksp_iterations

    def apply(self, x: Array) -> Array:
        """The product S x."""
        return self.system.apply(x)

    def linear_solve(
        self, linearised: Linearisation, rho: Array, sigma: Array, alpha: Array
    ) -> tuple[Array, Array, Array, Array]:
        """σ [stress], v [length] (m, k) and α of a linearised law, and combinations of motions that
        it does not resist."""
        modes = self.system.modes
        if modes is None:
            return (
                *self.system.linear_solve(linearised, rho, self._tolerance, None)[:2],
                alpha,
                np.zeros((len(alpha), 0)),
            )
        constraint = RigidModeConstraint(modes, linearised, sigma, 1.0)
        return *self.system.linear_solve(
            linearised, rho, self._tolerance, constraint
        ), constraint.free

    def close(self) -> None:
        """The system keeps its solvers."""
