"""The contact system of bodies on H-matrices, without S and without the inverse of A_0.

The equations of all bodies are solved together with a linear relation between v and σ on Γ_C. A
given σ, the Robin condition σ + ρv = f and a step of Newton's method are such relations. Each is
one Krylov solve that starts from the last solution.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, States
from ...contact.system import Linearisation, Modes, RigidModeConstraint
from ...round_off import SOLVED
from ..composed import ComposedSystem
from ..contact_compliance import ContactCompliance, MakeSurrogate
from .joint import JointBodies

FORCING = 0.05
"""Ratio of the residuals after and before an inner solve of Newton's method."""


class _SolvedCompliance(ContactCompliance):
    """The compliance S by solves; Newton's method takes `HierarchicalSystem` instead."""

    matrix_free = True

    def __init__(
        self, joint: JointBodies, surrogate: MakeSurrogate, soft: Array | float = 0.0
    ) -> None:
        super().__init__(surrogate)
        self._joint, self.soft = joint, soft
        self._solver, self._shape = joint.equations.krylov, joint.equations.coupling.shape

    def softened(self, layer: Array) -> ContactCompliance:
        """Return the compliance with a layer added to v."""
        soft = layer[:, None] * np.eye(self._shape[1])[-1]
        return _SolvedCompliance(self._joint, self.surrogate, soft)

    def apply(self, sigma: Array) -> Array:
        """Return S σ, by one solve."""
        return self._joint.loaded_by(sigma).v + self.soft * sigma

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """Solve δσ + ρ δv = r."""
        state = self._joint.robin(rho, r, modes, work, self.soft)
        return state.v + self.soft * state.sigma, state.sigma


class MonolithicBodies(JointBodies):
    """All bodies, which make the contact systems."""

    def compliance(self, surrogate: MakeSurrogate) -> ContactCompliance:
        """Return the compliance S, which is applied by solves."""
        return _SolvedCompliance(self, surrogate)

    def system(
        self, u_0: Array, weight: Array, modes: Modes, shares: Array, operator: ContactCompliance
    ) -> HierarchicalSystem:
        """Return the contact system of a load."""
        return HierarchicalSystem(u_0, weight, modes, operator, self, shares)


class HierarchicalSystem(ComposedSystem):
    """The contact system of bodies on H-matrices; each linear problem is one Krylov solve.

    Parameters
    ----------
    u_0, weight, modes, operator
        As of `ComposedSystem`.
    joint : JointBodies
    shares : (K,) array
        Weights of the load states.
    """

    def __init__(
        self,
        u_0: Array,
        weight: Array,
        modes: Modes,
        operator: ContactCompliance,
        joint: JointBodies,
        shares: Array,
    ) -> None:
        super().__init__(u_0, weight, modes, operator)
        self._joint, self._shares, self.defect = joint, shares, 0.0
        self._soft = operator.soft if isinstance(operator, _SolvedCompliance) else 0.0
        self._offset = u_0 - (shares @ joint.base).reshape(u_0.shape)
        self._known: tuple[Array, Array] | None = None
        self._change: tuple[Array, Array] | None = None
        self._states: States | None = None
        self._exchanged = u_0.size + 1

    def apply(self, sigma: Array) -> Array:
        """Return S σ, by one solve, or none if σ is that of the last solution or of the last small
        change of it."""
        if self._known is None:
            return super().apply(sigma)
        last, moved = self._known
        if np.array_equal(last, sigma):
            return moved
        # changes of σ by less than a hundredth have their own product
        size, difference = 1e-2 * np.linalg.norm(last), sigma - last
        if np.linalg.norm(sigma) <= size:
            return self._changed(sigma)
        return (
            moved + self._changed(difference)
            if np.linalg.norm(difference) <= size
            else super().apply(sigma)
        )

    def _changed(self, difference: Array) -> Array:
        """Return S times a small change of the last σ, by one solve, or none if it is the change
        before, up to round-off of σ."""
        assert self._known is not None
        least = SOLVED * np.linalg.norm(self._known[0])
        if self._change is None or np.linalg.norm(difference - self._change[0]) > least:
            self.applications += 1
            self._change = difference, self._joint.corrected(difference) + self._soft * difference
        return self._change[1]

    def linear_solve(
        self,
        linearised: Linearisation,
        rho: Array,
        tolerance: float,
        constraint: RigidModeConstraint | None,
    ) -> tuple[Array, Array, Array]:
        """Return σ, v and α of a linearised law, by one solve from the last solution.

        The active components have y = σ - ρv, σ = Π' y + constant and v = (σ - y)/ρ; those that
        stick have v = 0. On the other components σ is the constant, and v is unknown.
        """
        self.elastic_solves += 1
        k = rho.shape[1]
        n_sigma = linearised.derivative * linearised.active[:, None, :]
        slack = (n_sigma - np.eye(k)) / rho[:, :, None]
        slack[linearised.stick | ~linearised.active] = 0.0
        n_v = slack + np.eye(k) * ~linearised.active[:, None, :]
        v_0 = np.where(linearised.active & ~linearised.stick, linearised.constant / rho, 0.0)
        # more of it pays where sets no longer change, or change more than before: of a loose
        # solution they may be far off
        changed = (
            rho.size if self._states is None else int((self._states != linearised.states).sum())
        )
        exact = changed == 0 or changed >= self._exchanged
        self._states, self._exchanged = linearised.states, changed
        wanted = min(tolerance, self._joint.tolerance)
        # a tenth of the tolerance of the criterion, or of the compression
        state = self._joint.related(
            n_v,
            n_sigma,
            v_0,
            linearised.constant,
            offset=self._offset,
            shares=self._shares,
            balance=self._joint.balance(self.modes, constraint),
            rtol=0.1 * wanted,
            forcing=FORCING**2 if exact else FORCING,
            soft=self._soft,
        )
        self.defect = self._joint.equations.defect * tolerance / wanted
        v = state.v + self._soft * state.sigma
        moved = v if self.modes is None else v - self.modes.motion @ state.alpha
        self._known, self._change = (state.sigma, moved - self.u_0), None
        return state.sigma, v, state.alpha
