"""Where given data are rough within the elements of a part, so that cells of integration end
there."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Index
from ..geometry.same_place import TOLERANCE
from ..given.features import kinks
from ..given.sites import Sites, Way
from ..given.values import Given
from .boundary_mesh import BoundaryMesh
from .pairs.ray_casting import Faces

MOST = 16
"""Largest number of cuts of an element along one direction; data with more are rough everywhere,
which their samples show."""


def rough_places(mesh: BoundaryMesh, part: str, data: Sequence[Given]) -> list[tuple[Index, Array]]:
    """Return where data may be rough on the elements of a part, along each of their directions.

    They are looked at along the middle of each element. There data have kinks and jumps, or
    sub-expressions of theirs vanish or have an extremum, as in the middle of each narrow load.

    Returns
    -------
    list of (k,) and (k,) arrays
        Numbers of the elements among those of the part, and shares from 0 to 1 of their extent.
    """
    rough = tuple(each for each in data if each.everywhere and not math.isfinite(each.degree))
    return mesh.once(("rough places", part, rough), lambda: _rough_places(mesh, part, rough))


def _rough_places(
    mesh: BoundaryMesh, part: str, rough: Sequence[Given]
) -> list[tuple[Index, Array]]:
    elements, faces = mesh.faces(part)
    return [
        _along(functools.partial(_sites, mesh, elements, faces, axis), rough, len(elements))
        for axis in range(mesh.dim - 1)
    ]


def narrow_places(mesh: BoundaryMesh, part: str, data: Sequence[Given]) -> tuple[Index, Array]:
    """Return points at which narrow data of a part show.

    They are the places of `rough_places` and the middles between them.

    Returns
    -------
    row : (k,) array
        Numbers of elements among those of the part.
    share : (k, d-1) array
        From 0 to 1 of their extent.
    """
    along = rough_places(mesh, part, data)
    rows, shares = [np.empty(0, dtype=np.int64)], [np.empty((0, len(along)))]
    for k in np.unique(np.concatenate([row for row, _ in along])):
        ends = [share[row == k] for row, share in along]
        lists = [np.concatenate([e, 0.5 * (e[1:] + e[:-1])]) if len(e) else [0.5] for e in ends]
        grid = np.stack(np.meshgrid(*lists), axis=-1).reshape(-1, len(along))
        rows.append(np.full(len(grid), k))
        shares.append(grid)
    return np.concatenate(rows), np.concatenate(shares)


def _sites(mesh: BoundaryMesh, elements: Index, faces: Faces, axis: int, fractions: Array) -> Sites:
    """Return the sites at fractions (n,) of a line through the middles of all elements."""
    row, share = _of_elements(fractions, len(elements))
    shares = np.full((len(row), mesh.dim - 1), 0.5)
    shares[:, axis] = share
    return mesh.sites_at(elements[row], faces.spread(row, shares))


def _of_elements(fractions: Array, count: int) -> tuple[Index, Array]:
    """Return the element of each fraction of the line through `count` elements, and the share of
    its extent."""
    row = np.minimum((fractions * count).astype(np.int64), count - 1)
    return row, fractions * count - row


def _values(datum: Given, way: Way, fractions: Array) -> Array:
    return datum.near(way(fractions))


def _along(way: Way, data: Sequence[Given], count: int) -> tuple[Index, Array]:
    """Return the elements and the shares of the places along a line through elements."""
    places = np.empty(0)
    for datum in data:
        centres, samples = datum.features(way)
        values = functools.partial(_values, datum, way)
        bent = kinks(values, samples, values(samples))
        # centres are known to all their digits
        for more in (centres, bent[0]):
            away = np.abs(more[:, None] - places[None]).min(axis=1, initial=np.inf)
            places = np.append(places, np.unique(more[away > TOLERANCE / count]))
    places = np.sort(places)
    row, share = _of_elements(places, count)
    within = (share > TOLERANCE) & (share < 1.0 - TOLERANCE)
    within &= np.bincount(row[within], minlength=count)[row] <= MOST
    return row[within], share[within]
