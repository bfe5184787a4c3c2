"""A prepared case to its solution: iterate, check."""

from __future__ import annotations

import platform
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from .. import __version__
from ..arrays import Array
from ..bem.operators import BoundaryOperators
from ..contact.criterion import Criterion
from ..contact.friction_law import contact_norm
from ..contact.iteration import Iteration
from ..contact.laws import EXCESS, law_excess, law_residual
from ..contact.methods.registry import method_of
from ..contact.rho_rules import Rule
from ..contact.state import ContactState, Monitor, Start
from ..errors import InputError, SolverError
from ..geometry.outline import Outline
from ..model.assembly import Assembly, assembly_of
from ..model.case import Case
from ..model.problem import Problem
from ..model.solver_options import Method
from ..results.solution import Solution, contact_fields
from ..results.steps.solution import AssemblySolution
from ..runtime import threads
from ..runtime.memory import peak_memory
from ..runtime.petsc import options, petsc, reason_name, stage, timed
from ..runtime.terminal import printable
from .initial_state import initial_functions
from .prepare import Announce, Prepared, is_stepped, prepare
from .trust.elastic import ELASTIC_LIMIT, elastic_residual


def iterate(
    prepared: Prepared, method: Method, *, rule: Rule | None = None, start: Start | None = None,
    monitor: Monitor | None = None,
) -> ContactState:  # fmt: skip
    """The method of a `[method]` table on a prepared problem.

    Parameters
    ----------
    prepared : Prepared
    method : Method
    rule : Rule, optional
        Over `method.rule`, for the projection method.
    start : pair of (m, 1) arrays, optional
        Initial u_t [length] and σ_t [stress], over `method.start`.
    monitor : callable, optional
        See `Iteration`.

    Raises
    ------
    InputError
        If `method.start` names no usable result file.
    SolverError
        If a solve or an iterate fails.
    """
    operators = prepared.operators
    if start is None:
        start = initial_functions(method.start, prepared.system, operators.mesh, operators.data.contact_nodes)
    criterion = Criterion(method.tolerance, method.stop)
    iteration = Iteration(criterion, method.max_iterations, start, monitor)
    return method_of(method, rule)(prepared.system, prepared.law, iteration)


def run(
    prepared: Prepared,
    case: Case,
    *,
    rule: Rule | None = None,
    start: Start | None = None,
    monitor: Monitor | None = None,
    probe: bool = True,
) -> Solution:
    """The method of a case on a prepared problem, as `iterate`; without `probe` the elastic residual is left for `probed`.

    A solve that fails, or that the monitor ends, keeps its last iterate and history in a solution of status "failed";
    only a failure before the first iterate raises.

    Raises
    ------
    SolverError
        If there is no iterate to keep.
    """
    last: list[ContactState] = []

    def keep(state: ContactState) -> str | None:
        last[:] = [state]
        return monitor(state) if monitor is not None else None

    unknowns = prepared.operators.n_unknowns
    size = len(prepared.operators.data.contact_nodes) if case.method.formulation == "condensed" else unknowns
    with timed() as seconds, options(case.petsc), threads.suited_to(size), stage("iterate"):
        try:
            state = iterate(prepared, case.method, rule=rule, start=start, monitor=keep)
        except SolverError as error:
            if not last:
                raise
            state = replace(last[0], reason=str(error), stopped=True)
        u, traction = prepared.system.boundary(state.sigma)
    solution = _finish(prepared, case, state, u, traction, {**prepared.timings, **seconds}, rule)
    return probed(solution, prepared.operators) if probe else solution


def solve(
    case: Case | Problem | Assembly,
    *,
    method: Method | None = None,
    rule: Rule | None = None,
    petsc_options: Mapping[str, Any] | None = None,
    comm: Any = None,
    monitor: Callable[[Any], str | None] | None = None,
    announce: Announce | None = None,
) -> Solution | AssemblySolution:
    """Solve a case, a problem with a method, or several bodies; in the plane adaptively where `[mesh]` leaves the mesh open.

    Parameters
    ----------
    case : Case, Problem or Assembly
        From `load`, `load_assembly`, or built in Python.
    method : Method, optional
        Over the case's own.
    rule : Rule, optional
        A rule of your own for the projection method: any object with `update(rho, balance)`.
    petsc_options : mapping, optional
        Over the case's `[petsc]` table, for example ``{"ksp_type": "gmres"}``.
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default; every rank gets the whole solution.
    monitor : callable, optional
        Called with the state so far after each iteration, of load steps with each increment; a reason that it returns ends
        the solve there.
    announce : callable, optional
        As in `prepare`.

    Returns
    -------
    Solution or AssemblySolution
        The latter of several bodies, load steps, unilateral or Coulomb contact, and a body that only friction holds.

    Raises
    ------
    InputError
        If the problem is ill-posed, or has a rule of one's own and such contact.
    SolverError
        If a solve fails before there is an iterate to keep.
    """
    case, changes = case if isinstance(case, Assembly) else Case.of(case), dict[str, Any]()
    if method is not None:
        changes["method"] = method
    if petsc_options is not None:
        changes["petsc"] = {**case.petsc, **petsc_options}
    case = case.model_copy(update=changes)
    if is_stepped(case):
        from .load_steps import solve_assembly

        if rule is not None:
            raise InputError("rule: bodies, load steps and other laws take the rules of method.rule")
        return solve_assembly(assembly_of(case), comm=comm, monitor=monitor)
    assert isinstance(case, Case)
    if case.mesh.automatic and isinstance(case.geometry.outline(), Outline):
        from .adaptive import solve_adaptively

        return solve_adaptively(case, rule=rule, comm=comm, monitor=monitor)
    prepared = prepare(case, comm, announce=announce)
    try:
        return run(prepared, case, rule=rule, monitor=monitor)
    finally:
        prepared.close()


def _finish(
    prepared: Prepared, case: Case, state: ContactState, u: Array, traction: Array,
    timings: dict[str, float], rule: Rule | None,
) -> Solution:  # fmt: skip
    """Put together what a method returned."""
    began = time.perf_counter()
    operators, system = prepared.operators, prepared.system
    mesh, data = operators.mesh, operators.data
    contact, zones = contact_fields(mesh, data, u, traction, state)
    status, reason = "failed" if state.stopped else "converged" if state.converged else "not converged", state.reason
    excess = law_excess(prepared.law, state.sigma, float(np.abs(traction).max(initial=0.0)))
    if status == "converged" and not excess <= EXCESS * case.method.tolerance:
        status, reason = "not converged", f"tractions exceed what friction allows by {excess:.1e} of the largest traction"
    residual = law_residual(prepared.law, state.v, state.sigma, state.rho)
    timings["check"] = time.perf_counter() - began
    info = {
        "solver": system.describe(),
        "ksp_reason": reason_name(system.ksp_reason) if system.ksp_reason else "",
        "method": case.method.resolved_name,
        "rule": type(rule).__name__ if rule is not None else (case.method.rule or "modified"),
        "argv": printable(" ".join(sys.argv)),
        "petsc_options": petsc_options_of(case.petsc),
        "versions": versions(),
        "elastic_solves": system.elastic_solves,
        "elastic_limit": max(ELASTIC_LIMIT, getattr(system, "tolerance", 0.0)),
        "ranks": prepared.comm.getSize(),
        "peak_memory": peak_memory(prepared.comm),
    }
    return Solution(
        case, mesh, u, traction, contact, zones, state.history, status, reason, float(np.max(state.rho)),
        contact_norm(residual, contact.weight), np.nan, timings, info,
    )  # fmt: skip


def probed(solution: Solution, operators: BoundaryOperators) -> Solution:
    """The solution with its elastic residual, failed where that is too large."""
    began = time.perf_counter()
    defect = elastic_residual(operators, solution.u, solution.traction)
    status, reason = solution.status, solution.reason
    limit = solution.info.get("elastic_limit", ELASTIC_LIMIT)
    if status != "failed" and not defect <= limit:
        status = "failed"
        reason = f"check: elastic residual {defect:.1e} > {limit:g}; {_remedy(solution)}"
    timings = {**solution.timings, "check": solution.timings.get("check", 0.0) + time.perf_counter() - began}
    return replace(solution, status=status, reason=reason, elastic_residual=defect, timings=timings)


def _remedy(solution: Solution) -> str:
    """What makes the elastic solution of a formulation more accurate."""
    solver = solution.info["solver"]
    if "hodlr" in solver:
        return "use a smaller -bem_hodlr_tol, or -bem_mat_type dense"
    if "hmatrix" in solver:
        return "use a smaller -bem_hmatrix_tol, or -bem_mat_type dense"
    prefix = "" if solver.startswith("full") else "elastic_"
    return f"use -{prefix}pc_type lu, or a smaller -{prefix}ksp_rtol"


def petsc_options_of(table: Mapping[str, Any]) -> str:
    """All PETSc options in force, with those of a config's table."""
    with options(dict(table)):
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
