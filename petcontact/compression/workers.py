"""Threads of one rank and ranks of one communicator, with the few exchanges that a tree of clusters
needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar, cast

from ..untyped import Comm

T = TypeVar("T")


class Workers:
    """Threads and ranks.

    Parameters
    ----------
    threads : int
        Threads of this rank.
    comm : mpi4py.MPI.Comm or None
        None is one process.
    """

    def __init__(self, threads: int, comm: Comm = None) -> None:
        self.threads, self.comm = threads, comm
        self.rank: int = comm.Get_rank() if comm is not None else 0
        self.size: int = comm.Get_size() if comm is not None else 1
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    def map(self, task: Callable[..., T], *items: Iterable[object]) -> list[T]:
        """Return the results of a task on each item, computed by threads."""
        return list(map(task, *items) if self._pool is None else self._pool.map(task, *items))

    def share(self, task: Callable[[int], object]) -> None:
        """Run a task for each number of a thread; the first one is the thread that asks.

        Threads that are started for each product of an H-matrix cost a quarter of it.
        """
        others = [self._pool.submit(task, k) for k in range(1, self.threads)] if self._pool else []
        task(0)
        for each in others:
            each.result()

    def gather(self, items: list[T]) -> list[T]:
        """Return the items of all ranks, in the order of the ranks, on every rank."""
        if self.size == 1:
            return items
        return [item for part in self.comm.allgather(items) for item in part]

    def at_root(self, task: Callable[[], T]) -> T:
        """Return on every rank what rank 0 computes, so that all use the same digits."""
        if self.size == 1:
            return task()
        return cast(T, self.comm.bcast(task() if self.rank == 0 else None, root=0))
