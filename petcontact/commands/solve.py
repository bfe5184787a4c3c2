"""Solve one problem, print a verdict, write the result (HDF5) and figures."""

from __future__ import annotations

import argparse
import contextlib
import difflib
import functools
import math
import os
import re
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, OutputError, in_file
from ..runtime.signals import BrokenOff, Interrupted, answering, stopping
from ..runtime.terminal import SOON
from ..untyped import Comm, Keyed
from .options import option, options, positive, real

if TYPE_CHECKING:
    from ..contact.state import ContactState
    from ..model.problem import Problem
    from ..pipeline.adapt.budget import Reached
    from ..results.numbers.number import Number
    from ..results.solution import Solution
    from ..runtime.terminal import StatusLine


SUFFIXES = (".h5", ".hdf5")
"""Suffixes of result files."""
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
    from ..results.hdf5 import write_solution

    status = StatusLine(sys.stderr.isatty() and first > quiet, first > quiet)
    tolerance = case.method.tolerance
    meshes = Meshes(status, output, replaces=is_replaced(arguments, output), quiet=quiet)
    with stopping(comm, meshes.saved) as stop:

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
            write_solution(output, solution, replace=meshes.replaces)
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

    output = Path(arguments.output or f"{Path(arguments.config).stem}.h5")
    if output.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"-o {output}: a result is a file {' or '.join(SUFFIXES)}; petcontact field and export "
            "write other formats from it"
        )
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


def saved_text(solution: Solution, output: Path) -> str:
    """What a signal has left, and how to go on from there; an adaptive solve begins anew."""
    subject = "the last iterate" if solution.status == "failed" else "the solution"
    adaptive = solution.accuracy.wanted is not None
    begin = "" if adaptive else f", go on with --set method.start={output}"
    return f"{subject} is saved in {output}{begin}"


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


def announcer(
    status: StatusLine, adaptive: bool, *, quiet: bool
) -> Callable[[int, int, float, float], Callable[[float], None]]:
    """Announces what will take a while, the whole solve or one of its meshes, and shows on the
    status line how far it is."""
    began = time.perf_counter()

    def progress(share: float) -> None:
        left = (time.perf_counter() - began) * (1.0 - share) / max(share, 1e-3)
        status.show(f"matrix: {share:.0%}, about {left:.0f} s left")

    def announced(
        nodes: int, unknowns: int, seconds: float, memory: float
    ) -> Callable[[float], None]:
        nonlocal began
        began = time.perf_counter()
        if seconds > SOON and not quiet:
            size = f"{nodes} nodes, {unknowns} unknowns, about {memory / 1e9:.2g} GB"
            after = ", if no finer mesh is needed" if adaptive else ""
            line = f"petcontact: {size}: about {seconds:.0f} s of processor time{after}"
            print(line, file=sys.stderr, flush=True)
        return progress

    return announced


class Meshes:
    """Shows each mesh of an adaptive solve, in lines of their own on a terminal and where it takes
    long; there it saves the solution, which a solve that is killed would lose.

    Attributes
    ----------
    replaces : bool
        Whether what has the name of the result may be replaced: from the first mesh on it is ours.
    said : str
        That something is.
    """

    def __init__(self, status: StatusLine, output: Path, *, replaces: bool, quiet: bool) -> None:
        self._status, self._output, self.replaces = status, output, replaces
        self._quiet = quiet
        self.said = " (replaced)" if output.exists() else ""
        self._last: Solution | None = None

    def saved(self) -> str:
        """Save the solution on the last mesh, if there is one; what is saved, in words."""
        from ..results.hdf5 import write_solution

        if self._last is None:
            return "nothing was written"
        # a reader computes the numbers, which take longer than some meshes
        write_solution(self._output, replace(self._last, written=()), replace=self.replaces)
        self.replaces = True
        return saved_text(self._last, self._output)

    def __call__(self, mesh: Reached) -> None:
        self._last = mesh.solution
        error = (
            f"error {mesh.estimate:.1e} estimated"
            if math.isfinite(mesh.estimate)
            else "error not known yet"
        )
        text = f"mesh {mesh.number}: {mesh.nodes} nodes, {error}, {mesh.seconds:.1f} s"
        if not self._quiet and (self._status.enabled or mesh.seconds > SOON):
            self._status.close()
            print(f"petcontact: {text}", file=sys.stderr, flush=True)
        if mesh.seconds > SOON:
            with contextlib.suppress(OutputError):  # the result itself will meet it
                self.saved()


def overrides(words: list[str]) -> Keyed:
    """--set KEY=VALUE as dotted keys; the value is read as TOML, else as a number or a text.

    >>> overrides(["mesh.order=2", "mesh.element_size=.5", "boundary.0.gap=x**2"])
    {'mesh.order': 2, 'mesh.element_size': 0.5, 'boundary.0.gap': 'x**2'}
    """
    from ..model.toml_text import parse_toml

    result: Keyed = {}
    for word in words:
        try:
            word = os.fsencode(word).decode(
                "utf-8"
            )  # Python takes the words in the encoding of the locale
        except UnicodeDecodeError:
            raise InputError(f"--set {word!a}: not text in UTF-8") from None
        key, equals, value = word.partition("=")
        if not (key and equals and value):
            raise InputError(f"--set {word}: expected KEY=VALUE")
        try:
            result[key] = parse_toml(f"v = {value}", "--set")["v"]
        except InputError:  # numbers are written as .2 and 2., too
            result[key] = value if math.isnan(number := real(value)) else number
    return result


def read_files(config: str, case: Problem) -> list[str]:
    """The files that a case is read from, but for the result that it starts from: going on may
    replace that."""
    return [config, *(b.geometry.file for b in case.body if hasattr(b.geometry, "file"))]


@contextlib.contextmanager
def unused_reported(first: bool) -> Iterator[None]:
    """Name the PETSc options that no object in the block asked for, also where it fails; after bad
    input nothing was solved."""
    try:
        yield
    except InputError:
        raise
    except BaseException:
        report_unused(first)
        raise
    report_unused(first)


def report_unused(first: bool) -> None:
    """Name the PETSc options that no object asked for, and the nearest of ours."""
    from ..given.tables.solver_options import Bem
    from ..manual import chapter
    from ..runtime.petsc import unused_options

    unused = unused_options() if first else []
    # PETSc lists no options that no object asked for; the manual names the usual ones
    named = re.findall(r"-[a-z]\w+", chapter("options")) if unused else []
    ours = [*(f"-bem_{name}" for name in Bem.model_fields), *sorted(set(named))]
    for name in unused:
        near = [] if name in ours else difflib.get_close_matches(name, ours, n=1)
        hint = f", did you mean {near[0]}?" if near else " (-help lists those that are)"
        print(f"petcontact: PETSc option {name} was not used by any object{hint}", file=sys.stderr)


def report_ignored(case: Problem, adaptive: bool, *, quiet: bool) -> None:
    """Name the keys of the config that the method that ran does not read."""
    method, keys = case.method, case.ignored(adaptive=adaptive)
    if keys and not quiet:
        who = "an adaptive solve" if adaptive else method.resolved_name
        rule = f" with rule {method.rule}" if method.rule and who == "projection" else ""
        print(f"petcontact: note: {who}{rule} does not use {', '.join(keys)}", file=sys.stderr)


def monitor_line(state: ContactState) -> str:
    """The iteration that has just ended, in full."""
    h = state.history
    counts = ", ".join(f"{name} {count}" for name, count in state.counts.items())
    ksp = f", KSP {h.ksp_iterations[-1]}" if h.ksp_iterations[-1] else ""
    where = f"; {state.where}" if state.where else ""
    return (
        f"  {len(h):3d}: change {h.change[-1]:.3e}, |R_rho| {h.residual[-1]:.3e}, "
        f"{counts}{ksp}{where}"
    )


def iteration_line(state: ContactState, tolerance: float) -> str:
    """The iteration that has just ended, and of which increment it is."""
    h = state.history
    where = f"{state.where}, " if state.where else ""
    return (
        f"{where}iteration {len(h)}: change {h.change[-1]:.1e} (to {tolerance:.0e}), rho "
        f"{h.rho[-1]:.3g}"
    )


def draw(solution: Solution, output: Path, folder: Path, whole: bool) -> list[str]:
    """Draw all figures of a solution, or the first ones; return where they are."""
    from ..results.figures.plots import FIRST, plot_all

    whole = whole or not solution.nodes
    paths = plot_all(solution, folder, output.stem, names=None if whole else FIRST)
    more = [] if whole else [f"  more figures: petcontact plot {output}"]
    return [*(f"  figure: {path}" for path in paths), *more]
