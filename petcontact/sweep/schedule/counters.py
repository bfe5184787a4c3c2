"""One atomic counter that deals out the chunks of a sweep, and two that tell how far it is; no rank ever waits for another.

`WindowCounters` is memory of rank 0 that the others reach by MPI's one-sided fetch-and-add. That needs an MPI that makes
progress by itself: where rank 0 has to enter MPI before another rank's operation ends, everybody would wait while rank 0 is
in the middle of an LU. `progresses_alone` tries it out. Where it does not, `FileCounters` appends bytes to files: the length
of a file is the number, and a file opened to append gives every writer a place of its own, without a lock. (On NFS two
clients may be given the same place: then a chunk is computed twice, never left out, and both results are the same.)
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...arrays import Index

CLAIMED, DONE, FAILED = range(3)
PROBE = 0.06
"""Seconds that rank 0 stays out of MPI while the others try to reach its memory."""


class Counts(NamedTuple):
    """Chunks claimed; cases on the disk; cases of these that failed."""

    claimed: int
    done: int
    failed: int


class Counters(Protocol):
    """What the ranks of a sweep share while it runs."""

    def next(self) -> int:
        """Add one to the number of claimed chunks; what it was before."""

    def add(self, done: int, failed: int) -> None:
        """So many more cases are on the disk, so many of them failed."""

    def look(self) -> Counts:
        """All three; by rank 0, in any thread."""

    def close(self) -> None:
        """Free what is held; collective."""


class WindowCounters:
    """Three integers of rank 0.

    Parameters
    ----------
    world : mpi4py communicator
        Collective.
    """

    def __init__(self, world: Any) -> None:
        from mpi4py import MPI

        self._mpi = MPI
        first = world.Get_rank() == 0
        self._window = MPI.Win.Allocate(24 if first else 0, 8, comm=world)
        self._local: Index = np.zeros(0, np.int64)
        if first:
            memory: Any = self._window.tomemory()
            self._local = np.frombuffer(memory, np.int64)
        self._local[:] = 0
        world.Barrier()
        self._window.Lock_all()

    def next(self) -> int:
        return self._fetch_and_add(CLAIMED, 1)

    def add(self, done: int, failed: int) -> None:
        for slot, number in ((DONE, done), (FAILED, failed)):
            if number:
                self._fetch_and_add(slot, number)

    def look(self) -> Counts:
        # plain memory of this process: another thread than MPI's may read it
        return Counts(*map(int, self._local))

    def close(self) -> None:
        self._window.Unlock_all()
        self._window.Free()

    def _fetch_and_add(self, slot: int, number: int) -> int:
        before = np.zeros(1, np.int64)
        self._window.Fetch_and_op(np.array([number], np.int64), before, 0, slot, self._mpi.SUM)
        self._window.Flush(0)
        return int(before[0])


class FileCounters:
    """Three files whose lengths count; the folder must be empty when a run starts."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def next(self) -> int:
        return self._append(CLAIMED, 1) - 1

    def add(self, done: int, failed: int) -> None:
        for slot, number in ((DONE, done), (FAILED, failed)):
            if number:
                self._append(slot, number)

    def look(self) -> Counts:
        return Counts(*(self._length(slot) for slot in (CLAIMED, DONE, FAILED)))

    def close(self) -> None:
        pass

    def _append(self, slot: int, number: int) -> int:
        """The length of a file after so many bytes were appended by this call."""
        descriptor = os.open(self.folder / str(slot), os.O_CREAT | os.O_WRONLY | os.O_APPEND, 0o666)
        try:
            os.write(descriptor, b"." * number)
            return os.lseek(descriptor, 0, os.SEEK_CUR)
        finally:
            os.close(descriptor)             # network file systems show to others what was closed

    def _length(self, slot: int) -> int:
        try:
            return (self.folder / str(slot)).stat().st_size
        except FileNotFoundError:
            return 0


def shared_counters(world: Any, folder: Path) -> Counters:
    """The counters that suit this MPI; collective.

    Parameters
    ----------
    world : mpi4py communicator
    folder : Path
        Where files go if they must; on a disk that all ranks see.
    """
    if world.Get_size() == 1:
        return FileCounters(folder)
    from mpi4py import MPI

    try:
        window = WindowCounters(world)
    except MPI.Exception:                     # on all ranks: some transports have no one-sided communication beside threads
        return FileCounters(folder)
    if progresses_alone(world, window):
        return window
    window.close()
    return FileCounters(folder)


def progresses_alone(world: Any, window: WindowCounters) -> bool:
    """Whether a fetch-and-add of every rank ends while rank 0 sleeps outside MPI; collective, and the same on all ranks."""
    world.Barrier()
    began = time.perf_counter()
    if world.Get_rank() == 0:
        time.sleep(PROBE)
        seconds = 0.0
    else:
        window._fetch_and_add(FAILED, 0)
        seconds = time.perf_counter() - began
    slowest: float = max(world.allgather(seconds))
    return slowest < 0.5 * PROBE
