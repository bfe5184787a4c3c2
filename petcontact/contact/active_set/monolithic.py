"""Solver of the law's linear equations together with the body's, for systems that offer it."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ..linearisation import Linearisation
from ..system import MonolithicSystem, RigidModeConstraint


class MonolithicSolver:
    """Solver by a system that solves the body's equations together with the law's.

    S and its blocks are never applied. `tolerance` is the criterion's.
    """

    noise = 1e-10

    def __init__(self, system: MonolithicSystem, tolerance: float) -> None:
        self.system, self._tolerance = system, tolerance

    @property
    def defect(self) -> float:
        """Relative residual of the body's equations after the last solve."""
        return self.system.defect

    @property
    def ksp_iterations(self) -> int:
        """Number of KSP iterations of the last solve."""
        return self.system.ksp_iterations

    def apply(self, x: Array) -> Array:
        """Return the product S x."""
        return self.system.apply(x)

    def linear_solve(
        self, linearised: Linearisation, rho: Array, sigma: Array, alpha: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Return σ [stress], v [length] (m, k) and α of a linearised law, and motions that it does
        not resist."""
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
        """Do nothing: the system keeps its solvers."""
