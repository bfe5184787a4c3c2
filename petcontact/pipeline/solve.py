"""The front door: a problem or a file to its solution."""

from __future__ import annotations

import contextlib
import functools
import logging
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from ..contact.law_protocol import GivenLaw
from ..contact.methods.registry import GivenMethod
from ..contact.rho_rules import Rule
from ..errors import InputError
from ..given.tables.solver_options import Method
from ..model.case import checked_problem
from ..model.problem import Problem
from ..results.solution import Solution
from ..runtime.hints import demand_functions
from ..runtime.memory import peak_memory
from ..runtime.petsc import unused_options
from ..runtime.petsc_options import refused_in_config
from ..runtime.ranks import alone, meet, shared_solve
from ..untyped import Comm, Keyed
from .adapt.budget import Callbacks, Reached
from .adapt.fixed_mesh import with_estimate
from .eliminate import Announce
from .run import described, prepare, unreported, with_report
from .steps.increment import Monitor

LOG = logging.getLogger(__name__)


def solve(
    problem: Problem | str | Path,
    *,
    method: GivenMethod | None = None,
    rule: Rule | None = None,
    law: GivenLaw | None = None,
    petsc_options: Mapping[str, str | int | float | bool] | None = None,
    comm: Comm = None,
    monitor: Monitor | None = None,
    announce: Announce | None = None,
    reached: Callable[[Reached], None] | None = None,
) -> Solution:
    """Solve a problem; adaptively where `[mesh]` leaves the meshes open.

    Parameters
    ----------
    problem : Problem, or path of a TOML file
    method : str, Method, or ContactMethod, optional
        Over the problem's own: a name, a `[method]` table, a class of petcontact, or a method of
        your own, which is any `method(system, law, iteration)`.
    rule : Rule, optional
        A rule of your own for the projection method: any object with `update(rho, balance)`.
    law : ContactLaw, or callable, optional
        A law of your own in place of friction_bound and friction_coefficient: an object for the
        contact nodes as they are, or a function of these nodes (x, normal, weight, pairs, law) to
        one.
    petsc_options : mapping, optional
        Over the problem's `[petsc]` table, for example ``{"ksp_type": "gmres"}``.
    comm : mpi4py.MPI.Comm or PETSc.Comm, optional
        All ranks by default. All its ranks call this with the same problem, and each gets the whole
        solution.
    monitor : callable, optional
        Called with the state so far after each iteration, whose `where` says step and load factor;
        a reason that it returns ends the solve there.
    announce : callable, optional
        Called with nodes, unknowns, predicted processor seconds of the whole solve and bytes before
        these are spent; what it returns is called with the share that is built of an H-matrix.
    reached : callable, optional
        Called with each finished mesh of an adaptive solve and its estimate.

    Returns
    -------
    Solution

    Warns
    -----
    UserWarning
        Of `petsc_options` that nothing used.

    Raises
    ------
    InputError
        If the problem is ill-posed.
    SolverError
        If a solve fails before there is an iterate to keep.
    RanksError
        If another rank fails, or does not begin within 60 s (PETCONTACT_PATIENCE).

    Examples
    --------
    >>> from petcontact import Contact, Displacement, Material, MeshOptions, Problem, Rectangle
    >>> from petcontact import Traction, solve
    >>> block = Problem(
    ...     material=Material(1e4, 0.3),
    ...     geometry=Rectangle((0, 0), (8, 4)),
    ...     mesh=MeshOptions(element_size=0.5),
    ...     boundary=[
    ...         Contact("bottom", friction_bound=150),
    ...         Displacement("top", (0, 0)),
    ...         Traction("left", (400, 0)),
    ...         Traction("right", (0, 0)),
    ...     ],
    ... )
    >>> solve(block).status
    'converged'
    """
    posing = problem, method

    def call() -> Callable[[], Mapping[str, object]]:
        nonlocal problem, method
        demand_functions(monitor=monitor, announce=announce, reached=reached)
        problem, method = posed(*posing, petsc_options)
        return functools.partial(described, problem, method=method, rule=rule, law=law)

    with shared_solve(comm, call) as comm:
        assert isinstance(problem, Problem)
        solution = _solved(
            problem, method, rule, law, comm, (monitor, alone(announce), alone(reached))
        )
        meet("peak memory", comm)
        # judging takes memory, too
        used = replace(solution.provenance, peak_memory=peak_memory(comm))
        solution = replace(solution, provenance=used)
    LOG.info("%s: %s", solution.status, solution.reason)
    unused = unused_options() if petsc_options else []
    left = [name for name in petsc_options or () if f"-{name}" in unused]
    if left:
        warnings.warn(f"petsc_options that nothing used: {', '.join(left)}", stacklevel=2)
    return solution


def _solved(
    problem: Problem,
    method: GivenMethod | None,
    rule: Rule | None,
    law: GivenLaw | None,
    comm: Comm,
    callbacks: Callbacks,
) -> Solution:
    monitor, announce, reached = callbacks
    if adapts_itself(problem):
        from .adapt.loop import adapt

        return adapt(
            problem,
            None,
            method=method,
            rule=rule,
            law=law,
            comm=comm,
            monitor=monitor,
            announce=announce,
            reached=reached,
        )
    prepared = prepare(problem, comm, method=method, rule=rule, law=law, announce=announce)
    with contextlib.closing(prepared):
        solution, began = unreported(prepared, monitor), time.perf_counter()
        report = functools.partial(with_report, prepared)
        solution = with_estimate(solution, prepared.comm, law, report)
        return replace(solution, timings={**solution.timings, "judge": time.perf_counter() - began})


def adapts_itself(problem: Problem) -> bool:
    """Whether a problem that names no mesh is solved on adaptive ones; of facets of .msh files
    where it has an accuracy."""
    asked = any(body.mesh.accuracy is not None for body in problem.body)
    return all(
        body.mesh.automatic and (asked or problem.outline(b).known)
        for b, body in enumerate(problem.body)
    )


def posed(
    problem: Problem | str | Path,
    method: GivenMethod | None,
    petsc_options: Mapping[str, str | int | float | bool] | None,
) -> tuple[Problem, GivenMethod | None]:
    """The problem with a method and options over its own, and the method where that is no table."""
    problem = checked_problem(problem)
    changes: Keyed = {}
    if isinstance(method, str):
        method = Method(**{**problem.method.model_dump(exclude_unset=True), "name": method})
    if isinstance(method, Method):
        changes["method"], method = method, None
    if petsc_options is not None:
        if reason := refused_in_config(petsc_options):
            raise InputError(f"petsc_options: {reason}")
        changes["petsc"] = {**problem.petsc, **petsc_options}
    return problem.model_copy(update=changes), method
