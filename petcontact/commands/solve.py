"""Solve one problem, print a verdict, write the result (HDF5) and figures."""

from __future__ import annotations

import argparse
import difflib
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import InputError, in_file
from ..runtime.signals import Interrupted, stopping

SOON = 5.0
"""Seconds of work that need no announcement."""
STATUS = {"converged": 0, "not converged": 3, "failed": 1}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact solve`."""
    parser.add_argument("config", metavar="CONFIG.toml", help="the problem (see configs/ for examples)")
    parser.add_argument("-o", "--output", metavar="FILE.h5", help="result file (default: the config's stem + .h5)")
    parser.add_argument("--figures", metavar="DIR", help="folder of the figures (default: the result's)")
    parser.add_argument("--no-figures", action="store_true", help="draw nothing")
    parser.add_argument("--force", action="store_true", help="replace a result file that exists")
    parser.add_argument("--set", metavar="KEY=VALUE", action="append", default=[],
                        help="override a key of the config, for example --set method.rho=100")  # fmt: skip
    parser.add_argument("--monitor", action="store_true", help="print a line an iteration: change, residual, states, KSP")
    parser.add_argument("--adapt", action="store_true",
                        help="refine the mesh until the estimated error of u_t (p, q) is as wanted")  # fmt: skip
    parser.add_argument("--accuracy", metavar="ERROR", type=float,
                        help="with --adapt, or without a [mesh] table: wanted relative L2 error of u_t (1e-4)")  # fmt: skip


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Solve; exit status 0 converged, 3 not converged, 1 failed."""
    from ..model import case as config
    from ..runtime.atomic_write import check_target
    from ..runtime.petsc import initialise, petsc
    from ..runtime.terminal import StatusLine, say

    initialise(petsc_words)
    comm = petsc().COMM_WORLD
    first = comm.getRank() == 0
    case = config.load_any(arguments.config, overrides(arguments.set))
    output = Path(arguments.output or f"{Path(arguments.config).stem}.h5")
    longest = "" if arguments.no_figures else f"{output.stem}-displacement.png"
    check_target(output, replace=arguments.force, inputs=read_files(arguments.config, case), longest=longest)
    accuracy = wanted_accuracy(arguments, case)
    from ..results.hdf5 import write_solution

    status, tolerance = StatusLine(first and sys.stderr.isatty()), case.method.tolerance
    with stopping(comm) as stop:

        def monitor(state: Any) -> str:
            if arguments.monitor and first:
                say(monitor_line(state))
            status.show(iteration_line(state, tolerance))
            return stop.reason

        try:
            with in_file(arguments.config):
                solution = solved(case, accuracy, comm, monitor, announcer(status) if first else None)
        finally:
            status.clear()
        number = stop()
    if first:
        try:
            write_solution(output, solution, replace=arguments.force)
        except Interrupted as late:
            number = late.number
        say(f"{solution.verdict()}\n  result: {output}")
        if not (arguments.no_figures or number):
            from ..results.figures import plot_all

            folder = Path(arguments.figures) if arguments.figures else output.parent
            for path in plot_all(solution, folder, output.stem):
                say(f"  figure: {path}")
    if first:
        report_ignored(case, accuracy)
    report_unused(first)
    if number:
        what = "the last iterate" if solution.status == "failed" else "the solution"
        raise Interrupted(number, f"{what} is saved in {output}, go on with --set method.start={output}")
    return STATUS[solution.status]


def wanted_accuracy(arguments: argparse.Namespace, case: Any) -> float | None:
    """The accuracy of an adaptive solve, None for what the config says of its mesh."""
    adapt = arguments.adapt or (arguments.accuracy is not None and hasattr(case, "mesh") and case.mesh.automatic)
    if arguments.accuracy is not None and not adapt:
        raise InputError("--accuracy: only an adaptive solve has one; add --adapt")
    accuracy = 1e-4 if arguments.accuracy is None else arguments.accuracy
    if not 0.0 < accuracy < 1.0:
        raise InputError(f"--accuracy: must lie between 0 and 1, got {accuracy:g}")
    return accuracy if adapt else None


def solved(case: Any, accuracy: float | None, comm: Any, monitor: Callable[[Any], str | None], announce: Any) -> Any:
    """The solution on the mesh of the config, or on adaptive ones where an accuracy is wanted or the mesh is left open."""
    if accuracy is not None:
        return adapted(case, accuracy, comm, monitor)
    from ..pipeline.run import solve
    from ..results.solution import Solution

    solution = solve(case, comm=comm, monitor=monitor, announce=announce)
    if not isinstance(solution, Solution) or "estimated_error" in solution.info:
        return solution
    from ..pipeline.fixed_mesh import with_estimate

    return with_estimate(solution, comm)


def adapted(case: Any, accuracy: float, comm: Any, monitor: Callable[[Any], str | None]) -> Any:
    """The solution on meshes fine enough for an accuracy."""
    from ..pipeline.prepare import is_stepped

    if is_stepped(case):
        from ..model.assembly import assembly_of
        from ..pipeline.adaptive_assembly import adapt_assembly

        return adapt_assembly(assembly_of(case), accuracy, comm=comm, monitor=monitor)
    from ..pipeline.adaptive import adapt

    return adapt(case, accuracy, comm=comm, monitor=monitor)


def announcer(status: Any) -> Callable[[int, int, float], Callable[[float], None]]:
    """Tells the size of what will take a while, and on the status line how far it is."""
    began = time.perf_counter()

    def progress(share: float) -> None:
        left = (time.perf_counter() - began) * (1.0 - share) / max(share, 1e-3)
        status.show(f"matrix: {share:.0%}, about {left:.0f} s left")

    def announced(nodes: int, unknowns: int, seconds: float) -> Callable[[float], None]:
        nonlocal began
        began = time.perf_counter()
        if seconds > SOON:
            size = f"{nodes} nodes, {unknowns} unknowns"
            print(f"petcontact: {size}: about {seconds:.0f} s to eliminate", file=sys.stderr, flush=True)
        return progress

    return announced


def overrides(words: list[str]) -> dict[str, Any]:
    """--set KEY=VALUE as dotted keys; the value is read as TOML, and as text where it is none."""
    from ..model.case import parse_toml

    result: dict[str, Any] = {}
    for word in words:
        try:
            word = os.fsencode(word).decode("utf-8")  # Python takes the words in the encoding of the locale
        except UnicodeDecodeError:
            raise InputError(f"--set {word!a}: not text in UTF-8") from None
        key, equals, value = word.partition("=")
        if not (key and equals and value):
            raise InputError(f"--set {word}: expected KEY=VALUE")
        try:
            result[key] = parse_toml(f"v = {value}", "--set")["v"]
        except InputError:
            result[key] = value
    return result


def read_files(config: str, case: Any) -> list[str]:
    """The files that a case is read from, but for the result that it starts from: going on may replace that."""
    shapes = [body.geometry for body in getattr(case, "body", [case])]
    return [config, *(shape.file for shape in shapes if hasattr(shape, "file"))]


def report_unused(first: bool) -> None:
    """Name the PETSc options that no object asked for, and the nearest of ours."""
    from ..model.solver_options import Bem
    from ..runtime.petsc import unused_options

    ours = [f"-bem_{name}" for name in Bem.model_fields]
    for name in unused_options() if first else []:
        near = difflib.get_close_matches(name, ours, n=1)
        hint = f", did you mean {near[0]}?" if near else " (-help lists those that are)"
        print(f"petcontact: PETSc option {name} was not used by any object{hint}", file=sys.stderr)


def report_ignored(case: Any, accuracy: float | None) -> None:
    """Name the keys of the config that the method that ran does not read."""
    method = case.method if accuracy is None else case.method.model_copy(update={"name": "semismooth-newton", "rule": None})
    keys = [f"method.{key}" for key in method.ignored]
    if accuracy is not None and hasattr(case, "mesh"):
        keys += [f"mesh.{key}" for key in type(case.mesh).model_fields
                 if key in case.mesh.model_fields_set and key != "graded_points"]  # fmt: skip
    if keys:
        who = "an adaptive solve" if accuracy is not None else method.resolved_name
        rule = f" with rule {method.rule}" if method.rule and method.resolved_name == "projection" else ""
        print(f"petcontact: {who}{rule} does not use {', '.join(keys)}", file=sys.stderr)


def monitor_line(state: Any) -> str:
    """The iteration that has just ended, in full; of load steps the increment."""
    if not hasattr(state, "history"):
        return f"  {iteration_line(state, 0.0)}, {state.reason}"
    h = state.history
    counts = ", ".join(f"{name} {count}" for name, count in state.counts.items())
    ksp = f", KSP {h.ksp_iterations[-1]}" if h.ksp_iterations[-1] else ""
    return f"  {len(h):3d}: change {h.change[-1]:.3e}, |R_rho| {h.residual[-1]:.3e}, {counts}{ksp}"


def iteration_line(state: Any, tolerance: float) -> str:
    """The iteration, or the increment of a load step, that has just ended."""
    if not hasattr(state, "history"):
        return f"step {state.step} ({state.name}): {state.load_factor:.4g}, {state.iterations} iterations"
    h = state.history
    return f"iteration {len(h)}: change {h.change[-1]:.1e} (to {tolerance:.0e}), rho {h.rho[-1]:.3g}"
