"""From a case to its solution: discretise, eliminate, iterate, check."""

from __future__ import annotations

import platform
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .. import __version__
from ..arrays import Array
from ..bem.boundary_data import evaluate_boundary
from ..bem.kernels import kernel_for
from ..bem.operators import BoundaryOperators
from ..compliance.base import ContactSystem
from ..compliance.condensed import CondensedSystem, FullSystem
from ..compliance.spectral import shared_by
from ..contact.friction_law import contact_norm, projection_residual
from ..contact.methods.registry import run_method
from ..contact.rho_rules import Rule
from ..contact.state import ContactState, History
from ..errors import InputError, SolverError
from ..mesh.curve_mesh import as_curve
from ..model.case import Case
from ..model.problem import Contact, Problem
from ..model.solver_options import Bem, Method
from ..refinement.marks import mesh_of
from ..results.solution import Solution, contact_fields
from ..runtime import threads as _threads
from ..runtime.petsc import options, petsc, reason_name, stage
from ..runtime.signals import Interrupted, check, held

PROBED_NODES = 24
CROSSOVER = 1200
"""Nodes above which `mat_type = "auto"` compresses."""
ELASTIC_LIMIT = 1e-7
"""Largest accepted defect of the boundary integral equations, relative to the largest displacement."""


@dataclass
class Prepared:
    """A discretised and eliminated problem: any number of methods, rules and ρ run on it.

    Attributes
    ----------
    operators : BoundaryOperators
    system : ContactSystem
    timings : dict of str to float
        Seconds of mesh, assemble and factor.
    """

    operators: BoundaryOperators
    system: ContactSystem
    comm: Any
    timings: dict[str, float] = field(default_factory=dict)

    def close(self) -> None:
        """Free every PETSc object."""
        self.system.close()


def discretise(problem: Problem) -> BoundaryOperators:
    """Mesh, boundary data and operators (not yet assembled) of a problem."""
    if not any(isinstance(condition, Contact) for condition in problem.boundary):
        raise InputError('boundary: no part is in contact; one at least needs condition = "contact"')
    outline = problem.geometry.outline()
    mesh = mesh_of(problem, outline)
    return BoundaryOperators(mesh, evaluate_boundary(problem, mesh), kernel_for(mesh, problem.material))


def prepare(case: Case, comm: Any = None, cases: int = 1) -> Prepared:
    """Discretise and eliminate; what does not depend on the method's parameters is done once, here.

    `cases` is how many will be run on it: several may share more than one would.
    """
    comm = comm if comm is not None else petsc().COMM_WORLD
    began = time.perf_counter()
    operators = discretise(case)
    return prepare_operators(operators, case, comm, {"mesh": time.perf_counter() - began}, cases)


def prepare_operators(
    operators: BoundaryOperators, case: Case, comm: Any, timings: dict[str, float], cases: int = 1
) -> Prepared:
    """Eliminate a problem that is discretised already; its seconds are added to `timings`."""
    with options(case.petsc), _threads.suited_to(operators.n_unknowns):
        system = _build_system(operators, case, comm, timings)
        if case.method.formulation == "condensed" and cases > 1:
            system = shared_by(cases, system, comm, timings)
    return Prepared(operators, system, comm, timings)


def _build_system(
    operators: BoundaryOperators, case: Case, comm: Any, timings: dict[str, float]
) -> ContactSystem:
    """The system that `[bem]`, the -bem_ options and the formulation ask for."""
    bem = resolved_bem(case.bem)
    compressed = bem.mat_type == "hodlr" or (bem.mat_type == "auto" and operators.mesh.n_nodes > CROSSOVER)
    if case.method.formulation == "full":
        if bem.mat_type == "hodlr":
            raise InputError('method.formulation: "full" is dense; use "condensed" with bem.mat_type = "hodlr"')
        return FullSystem(operators, comm, timings)
    if compressed:
        from ..compliance.compressed import CompressedSystem

        return CompressedSystem(operators, comm, bem, timings)
    return CondensedSystem(operators, comm, timings)


def resolved_bem(bem: Bem) -> Bem:
    """`[bem]` with -bem_mat_type, -bem_hodlr_tol and -bem_hodlr_leaf over it."""
    database = petsc().Options("bem_")
    given = {name: database.getString(name) for name in type(bem).model_fields if database.hasName(name)}
    values: dict[str, Any] = {**bem.model_dump()}
    for name, text in given.items():
        try:
            values[name] = text if name == "mat_type" else float(text) if name == "hodlr_tol" else int(text)
        except ValueError:
            raise InputError(f"-bem_{name}: {text!r} is not a number") from None
    return Bem(**values)


def run(
    prepared: Prepared,
    case: Case,
    *,
    rule: Rule | None = None,
    start: tuple[Array, Array] | None = None,
    monitor: Callable[[ContactState], None] | None = None,
    keep_interrupted: bool = False,
    probe: bool = True,
) -> Solution:
    """The method of a case on a prepared problem.

    `start`, initial u_t and σ_t (m, 1), has precedence over the method's own. Without `probe` the elastic residual is
    left for `probed`.

    A solve that fails keeps its last iterate and history in a solution of status "failed"; only a failure before the
    first iterate raises. With `keep_interrupted` a signal that `signals.install` has taken over counts as a failure, and
    `info["interrupted"]` is its number; without it `Interrupted` goes through.

    Raises
    ------
    SolverError
        If there is no iterate to keep.
    """
    began = time.perf_counter()
    unknowns = prepared.operators.n_unknowns
    last: list[ContactState] = []

    def keep(state: ContactState) -> None:
        last[:] = [state]
        check(prepared.comm)
        if monitor is not None:
            monitor(state)

    size = len(prepared.operators.data.contact_nodes) if case.method.formulation == "condensed" else unknowns
    with options(case.petsc), _threads.suited_to(size), stage("iterate"):
        try:
            state, status, interrupted = run_method(prepared.system, case.method, rule, keep, start), "", 0
        except (SolverError, Interrupted) as error:
            if not last or (isinstance(error, Interrupted) and not keep_interrupted):
                raise
            state, status, interrupted = last[0], "failed", getattr(error, "number", 0)
            state.reason = f"interrupted by {error.name}" if isinstance(error, Interrupted) else str(error)
    with held(keep_interrupted) as late:
        with options(case.petsc), _threads.suited_to(size), stage("iterate"):
            u, traction = prepared.system.boundary(state.sigma_t)
        timings = {**prepared.timings, "iterate": time.perf_counter() - began}
        solution = _finish(prepared, case, state, status, u, traction, timings, rule)
        if probe:
            solution = probed(solution, prepared.operators)
    if interrupted or late:
        solution.info["interrupted"] = interrupted or late[0]
    return solution


def solve(
    case: Case | Problem,
    *,
    method: Method | None = None,
    rule: Rule | None = None,
    petsc_options: Mapping[str, Any] | None = None,
    comm: Any = None,
    monitor: Callable[[ContactState], None] | None = None,
) -> Solution:
    """Solve a case, or a problem with a method.

    Parameters
    ----------
    case : Case or Problem
        From `load`, or built in Python.
    method : Method, optional
        Over the case's own.
    rule : Rule, optional
        A rule of your own for the projection method: any object with `update(rho, balance)`.
    petsc_options : mapping, optional
        Over the case's `[petsc]` table, for example ``{"ksp_type": "gmres"}``.
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default; every rank gets the whole solution.
    monitor : callable, optional
        Called with the state so far after each iteration.

    Raises
    ------
    InputError
        If the problem is ill-posed.
    SolverError
        If a solve fails before there is an iterate to keep.
    """
    if not isinstance(case, Case):
        case = Case(**{name: getattr(case, name) for name in type(case).model_fields})
    changes: dict[str, Any] = {}
    if method is not None:
        changes["method"] = method
    if petsc_options is not None:
        changes["petsc"] = {**case.petsc, **petsc_options}
    case = case.model_copy(update=changes)
    prepared = prepare(case, comm)
    try:
        return run(prepared, case, rule=rule, monitor=monitor)
    finally:
        prepared.close()


def _finish(
    prepared: Prepared, case: Case, state: ContactState, status: str, u: Array, traction: Array,
    timings: dict[str, float], rule: Rule | None,
) -> Solution:  # fmt: skip
    """Put together what a method returned."""
    began = time.perf_counter()
    operators, system = prepared.operators, prepared.system
    mesh, data = as_curve(operators.mesh), operators.data
    contact, zones = contact_fields(mesh, data, traction, state)
    status = status or ("converged" if state.converged else "not converged")
    residual = projection_residual(state.u_t, state.sigma_t, data.friction_bound, state.rho)
    timings["check"] = time.perf_counter() - began
    info = {
        "solver": system.describe(),
        "ksp_reason": reason_name(system.ksp_reason) if system.ksp_reason else "",
        "method": case.method.resolved_name,
        "rule": type(rule).__name__ if rule is not None else (case.method.rule or "modified"),
        "argv": " ".join(sys.argv),
        "petsc_options": _petsc_options(case),
        "versions": versions(),
        "elastic_solves": system.elastic_solves,
        "ranks": prepared.comm.getSize(),
    }
    return Solution(
        case, mesh, u, traction, contact, zones, state.history, status, state.reason, state.rho,
        contact_norm(residual, contact.weight), np.nan, timings, info,
    )  # fmt: skip


def probed(solution: Solution, operators: BoundaryOperators) -> Solution:
    """The solution with its elastic residual, failed where that is too large."""
    began = time.perf_counter()
    defect = elastic_residual(operators, solution.u, solution.traction)
    status, reason = solution.status, solution.reason
    if status != "failed" and not defect <= ELASTIC_LIMIT:
        status = "failed"
        reason = f"check: elastic residual {defect:.1e} > {ELASTIC_LIMIT:g}; use LU or a tighter -ksp_rtol"
    timings = {**solution.timings, "check": solution.timings.get("check", 0.0) + time.perf_counter() - began}
    return replace(solution, status=status, reason=reason, elastic_residual=defect, timings=timings)


def elastic_residual(operators: BoundaryOperators, u: Array, traction: Array) -> float:
    """Largest defect of (4.10) at random nodes, from exact kernel entries, over the largest displacement.

    It sees what no KSP can: a wrong or badly conditioned factorisation, a compression that missed its tolerance.
    """
    count = min(PROBED_NODES, operators.mesh.n_nodes)
    rows = np.sort(np.random.default_rng(20190).choice(operators.mesh.n_nodes, count, replace=False))
    defect = np.abs(operators.residual(rows, u, traction)).max()
    scale = np.abs(u).max()
    return float(defect / scale) if scale > 0.0 else float(defect)


def _petsc_options(case: Case) -> str:
    with options(case.petsc):
        return " ".join(f"-{key} {value}".strip() for key, value in sorted(petsc().Options().getAll().items()))


def versions() -> str:
    """Versions of what the digits depend on."""
    import h5py
    import scipy

    numbers = ".".join(str(k) for k in petsc().Sys.getVersion())
    return (
        f"petcontact {__version__}, PETSc {numbers}, numpy {np.__version__}, scipy {scipy.__version__}, "
        f"h5py {h5py.__version__}, Python {platform.python_version()}"
    )


__all__ = ["History", "Prepared", "discretise", "elastic_residual", "prepare", "run", "solve", "versions"]
