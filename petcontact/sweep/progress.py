"""How far a sweep is: one line that is overwritten on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Sequence
from types import TracebackType

from ..runtime.terminal import StatusLine, on_terminal
from .claims import Board
from .cost import Group

ON_TERMINAL, PLAIN = 0.5, 30.0
"""Seconds between two looks at the board."""


class Progress:
    """A thread that looks at the board of a sweep; it neither talks to other ranks nor touches HDF5."""

    def __init__(self, board: Board, groups: Sequence[Group], *, enabled: bool) -> None:
        self._board, self._groups = board, groups
        self._began = time.monotonic()
        self._over = threading.Event()
        self._status = StatusLine(enabled and on_terminal())
        self._thread = threading.Thread(target=self._watch, daemon=True) if enabled and groups else None

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
        """Cases done, running, failed, and the time left by the estimated costs."""
        state = self._board.read()
        cost = {place: group.case + group.prepare / len(group.cases) for group in self._groups for place in group.cases}
        done, total = sum(cost[place] for place in state.done), sum(cost.values())
        left = f", {_duration(elapsed * (total / done - 1.0))} left" if done > 0.0 else ""
        running = len(state.claimed - state.done)
        return f"{len(state.done)} of {len(cost)} cases done, {running} running, {len(state.failed)} failed{left}"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02d} min"
