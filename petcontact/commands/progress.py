"""What a solve shows while it is under way: its size, its meshes, its iterations."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import OutputError
from ..runtime.terminal import SOON

if TYPE_CHECKING:
    from ..contact.state import ContactState
    from ..pipeline.adapt.budget import Reached
    from ..results.solution import Solution
    from ..runtime.terminal import StatusLine


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
        self._result: Solution | None = None

    def saved(self) -> str:
        """What is saved, in words: the result if it is written, else the solution on the last mesh,
        which is then, if there is one."""
        if self._result is not None:
            return saved_text(self._result, self._output)
        if self._last is None:
            return "nothing was written"
        # a reader computes the numbers, which take longer than some meshes
        self._write(replace(self._last, written=()))
        return saved_text(self._last, self._output)

    def finish(self, result: Solution) -> None:
        """Write the result."""
        self._write(result)
        self._result = result

    def _write(self, solution: Solution) -> None:
        from ..results.hdf5 import write_solution

        write_solution(self._output, solution, replace=self.replaces)
        self.replaces = True

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


def saved_text(solution: Solution, output: Path) -> str:
    """What a signal has left, and how to go on from there; an adaptive solve begins anew."""
    subject = "the last iterate" if solution.status == "failed" else "the solution"
    adaptive = solution.accuracy.wanted is not None
    begin = "" if adaptive else f", go on with --set method.start={output}"
    return f"{subject} is saved in {output}{begin}"


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
