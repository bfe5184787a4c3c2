"""How far a sweep is: one line that is overwritten on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from types import TracebackType

from ..runtime.terminal import StatusLine, on_terminal
from .schedule.deal import Counters

DONE, FAILED = "done", "failed"
"""Names of the counters of cases on the disk, and of failed ones among them."""
ON_TERMINAL, PLAIN = 0.5, 30.0
"""Seconds between two looks at the counters."""


class Progress:
    """A thread of rank 0 that looks at the counters of a sweep; it neither talks to other ranks nor touches HDF5.

    Parameters
    ----------
    counters : Counters
    cases : int
        To compute in this run.
    enabled : bool
    """

    def __init__(self, counters: Counters, cases: int, *, enabled: bool) -> None:
        self._counters, self._cases = counters, cases
        self._began = time.monotonic()
        self._over = threading.Event()
        self._status = StatusLine(enabled and on_terminal())
        self._thread = threading.Thread(target=self._watch, daemon=True) if enabled and cases else None

    def __enter__(self) -> Progress:
        if self._thread is not None:
            self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join()
            self._status.clear()

    def _watch(self) -> None:
        while not self._over.wait(ON_TERMINAL if self._status.enabled else PLAIN):
            line = self.line(time.monotonic() - self._began)
            if self._status.enabled:
                self._status.show(line)
            else:
                print(line, file=sys.stderr, flush=True)

    def line(self, elapsed: float) -> str:
        """Cases on the disk, failed ones among them, and the time left at the pace so far."""
        done, failed = self._counters.look(DONE), self._counters.look(FAILED)
        left = f", {_duration(elapsed * (self._cases / done - 1.0))} left" if done > 0 else ""
        return f"{done} of {self._cases} cases done, {failed} failed{left}"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02d} min"
