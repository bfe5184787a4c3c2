"""How rows lie over the ranks of a communicator, and how all come to each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ..arrays import AnyArray, Array, Index
from ..runtime.memory import give_back
from ..runtime.ranks import mpi
from ..untyped import Comm

Range = tuple[int, int]
TOGETHER = 100
"""Rounds in which ranks exchange columns, so that what is on its way takes little memory."""


def even_ranges(count: int, size: int) -> list[Range]:
    """PETSc's own split of `count` rows over `size` ranks: the first ones have one more."""
    each, more = divmod(count, size)
    return list(itertools.pairwise(rank * each + min(rank, more) for rank in range(size + 1)))


def everywhere(local: Array, comm: Comm) -> Array:
    """All rows (n, ...) on every rank, from each rank's. Collective."""
    ranks = mpi(comm)
    if ranks is None:
        return local
    return gathered(local, ranks)


def summed(values: Array, comm: Comm) -> Array:
    """The sum of the values of all ranks, on every rank. Collective."""
    ranks = mpi(comm)
    return values if ranks is None else total(values, ranks)


def gathered(local: AnyArray, world: Comm) -> AnyArray:
    """The rows (m, ...) of all ranks of an mpi4py communicator, one below another. Collective.

    Arrays go from rank to rank as they are: a pickled copy takes their memory twice, and mpi4py
    cannot send one of 2 GiB.
    """
    counts = world.allgather(len(local))
    rows, width = np.empty((sum(counts), *local.shape[1:]), local.dtype), math.prod(local.shape[1:])
    world.Allgatherv(np.ascontiguousarray(local), [rows, [count * width for count in counts]])
    return rows


def total(values: Array, world: Comm) -> Array:
    """The sum of the arrays of all ranks of an mpi4py communicator. Collective."""
    result = np.empty_like(values, order="C")
    world.Allreduce(np.ascontiguousarray(values), result)
    return result


def summed_at(root: int, values: Array, world: Comm) -> Array:
    """The sum of the arrays of all ranks on one of them; nothing of use on others. Collective."""
    result = np.empty_like(values)
    world.Reduce(values, result, root=root)
    return result


def exchanged(
    columns: Array, owners: Sequence[Index], world: Comm, *, used_up: bool = False
) -> Array:
    """This rank's columns with all of their rows, (c', n), out of its rows of all columns (c,
    rows). Collective.

    Parameters
    ----------
    columns : (c, rows) array
    owners : sequence of int arrays
        The numbers of the columns that each rank is to have.
    world : mpi4py communicator
    used_up : bool
        Whether nobody reads `columns` again: what has been sent gives its memory back.
    """
    heights, own = world.allgather(columns.shape[1]), owners[world.Get_rank()]
    result = np.empty((len(own), sum(heights)))
    places = np.cumsum([0, *heights])
    step = max(1, len(columns) // (TOGETHER * len(owners)))
    for first in range(0, max(map(len, owners)), step):
        some = [numbers[first : first + step] for numbers in owners]
        sent = np.ascontiguousarray(columns[np.concatenate(some)])
        count = len(some[world.Get_rank()])
        came = np.empty(count * sum(heights))
        world.Alltoallv(
            [sent, [len(numbers) * columns.shape[1] for numbers in some]],
            [came, [count * height for height in heights]],
        )
        for k, height in enumerate(heights):
            part = came[count * places[k] : count * places[k + 1]].reshape(count, height)
            result[first : first + count, places[k] : places[k + 1]] = part
        if used_up:
            numbers = np.concatenate(some)
            for run in np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1):
                give_back(columns[run[0] : run[-1] + 1])
    return result
