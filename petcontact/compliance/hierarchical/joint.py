"""Solves of the equations of all bodies and of contact: for loads, tractions and linear laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...contact.system import Linearisation, Modes, RigidModeConstraint
from ...errors import InputError
from ...round_off import SOLVED
from ...runtime.petsc import stage
from ...untyped import Comm
from ..body.eliminated import ElasticBody
from ..interface import ContactMaps, Interface
from .coupling import TWICE, Coupling, Relation
from .equations import MixedEquations
from .linear_problem import Balance, Posed, State
from .rows import BodyRows

RTOL = 1e-9
"""Residual of an elastic solve, relative to the load."""


class JointBodies:
    """The equations of all bodies with their last solution.

    Attributes
    ----------
    equations : MixedEquations
    at_rest : (K, N) array
        Unknowns in each load state without contact tractions.
    base : (K, M k) array
        v of each load state [length].
    tolerance : float
        Smallest tolerance of the compressions.
    """

    def __init__(
        self,
        bodies: Sequence[ElasticBody],
        rows: Sequence[BodyRows],
        interfaces: Sequence[Interface],
        maps: Sequence[ContactMaps],
        comm: Comm,
    ) -> None:
        self._bodies, self._maps = bodies, maps
        with stage("factor"):
            self.equations = MixedEquations(rows, Coupling(bodies, rows, interfaces, maps), comm)
            coupling, states = self.equations.coupling, bodies[0].data.states
            self.tolerance = min(body.tolerance for body in bodies if body.is_solved_jointly)
            # what the solution at rest leaves is in S σ, too, and not in v: a thousandth is enough
            later = [
                self.equations.elastic(self.equations.loads(shares), 1e-3 * self.tolerance)
                for shares in np.eye(states)[1:]
            ]
        self.at_rest = np.array([state.z for state in (self.equations.at_rest, *later)])
        self.base = np.array([coupling.seen @ z[coupling.met] for z in self.at_rest])
        self._last = self.equations.at_rest
        self._shares = np.zeros(states)
        self._unloaded = np.zeros(states)
        self._corrected: State | None = None

    def unknowns_of(self, number: int) -> Array:
        """Return the numbers of a body's displacements in contact among all unknowns, (m, k)."""
        return np.asarray(self.equations.coupling.first[number] + self.equations.rows[number].slot)

    def moved_by(self, number: int, traction: Array, shares: Array) -> State:
        """Return the unknowns of one body under contact tractions (k m,) and its loads."""
        given = (
            traction.reshape(self._bodies[number].data.contact_shape)
            / self.equations.rows[number].scale
        )
        factors, rows = self.equations.loads(shares, only=number)
        return self.equations.elastic(
            (factors + self.equations.coupling.given(number, given), rows), RTOL
        )

    def solution_for(self, number: int, shares: Array, traction: Array) -> State:
        """Return a solution in which the body has these loads and contact tractions."""
        # without contact tractions what an iteration left is not small beside the solution
        if traction.any() and np.array_equal(shares, self._shares):
            for state in filter(None, (self._last, self._corrected)):
                carried = self._maps[number].carried(state.sigma.ravel())
                if np.abs(carried - traction).max(initial=0.0) <= SOLVED * np.abs(traction).max(
                    initial=0.0
                ):
                    return state
        return self.moved_by(number, traction, shares)

    def strained(self, number: int, state: State) -> Array:
        """Return the unknowns of a body without its rigid motion."""
        equations = self.equations
        own_rows = slice(equations.coupling.first[number], equations.coupling.first[number + 1])
        own_motions = slice(equations.ends[number], equations.ends[number + 1])
        return np.asarray(
            state.z[own_rows] - equations.rows[number].motions @ state.alpha[own_motions]
        )

    def multipliers(self, number: int, state: State) -> Array:
        """Return the multipliers of the rigid motions of a body."""
        return state.beta[self.equations.ends[number] : self.equations.ends[number + 1]]

    def loaded_by(self, sigma: Array, rtol: float = RTOL) -> State:
        """Return all bodies under σ (M, k) alone, by one solve; v is S σ."""
        factors, rows = self.equations.loads(self._unloaded)
        return self.equations.elastic(
            (factors + self.equations.coupling.tractions(sigma), rows), rtol
        )

    def corrected(self, difference: Array) -> Array:
        """Return S times a small change (M, k) of σ, and add it to the last solution."""
        last = self._last
        sizes = [float(np.linalg.norm(part)) for part in (self._last.sigma, difference)]
        # small changes of a solution are known to a hundredth at least
        change = self.loaded_by(
            difference, min(1e-2, RTOL * sizes[0] / sizes[1]) if sizes[1] > 0.0 else RTOL
        )
        self._corrected = State(
            last.z + change.z,
            last.v + change.v,
            last.sigma + difference,
            last.alpha,
            last.beta + change.beta,
        )
        return change.v

    def related(
        self,
        n_v: Array,
        n_sigma: Array,
        v_0: Array,
        sigma_0: Array,
        *,
        offset: Array,
        shares: Array,
        balance: Balance,
        rtol: float,
        forcing: float = 0.0,
        start: State | None = None,
        soft: Array | float = 0.0,
    ) -> State:
        """v = v_0 + N_v y and σ = σ_0 + N_σ y, from a start or the last solution; it is the last
        one then.

        Of v the part `soft` (M, k) times σ is no displacement, and not in the solution's v.
        """
        coupling = self.equations.coupling
        if np.any(soft):
            v_0, n_v = v_0 - soft * sigma_0, n_v - np.asarray(soft)[:, :, None] * n_sigma
        relation = Relation.normalised(v_0, sigma_0, n_v, n_sigma, coupling.scale).nearest(
            offset, coupling.scale
        )
        posed = Posed(
            coupling.expansion(relation, balance.motion),
            offset,
            *self.equations.loads(shares),
            balance,
        )
        if start is not None:
            return self.equations.solve(posed, start, rtol, forcing)
        if not self._last.sigma.any():
            # what is left of a solution without tractions measures no other one, and tractions of
            # what bends are a small part of it: to the end, from rest
            self._last, forcing = self.equations.at_rest, 0.0
        self._last = self.equations.solve(posed, self._last, rtol, forcing)
        self._shares = shares.copy()
        self._corrected = None
        return self._last

    def balance(self, modes: Modes | None, constraint: RigidModeConstraint | None) -> Balance:
        """Return the equilibrium of the motions that a law resists; the others stay fixed."""
        shape, bodies = self.equations.coupling.shape, int(self.equations.ends[-1])
        if modes is None or constraint is None:
            return Balance.at_rest(shape, 0)
        now, resisted = np.zeros(len(modes.load)), constraint.resisted
        common = min(len(now), len(self._last.alpha))
        now[:common] = self._last.alpha[:common]
        held = (constraint.free * modes.size[:, None]).T
        resultant = np.tensordot(resisted.T, modes.resultant, 1)
        return Balance(
            modes.motion[:, :, bodies:], resultant, resisted.T @ modes.load, held, held @ now
        )

    def robin(
        self, rho: Array, r: Array, modes: Modes | None, work: Array, soft: Array | float = 0.0
    ) -> State:
        """Solve δσ + ρ δv = r without loads; it is no law of a node that is a secondary twice."""
        if len(self.equations.coupling.leading) < r.size:
            raise InputError(TWICE)
        eye, still = np.broadcast_to(np.eye(r.shape[1]), (*r.shape, r.shape[1])), np.zeros_like(r)
        loaded = None if modes is None else replace(modes, load=-work)
        constraint = (
            None
            if modes is None
            else RigidModeConstraint(loaded, Linearisation.all_stick(r), still, 1.0)
        )
        return self.related(
            eye,
            -eye * rho[:, :, None],
            still,
            r,
            offset=still,
            shares=self._unloaded,
            balance=self.balance(loaded, constraint),
            rtol=RTOL,
            start=self.equations.at_rest,
            soft=soft,
        )

    def close(self) -> None:
        """Free the PETSc objects."""
        self.equations.close()
