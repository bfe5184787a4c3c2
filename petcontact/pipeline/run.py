"""A problem prepared, and run through its steps."""

from __future__ import annotations

import sys
import time
import tomllib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .. import __version__
from ..contact.active_set.block_factors import BlockFactors
from ..contact.law_protocol import GivenLaw
from ..contact.methods.newton import SemismoothNewton
from ..contact.methods.registry import GivenMethod, method_of
from ..contact.rho_rules import Rule
from ..errors import SolverError
from ..given.tables.solver_options import Method
from ..model.problem import Problem
from ..refinement.levels import CONTACT_LADDER
from ..results.report import Provenance
from ..results.solution import Solution
from ..runtime import threads
from ..runtime.petsc import given_options, options, petsc_version, reason_name, stage, timed
from ..runtime.ranks import demand_same
from ..runtime.signals import BrokenOff
from ..runtime.terminal import printable
from ..runtime.world import world
from ..untyped import Comm, Keyed
from .choice import USUAL, Newton
from .eliminate import Announce, eliminated
from .judge.increments import rough_step
from .judge.solutions import findings_of, reached
from .pose.discretise import Discrete, discretise
from .steps.cycles import wear_history
from .steps.feasibility import check_feasible
from .steps.increment import Monitor
from .steps.path import GROWTH, divided_load, is_affordable, with_fewer, with_paths
from .steps.prepared import PreparedProblem
from .steps.start import finished_before, first_iterate, starts_from
from .steps.step_loop import increments


def prepare(
    problem: Problem,
    comm: Comm = None,
    discrete: Discrete | None = None,
    *,
    method: GivenMethod | None = None,
    rule: Rule | None = None,
    law: GivenLaw | None = None,
    cases: int = 1,
    announce: Announce | None = None,
    newton: Newton = USUAL,
) -> PreparedProblem:
    """Discretise and eliminate; what does not depend on the method's parameters is done once, here.

    Parameters
    ----------
    problem : Problem
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default.
    discrete : Discrete, optional
        The problem on meshes of one's own.
    method, rule, law
        As in `solve`.
    cases : int
        How many will be run on it: several may share more than one would.
    announce : callable, optional
        Called with nodes, unknowns, predicted processor seconds of the whole solve and bytes before
        these are spent; what it returns is called with the share that is built of an H-matrix.
    newton : Newton, optional
        What increments are expected to take.

    Raises
    ------
    InputError
        If the problem is ill-posed.
    SolverError
        If a body cannot be eliminated, or nothing holds the loads where that takes long.
    """
    comm = world() if comm is None else comm
    began = time.perf_counter()
    discrete = discrete if discrete is not None else discretise(problem, law=law)
    if comm.getSize() > 1:
        demand_same("data", _numbers(discrete))
    seconds = {"mesh": time.perf_counter() - began}
    largest = max(mesh.x.size for mesh in discrete.meshes)
    with options(problem.petsc), threads.suited_to(largest), timed() as stages:
        check_feasible(discrete, comm)
        system = eliminated(discrete, comm, cases, announce, newton)
    chosen = problem.method if method is None else method
    if not discrete.interfaces:  # there is nothing for a method to do, whichever is asked for
        chosen, rule = Method(name="semismooth-newton"), None
    return PreparedProblem(
        discrete,
        system,
        method_of(chosen, rule, problem.method),
        comm,
        {**seconds, **stages},
        named=_named(method, rule),
        block_factors=BlockFactors(comm),
    )


def described(problem: Problem, **given: object) -> Keyed:
    """Return a problem, and what is given for its solve, as plain values that ranks compare."""
    table = tomllib.loads(problem.toml())
    for key, value in given.items():
        if value is not None:
            known = value if isinstance(value, str) else type(value).__name__
            table[key] = getattr(value, "__qualname__", known)
    return {"petcontact": __version__, **table}


def _numbers(discrete: Discrete) -> dict[str, float]:
    """Return sizes of a discrete problem, rounded so that they are equal on all processors."""
    arrays = {
        f"of body {k}: {name}": array
        for k, (mesh, data) in enumerate(zip(discrete.meshes, discrete.data, strict=True))
        for name, array in (("nodes", mesh.x), ("given values", data.value), ("forces", data.force))
    }
    arrays |= {f"of {face.name}: gap": face.gap for face in discrete.interfaces}
    arrays["of wear"] = discrete.wear
    finite = {key: array[np.isfinite(array)] for key, array in arrays.items()}
    return {key: float(f"{np.linalg.norm(array):.6g}") for key, array in finite.items()}


def _named(method: GivenMethod | None, rule: Rule | None) -> dict[str, str]:
    """What a method and a rule over those of the problem are called in results."""
    given = {"method": method if rule is None or method is not None else "projection", "rule": rule}
    return {
        key: value if isinstance(value, str) else getattr(value, "__name__", type(value).__name__)
        for key, value in given.items()
        if value is not None
    }


def run(problem: PreparedProblem, *, monitor: Monitor | None = None) -> Solution:
    """The steps of a prepared problem.

    A solve that fails, or that the monitor ends, keeps its last iterate and the increments before
    it in a solution of status "failed"; only a failure before the first iterate raises.

    Raises
    ------
    SolverError
        If there is no iterate to keep.
    """
    return with_report(problem, unreported(problem, monitor))


Coarse = tuple[PreparedProblem, Solution]
"""A problem and its solution on a coarser mesh."""
RESOLVED = 0.03
"""Largest estimated error of a coarser mesh on which the path is looked at. The error of the path
of 13 rollers on given meshes is 0.8 to 1.2 of that on the mesh itself then. With errors of 0.03 to
0.07 it is 0.6 to 1.2, of a small contact 2.7 (heated_disc), with 1 it is 0.4 (space_sphere)."""


def with_report(
    problem: PreparedProblem,
    solution: Solution,
    coarse: Coarse | None = None,
    wanted: float | None = None,
) -> Solution:
    """A solution of a prepared problem with all that is to be said of it.

    The path is looked at on a coarser mesh, where that is given with its solution: a solve costs a
    fraction there. The increments that are needed there are taken. Which these are does not depend
    on the method: Newton's finds them.
    """
    solution = reported(problem, solution)
    here = replace(problem, method=SemismoothNewton()), solution
    for first in (coarse, here) if coarse else (here,):
        finer, there = _divided(*first, wanted)
        taken, path = len(there.steps), there.accuracy.path
        divided = taken > len(first[1].steps)
        if first is here and (not divided or isinstance(problem.method, SemismoothNewton)):
            return there
        # what is not known there, or too dear here, is asked of the mesh itself
        if np.isnan(path) or (divided and not is_affordable(problem, solution, taken)):
            continue
        again = _divided_as(problem, finer) if divided else solution
        if not again.converged:
            continue
        # a coarser mesh tells the errors of its own path only
        told = {"tracked": there} if first is coarse else {"paths": there.paths}
        again = replace(again, accuracy=replace(again.accuracy, path=path), **told)
        return again.with_findings(each for each in there.findings if each.kind == "path")
    return with_paths(problem, solution, wanted)


def _divided_as(problem: PreparedProblem, finer: PreparedProblem) -> Solution:
    """The solution of a problem with the increments of another one."""
    discrete = problem.discrete.with_steps_of(finer.discrete.problem)
    problem = replace(problem, discrete=discrete, factors=finer.factors, halvings=0)
    solution = unreported(problem, None, anew=True)
    return reported(problem, solution) if solution.converged else solution


def _divided(
    problem: PreparedProblem, solution: Solution, wanted: float | None
) -> tuple[PreparedProblem, Solution]:
    """A solution with those on other paths and the error of its own, and its problem.

    Steps that name no increments are solved again in `GROWTH` times as many, while the error of the
    path exceeds the wanted one, by default that of adaptive meshes. The solution before is the
    other path then.
    """
    solution, last = with_paths(problem, solution, wanted), problem
    apart, taken, limit = 0.0, GROWTH, wanted or CONTACT_LADDER.usual
    while solution.accuracy.path > limit:
        if (finer := divided_load(problem, solution, taken, limit)) is None:
            break
        finer = replace(finer, starts=starts_from(finer, solution.steps))
        again = unreported(finer, None, anew=True)
        if not again.converged:
            break
        again = reported(finer, again)
        solution, apart = with_fewer(finer, again, solution, apart, wanted)
        last, taken = finer, GROWTH * taken
    return last, solution


def unreported(
    problem: PreparedProblem, monitor: Monitor | None, *, checked: bool = True, anew: bool = False
) -> Solution:
    """As `run`, without the path and what is reported: all that a mesh on the way needs.

    `anew` solves also the increments that the file of `method.start` has: another path has others.
    """
    (results, rows), began = finished_before(problem, anew=anew), time.perf_counter()
    if problem.start is None:
        problem = replace(problem, start=first_iterate(problem))
    status, reason, failed = "converged", "", None
    with (
        options(problem.discrete.problem.petsc),
        threads.suited_to(len(problem.system.base[0])),
        stage("iterate"),
    ):
        try:
            for result in increments(problem, results, monitor, checked=checked, rows=rows):
                results.append(result)
        except (SolverError, BrokenOff) as error:
            if not results:
                raise
            status, reason = "failed", str(error)
    seconds = {**problem.timings, "iterate": time.perf_counter() - began}
    discrete = problem.discrete
    if status == "converged" and (rough := rough_step(results)):
        results = [*results[: rough[0]], rough[1]]
    if results and results[-1].status != "converged":
        results, failed = results[:-1], results[-1]
        status, reason = failed.status, failed.reason
        if failed.status == "failed" and discrete.problem.step:
            reason = f"{reason} after {len(results)} increments"
    if status == "converged":
        reason = reached(discrete, results)
    names = [body.name for body in discrete.problem.body]
    return Solution(
        discrete.problem,
        dict(zip(names, discrete.meshes, strict=True)),
        {i.name: i.nodes for i in discrete.interfaces},
        {s.name: (names[s.body], s.part) for s in discrete.sides},
        results,
        status,
        reason,
        seconds,
        failed=failed,
        wear=wear_history(problem, rows),
        volumes=dict(zip(names, discrete.volumes, strict=True)),
    )


def reported(problem: PreparedProblem, solution: Solution) -> Solution:
    """A solution of a prepared problem with all that is reported of it but for `with_paths`."""
    discrete, system = problem.discrete, problem.system
    names, options_ = [body.name for body in discrete.problem.body], discrete.problem.method
    operator = system.operator
    named = {"method": options_.resolved_name, "rule": options_.rule or "modified"} | problem.named
    provenance = Provenance(
        solver=system.describe(),
        ksp_reason=reason_name(operator.reason) if operator.reason else "",
        method=named["method"],
        rule=named["rule"],
        argv=printable(" ".join(sys.argv)),
        petsc_options=petsc_options_of(discrete.problem.petsc),
        versions=versions(),
        ranks=problem.comm.getSize(),
        distance={i.name: d for i, d in zip(discrete.sides, discrete.distance, strict=True)},
        motions={
            name: body.modes.shape[2] for name, body in zip(names, system.bodies, strict=True)
        },
    )
    findings = findings_of(problem, solution)
    return replace(solution, provenance=provenance, findings=tuple(findings))


def petsc_options_of(table: Mapping[str, str | int | float | bool]) -> str:
    """All PETSc options in force, with those of a config's table."""
    with options(dict(table)):
        return " ".join(f"-{key} {value}".strip() for key, value in sorted(given_options().items()))


def versions() -> str:
    """Versions of what the digits depend on; PETSc's where it runs."""
    import h5py
    import scipy

    used = {
        "petcontact": __version__,
        "PETSc": petsc_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "h5py": h5py.__version__,
        "Python": sys.version.split()[0],
    }
    return ", ".join(f"{name} {version}" for name, version in used.items() if version)
