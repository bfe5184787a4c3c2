"""Bodies of which some are on H-matrices, and their contact system: neither S nor the inverse of A_0 is ever formed.

The equations of all bodies are solved together with a linear relation between v and σ on Γ_C. A given σ, the Robin condition
σ + ρv = f and a step of Newton's method are such relations, so that each is one Krylov solve, from the solution before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...arrays import Array, States
from ...bem.operators import BoundaryOperators
from ...contact.system import Linearisation, Modes, RigidModeConstraint
from ...model.solver_options import Bem
from ...runtime.petsc import stage
from ...runtime.threads import one_blas_thread
from ..body.base import ElasticBody
from ..composed import ComposedSystem
from ..contact_compliance import ContactCompliance, MakeSurrogate
from ..interface import ContactMaps, Interface
from .coupling import Coupling, Relation
from .equations import MixedEquations
from .posed import Balance, Posed, State
from .rows import CompressedRows, CondensedRows

FORCING = 0.1
"""Residual of an inner solve of Newton's method over that before it ..."""
INNER = 0.1
"""... and over the tolerance of the criterion, or of the compression, at last."""
RTOL = 1e-9
"""Residual of an elastic solve, relative to the load."""
ROUND_OFF = 1e-12
"""Relative difference of tractions that are the same."""


class HierarchicalBody(ElasticBody):
    """The boundary equations of a body on an H-matrix, to be solved with those of the bodies that it meets.

    Parameters
    ----------
    operators : BoundaryOperators
        On a `SurfaceMesh`.
    modes : (n, 3, r) array
    bem : Bem
    comm : PETSc.Comm
    progress : callable, optional
        Called with the share of the matrix that is built.

    Raises
    ------
    InputError
        If the machine's memory will not do.
    SolverError
        If the compressed operator misses its tolerance on random exact rows.
    """

    compliance = None
    is_solved_jointly = True

    def __init__(
        self, operators: BoundaryOperators, modes: Array, bem: Bem, comm: Any,
        progress: Callable[[float], None] = lambda share: None,
    ) -> None:  # fmt: skip
        super().__init__(operators, modes)
        self.tolerance = bem.hmatrix_tol
        with one_blas_thread(), stage("assemble"):
            self.rows = CompressedRows(operators, modes, comm, bem.hmatrix_tol, progress)
        self._joint: JointBodies | None = None
        self._number = 0

    def join(self, joint: JointBodies, number: int) -> None:
        """Be this one of the bodies that are solved together."""
        self._joint, self._number = joint, number
        self.u_0 = joint.at_rest[:, joint.unknowns_of(number)] + self.data.sliding

    @property
    def joint(self) -> JointBodies:
        """Of which this body is one."""
        assert self._joint is not None, "a body on an H-matrix is solved with those that it meets"
        return self._joint

    def apply(self, traction: Array) -> Array:
        """S t: one solve a column."""
        if traction.ndim > 1:
            return np.column_stack([self.apply(column) for column in traction.T])
        still = np.zeros(self.data.states)
        moved = self.joint.moved_by(self._number, traction, still).z
        return np.asarray(moved[self.joint.unknowns_of(self._number)].ravel())

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """Of the last solution, where it is that of these loads, or of one solve with the traction given."""
        joint = self.joint
        state = joint.solution_for(self._number, shares, traction.ravel())
        z = self.rows.by_nodes(joint.strained(self._number, state))
        return np.concatenate([z, joint.multipliers(self._number, state)])

    def describe(self) -> str:
        """Operator and memory."""
        memory = "" if self._joint is None else f" of {self._joint.equations.memory() / 1e6:.0f} MB"
        return f"mixed, hmatrix {self.tolerance:g}{memory}"

    def close(self) -> None:
        """Free the PETSc objects and let go of the matrix."""
        if self._joint is not None:
            self._joint.close()
            self._joint = None



class JointBodies:
    """The equations of all bodies, and their last solution.

    Attributes
    ----------
    equations : MixedEquations
    at_rest : (K, N) array
        Unknowns in each load state without contact tractions.
    base : (K, M k) array
        v there.
    tolerance : float
        Smallest of the compressions.
    """

    def __init__(
        self, bodies: Sequence[ElasticBody], interfaces: Sequence[Interface], maps: Sequence[ContactMaps], comm: Any
    ) -> None:
        self._bodies, self._maps = bodies, maps
        with stage("factor"):
            rows = [body.rows if isinstance(body, HierarchicalBody) else CondensedRows(body, comm) for body in bodies]
            self.equations = MixedEquations(rows, Coupling(bodies, rows, interfaces, maps), comm)
            coupling, states = self.equations.coupling, bodies[0].data.states
            at_rest = [self.equations.at_rest]
            for shares in np.eye(states)[1:]:
                at_rest.append(self.equations.elastic(self.equations.loads(shares), RTOL))
        self.at_rest = np.array([state.z for state in at_rest])
        self.tolerance = min(body.tolerance for body in bodies if isinstance(body, HierarchicalBody))
        self.base = np.array([coupling.seen @ z[coupling.met] for z in self.at_rest])
        self._last, self._shares, self._unloaded = self.equations.at_rest, np.zeros(states), np.zeros(states)
        for number, body in enumerate(bodies):
            if isinstance(body, HierarchicalBody):
                body.join(self, number)

    def unknowns_of(self, number: int) -> Array:
        """Displacements in contact of a body among all unknowns, (m, k)."""
        return np.asarray(self.equations.coupling.first[number] + self.equations.rows[number].slot)

    def moved_by(self, number: int, traction: Array, shares: Array, start: State | None = None) -> State:
        """One body under contact tractions (k m,) and its loads."""
        given = traction.reshape(self._bodies[number].data.contact_shape) / self.equations.rows[number].scale
        factors, rows = self.equations.loads(shares, only=number)
        return self.equations.elastic((factors + self.equations.coupling.given(number, given), rows), RTOL, start)

    def solution_for(self, number: int, shares: Array, traction: Array) -> State:
        """One where this body has these loads and contact tractions."""
        known = self._maps[number].carried(self._last.sigma.ravel())
        same = np.abs(known - traction).max(initial=0.0) <= ROUND_OFF * np.abs(traction).max(initial=0.0)
        return self._last if same and np.array_equal(shares, self._shares) else self.moved_by(number, traction, shares)

    def strained(self, number: int, state: State) -> Array:
        """The unknowns of a body without its rigid motion."""
        equations = self.equations
        here = slice(equations.coupling.first[number], equations.coupling.first[number + 1])
        mine = slice(equations.ends[number], equations.ends[number + 1])
        return np.asarray(state.z[here] - equations.rows[number].motions @ state.alpha[mine])

    def multipliers(self, number: int, state: State) -> Array:
        """Of the rigid motions of a body."""
        return state.beta[self.equations.ends[number] : self.equations.ends[number + 1]]

    def under(self, sigma: Array) -> Array:
        """S σ, (M, k): one solve."""
        equations, coupling = self.equations, self.equations.coupling
        factors, rows = equations.loads(self._unloaded)
        return equations.elastic((factors + coupling.tractions(sigma), rows), RTOL).v

    def related(
        self, n_v: Array, n_sigma: Array, v_0: Array, sigma_0: Array, *, offset: Array, shares: Array, balance: Balance,
        rtol: float, forcing: float = 0.0, start: State | None = None,
    ) -> State:  # fmt: skip
        """v = v_0 + N_v y and σ = σ_0 + N_σ y, from a start or the last solution; it is the last one then."""
        coupling = self.equations.coupling
        relation = Relation.of(v_0, sigma_0, n_v, n_sigma, coupling.scale)
        posed = Posed(coupling.expansion(relation, balance.motion), offset, *self.equations.loads(shares), balance)
        if start is not None:
            return self.equations.solve(posed, start, rtol, forcing)
        self._last, self._shares = self.equations.solve(posed, self._last, rtol, forcing), shares.copy()
        return self._last

    def balance(self, modes: Modes | None, constraint: RigidModeConstraint | None) -> Balance:
        """Equilibrium of the motions that a law resists; others stay where they are."""
        shape, bodies = self.equations.coupling.shape, int(self.equations.ends[-1])
        if modes is None or constraint is None:
            return Balance.at_rest(shape, 0)
        now, resisted = np.zeros(len(modes.load)), constraint.resisted
        common = min(len(now), len(self._last.alpha))
        now[:common] = self._last.alpha[:common]
        held = (constraint.free * modes.size[:, None]).T
        resultant = np.tensordot(resisted.T, modes.resultant, 1)
        return Balance(modes.motion[:, :, bodies:], resultant, resisted.T @ modes.load, held, held @ now)

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> State:
        """δσ + ρ δv = r without loads."""
        eye, still = np.broadcast_to(np.eye(r.shape[1]), (*r.shape, r.shape[1])), np.zeros_like(r)
        loaded = None if modes is None else Modes(modes.motion, modes.resultant, -work)
        constraint = None if modes is None else RigidModeConstraint(loaded, Linearisation.all_stick(r), still, 1.0)
        return self.related(
            eye, -eye * rho[:, :, None], still, r, offset=still, shares=self._unloaded,
            balance=self.balance(loaded, constraint), rtol=RTOL, start=self.equations.at_rest,
        )  # fmt: skip

    def compliance(self, surrogate: MakeSurrogate) -> ContactCompliance:
        """S by solves."""
        return _SolvedCompliance(self, surrogate)

    def system(
        self, u_0: Array, weight: Array, modes: Modes, shares: Array, operator: ContactCompliance
    ) -> MonolithicSystem:
        """The contact system at some load."""
        return MonolithicSystem(u_0, weight, modes, operator, self, shares)

    def close(self) -> None:
        """Free the PETSc objects."""
        self.equations.close()


class _SolvedCompliance(ContactCompliance):
    """S by solves, for what asks for it by name; Newton's method takes `MonolithicSystem`."""

    matrix_free = True

    def __init__(self, joint: JointBodies, surrogate: MakeSurrogate) -> None:
        super().__init__(surrogate)
        self._joint = joint

    def apply(self, sigma: Array) -> Array:
        """S σ: one solve."""
        return self._joint.under(sigma)

    def matrix(self) -> Array:
        """S, a solve a column: for tests."""
        shape = self._joint.equations.coupling.shape
        return np.column_stack([self.apply(unit.reshape(shape)).ravel() for unit in np.eye(shape[0] * shape[1])])

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """δσ + ρ δv = r: one solve."""
        state, equations = self._joint.robin(rho, r, modes, work), self._joint.equations
        self.ksp_iterations, self.ksp_reason = equations.iterations, equations.reason
        return state.v, state.sigma

    @property
    def kind(self) -> str:
        """Of the KSP without a prefix."""
        return self._joint.equations.kind


class MonolithicSystem(ComposedSystem):
    """The contact system of bodies of which some are on H-matrices: one Krylov solve for each linear problem.

    Parameters
    ----------
    u_0, weight, modes, operator
        As of `ComposedSystem`.
    joint : JointBodies
    shares : (K,) array
        Weights of the load states.
    """

    def __init__(
        self, u_0: Array, weight: Array, modes: Modes, operator: ContactCompliance, joint: JointBodies, shares: Array
    ) -> None:
        super().__init__(u_0, weight, modes, operator)
        self._joint, self._shares, self.defect = joint, shares, 0.0
        self._offset = u_0 - (shares @ joint.base).reshape(u_0.shape)
        self._known: tuple[Array, Array] | None = None
        self._states: States | None = None

    @property
    def ksp_iterations(self) -> int:
        """KSP iterations of the last solve."""
        return self._joint.equations.iterations

    @property
    def ksp_reason(self) -> int:
        """Its outcome, PETSc's number."""
        return self._joint.equations.reason

    def apply(self, sigma: Array) -> Array:
        """S σ: one solve, or none where σ is that of the last solution."""
        if self._known is not None and np.array_equal(self._known[0], sigma):
            return self._known[1]
        return super().apply(sigma)

    def linear_solve(
        self, linearised: Linearisation, rho: Array, tolerance: float, constraint: RigidModeConstraint | None
    ) -> tuple[Array, Array, Array]:
        """σ, v and α of a linearised law: one solve, from the last solution.

        With y = σ - ρv on the active components, σ = Π' y + constant and v = (σ - y)/ρ, sticking ones having v = 0;
        on the others σ is the constant, and v unknown.
        """
        self.elastic_solves += 1
        k = rho.shape[1]
        n_sigma = linearised.derivative * linearised.active[:, None, :]
        slack = (n_sigma - np.eye(k)) / rho[:, :, None]
        slack[linearised.stick | ~linearised.active] = 0.0
        n_v = slack + np.eye(k) * ~linearised.active[:, None, :]
        v_0 = np.where(linearised.active & ~linearised.stick, linearised.constant / rho, 0.0)
        # sets that no longer change are solved on to the end
        again = self._states is not None and np.array_equal(self._states, linearised.states)
        self._states = linearised.states
        state = self._joint.related(
            n_v, n_sigma, v_0, linearised.constant, offset=self._offset, shares=self._shares,
            balance=self._joint.balance(self.modes, constraint), rtol=INNER * min(tolerance, self._joint.tolerance),
            forcing=0.0 if again else FORCING,
        )  # fmt: skip
        self.defect = self._joint.equations.defect
        moved = state.v if self.modes is None else state.v - self.modes.motion @ state.alpha
        self._known = state.sigma, moved - self.u_0
        return state.sigma, state.v, state.alpha
