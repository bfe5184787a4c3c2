"""The laws of contact between two sides, node by node: normal and tangential, as the solver of active sets asks for them.

v = (w, v_n) is the relative displacement of the secondary, tangential and along n minus the gap; σ = (σ_t, σ_n) the traction
on it, p = -σ_n:

    v_n <= 0, p >= 0, p v_n = 0    (unilateral)      v_n = 0    (bilateral, bonded)
    |σ_t| <= b(p), σ_t = -b(p) δw/|δw| where δw = w - w_prev is not zero;    δw = 0    (bonded)

with b(p) = µp (Coulomb), g (Tresca), the smaller of the two, or 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Mask


@dataclass(frozen=True)
class PairLaw:
    """Laws of m nodes, of any number of pairs.

    Attributes
    ----------
    present : (m,) bool array
        Nodes that face something; the others are open for ever.
    unilateral, bonded, coulomb : (m,) bool arrays
    coefficient : (m,) array
        µ where `coulomb`, else 0 [-].
    cap : (m,) array
        g: infinite where there is no bound but Coulomb's, 0 where there is no friction [stress].
    """

    present: Mask
    unilateral: Mask
    bonded: Mask
    coulomb: Mask
    coefficient: Array
    cap: Array

    def bound(self, pressure: Array) -> Array:
        """b(p) >= 0, infinite where bonded, 0 where a unilateral contact is open [stress]."""
        push = np.maximum(pressure, 0.0)
        value = np.minimum(np.where(self.coulomb, self.coefficient * push, np.inf), self.cap)
        value[self.unilateral & (push == 0.0)] = 0.0
        value[self.bonded] = np.inf
        return np.asarray(value, dtype=np.float64)

    def project(self, trial: Array) -> Array:
        """Π(τ), (m, 2): τ_n pulled into the admissible pressures and τ_t into the ball of their bound."""
        least = np.where(self.unilateral, 0.0, -np.inf)
        normal: Array = np.asarray(np.maximum(trial[:, 1], least) * self.present, dtype=np.float64)
        bound = self.bound(normal)
        bound[~self.present] = 0.0
        return np.column_stack([np.clip(trial[:, 0], -bound, bound), normal])

    def residuals(self, v: Array, sigma: Array, rho: Array, weight: Array) -> tuple[float, float]:
        """‖σ + Π(ρv - σ)‖ over ‖σ_n‖, normal and tangential, L2 with the nodes' weights; v tangential is δw.

        Parameters
        ----------
        v, sigma : (m, 2) arrays
        rho : (m, 2) array
            [stress/length]
        """
        reached = np.where(np.isfinite(v), v, 0.0)
        defect = (sigma + self.project(rho * reached - sigma)) * self.present[:, None]
        size = max(float(np.sqrt(weight @ sigma[:, c] ** 2)) for c in range(2))
        tangential, normal = (float(np.sqrt(weight @ defect[:, c] ** 2)) for c in range(2))
        return (normal / size, tangential / size) if size > 0.0 else (normal, tangential)
