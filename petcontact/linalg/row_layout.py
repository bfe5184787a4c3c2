"""How rows lie over the ranks of a communicator, and how all come to each."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from ..arrays import Array

Range = tuple[int, int]


def even_ranges(count: int, size: int) -> list[Range]:
    """PETSc's own split of `count` rows over `size` ranks: the first ones have one more."""
    each, more = divmod(count, size)
    return list(itertools.pairwise(rank * each + min(rank, more) for rank in range(size + 1)))


def everywhere(local: Array, comm: Any) -> Array:
    """All rows (n, ...) on every rank, from each rank's. Collective."""
    if comm.getSize() == 1:
        return local
    return np.asarray(np.concatenate(comm.tompi4py().allgather(np.array(local))))


def summed(values: Array, comm: Any) -> Array:
    """The sum of the values of all ranks, on every rank. Collective."""
    return values if comm.getSize() == 1 else np.asarray(comm.tompi4py().allreduce(values))
