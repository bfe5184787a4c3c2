"""When a method may stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Array
from .friction_law import balanced_rho, contact_norm
from .laws import ContactLaw

Stop = Literal["both", "displacement", "residual"]
SLACK = 1e3
"""How much larger than the tolerance the relative friction residual may be when the change has met it: a change that is
small only because ρ is far off is no convergence."""


@dataclass(frozen=True)
class Criterion:
    """The stopping criterion of section 5, and two others.

    Attributes
    ----------
    tolerance : float
    stop : {"both", "displacement", "residual"}
        Relative change of v and σ together (the paper's), of v alone, or ‖R_ρ‖/‖σ‖ with the balanced ρ.
    """

    tolerance: float
    stop: Stop = "both"

    def change(self, v: Array, sigma: Array, dv: Array, dsigma: Array, weight: Array) -> float:
        """The relative change of a step that led to (v, σ)."""
        moved, size = contact_norm(dv, weight), contact_norm(v, weight)
        if self.stop != "displacement":
            moved, size = moved + contact_norm(dsigma, weight), size + contact_norm(sigma, weight)
        return moved / size if size > 0.0 else (0.0 if moved == 0.0 else np.inf)

    def relative_residual(
        self, law: ContactLaw, v: Array, sigma: Array, weight: Array, rho: float, scale: float = 0.0
    ) -> float:
        """‖R_ρ‖/‖σ‖ with the balanced ρ: independent of the method's ρ and of units.

        `scale` is the largest ‖σ‖ seen so far: where friction vanishes σ itself does, and cannot be its own measure.
        """
        balanced = balanced_rho(v, sigma, weight, rho)
        size = max(contact_norm(sigma, weight), scale) or balanced * contact_norm(v, weight)
        residual = contact_norm(law.residual(v, sigma, balanced), weight)
        return residual / size if size > 0.0 else 0.0

    def met(self, change: float, relative_residual: float) -> bool:
        """Whether the method may stop."""
        if self.stop == "residual":
            return relative_residual <= self.tolerance
        return change <= self.tolerance and relative_residual <= SLACK * self.tolerance
