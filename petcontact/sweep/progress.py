"""What a sweep reports: how far it is, in one line now and then, and how it ended."""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from ..runtime.terminal import StatusLine
from .schedule.deal import Counters

DONE, FAILED = "done", "failed"
"""Names of the counters of cases on the disk, and of failed ones among them."""
ON_TERMINAL, PLAIN = 0.5, 30.0
"""Seconds between two looks at the counters.  On a terminal the first look is at once; elsewhere
each look leaves a line."""
LISTED = 20
"""Cases that did not converge that the summary names."""


class Progress:
    """A thread that looks at the counters of a sweep while the block runs; it neither talks to
    other ranks nor touches HDF5.

    Parameters
    ----------
    counters : Counters
    cases : int
        To compute in this run.
    """

    def __init__(self, counters: Counters, cases: int) -> None:
        self._counters, self._cases, self._began = counters, cases, time.monotonic()
        self._first: tuple[float, int] | None = None
        self._over = threading.Event()
        self._status = StatusLine(sys.stderr.isatty())
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._thread.join()
        self._status.close()

    def _watch(self) -> None:
        pause = 0.0 if self._status.enabled else PLAIN
        while not self._over.wait(pause):
            line = self.line(time.monotonic() - self._began)
            if self._status.enabled:
                self._status.show(line)
                pause = ON_TERMINAL
            else:
                print(line, file=sys.stderr, flush=True)

    def line(self, elapsed: float) -> str:
        """Cases on the disk, failed ones among them, and the time left at the pace since the first
        of them were there: they wait for what all share, such as meshes and eliminations."""
        done, failed, left = self._counters.look(DONE), self._counters.look(FAILED), ""
        if self._first is None and done > 0:
            self._first = elapsed, done
        began, before = self._first or (elapsed, done)
        if done > before:
            pace = (elapsed - began) / (done - before)
            left = f", {_duration(pace * (self._cases - done))} left"
        return f"{done} of {self._cases} cases done, {failed} failed{left}"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02d} min"


@dataclass
class Summary:
    """How a sweep ended.

    Attributes
    ----------
    computed, reused : int
        Cases of this run, and cases that were there.
    failed, not_converged : dict of str to str
        Reasons by case id, of this run and of reused rows.
    seconds : float
        From the first look at the folder to results.h5 on the disk.
    cpu : list of float
        Processor seconds of each rank in that time; a rank that waits sleeps.
    timings : dict of str to float
        Seconds by stage, summed over teams.
    results : Path
        The table.
    """

    computed: int
    reused: int
    failed: dict[str, str] = field(default_factory=dict)
    not_converged: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    cpu: list[float] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    results: Path = Path()

    @property
    def exit_status(self) -> int:
        """0 all converged, 3 some not converged, 1 some failed."""
        return 1 if self.failed else 3 if self.not_converged else 0

    def lines(self) -> list[str]:
        """A few lines for the user."""
        ends = {"failed": self.failed, "not converged": self.not_converged}
        bad = [
            f"  {status}: {id_}: {reason}"
            for status, cases in ends.items()
            for id_, reason in cases.items()
        ]
        more = (
            [f"  ... and {len(bad) - LISTED} more, see petcontact report"]
            if len(bad) > LISTED
            else []
        )
        ranks, converged = len(self.cpu), self.computed + self.reused - len(bad)
        return [
            *bad[:LISTED],
            *more,
            f"  computed {self.computed}, reused {self.reused}, failed {len(self.failed)}"
            f" ({converged} converged, {len(self.not_converged)} not converged)",
            f"  {self.seconds:.3f} s on {ranks} rank{'s' if ranks != 1 else ''}; processor time a "
            f"rank: mean {sum(self.cpu) / ranks:.3f} s, largest {max(self.cpu):.3f} s",
            "  summed over the ranks [s]: "
            f"{', '.join(f'{name} {seconds:.3f}' for name, seconds in self.timings.items())}",
            f"  result: {self.results}",
        ]
