"""How rows lie over the ranks of a communicator, and how to move them."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from ..arrays import Array, even_bounds

Range = tuple[int, int]


def even_ranges(count: int, size: int) -> list[Range]:
    """PETSc's own split of `count` rows over `size` ranks: the first ones have one more."""
    return list(itertools.pairwise(even_bounds(count, size).tolist()))


def redistribute(local: Array, owned: list[Range], wanted: list[Range], comm: Any) -> Array:
    """Rows (k, ...) of this rank, moved from one contiguous layout over the ranks to another.

    Parameters
    ----------
    local : (owned rows, ...) array
    owned, wanted : list of (first, last + 1), one a rank
    comm : PETSc.Comm
    """
    rank, size = comm.getRank(), comm.getSize()
    if size == 1 or owned == wanted:
        return local
    mine, needed = owned[rank], wanted[rank]
    result = np.empty((needed[1] - needed[0], *local.shape[1:]))
    parcels: list[tuple[int, Array] | None] = [None] * size
    for other in range(size):
        first, last = max(mine[0], wanted[other][0]), min(mine[1], wanted[other][1])
        if first < last:
            parcels[other] = (first, np.ascontiguousarray(local[first - mine[0] : last - mine[0]]))
    own, parcels[rank] = parcels[rank], None
    for parcel in [own, *comm.tompi4py().alltoall(parcels)]:
        if parcel is not None:
            first, rows = parcel
            result[first - needed[0] : first - needed[0] + len(rows)] = rows
    return result
