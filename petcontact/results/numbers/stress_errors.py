"""Errors of the largest stresses of a solution, from the stress on the mesh before.

A largest stress is compared at its place, at places beside it, and wherever the stress is nearly as
large.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...arrays import Array, Index, Mask, largest_by, scattered, smallest_by
from ...fields.boundary.places import located, sizes
from ...linalg.nearest import within
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record
from ..evaluated import Evaluated
from ..records import StepResult
from ..strength.corners import corners_of
from ..strength.singular_places import singular_places
from ..strength.strengths import RING, TOP, growth, tops
from .number import Key, Number
from .peaks import stress_name
from .printed import end_of
from .stress_samples import FINEST

BESIDE, INSIDE = 4, 0.2
"""Places at which a stress is compared on the boundary, the nearest that there are, and how far
apart they lie inside, over the distance to the boundary: stress varies no faster there."""
SHEAR = math.sqrt(3.0)
"""Largest stress over the largest traction of a narrow load: the von Mises stress of a shear. On a
half plane a load 1/(1 + x²) of either direction makes no first principal one above 1.21."""
RIVAL = 0.5 * TOP
"""As `TOP`, of what may be a top: whether something larger lies as far away as that hangs on where
the samples of a mesh are. A first principal stress of 0.0043 was found with errors of 1e-2, 1e-3
and 1e-5, not of 1e-4."""


@record
class NearStress:
    """A largest stress and the stress around it.

    Attributes
    ----------
    x, parts : (q, d), (q,) arrays
        The place, places beside it, and samples of the surface; and their parts, empty inside the
        body.
    values, spread : (q,) arrays
        The stress there, and how much it varies in the element of the surface there [stress].
    element : (q,) array
        The elements of the surface there, -1 inside.
    count : int
        How many are the place and those beside it.
    at_corner : bool
        Whether the place is a corner.
    reach, grown, halvings : (q,) arrays
        Distance within which no stress is larger than a top there, 0 where none is looked for
        [length]; what more it may be at a place where it grows slowly [stress]; and what the stress
        there changes by smaller elements over its last change, see `Place.halvings`.
    at_edge : (q,) array
        Whether panels have an edge of contact or of stick there, see `at_edges`.
    """

    x: Array
    parts: Any
    values: Array
    spread: Array
    element: Index
    count: int
    at_corner: bool
    reach: Array
    grown: Array
    halvings: Array
    at_edge: Mask


@record
class Left:
    """What is left, on the finer of two meshes, of what they differ by.

    Attributes
    ----------
    own : float
        Of the number itself [-].
    usual, at_edge : float
        Of stress away from edges of contact and stick, and there [-].
    moved : float
        How far these edges lie apart on the two meshes [length].
    """

    own: float = 1.0
    usual: float = 1.0
    at_edge: float = 1.0
    moved: float = 0.0


def at_edges(solution: Evaluated, end: StepResult, body: str, x: Array, element: Index) -> Mask:
    """Return which points (q, d) on elements (q,) of a body have nodes of two states within twice
    the size of their element."""
    result = np.zeros(len(x), dtype=bool)
    reach = np.where(element >= 0, 2.0 * sizes(solution.meshes[body])[element], 0.0)
    for pair in end.pairs.values():
        point, node = within(pair.x, x, reach)
        state = pair.state[node].astype(float)
        result |= largest_by(point, state, len(x), -np.inf) > smallest_by(point, state, len(x))
    return result


def stresses_near(solution: Evaluated, numbers: Sequence[Number]) -> dict[Key, NearStress]:
    """Return the stress around each largest stress that has a place."""
    stresses = dict[Key, NearStress]()
    for number in numbers:
        place = number.place if stress_name(number) else None
        if place is None or np.isinf(number.error):
            continue
        end, near = end_of(solution, number), functools.partial(_near, solution, number, place)
        stresses[number.key] = solution.at_end((number.key, *place), end, near)
    return stresses


def unseen(solution: Evaluated, number: Number, parts: Any) -> Array:
    """How much stress (q,) given tractions cause that the functions of a mesh do not have, on parts
    of the surface, or inside: no difference of two meshes shows them."""
    given = solution.accuracy.unseen.get(number.of)
    if given is None:
        return np.zeros(len(parts))
    of_part = dict(zip(solution.meshes[number.of].part_names, given, strict=True))
    return SHEAR * np.array([of_part.get(part, max(given)) for part in parts])


def _near(solution: Evaluated, number: Number, place: Array) -> NearStress:
    """The stress around the place of a number."""
    x, parts, spread, count, reach = _places(solution, number, place)
    values, element = _stress_at(solution, number, x, parts)
    corner = bool(number.part) and _is_corner(solution.meshes[number.of], place)
    end = end_of(solution, number)
    share, halvings = growth(solution, end, number.of, x)
    grown = values * share * (reach > 0.0)
    # along curves edges are known better than elements are long
    at_edge = at_edges(solution, end, number.of, x, element) & bool(solution.accuracy.estimates)
    around = x, parts, values, spread, element, count
    return NearStress(*around, corner, reach, grown, halvings, at_edge)


def _is_corner(mesh: BoundaryMesh, place: Array) -> bool:
    """Whether a place is a corner of a body."""
    corners = corners_of(mesh)
    away = np.linalg.norm(corners.x - place, axis=1)
    return bool((away < FINEST * sizes(mesh)[corners.element[:, 0]]).any())


def stress_change(
    solution: Evaluated, coarser: Evaluated, number: Number, near: NearStress, left: Left
) -> float:
    """Return the error of a largest stress: its change at its place, around it and elsewhere.

    Of these `left` times as much is left, as far as the meshes tell. At a place whose exponents are
    known these tell it, in place of the meshes, where they say more. By edges of contact and stick,
    which move from mesh to mesh, the largest stresses as near as they move are compared.

    At a corner the stress may go on changing as slowly as it does in the last element. Where an
    element gains nothing on the other mesh, the difference tells no error: both owe it to the same
    data, or to panels that were not refined. There it has the relative error of the solution; on
    panels, which are extrapolated to their corners, how much it varies in the element.
    """
    before, element = _stress_at(coarser, number, near.x, near.parts)
    reach, own = np.where(near.at_edge, left.moved, 0.0), slice(near.count)
    largest = [_largest_within(near, reach, each) for each in (near.values, before)]
    change = np.abs(largest[0] - largest[1])
    if np.isnan(change[own]).all():
        return np.nan
    if number.part:
        same = _gains_nothing((solution, coarser), number.of, np.array([near.element, element]))
        # panels that were not cut gain nothing
        cut, least = not np.isnan(solution.accuracy.resultants), near.spread
        if not cut:
            least = solution.accuracy.error * number.size * (np.arange(len(least)) < near.count)
        change *= np.fmax(near.halvings / max(left.own, 1.0), 1.0)
        change *= np.where(near.at_edge, left.at_edge, left.usual) / left.own
        # what varies by an edge elsewhere is the edge itself
        same[near.count :] &= ~near.at_edge[near.count :]
        change = np.where(same, np.fmax(change, least / max(left.own, 1.0)), change)
    change = change + unseen(solution, number, near.parts) / left.own
    top, off = float(number.value[0]), float(np.nanmax(change[own]))
    off = _rival(near, change, top + off) - top
    return float(max(off, np.ptp(near.values[own])) if near.at_corner else off)


def _largest_within(near: NearStress, reach: Array, values: Array) -> Array:
    """The largest of values (q,) at places of the same part within reaches (q,) of each."""
    result, known = values.copy(), np.isfinite(values)
    for part in np.unique(near.parts[reach > 0.0]):
        rows = np.flatnonzero((near.parts == part) & known)
        asked = rows[reach[rows] > 0.0]
        place, other = within(near.x[rows], near.x[asked], reach[asked])
        result[asked] = largest_by(place, values[rows[other]], len(asked), -np.inf)
    return result


def _rival(near: NearStress, change: Array, above: float) -> float:
    """The largest that a stress may be that has changes (q,) where it may have a top, or a bound
    above which there is none: a top is no smaller than what is around it, as far as the changes
    tell."""
    change = np.nan_to_num(change) + near.grown
    most, least, own = near.values + change, near.values - change, slice(near.count, None)
    usable = (near.reach > 0.0) & (most > above)
    k = next(tops(near.x[own], most[own], near.reach[own], usable[own], least[own]), None)
    return above if k is None else float(most[own][k])


def _gains_nothing(solutions: Sequence[Evaluated], body: str, elements: Index) -> Mask:
    """Where (q,) elements (2, q) of a body have the nodes and the size of the coarser mesh; another
    path on the same meshes is not there to gain anything."""
    pairs = zip(*(each.meshes.values() for each in solutions), strict=True)
    refined = any(mesh is not before for mesh, before in pairs)
    meshes = (each.meshes[body] for each in solutions)
    (nodes, size), (before, size_before) = (
        (np.diff(mesh.first_node)[element], sizes(mesh)[element])
        for mesh, element in zip(meshes, elements, strict=True)
    )
    same = (elements.min(axis=0) >= 0) & (nodes <= before) & (size > 0.8 * size_before)
    return np.asarray(refined & same)


def _places(
    solution: Evaluated, number: Number, place: Array
) -> tuple[Array, Any, Array, int, Array]:
    """The places of `NearStress`, their parts, the spread, how many are the place and those beside
    it, and the reach."""
    mesh = solution.meshes[number.of]
    if not number.part:
        ways = INSIDE * float(np.linalg.norm(mesh.x - place, axis=1).min()) * np.eye(mesh.dim)
        x = np.asarray(place + np.vstack([0.0 * ways[:1], ways, -ways]))
        return x, np.full(len(x), ""), np.zeros(len(x)), len(x), np.zeros(len(x))
    end = end_of(solution, number)
    element, state = solution.boundary_state(number.of, end)
    parts = np.array(mesh.part_names)[mesh.part[element]]
    away, stress = np.linalg.norm(state.x - place, axis=1), getattr(state, stress_name(number))
    reach = np.full(len(stress), np.ptp(mesh.x, axis=0).max() * (number.beside is None))
    for each in singular_places(solution, end)[number.of]:
        r = each.away(state.x)
        reach = np.minimum(reach, np.where(r < RING * each.distance, 0.0, RIVAL * r))
    beside = np.where(parts == number.part, away, np.inf).argsort()[:BESIDE]
    rows = np.append(beside, np.arange(len(stress)))
    x, spread = np.vstack([place, state.x[rows]]), _spread(element, stress)[rows]
    parts, spread = np.append(number.part, parts[rows]), np.append(spread[0], spread)
    reach = np.append(np.zeros(1 + len(beside)), reach)
    return x, parts, spread, 1 + len(beside), reach


def _spread(element: Index, values: Array) -> Array:
    """How much values (n,) vary in their elements, (n,)."""
    count = int(element.max()) + 1
    most = largest_by(element, values, count, -np.inf)
    return np.asarray((most - smallest_by(element, values, count))[element])


def _stress_at(solution: Evaluated, number: Number, x: Array, parts: Any) -> tuple[Array, Index]:
    """The stress that a number is the largest of, at points inside, or on parts of the surface, and
    the elements there; nan and -1 off the body."""
    mesh, key = solution.meshes[number.of], stress_name(number)
    fields = solution.body_fields(number.of, end_of(solution, number))
    if not number.part:
        return np.asarray(getattr(fields.at(x, outside=np.nan), key)), np.full(len(x), -1)
    element, place = _feet(mesh, x, parts)
    on = element >= 0
    stress = getattr(fields.on_boundary(element[on], place[on]), key)
    return scattered(stress, on, len(x), np.nan), element


def _feet(mesh: BoundaryMesh, x: Array, parts: Any) -> tuple[Index, Array]:
    """The elements (q,) that hold points on parts (q,) of the surface, -1 off it, and the places on
    them."""
    rows = [np.flatnonzero(parts == part) for part in np.unique(parts)]
    hits = [located(mesh, x[some], str(parts[some[0]]), within=sizes(mesh)) for some in rows]
    element, place = (np.concatenate(each) for each in zip(*hits, strict=True))
    back = np.argsort(np.concatenate(rows))
    return element[back], place[back]
