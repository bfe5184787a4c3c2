"""Tiles: some columns of the boundary operators whose kernels are integrated in one call, and where they go."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..mesh.curve_mesh import Batch


@dataclass(frozen=True)
class Tile:
    """k columns of one part and order.

    Attributes
    ----------
    batch : Batch
        The elements that own them, and their nodes (k,).
    place : slice or (k,) array
        Where they go among the columns asked for.
    pick : array or None
        Which of the elements' nodes they are, if not all.
    known : (k, 2) bool array
        Where the traction is known.
    frame : (k, 2, 2) array
    given, moved : (k, 2) arrays
        Known tractions and displacements [length].
    beside, beside_place
        Columns that have one beside A_0, and where those go.
    push, shift
        The tractions and (if any) the displacements behind those.
    """

    batch: Batch
    place: Any
    pick: Index | None
    known: Mask
    frame: Array
    given: Array
    moved: Array
    beside: Index
    beside_place: Any
    push: Array
    shift: Array | None


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


def some(kernel: Array | None, columns: Index) -> Array:
    """Columns of a kernel (2, 2, k, m), without a copy if they are all."""
    assert kernel is not None
    return kernel if len(columns) == kernel.shape[2] else kernel[:, :, columns]


def put(out: Array, where: tuple[Any, ...], kernel: Array | None, direction: Array, chosen: Mask) -> None:
    """kernel · direction into out[where, :, a] for the chosen columns; axis-parallel directions cost a copy."""
    if kernel is None or not chosen.any():
        return
    if not chosen.all():
        where = (np.arange(len(out))[where[0]][chosen], *where[1:])
        kernel, direction = kernel[:, :, chosen], direction[chosen]
    dx, dy = direction[:, :1], direction[:, 1:]
    for a in range(2):
        if not dy.any():
            out[(*where, slice(None), a)] = kernel[a, 0] * dx
        elif not dx.any():
            out[(*where, slice(None), a)] = kernel[a, 1] * dy
        else:
            out[(*where, slice(None), a)] = kernel[a, 0] * dx + kernel[a, 1] * dy
