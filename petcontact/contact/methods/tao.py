"""PETSc TAO's bound-constrained solvers on the dual problem, followed by Newton steps.

If S were symmetric in the inner product of the node weights, σ_t would minimise ½σᵀWSσ + σᵀWu_0
over |σ| <= g. Collocation makes S symmetric only up to its own error. The minimum belongs to the
symmetric part of WS, and differs by some percent in σ_t (2 % in Example 1). TAO's result therefore
only gives the first active set. Semismooth Newton steps on S itself follow, so that the returned
state solves the same problem as that of every other method.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...errors import InputError, SolverError
from ...given.tables.solver_options import Method
from ...runtime.petsc import petsc
from ...untyped import Vec
from ..iteration import ContactMethod, Iteration, Recorder
from ..law_protocol import ContactLaw
from ..laws import Tresca
from ..rho_rules import Rule
from ..state import ContactState, History
from ..system import ContactSystem
from .newton import SemismoothNewton

DEFAULT_TYPE = "gpcg"
LARGEST = 8000
"""Largest number of contact nodes for the dense S that the symmetric part needs."""


def tao(system: ContactSystem, law: ContactLaw, iteration: Iteration) -> ContactState:
    """Solve the dual problem by TAO (`-tao_type gpcg | bnls | tron | blmvm ...`), then take Newton
    steps on S.

    As `ContactMethod`, but only σ of the start is used. The iteration limit is that of the Newton
    steps; TAO's is `-tao_max_it`.

    Notes
    -----
    Products with the symmetrised matrix inside TAO are not counted among the system's applications.

    Raises
    ------
    InputError
        If the law is not Tresca's in the plane, or there are more than LARGEST contact nodes: the
        symmetric part of S needs S as a dense matrix.
    SolverError
        If TAO breaks down.
    """
    if not isinstance(law, Tresca) or law.k != 1:
        raise InputError(
            "method.name: tao solves bilateral contact with Tresca friction in the plane, and no "
            "other"
        )
    bound = law.bound
    if len(bound) > LARGEST:
        raise InputError(
            f"method.name: tao needs S as a dense matrix, too large for {len(bound)} contact nodes"
        )
    start = iteration.start
    first = np.zeros_like(bound) if start is None else np.clip(start[1][:, 0], -bound, bound)
    iterates = minimise(system.compliance(), system.u_0[:, 0], bound, system.weight, first)
    sigma = iterates[-1]
    slips = np.abs(sigma) >= bound * (1.0 - 1e-8)
    # any displacement against σ says that a node slips: Newton takes only the set from it
    v = np.where(slips, -np.sign(sigma), 0.0) * np.abs(system.u_0).max()
    newton = replace(iteration, start=(v[:, None], sigma[:, None]))
    state = SemismoothNewton(predict=False)(system, law, newton)
    steps, state.history = state.history, _rows(system, law, iterates, iteration)
    state.history.extend(steps)
    state.reason += f", after {len(iterates) - 1} TAO iterations"
    return state


def build(options: Method, rule: Rule | None) -> ContactMethod:
    """Return the method that the options describe."""
    return tao


def _rows(
    system: ContactSystem, law: Tresca, iterates: list[Array], iteration: Iteration
) -> History:
    """Return the history with a row for each of TAO's iterations."""
    recorder, old = Recorder(law, system, iteration), None
    for sigma in iterates:
        new = system.u_0 + system.apply(sigma[:, None]), sigma[:, None]
        if old is not None:
            recorder.step(old, *new, new[0] - old[0], new[1] - old[1], ksp_iterations=0)
        old = new
    return recorder.history


def minimise(
    compliance: Array, base: Array, bound: Array, weight: Array, sigma: Array
) -> list[Array]:
    """Return TAO's iterates (m,) to the minimum of ½σᵀWSσ + σᵀWu_0 over |σ| <= g; the last is the
    best.

    S is replaced by the symmetric part of WS.

    Parameters
    ----------
    compliance : (m, m) array
        S [length/stress].
    base : (m,) array
        u_0 [length].
    bound, weight : (m,) arrays
        g [stress] and node weights [length].
    sigma : (m,) array
        First iterate [stress].
    """
    hessian = compliance * weight[:, None]
    hessian = 0.5 * (hessian + hessian.T)
    # σ = unit · x with x of order one and a unit diagonal: TAO's tolerances are absolute, and
    # graded meshes need it
    diagonal = np.sqrt(np.diag(hessian))
    unit = (float(bound.max()) or 1.0) * float(np.sqrt(np.mean(diagonal**2))) / diagonal
    hessian /= diagonal[:, None] * diagonal
    mean = float(np.mean(unit * diagonal))
    linear = weight * base / diagonal / mean
    with contextlib.closing(_BoundSolver(hessian, linear, bound / unit)) as solver:
        return [x * unit for x in solver.run(sigma / unit)]


class _BoundSolver:
    """TAO on min ½xᵀHx + bᵀx over |x| <= c, on COMM_SELF: every rank solves the same small
    problem."""

    def __init__(self, hessian: Array, linear: Array, bound: Array) -> None:
        module = petsc()
        m = len(linear)
        self.linear, self._iterates = linear, list[Array]()
        self._hessian = module.Mat().createDense(
            (m, m), array=np.asfortranarray(hessian), comm=module.COMM_SELF
        )
        self._hessian.assemble()
        self._x, self._b = self._hessian.createVecs()
        self._lower, self._upper, self._gradient = (self._x.duplicate() for _ in range(3))
        self._lower.setArray(-bound)
        self._upper.setArray(bound)
        self._tao = module.TAO().create(module.COMM_SELF)
        self._tao.setType(DEFAULT_TYPE)
        self._tao.setObjectiveGradient(self._evaluate, self._gradient)
        self._tao.setHessian(lambda solver, x, matrix, preconditioner: None, self._hessian)
        self._tao.setVariableBounds(self._lower, self._upper)
        self._tao.setMaximumIterations(10_000)
        self._tao.setMonitor(
            lambda solver: self._iterates.append(np.array(self._x.getArray(readonly=True)))
        )

    def run(self, x: Array) -> list[Array]:
        """Return the iterates from x to the minimum."""
        self._b.setArray(self.linear)
        self._x.setArray(x)
        size = float(np.linalg.norm(self.linear))
        self._tao.setTolerances(gatol=1e-12 * size, grtol=0.0, gttol=0.0)
        self._tao.setFromOptions()
        try:
            self._tao.solve(self._x)
        except petsc().Error as error:
            raise SolverError(
                "iterate", f"TAO: PETSc error {error.ierr}", "try -tao_type bnls or another method"
            ) from error
        return [x, *self._iterates[1:], np.array(self._x.getArray(readonly=True))]

    def close(self) -> None:
        """Free every PETSc object."""
        for item in (
            self._tao,
            self._hessian,
            self._x,
            self._b,
            self._lower,
            self._upper,
            self._gradient,
        ):
            item.destroy()

    def _evaluate(self, solver: object, x: Vec, gradient: Vec) -> float:
        self._hessian.mult(x, gradient)
        value = 0.5 * float(x.dot(gradient)) + float(self._b.dot(x))
        gradient.axpy(1.0, self._b)
        return value
