"""Damped steps of Newton's method: the step is shortened until the residual of the law falls."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ..law_protocol import ContactLaw, law_residual
from ..system import Modes

HALVINGS, DESCENT = 10, 1e-4
"""`HALVINGS` is the number of step lengths, each half the one before. `DESCENT` is the share of the
step length by which the residual must fall [-]."""


class LineSearch:
    """Iterates with falling residuals.

    The law is linearised at τ = ρv - σ of the iterate itself with one ρ. Therefore R = σ + Π(ρv -
    σ) falls along the direction wherever Π is smooth (De Luca, Facchinei and Kanzow, Math. Program.
    75 (1996) 407-439). Along the step from σ, v and α to a solution of the linear equations, v =
    u_0 + S σ + M α holds. The merit is |R|/|σ| plus the forces out of balance over all acting
    forces.

    Attributes
    ----------
    sigma, v, alpha : (m, k), (m, k) and (r,) arrays
        The iterate.
    goes_on : bool
        Whether the last step reduced the residual.
    """

    def __init__(self, law: ContactLaw, base: Array, modes: Modes | None) -> None:
        self._law, self._base, self._modes, self.goes_on = law, base, modes, True
        self._left, self._rho = np.inf, 1.0

    def after(self, sigma: Array, v: Array, alpha: Array) -> tuple[Array, Array]:
        """Return τ and ρ (m, k) of the next iterate, on the way to a solution of the linear
        equations.

        The first iterate is that solution itself.
        """
        if np.isinf(self._left):
            strain = (
                v - self._base
                if self._modes is None
                else v - self._base - self._modes.motion @ alpha
            )
            self._rho = (float(np.abs(sigma).max()) or 1.0) / (float(np.abs(strain).max()) or 1.0)
            self.sigma, self.v, self.alpha, self._left = sigma, v, alpha, self._merit(sigma, v)
        else:
            self.goes_on = self._searched(sigma, v, alpha)
        return self._rho * self.v - self.sigma, np.full(sigma.shape, self._rho)

    def _searched(self, sigma: Array, v: Array, alpha: Array) -> bool:
        for share in 0.5 ** np.arange(HALVINGS):
            trial = self.sigma + share * (sigma - self.sigma), self.v + share * (v - self.v)
            left = self._merit(*trial)
            if left < (1.0 - DESCENT * share) * self._left:
                (self.sigma, self.v), self._left = trial, left
                self.alpha = self.alpha + share * (alpha - self.alpha)
                return True
        return False

    def _merit(self, sigma: Array, v: Array) -> float:
        size = float(np.linalg.norm(sigma)) or 1.0
        unbalanced = (
            0.0 if self._modes is None else self._modes.defect(sigma, np.eye(len(self._modes.load)))
        )
        return (
            float(np.linalg.norm(law_residual(self._law, v, sigma, self._rho))) / size + unbalanced
        )
