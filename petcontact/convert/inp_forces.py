"""Forces at nodes as tractions of the faces around them."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping
from typing import TypeVar

import numpy as np
import scipy

from ..arrays import Array
from ..round_off import WRITTEN
from .inp_file import Face

Key = TypeVar("Key", bound=Hashable)


def connected(nodes: Mapping[Key, Iterable[int]]) -> list[list[Key]]:
    """What hangs together by nodes, in the order of the keys."""
    keys = list(nodes)
    pairs = [(k, node) for k, key in enumerate(keys) for node in nodes[key]]
    place = {node: len(keys) + k for k, node in enumerate(dict.fromkeys(n for _, n in pairs))}
    ends = np.array([(k, place[node]) for k, node in pairs]).reshape(-1, 2)
    size = len(keys) + len(place)
    graph = scipy.sparse.coo_matrix((np.ones(len(ends)), ends.T), (size, size))
    label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][: len(keys)]
    groups: dict[int, list[Key]] = {}
    for key, value in zip(keys, label.tolist(), strict=True):
        groups.setdefault(value, []).append(key)
    return list(groups.values())


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


def linear_traction(corners: list[Array], points: Array, forces: Array, axial: bool) -> Array:
    """The traction, linear in the coordinates, that has the resultant and all first moments of
    forces: its value at the origin and its derivative along each axis, (1 + d, d).

    Parameters
    ----------
    corners : list of (n, d) arrays
        Of the faces: lines, triangles or quadrilaterals.
    points, forces : (m, d) arrays
        Where forces act, and these; in axial problems whole ones of rings.
    axial : bool
        Whether faces are rings about x = 0.
    """
    places, weights = _rules(corners, axial)
    middle, size = weights @ places / weights.sum(), np.ptp(np.vstack(corners), axis=0).max()

    def terms(x: Array) -> Array:
        return np.column_stack([np.ones(len(x)), (x - middle) / size])

    phi = terms(places)
    gram = phi.T @ (weights[:, None] * phi)
    # coordinates have as many digits
    traction = np.linalg.pinv(gram, rcond=WRITTEN, hermitian=True) @ terms(points).T @ forces
    traction[np.abs(traction) <= WRITTEN * np.abs(traction).max()] = 0.0
    return _from_origin(traction / np.array([1.0, *[size] * len(middle)])[:, None], middle)


def turning_traction(
    corners: list[Array], point: Array, force: Array, moment: Array, axial: bool
) -> Array:
    """The traction a + b × x of faces, (1 + d, d), with the resultant of a force (3,) at a point
    and of a moment (3,); axial ones have no moment."""
    places, weights = _rules(corners, axial)
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


def _rules(corners: list[Array], axial: bool) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,) that integrate over faces, of rings the whole ones."""
    places, weights = map(np.concatenate, zip(*map(_rule, corners), strict=True))
    return places, weights * (2.0 * math.pi * places[:, 0] if axial else 1.0)


def _rule(corners: Array) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,) that integrate quadratics over a line, a triangle or a
    quadrilateral of two triangles."""
    if len(corners) == 2:
        half = 0.5 * (corners[1] - corners[0])
        along = np.array([-1.0, 1.0]) / math.sqrt(3.0)
        return corners.mean(axis=0) + along[:, None] * half, np.full(2, np.linalg.norm(half))
    rules = []
    for k in range(1, len(corners) - 1):
        three = corners[[0, k, k + 1]]
        area = 0.5 * np.linalg.norm(np.cross(three[1] - three[0], three[2] - three[0]))
        rules.append((0.5 * (three + three[[1, 2, 0]]), np.full(3, area / 3.0)))
    return tuple(map(np.concatenate, zip(*rules, strict=True)))  # type: ignore[return-value]
