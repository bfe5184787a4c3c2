"""What a rank finishes, on its way to the disk: fields into a shard, then rows into the journal, at least once a second."""

from __future__ import annotations

import time
from collections.abc import Callable

from ...results.solution import Solution
from ...runtime.signals import deferred
from .folder import SweepFolder
from .journal import Journal, Row
from .shards import Shard

LONGEST_WAIT = 1.0
"""Seconds of finished work that a kill may cost."""


class Recorder:
    """Buffers rows and fields.

    Parameters
    ----------
    folder : SweepFolder
    keep : str
        scalars, contact or all.
    name : str
        Of the journal, different for every rank and run.
    written : callable
        Called with the numbers of rows, and of failed ones among them, that have just come to the disk.
    """

    def __init__(self, folder: SweepFolder, keep: str, name: str, written: Callable[[int, int], None]) -> None:
        self._journal = Journal(folder.journals / f"{name}.jsonl")
        self._shard = None if keep == "scalars" else Shard(folder.fields, keep)
        self._written = written
        self._rows: list[Row] = []
        self._oldest = self._began = time.monotonic()
        self._pace, self._estimate = 0.0, 1.0

    def begin(self, estimate: float) -> None:
        """A case begins, with its estimated cost in any unit.

        What waits is written first, if at the pace of the last case it might have to wait too long for the end of this one.
        """
        now = time.monotonic()
        if self._rows and now - self._oldest + 2.0 * self._pace * estimate > LONGEST_WAIT:
            self.flush()
        self._began, self._estimate = now, estimate

    def add(self, row: Row, solution: Solution | None) -> None:
        """A case has ended."""
        now = time.monotonic()
        self._pace = (now - self._began) / self._estimate
        if not self._rows:
            self._oldest = self._began
        if self._shard is not None and solution is not None:
            with deferred():
                self._shard.add(row["id"], solution)
                self._rows.append(row)
        else:
            self._rows.append(row)
        if now - self._oldest > LONGEST_WAIT:
            self.flush()

    def flush(self) -> None:
        """Put everything on the disk.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        if not self._rows:
            return
        with deferred():
            shards = self._shard.flush() if self._shard is not None else {}
            self._journal.append([{**row, "fields": shards.get(row["id"], "")} for row in self._rows])
            rows, self._rows = self._rows, []
        self._written(len(rows), sum(row["status"] == "failed" for row in rows))

    def close(self) -> None:
        """Flush and let the journal go."""
        self.flush()
        self._journal.close()
