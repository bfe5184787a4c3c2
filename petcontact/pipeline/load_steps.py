"""Load steps of an assembly: one elimination, then increment after increment with w_prev as the only history."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..contact.criterion import Criterion
from ..contact.equilibrium import unheld
from ..contact.friction_law import contact_norm
from ..contact.iteration import Iteration
from ..contact.laws import dissipation
from ..contact.methods.registry import method_of
from ..contact.state import ContactState, Start
from ..errors import InputError
from ..model.assembly import Assembly
from ..results.hdf5 import read_result
from ..results.steps.solution import AssemblySolution, StepResult
from ..runtime import threads
from ..runtime.memory import peak_memory
from ..runtime.petsc import options, petsc
from ..runtime.terminal import printable
from .assemble import Discrete, build, discretise, loadings_from
from .increment import (
    Freedoms,
    Progress,
    SteppedProblem,
    changed,
    freedoms_of,
    progress_after,
    reduced_problem,
    step_result,
    undetermined,
)  # fmt: skip
from .trust.warnings import warnings_of

HALVINGS = 8
"""How often an increment that fails is halved."""
PATH_ERROR = 1e-3
"""With increments = "auto": change of σ and of w over their sizes that halving an increment may make."""
ENERGY_ERROR = 1e-2
"""The same of the energy dissipated, over itself or the work of all tractions on the slip."""
LEAST_SLIP = 1e-3
"""Slip, over what the tractions move, below which its path error is relative to that."""
FAR = 0.05
"""Initial gap or overlap, over the size of the body, that is told."""
Monitor = Callable[[StepResult], str | None]


def prepare_assembly(assembly: Assembly, comm: Any = None, discrete: Discrete | None = None) -> SteppedProblem:
    """Discretise and eliminate."""
    if assembly.method.resolved_name == "tao":
        raise InputError('method.name: "tao" solves one body in bilateral Tresca contact only; bodies, load steps and other '
                         'laws take "semismooth-newton", "projection" or "operator-robin"')  # fmt: skip
    comm = comm if comm is not None else petsc().COMM_WORLD
    began = time.perf_counter()
    discrete = discrete if discrete is not None else discretise(assembly)
    return _eliminated(discrete, comm, {"mesh": time.perf_counter() - began})


def _eliminated(discrete: Discrete, comm: Any, timings: dict[str, float]) -> SteppedProblem:
    largest = max(mesh.x.size for mesh in discrete.meshes)
    with options(discrete.assembly.petsc), threads.suited_to(largest):
        system = build(discrete, comm, timings)
    return SteppedProblem(discrete, system, comm, timings)


def _from_step(problem: SteppedProblem, number: int, done: list[StepResult]) -> SteppedProblem:
    """The problem from a step on: eliminated once more where that holds or frees other components than the step before."""
    before = [result for result in done if result.step < number]
    if not before:
        return problem
    loadings = loadings_from(problem.discrete, number, before[-1].bodies)
    if all(new is old for new, old in zip(loadings, problem.discrete.loadings, strict=True)):
        return problem
    return _eliminated(replace(problem.discrete, loadings=loadings), problem.comm, problem.timings)


def solve_assembly(assembly: Assembly, *, comm: Any = None, monitor: Monitor | None = None) -> AssemblySolution:
    """Solve all load steps of an assembly.

    Parameters
    ----------
    assembly : Assembly
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default; every rank gets the whole solution.
    monitor : callable, optional
        Called with each increment; a reason, if it returns one, ends the solve there, and those solved are returned.

    Raises
    ------
    InputError
        If the problem is ill-posed.
    SolverError
        If a body cannot be eliminated.
    """
    return run_steps(prepare_assembly(assembly, comm), monitor=monitor)


def run_steps(problem: SteppedProblem, *, warm: Start | None = None, monitor: Monitor | None = None) -> AssemblySolution:
    """The steps of a prepared problem; `warm` are v and σ that a solution on another mesh had after its first increment."""
    began = time.perf_counter()
    results = finished_before(problem)
    status, reason = "converged", ""
    with options(problem.discrete.assembly.petsc), threads.suited_to(problem.system.dim * len(problem.system.weight)):
        for result in _increments(problem, warm, list(results)):
            results.append(result)
            stop = monitor(result) if monitor is not None else None
            if stop:
                status, reason = "failed", f"{stop} after {len(results)} increments"
                break
    return _finished(problem, results, status, reason, {**problem.timings, "steps": time.perf_counter() - began})


def _increments(problem: SteppedProblem, warm: Start | None, done: list[StepResult]) -> Iterator[StepResult]:
    """Increment after increment from where those done end; the last one has failed where not all steps are reached."""
    progress = progress_after(problem, done, warm)
    done = list(done)
    current = list(problem.discrete.assembly.obstacle)
    for number, step in enumerate(problem.steps, 1):
        current = [changed(o, step) for o in current]
        passed = bool(done) and number < done[-1].step
        reached = max((r.load_factor for r in done if r.step == number), default=float(passed))
        if reached >= 1.0:
            continue
        problem = _from_step(problem, number, done)
        begun = progress_after(problem, [r for r in done if r.step < number], warm) if reached > 0.0 else progress
        freedoms = [freedoms_of(o, begun, k, problem.system.dim) for k, o in enumerate(current)]
        auto = step.increments == "auto"
        whole = 1.0 if auto else 1.0 / int(step.increments)
        size, doubt = whole, False
        while reached < 1.0 - 1e-12:
            target = min(1.0, reached + size)
            target = 1.0 if 1.0 - target < 1e-9 else target
            hopeless = doubt and _unheld(problem, freedoms, progress, number, target)
            tried = None if hopeless else _attempt(problem, freedoms, progress, number, reached, target, auto=auto)
            if tried is None:
                doubt = True
                size *= 0.5
                if size >= whole * 0.5**HALVINGS:
                    continue
                tried = [_increment(problem, freedoms, progress, number, target)]
            problem.discrete.warnings += undetermined(problem, freedoms, progress, number, target, tried[-1][0])
            for place, (outcome, following) in zip(np.linspace(reached, target, len(tried) + 1)[1:], tried, strict=True):
                last = not outcome.converged or place == 1.0
                result = step_result(
                    problem, freedoms, step, number, float(place), outcome, progress, following, checked=last
                )
                done.append(result)
                yield result
                if result.status != "converged":
                    return
                progress = following
            reached = target
            size = min(whole, 2.0 * size)


def finished_before(problem: SteppedProblem) -> list[StepResult]:
    """The converged increments of the file that `method.start` names, "FILE.h5" or "FILE.h5:k" for the first k; else none.

    Raises
    ------
    InputError
        If there is no such file or increment, or it holds other meshes.
    """
    name = problem.discrete.assembly.method.start
    if name in ("zero", "frictionless"):
        return []
    file, colon, count = name.rpartition(":")
    file, count = (file, count) if colon and count.isdecimal() else (name, "")
    if not Path(file).is_file():
        raise InputError(f'method.start: {name!r} is neither "zero" nor a result file (FILE.h5, FILE.h5:3 for 3 increments)')
    old = read_result(file)
    same = isinstance(old, AssemblySolution) and set(old.nodes) == {i.name for i in problem.discrete.interfaces} and all(
        mesh.x.shape == new.x.shape and np.allclose(mesh.x, new.x)
        for mesh, new in zip(old.meshes.values(), problem.discrete.meshes, strict=False)
    )  # fmt: skip
    if not isinstance(old, AssemblySolution) or not same:
        raise InputError(f"method.start: {file} holds other bodies, pairs or meshes than this problem")
    steps = [step for step in old.steps if step.status == "converged"]
    if count and not 0 < int(count) <= len(steps):
        raise InputError(f"method.start: {file} has {len(steps)} converged increments, got {name!r}")
    return steps[: int(count)] if count else steps


def _unheld(problem: SteppedProblem, freedoms: list[Freedoms], progress: Progress, number: int, target: float) -> bool:
    """Whether no admissible traction holds the loads at a load factor."""
    reduced = reduced_problem(problem.system, freedoms, progress, number, target)
    return unheld(reduced.modes, problem.discrete.law) is not None


def _attempt(
    problem: SteppedProblem, freedoms: list[Freedoms], progress: Progress, number: int, reached: float, target: float, *,
    auto: bool,
) -> list[tuple[ContactState, Progress]] | None:  # fmt: skip
    """One increment, or with "auto" two halves that agree with it; None where it fails."""
    whole, after = _increment(problem, freedoms, progress, number, target)
    if not whole.converged:
        return None
    if not auto:
        return [(whole, after)]
    first, middle = _increment(problem, freedoms, progress, number, 0.5 * (reached + target))
    if not first.converged:
        return None
    second, end = _increment(problem, freedoms, middle, number, target)
    if not second.converged:
        return None
    weight = problem.system.weight
    # where nothing slips w is round-off of what the tractions move
    moved = problem.system.apply(second.sigma)
    size = max(contact_norm(end.slip, weight), LEAST_SLIP * contact_norm(moved, weight))
    apart = contact_norm(second.sigma - whole.sigma, weight) > PATH_ERROR * contact_norm(second.sigma, weight)
    if apart or contact_norm(end.slip - after.slip, weight) > PATH_ERROR * size:
        return None
    once, one, two = (float(weight @ dissipation(problem.discrete.law, start.sigma, state.sigma, state.v[:, :-1])[0])
                      for start, state in ((progress, whole), (progress, first), (middle, second)))  # fmt: skip
    if abs(one + two - once) > ENERGY_ERROR * max(one + two, size * contact_norm(second.sigma, weight)):
        return None
    return [(first, middle), (second, end)]


def _increment(
    problem: SteppedProblem, freedoms: list[Freedoms], progress: Progress, number: int, target: float
) -> tuple[ContactState, Progress]:
    """Newton's outcome at a load factor of a step, and what it hands on."""
    system = problem.system
    reduced = reduced_problem(system, freedoms, progress, number, target)
    method = problem.discrete.assembly.method
    iteration = Iteration(Criterion(method.tolerance, method.stop), method.max_iterations, progress.start)
    outcome = method_of(method)(reduced, problem.discrete.law, iteration)
    alpha, r = reduced.amplitudes(outcome.v, outcome.sigma), system.modes.shape[1]
    positions, loads = progress.positions.copy(), progress.loads.copy()
    taken = r
    for k, freedom in enumerate(freedoms):
        position, load = ((1.0 - target) * pair[0] + target * pair[1] for pair in (freedom.position, freedom.load))
        free = int(freedom.free.sum())
        position[freedom.free] = alpha[taken : taken + free]
        taken += free
        feels = system.weighted(system.obstacle_modes[k]) @ outcome.sigma.ravel()
        positions[k], loads[k] = position, np.where(freedom.free, load, -feels)
    slip = progress.slip + outcome.v[:, :-1]
    return outcome, Progress(slip, (outcome.v, outcome.sigma), alpha[:r], positions, loads, outcome.sigma)


def _finished(
    problem: SteppedProblem, results: list[StepResult], status: str, reason: str, timings: dict[str, float]
) -> AssemblySolution:
    from .run import petsc_options_of, versions

    discrete, failed = problem.discrete, None
    if results and results[-1].status != "converged":
        results, failed = results[:-1], results[-1]
        status, reason = "not converged", failed.reason
    if status == "converged":
        reason = _reached(discrete, results)
    warnings = [*discrete.warnings, *warnings_of(problem, results)]
    names = [body.name for body in discrete.assembly.body]
    info = {
        "argv": printable(" ".join(sys.argv)), "petsc_options": petsc_options_of(discrete.assembly.petsc),
        "versions": versions(), "ranks": problem.comm.getSize(), "peak_memory": peak_memory(problem.comm),
        "warnings": warnings, "distance": {side.name: d for side, d in zip(discrete.sides, discrete.distance, strict=True)},
        "motions": {name: body.modes.shape[2] for name, body in zip(names, problem.system.bodies, strict=True)},
    }  # fmt: skip
    return AssemblySolution(
        discrete.assembly, dict(zip(names, discrete.meshes, strict=True)),
        {i.name: i.nodes for i in discrete.interfaces}, {s.name: (names[s.body], s.part) for s in discrete.sides},
        results, status, reason, timings, info, failed,
    )  # fmt: skip


def _reached(discrete: Discrete, results: list[StepResult]) -> str:
    """How a converged solve ended, and what to look at."""
    worst = {key: max(float(np.nan_to_num(r.residuals[key])) for r in results)
             for key in ("normal", "tangential", "balance", "elastic", "equilibrium")}  # fmt: skip
    # a balance of 0 is none: nothing is held by contact only
    text = "residuals " + ", ".join(f"{key} {value:.1e}" for key, value in worst.items() if key != "balance" or value)
    if all(np.all(pair.state == 2) for pair in results[-1].pairs.values()):
        apart = "; ".join(f"pair {side.name!r} lies {d:.3g} apart" if np.isfinite(d) else f"pair {side.name!r} faces nothing"
                          for side, d in zip(discrete.sides, discrete.distance, strict=True))  # fmt: skip
        text += f"; no contact anywhere ({apart})"
    for side, d in zip(discrete.sides, discrete.distance, strict=True):
        if np.isfinite(d) and abs(d) > FAR * discrete.boundaries[side.body].diameter:
            how = f"lies {d:.3g} apart" if d > 0.0 else f"overlaps by {-d:.3g}"
            text += f"; pair {side.name!r} {how}, far for the theory of small displacements"
    return text
