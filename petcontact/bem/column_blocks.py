"""Blocks of columns of the boundary operators whose kernels are integrated in one call, and where the columns go."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..mesh.boundary_mesh import Batch


@dataclass(frozen=True)
class ColumnBlock:
    """Columns of k nodes of one part and kind of element.

    Attributes
    ----------
    batch : Batch
        The elements that own the nodes, and the nodes (k,).
    place : slice or (k,) array
        Where they go among the columns asked for.
    subset : array or None
        Which of the elements' nodes they are, if not all.
    traction_known : (k, d) bool array
    frame : (k, d, d) array
    owner : (q,) array
        The nodes (0 to k-1) that the right-hand-side columns belong to.
    rhs_place : slice or (q,) array
        Where those go.
    rhs_traction : (q, d) array
    rhs_displacement : (q, d) array or None
        None where all are zero.
    """

    batch: Batch
    place: Any
    subset: Index | None
    traction_known: Mask
    frame: Array
    owner: Index
    rhs_place: Any
    rhs_traction: Array
    rhs_displacement: Array | None


def common(one: Index, other: Index) -> tuple[Index, Index]:
    """Places of the numbers that two arrays share, the second one increasing."""
    place = np.minimum(np.searchsorted(other, one), len(other) - 1)
    found = np.flatnonzero(other[place] == one)
    return found, place[found]


def as_slice(places: Index) -> Any:
    """A slice where the places are consecutive: numpy copies into it several times faster."""
    if len(places) and places[-1] - places[0] + 1 == len(places) and bool(np.all(np.diff(places) == 1)):
        return slice(int(places[0]), int(places[-1]) + 1)
    return places


def columns_of(kernel: Array | None, columns: Index) -> Array:
    """Columns of a kernel (d, d, k, m), without a copy if they are all."""
    assert kernel is not None
    whole = len(columns) == kernel.shape[2] and bool(np.all(np.diff(columns) == 1))
    return kernel if whole else kernel[:, :, columns]


def contract(kernel: Array, vectors: Array, a: int) -> Any:
    """Component a of kernel (d, d, k, m) times one vector a column (k, d): (k, m); axis-parallel vectors cost a copy."""
    terms = [kernel[a, j] * vectors[:, j, None] for j in range(vectors.shape[1]) if vectors[:, j].any()]
    return functools.reduce(np.add, terms) if terms else 0.0


def put(out: Array, where: tuple[Any, ...], kernel: Array | None, vectors: Array, chosen: Mask) -> None:
    """kernel · vectors into out[where, :, a] for the chosen columns."""
    if kernel is None or not chosen.any():
        return
    if not chosen.all():
        where = (np.arange(len(out))[where[0]][chosen], *where[1:])
        kernel, vectors = kernel[:, :, chosen], vectors[chosen]
    for a in range(len(kernel)):
        out[(*where, slice(None), a)] = contract(kernel, vectors, a)
