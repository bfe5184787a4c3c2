"""The contact system of a body in space on an H-matrix: neither S nor the inverse of A_0 is ever formed.

The integral equations A_0 z = G_Ct σ + load are solved together with a linear relation between u and σ on Γ_C, whose two
unknowns a component are one y: u = u_0 + N_u y, σ = σ_0 + N_σ y. A given σ, the Robin condition σ + ρu = f and a step of
Newton's method are such relations, so that each is one Krylov solve on the boundary, from the solution before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Array
from ...bem.operators import BoundaryOperators
from ...contact.linearisation import Linearisation
from ...contact.system import Modes, Surrogate
from ...model.solver_options import Bem
from ...runtime.petsc import stage
from ...runtime.threads import one_blas_thread
from ..base import stand_in
from .equations import MixedEquations, Relation

FORCING = 0.1
"""Residual of an inner solve of Newton's method over that before it ..."""
INNER = 0.1
"""... and over the tolerance of the criterion at last."""
RTOL = 1e-9
"""Residual of an elastic solve, relative to the load."""
LARGEST_T = 8000
"""Contact unknowns up to which T, which is dense, is formed."""
ROUND_OFF = 1e-12
"""Relative difference of tractions that are the same."""


class HierarchicalSystem:
    """v = u_0 + S σ by an H-matrix of the mixed operator; a body that its conditions hold.

    Parameters
    ----------
    operators : BoundaryOperators
        On a `SurfaceMesh`.
    comm : PETSc.Comm
    bem : Bem
    progress : callable, optional
        Told the share of the matrix that is built.

    Raises
    ------
    InputError
        If the machine's memory will not do.
    SolverError
        If the compressed operator misses its tolerance on random exact rows.
    """

    modes: Modes | None = None
    matrix_free = True

    def __init__(
        self, operators: BoundaryOperators, comm: Any, bem: Bem, progress: Callable[[float], None] = lambda share: None
    ) -> None:
        self.operators, self.comm, self.bem = operators, comm, bem
        self.ksp_iterations = self.ksp_reason = self.elastic_solves = self.applications = 0
        self.weight = operators.mesh.weight[operators.data.contact_nodes]
        self._scale, self.tolerance = operators.traction_scale, bem.hmatrix_tol
        with one_blas_thread():
            with stage("assemble"):
                self._equations = MixedEquations(operators, comm, bem.hmatrix_tol, progress)
            with stage("factor"):
                self._equations.factor()
        shape = operators.data.contact_directions.shape
        self._zero = np.zeros(shape)
        self._state = self._equations.at_rest()
        self.defect = 0.0
        free = self._equations.given_traction(self._zero)
        self.u_0 = self._solve(free, loaded=True, rtol=RTOL)[0] + operators.data.sliding

    def apply(self, sigma: Array) -> Array:
        """S σ: one solve."""
        self.applications += 1
        kept, self._state = self._state, self._equations.at_rest()
        displacement = self._solve(self._equations.given_traction(sigma / self._scale), loaded=False, rtol=RTOL)[0]
        self._state = kept
        return displacement

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """σ + ρ v = f with all loads."""
        return self._robin(rho, f - rho * self.operators.data.sliding, True)

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """δσ + ρ δv = r without."""
        kept, self._state = self._state, self._equations.at_rest()
        result = self._robin(rho, r, False)
        self._state = kept
        return result

    def _robin(self, rho: float | Array, f: Array, loaded: bool) -> tuple[Array, Array]:
        self.elastic_solves += 1
        eye = np.broadcast_to(np.eye(f.shape[1]), (*f.shape, f.shape[1]))
        slope = eye * np.broadcast_to(rho, f.shape)[:, :, None] / self._scale
        u, t = self._solve(self._equations.related(eye, -slope, self._zero, f / self._scale), loaded=loaded, rtol=RTOL)
        return u + (self.operators.data.sliding if loaded else 0.0), t * self._scale

    def linear_solve(self, linearised: Linearisation, rho: Array, tolerance: float) -> tuple[Array, Array]:
        """σ and v of a linearised law: one solve, from the last solution.

        With y = σ - ρv on the active components, σ = Π' y + constant and v = (σ - y)/ρ, sticking ones having v = 0;
        on the others σ is the constant, and v unknown.
        """
        self.elastic_solves += 1
        k = self._zero.shape[1]
        n_sigma = linearised.derivative * linearised.active[:, None, :]
        slack = (n_sigma - np.eye(k)) / rho[:, :, None]
        slack[linearised.stick | ~linearised.active] = 0.0
        n_u = slack + np.eye(k) * ~linearised.active[:, None, :]
        u_0 = np.where(linearised.active & ~linearised.stick, linearised.constant / rho, 0.0) - self.operators.data.sliding
        relation = self._equations.related(n_u, n_sigma / self._scale, u_0, linearised.constant / self._scale)
        u, t = self._solve(relation, loaded=True, rtol=INNER * tolerance, forcing=FORCING)
        return t * self._scale, u + self.operators.data.sliding

    def compliance(self) -> Array:
        """S as a dense array, a solve a column: for tests."""
        m, k = self._zero.shape
        return np.column_stack([self.apply(unit.reshape(m, k)).ravel() for unit in np.eye(m * k)])

    def surrogate(self) -> Surrogate | None:
        """T, as of dense operators, as long as it is not large itself."""
        return stand_in(self.operators.mesh, self.operators) if self._zero.size <= LARGEST_T else None

    def boundary(self, sigma: Array) -> tuple[Array, Array]:
        """One solve with σ given, from the last solution."""
        known = sigma / self._scale
        if np.abs(self._state.t - known).max(initial=0.0) > ROUND_OFF * np.abs(known).max(initial=0.0):
            self._solve(self._equations.given_traction(known), loaded=True, rtol=RTOL)
        return self.operators.split(self._equations.by_nodes(self._state.z), sigma)

    def memory(self) -> int:
        """Bytes of the matrix and the local inverses, on all ranks."""
        return self._equations.memory()

    def describe(self) -> str:
        """Operator and solver."""
        return "; ".join(filter(None, [f"mixed, {self._equations.describe()}", self._equations.solver.kind]))

    def close(self) -> None:
        """Free the PETSc objects and let go of the matrix."""
        self._equations.close()

    def _solve(self, relation: Relation, *, loaded: bool, rtol: float, forcing: float = 0.0) -> tuple[Array, Array]:
        """u [length] and t [length], of which σ is `traction_scale` times, in the contact directions (m, k)."""
        equations = self._equations
        self._state, self.defect = equations.solve(relation, self._state, loaded, rtol, forcing)
        self.ksp_iterations, self.ksp_reason = equations.solver.iterations, equations.solver.reason
        return self._state.u, self._state.t
