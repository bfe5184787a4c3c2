"""Solve one problem, print a verdict, write the result (HDF5) and figures."""

from __future__ import annotations

import argparse
import contextlib
import functools
import math
import shlex
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, in_file
from ..runtime.signals import BrokenOff, Interrupted, answering, rescuing, stopping
from ..untyped import Comm, Keyed
from .options import option, options, overrides, positive
from .progress import Meshes, announcer, iteration_line, monitor_line, saved_text
from .unread import report_ignored, unused_reported

if TYPE_CHECKING:
    from ..contact.state import ContactState
    from ..model.problem import Problem
    from ..results.numbers.number import Number
    from ..results.solution import Solution


STATUS = {"converged": 0, "not converged": 3, "failed": 1}


add_arguments = options(
    option("config", metavar="CONFIG.toml", help="the problem (see configs/ for examples)"),
    option(
        "-o", "--output", metavar="FILE.h5", help="result file (default: the config's stem + .h5)"
    ),
    option(
        "--figures",
        metavar="DIR",
        help="draw all figures, into this folder (default: some, beside the result)",
    ),
    option("--no-figures", action="store_true", help="draw nothing"),
    option("--force", action="store_true", help="replace a file that another command wrote"),
    option(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="override a key of the config, for example --set method.rho=100",
    ),
    option(
        "--monitor",
        action="store_true",
        help="print a line an iteration: change, residual, states, KSP",
    ),
    option(
        "--verbose",
        action="store_true",
        help="print all of the verdict: meshes, methods, moments, times by stage",
    ),
    option(
        "--quiet",
        action="store_true",
        help="print the first line of the verdict only, and no progress",
    ),
    option(
        "--adapt",
        action="store_true",
        help="refine the mesh until the estimated error of u_t (p, q) is as wanted",
    ),
    option(
        "--accuracy",
        metavar="ERROR",
        type=positive,
        help="relative error to be reached, with --adapt or without [mesh]: of u_t (1e-4), of p "
        "and q (1e-2; in space 2e-2)",
    ),
)
"""The options of `petcontact solve`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Solve; exit status 0 converged, 3 not converged, 1 failed."""
    from ..model import case as config
    from ..runtime.petsc import is_launched
    from ..runtime.world import world

    if arguments.no_figures and arguments.figures:
        raise InputError("--figures: --no-figures draws nothing; give one of them")
    # one process refuses a config before PETSc starts; of several, PETSc tells who speaks
    comm = world(petsc_words) if is_launched() else None
    case = config.load(arguments.config, overrides(arguments.set))
    comm = comm or world(petsc_words)
    with unused_reported(comm.getRank() == 0):
        return _run(arguments, case, comm)


def _run(arguments: argparse.Namespace, case: Problem, comm: Comm) -> int:
    from ..runtime.terminal import StatusLine, say

    first, quiet = comm.getRank() == 0, bool(arguments.quiet)
    output, pictures = _targets(arguments, case)
    way = solver(arguments, case)
    from ..pipeline.solve import adapts_itself, solve

    status = StatusLine(sys.stderr.isatty() and first > quiet, first > quiet)
    tolerance = case.method.tolerance
    meshes = Meshes(status, output, replaces=is_replaced(arguments, output), quiet=quiet)
    with rescuing(meshes.saved):
        with stopping(comm) as stop:

            def monitor(state: ContactState) -> str:
                if arguments.monitor and first:
                    say(monitor_line(state))
                status.show(iteration_line(state, tolerance))
                return stop.reason

            with contextlib.closing(status), in_file(arguments.config):
                announce = announcer(status, way is not solve or adapts_itself(case), quiet=quiet)
                shown: Keyed = {"announce": announce, "reached": meshes}
                solution = way(case, comm=comm, monitor=monitor, **(shown if first else {}))
            interrupted = stop()  # from here on signals wait until the result is written
            if first:
                solution = with_numbers(solution, interrupted)
                meshes.finish(solution)
            number = stop()
        if first:
            try:
                report_ignored(case, solution.accuracy.wanted is not None, quiet=quiet)
                _tell(arguments, solution, output, None if number else pictures, meshes.said)
            except Interrupted as late:
                number = late.number
    if number:
        raise Interrupted(number, saved_text(solution, output))
    return STATUS[solution.status]


def _tell(
    arguments: argparse.Namespace,
    solution: Solution,
    output: Path,
    pictures: Path | None,
    said: str,
) -> None:
    """Print the verdict and draw; with --quiet its first line only, and no names of files."""
    from ..runtime.terminal import say

    lines = solution.verdict(arguments.verbose).split("\n")
    say(lines[0] if arguments.quiet else "\n".join([*lines, f"  result: {output}{said}"]))
    if not (arguments.no_figures or pictures is None):
        for line in draw(solution, output, pictures, whole=bool(arguments.figures)):
            if not arguments.quiet:
                say(line)


def _targets(arguments: argparse.Namespace, case: Problem) -> tuple[Path, Path]:
    """The result file and the folder of the figures, which can be written.

    Raises
    ------
    InputError
    """
    from ..runtime.atomic_write import check_target
    from ..runtime.file_kinds import demand_result_name

    output = Path(arguments.output or f"{Path(arguments.config).stem}.h5")
    demand_result_name(output, "-o ")
    longest = "" if arguments.no_figures else f"{output.stem}-displacement.png"
    inputs = read_files(arguments.config, case)
    check_target(output, replace=is_replaced(arguments, output), inputs=inputs, longest=longest)
    pictures = Path(arguments.figures) if arguments.figures else output.parent
    if pictures.exists() and not pictures.is_dir():
        raise InputError(f"--figures {pictures}: is a file, and figures need a folder")
    return output, pictures


def is_replaced(arguments: argparse.Namespace, output: Path) -> bool:
    """Return whether a file may be replaced: with --force, or if it has no name of its own and is
    what the same config gave before."""
    from ..results.format.container import opened

    if arguments.force or arguments.output or not output.is_file():
        return bool(arguments.force)
    try:
        with opened(output) as file:
            return arguments.config in shlex.split(str(file.attrs.get("argv", "")))
    except (InputError, ValueError):
        return False


def with_numbers(solution: Solution, interrupted: int) -> Solution:
    """A solution with the numbers of its verdict, which the first rank computes, and the time that
    they took; with none where a signal has come or comes meanwhile."""
    from ..pipeline.judge.findings import new_finding
    from ..runtime.petsc import petsc

    began = time.perf_counter()
    numbers: tuple[Number, ...] = ()
    with contextlib.suppress(BrokenOff), answering(petsc().COMM_SELF):
        numbers = () if interrupted else tuple(solution.numbers)
    timings = {**solution.timings, "numbers": time.perf_counter() - began}
    solution = replace(solution, written=numbers, timings=timings)
    if not (interrupted and math.isnan(solution.accuracy.path)):
        return solution
    text = "interrupted before the error of the path was known: numbers have no +-"
    return solution.with_findings([new_finding("interrupted", text)])


def solver(arguments: argparse.Namespace, problem: Problem) -> Callable[..., Solution]:
    """What solves: `adapt` where the command line asks for an adaptive solve, else `solve`, which
    adapts where the config asks for it."""
    accuracy = arguments.accuracy
    if accuracy is not None and not (
        arguments.adapt or all(body.mesh.automatic for body in problem.body)
    ):
        raise InputError("--accuracy: only an adaptive solve has one; add --adapt")
    if accuracy is not None and not 0.0 < accuracy < 1.0:
        raise InputError(f"--accuracy: must lie between 0 and 1, got {accuracy:g}")
    if arguments.adapt or accuracy is not None:
        from ..pipeline.adapt.loop import adapt

        return functools.partial(adapt, accuracy=accuracy)
    from ..pipeline.solve import solve

    return solve


def read_files(config: str, case: Problem) -> list[str]:
    """The files that a case is read from, but for the result that it starts from: going on may
    replace that."""
    return [config, *(b.geometry.file for b in case.body if hasattr(b.geometry, "file"))]


def draw(solution: Solution, output: Path, folder: Path, whole: bool) -> list[str]:
    """Draw all figures of a solution, or the first ones; return where they are."""
    from ..results.figures.plots import FIRST, plot_all

    whole = whole or not solution.nodes
    paths = plot_all(solution, folder, output.stem, names=None if whole else FIRST)
    more = [] if whole else [f"  more figures: petcontact plot {output}"]
    return [*(f"  figure: {path}" for path in paths), *more]
