"""Forces at nodes as tractions of the faces around them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..arrays import Array, connected
from ..geometry.quadratic import QuadraticCells, on_side
from ..mesh.basis import gauss
from ..round_off import WRITTEN
from .inp_file import Face

GAUSS, WEIGHT = 0.5 + 0.5 * gauss(3)[0], 0.5 * gauss(3)[1]
"""Rule on [0, 1] of degree seven, for moments of a linear traction on cells of second order."""


def loaded_faces(
    faces: Mapping[Face, tuple[int, ...]], loaded: set[int]
) -> list[tuple[list[Face], list[int]]]:
    """Faces on which forces at nodes are spread, and these nodes, group by group: faces whose nodes
    are all loaded, and all those around a node that none of them has."""
    covered = {face: nodes for face, nodes in faces.items() if loaded.issuperset(nodes)}
    alone = loaded.difference(*covered.values())
    around = {face: nodes for face, nodes in faces.items() if not alone.isdisjoint(nodes)}
    candidates = covered | around
    groups = connected({face: loaded.intersection(nodes) for face, nodes in candidates.items()})
    return [
        (group, sorted({node for face in group for node in candidates[face]} & loaded))
        for group in groups
    ]


def linear_traction(cells: list[Array], points: Array, forces: Array, axial: bool) -> Array:
    """The traction, linear in the coordinates, that has the resultant and all first moments of
    forces: its value at the origin and its derivative along each axis, (1 + d, d).

    Parameters
    ----------
    cells : list of (n, d) arrays
        Nodes of the faces: the corners of lines, triangles or quadrilaterals, then the middles of
        their edges if these are curved.
    points, forces : (m, d) arrays
        Where forces act, and these; in axial problems whole ones of rings.
    axial : bool
        Whether faces are rings about x = 0.
    """
    places, weights = _rules(cells, axial)
    middle, size = weights @ places / weights.sum(), np.ptp(np.vstack(cells), axis=0).max()

    def terms(x: Array) -> Array:
        return np.column_stack([np.ones(len(x)), (x - middle) / size])

    phi = terms(places)
    gram = phi.T @ (weights[:, None] * phi)
    # coordinates have as many digits
    traction = np.linalg.pinv(gram, rcond=WRITTEN, hermitian=True) @ terms(points).T @ forces
    traction[np.abs(traction) <= WRITTEN * np.abs(traction).max()] = 0.0
    return _from_origin(traction / np.array([1.0, *[size] * len(middle)])[:, None], middle)


def turning_traction(
    cells: list[Array], point: Array, force: Array, moment: Array, axial: bool
) -> Array:
    """The traction a + b × x of faces, (1 + d, d), with the resultant of a force (3,) at a point
    and of a moment (3,); axial ones have no moment."""
    places, weights = _rules(cells, axial)
    dim = places.shape[1]
    middle = weights @ places / weights.sum()
    arms, off = (np.pad(x, [(0, 0), (0, 3 - dim)]) for x in (places - middle, [point - middle]))
    inertia = np.eye(3) * (weights @ np.sum(arms**2, axis=1)) - arms.T @ (weights[:, None] * arms)
    turn = np.linalg.pinv(inertia, rcond=WRITTEN, hermitian=True) @ (
        moment + np.cross(off[0], force)
    )
    traction = np.vstack([force / weights.sum(), np.cross(turn, np.eye(3)) * (not axial)])
    traction[np.abs(traction) <= WRITTEN * np.abs(traction).max()] = 0.0
    return _from_origin(traction[: 1 + dim, :dim], middle)


def outward(corners: Array) -> Array:
    """The unit normal of a straight line or a plane face, to either side."""
    along = corners[1:] - corners[0]
    normal = np.array([along[0, 1], -along[0, 0]]) if len(along) == 1 else np.cross(*along[:2])
    return np.asarray(normal / np.linalg.norm(normal))


def _from_origin(traction: Array, middle: Array) -> Array:
    """Return a linear traction by its value at the origin in place of that in the middle."""
    return np.vstack([traction[0] - middle @ traction[1:], traction[1:]])


def written(traction: Array) -> tuple[float | str, ...]:
    """A linear traction, a component each: a number where it is the same everywhere."""
    return tuple(
        f"{c:.12g}" + "".join(f" {s:+.12g}*{x}" for s, x in zip(slopes, "xyz", strict=False) if s)
        if slopes.any()
        else float(f"{c:.12g}")
        for c, slopes in zip(traction[0], traction[1:].T, strict=True)
    )


def _rules(cells: list[Array], axial: bool) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,) that integrate over faces, of rings the whole ones."""
    places, weights = map(np.concatenate, zip(*map(_rule, cells), strict=True))
    return places, weights * (2.0 * math.pi * places[:, 0] if axial else 1.0)


def _rule(cell: Array) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,) that integrate over a line, a triangle or a quadrilateral of
    second order, straight where it has corners only."""
    d = cell.shape[1]
    corners = 2 if d == 2 else 4 if len(cell) in (4, 8) else 3
    if len(cell) == corners:
        middles = 0.5 * (cell + np.roll(cell, -1, axis=0))
        cell = np.vstack([cell, middles[: 1 if d == 2 else None]])
    if d == 2:
        t, start, middle, end = GAUSS[:, None], cell[0], cell[2], cell[1]
        along = (4.0 * t - 3.0) * start + 4.0 * (1.0 - 2.0 * t) * middle + (4.0 * t - 1.0) * end
        return on_side(start, middle, end, t), WEIGHT * np.linalg.norm(along, axis=1)
    s, t = (x.ravel() for x in np.meshgrid(GAUSS, GAUSS))
    weight = np.outer(WEIGHT, WEIGHT).ravel()
    if corners == 3:
        local, weight = np.column_stack([s, t * (1.0 - s)]), weight * (1.0 - s)
    else:
        local, weight = 2.0 * np.column_stack([s, t]) - 1.0, 4.0 * weight
        centre = 0.5 * cell[4:].sum(axis=0) - 0.25 * cell[:4].sum(axis=0)
        cell = np.vstack([cell, centre])
    places, along = QuadraticCells(cell[None]).at(local[None])
    return places[0], weight * np.linalg.norm(np.cross(*along[0].transpose(1, 0, 2)), axis=1)
