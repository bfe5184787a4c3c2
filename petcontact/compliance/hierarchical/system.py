"""A body in space on an H-matrix, and its contact system: neither S nor the inverse of A_0 is ever formed.

The integral equations A_0 z = G_Ct σ + load are solved together with a linear relation between u and σ on Γ_C, whose two
unknowns a component are one y: u = u_0 + N_u y, σ = σ_0 + N_σ y. A given σ, the Robin condition σ + ρu = f and a step of
Newton's method are such relations, so that each is one Krylov solve on the boundary, from the solution before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...bem.operators import BoundaryOperators
from ...contact.system import Linearisation, Modes
from ...model.solver_options import Bem
from ...runtime.petsc import stage
from ...runtime.threads import one_blas_thread
from ..body.base import ElasticBody
from ..contact_compliance import ContactCompliance, MakeSurrogate
from .equations import MixedEquations, Relation, State

FORCING = 0.1
"""Residual of an inner solve of Newton's method over that before it ..."""
INNER = 0.1
"""... and over the tolerance of the criterion at last."""
RTOL = 1e-9
"""Residual of an elastic solve, relative to the load."""
ROUND_OFF = 1e-12
"""Relative difference of tractions that are the same."""


class HierarchicalBody(ElasticBody):
    """The boundary equations of a body on an H-matrix; a body that its conditions hold.

    Parameters
    ----------
    operators : BoundaryOperators
        On a `SurfaceMesh`.
    modes : (n, 3, 0) array
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

    def __init__(
        self, operators: BoundaryOperators, modes: Array, bem: Bem, comm: Any,
        progress: Callable[[float], None] = lambda share: None,
    ) -> None:  # fmt: skip
        super().__init__(operators, modes)
        self.tolerance, self.scale = bem.hmatrix_tol, operators.traction_scale
        with one_blas_thread():
            with stage("assemble"):
                self.equations = MixedEquations(operators, comm, bem.hmatrix_tol, progress)
            with stage("factor"):
                self.equations.factor()
        self.state = self.equations.at_rest()
        data, still = operators.data, np.zeros(operators.data.contact_shape)
        at_rest = []
        for shares in np.eye(data.states):
            loaded = bool(np.any(operators.amplitudes @ shares) or np.any(np.tensordot(shares, data.force, 1)))
            at_rest.append(self.solve(self.equations.given_traction(still), shares, RTOL).u if loaded else still)
        self.u_0 = np.array(at_rest) + data.sliding

    def solve(self, relation: Relation, shares: Array, rtol: float, forcing: float = 0.0) -> State:
        """The solution, from the last one; it is the last one then."""
        self.state, self.defect = self.equations.solve(relation, self.state, shares, rtol, forcing)
        return self.state

    def response(self, relation: Relation) -> State:
        """The solution without loads; the last one stays what it is."""
        return self.equations.solve(relation, self.equations.at_rest(), np.zeros(self.data.states), RTOL, 0.0)[0]

    def apply(self, traction: Array) -> Array:
        """S t: one solve a column."""
        if traction.ndim > 1:
            return np.column_stack([self.apply(column) for column in traction.T])
        given = traction.reshape(self.data.contact_shape) / self.scale
        return self.response(self.equations.given_traction(given)).u.ravel()

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """One solve with the traction given, from the last solution."""
        known = traction / self.scale
        if np.abs(self.state.t - known).max(initial=0.0) > ROUND_OFF * np.abs(known).max(initial=0.0):
            self.solve(self.equations.given_traction(known), shares, RTOL)
        return self.equations.by_nodes(self.state.z)

    def contact_compliance(self, place: Index, surrogate: MakeSurrogate) -> ContactCompliance:
        """S and Robin problems by solves of the equations."""
        return _SolvedCompliance(self, place, surrogate)

    def monolithic(self, place: Index, shares: Array, shift: Array, surrogate: MakeSurrogate) -> MonolithicSystem:
        """The equations together with those of contact."""
        return MonolithicSystem(self, place, shares, shift, surrogate)

    def describe(self) -> str:
        """Operator and memory."""
        return f"mixed, {self.equations.describe()}"

    def close(self) -> None:
        """Free the PETSc objects and let go of the matrix."""
        self.equations.close()


class _SolvedCompliance(ContactCompliance):
    """S by solves, for what asks for it by name; the methods take `MonolithicSystem`."""

    matrix_free = True

    def __init__(self, body: HierarchicalBody, place: Index, surrogate: MakeSurrogate) -> None:
        super().__init__(surrogate)
        self._body, self.place = body, place

    def apply(self, sigma: Array) -> Array:
        """S σ: one solve."""
        traction = np.empty_like(sigma)
        traction[self.place] = sigma
        return self._body.apply(traction.ravel()).reshape(sigma.shape)[self.place]

    def matrix(self) -> Array:
        """S, a solve a column: for tests."""
        shape = self._body.data.contact_shape
        return np.column_stack([self.apply(unit.reshape(shape)).ravel() for unit in np.eye(shape[0] * shape[1])])

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """δσ + ρ δv = r: one solve; there are no motions."""
        body, slope, right = self._body, np.empty_like(r), np.empty_like(r)
        slope[self.place], right[self.place] = rho / body.scale, r / body.scale
        eye = np.broadcast_to(np.eye(r.shape[1]), (*r.shape, r.shape[1]))
        state = body.response(body.equations.related(eye, -eye * slope[:, :, None], np.zeros_like(r), right))
        solver = body.equations.solver
        self.ksp_iterations, self.ksp_reason = solver.iterations, solver.reason
        return state.u[self.place], state.t[self.place] * body.scale

    @property
    def kind(self) -> str:
        """Of the KSP without a prefix."""
        return self._body.equations.solver.kind


class MonolithicSystem:
    """The contact system of a body on an H-matrix at some load: one Krylov solve for each linear problem.

    Parameters
    ----------
    body : HierarchicalBody
    place : (m,) array
        Of the system's nodes among the body's contact nodes.
    shares : (K,) array
        Weights of the load states.
    shift : (m, k) array
        What v is beyond the displacement that strains the body [length].
    surrogate : callable
        Makes T, for methods that ask for it.
    """

    modes: Modes | None = None
    matrix_free = True

    def __init__(
        self, body: HierarchicalBody, place: Index, shares: Array, shift: Array, surrogate: MakeSurrogate
    ) -> None:
        self.surrogate = surrogate
        self._body, self._place, self._shares, self._shift = body, place, shares, shift
        self._operator = _SolvedCompliance(body, place, lambda: None)
        self.weight = body.mesh.weight[body.contact][place]
        self.u_0 = np.tensordot(shares, body.u_0 - body.data.sliding, 1)[place] + shift
        self.ksp_iterations = self.ksp_reason = self.elastic_solves = self.applications = 0
        self.defect = 0.0

    def apply(self, sigma: Array) -> Array:
        """S σ: one solve."""
        self.applications += 1
        return self._operator.apply(sigma)

    def compliance(self) -> Array:
        """S as a dense array, a solve a column: for tests."""
        return self._operator.matrix()

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """σ + ρ v = f with all loads."""
        self.elastic_solves += 1
        eye = np.broadcast_to(np.eye(f.shape[1]), (*f.shape, f.shape[1]))
        each = np.broadcast_to(rho, f.shape)
        sigma, v = self._related(eye, -eye * each[:, :, None], np.zeros_like(f), f - each * self._shift, RTOL, 0.0)
        return v, sigma

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """δσ + ρ δv = r without."""
        self.elastic_solves += 1
        dv, dsigma = self._operator.robin(np.broadcast_to(rho, r.shape), r, None, np.zeros(0))
        self.ksp_iterations, self.ksp_reason = self._operator.ksp_iterations, self._operator.ksp_reason
        return dv, dsigma

    def linear_solve(self, linearised: Linearisation, rho: Array, tolerance: float) -> tuple[Array, Array]:
        """σ and v of a linearised law: one solve, from the last solution.

        With y = σ - ρv on the active components, σ = Π' y + constant and v = (σ - y)/ρ, sticking ones having v = 0;
        on the others σ is the constant, and v unknown.
        """
        self.elastic_solves += 1
        k = rho.shape[1]
        n_sigma = linearised.derivative * linearised.active[:, None, :]
        slack = (n_sigma - np.eye(k)) / rho[:, :, None]
        slack[linearised.stick | ~linearised.active] = 0.0
        n_u = slack + np.eye(k) * ~linearised.active[:, None, :]
        u_0 = np.where(linearised.active & ~linearised.stick, linearised.constant / rho, 0.0) - self._shift
        return self._related(n_u, n_sigma, u_0, linearised.constant, INNER * tolerance, FORCING)

    def _related(
        self, n_u: Array, n_sigma: Array, u_0: Array, sigma_0: Array, rtol: float, forcing: float
    ) -> tuple[Array, Array]:
        """σ and v with u = u_0 + N_u y, σ = σ_0 + N_σ y."""
        body, back = self._body, np.argsort(self._place)
        scaled = (n_sigma / body.scale)[back], u_0[back], (sigma_0 / body.scale)[back]
        state = body.solve(body.equations.related(n_u[back], *scaled), self._shares, rtol, forcing)
        self.defect, solver = body.defect, body.equations.solver
        self.ksp_iterations, self.ksp_reason = solver.iterations, solver.reason
        return state.t[self._place] * body.scale, state.u[self._place] + self._shift
