"""The errors of the numbers of a solution.

Where the solution on the mesh before is at hand each number is compared as itself: what the two
differ by is the error of the one before. A maximum is off by as much as the function is wherever it
may be largest. Each element has the largest of the changes at its nodes, so that one node at which
the change has no sign says nothing. On one surface mesh the errors follow from the tails of the
tractions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..contact.friction_law import lengths
from ..contact.law_protocol import OPEN
from ..fields.boundary.places import located, sizes
from ..frozen import frozen
from ..refinement.levels import LEAST_GAIN, MOST_GAIN
from ..round_off import EPS
from .evaluated import Evaluated
from .numbers import Number, numbers_of, resultant, stress_name
from .peaks import FINEST, hill_reach
from .records import PairResult, StepResult
from .unbounded import Unbounded, corners_of, unbounded_places

FUNCTIONS: dict[str, Callable[[PairResult], Array]] = {
    "largest p": lambda pair: pair.pressure,
    "largest q": lambda pair: lengths(pair.sigma_t),
    "largest slip": lambda pair: lengths(pair.slip),
    "worn depth": lambda pair: np.zeros(1) if pair.wear is None else pair.wear.sum(axis=1),
}
"""Of a pair, at its nodes, whose maxima in contact are numbers."""
Key = tuple[str, str, int, int]
"""Of a number, as `Number.key`."""
BESIDE, INSIDE = 4, 0.2
"""Places at which a stress is compared on the boundary, the nearest that there are, and how far
apart they lie inside, over the distance to the boundary: stress varies no faster there."""


def with_errors(solution: Evaluated) -> list[Number]:
    """The numbers of a solution with their errors."""
    numbers = numbers_of(solution)
    if solution.coarser is not None:
        numbers = _compared(solution, numbers)
    elif not np.isnan(solution.accuracy.resultants):
        numbers = [_by_tails(solution, number) for number in numbers]
    by_path = path_errors(solution, numbers)
    return [number.known_to(number.error + by_path[number.key]) for number in numbers]


def path_errors(solution: Evaluated, numbers: Sequence[Number]) -> dict[Key, float]:
    """Return the errors of numbers that the increments of the path cause.

    An error is what a number differs by on other paths at the end of the same step. It is at least
    the error that the increments of the path itself show.
    """
    now, last = {number.key: number for number in numbers}, solution
    errors = dict.fromkeys(now, 0.0)
    for factor, other in solution.paths:
        there = {number.key: number for number in numbers_of(other, peaks=False)}
        ends = {(step.step, step.cycle) for step in other.steps}
        stresses = _stresses_near(last, [each for each in numbers if each.key[2:] in ends])
        for key, error in errors.items():
            number = now[key]
            if not np.isinf(number.error):
                change = np.nan
                if key[2:] in ends:
                    change = _path_change(last, other, number, there, stresses)
                errors[key] = error + factor * change
        now, last = now | there, other
    return {
        number.key: float(np.maximum(errors[number.key], _of_increments(number)))
        for number in numbers
    }


def _path_change(
    solution: Evaluated,
    other: Evaluated,
    number: Number,
    there: dict[Key, Number],
    stresses: dict[Key, _Stresses],
) -> float:
    """Return the difference of a number on another path.

    A maximum differs by the largest difference of its function.
    """
    if number.name not in FUNCTIONS or number.key not in there:
        return _change(solution, other, number, there.get(number.key), stresses)
    pairs = [_end(each, number).pairs[number.of] for each in (solution, other)]
    one, two = (FUNCTIONS[number.name](pair) for pair in pairs)
    return float(np.abs(one - two)[pairs[0].state != OPEN].max(initial=0.0))


def _compared(solution: Evaluated, numbers: Sequence[Number]) -> list[Number]:
    stresses = _stresses_near(solution, numbers)
    others = [
        (each, share, {number.key: number for number in numbers_of(each, peaks=False)})
        for each, share in _coarser(solution)
    ]
    single = len(others) == 1 and not solution.accuracy.estimates
    result = list[Number]()
    for number in numbers:
        error = number.error
        for other, share, there in others:
            old = there.get(number.key)
            error = np.fmax(error, share * _change(solution, other, number, old, stresses))
            if single and old is not None:
                apart = float(np.abs(number.value - old.value).max())
                error = np.fmax(error, apart / (LEAST_GAIN - 1.0))
        alone = number.alone - _of_increments(number)
        if number.name == "dissipated energy":
            # a product of what is known to this share in L2, where two meshes agree by chance
            alone = np.fmax(0.0, min(solution.accuracy.error, 1.0) * number.size)
        result.append(number.known_to(float(np.maximum(error, alone))))
    return _balanced(result)


def _balanced(numbers: Sequence[Number]) -> list[Number]:
    """Forces, and moments, at the end of a step balance one another: where one is off another one
    is, though two meshes may agree on it by chance. It is off by as much, or by the same share of
    all that acts."""
    others = dict[tuple[str, int, int], list[Number]]()
    for number in (each for each in numbers if each.is_resultant):
        others.setdefault((number.unit, *number.key[2:]), []).append(number)
    return [
        number.known_to(
            max(
                (
                    each.error * min(1.0, number.scale / each.scale)
                    for each in others[number.unit, *number.key[2:]]
                    if not np.isnan(each.error)
                ),
                default=number.error,
            )
        )
        if number.is_resultant
        else number
        for number in numbers
    ]


def _coarser(solution: Evaluated) -> Iterator[tuple[Evaluated, float]]:
    """The solutions on the two meshes before, and the error of this one over what it differs by
    from each, 1/(gain - 1).

    Panels are refined where errors are largest: neighbouring meshes have most of them in common,
    and no number gains more than the estimates do. Along curves each mesh is another one, and two
    may agree by chance: the two before say how much they gain at most.
    """
    gains, other = np.array([2.0, 1.0 + MOST_GAIN]), solution.coarser
    if len(estimates := np.array(solution.accuracy.estimates)) > 1:
        gains = estimates[-2:-4:-1] / max(estimates[-1], EPS)
    for gain in np.clip(gains, LEAST_GAIN, 1.0 + MOST_GAIN).tolist():
        if other is not None:
            yield other, 1.0 / (gain - 1.0)
            other = other.coarser


def _of_increments(number: Number) -> float:
    """What of `alone` lies between increments, where that is not between nodes."""
    return number.alone if number.name == "dissipated energy" else 0.0


def _change(
    solution: Evaluated,
    coarser: Evaluated,
    number: Number,
    before: Number | None,
    stresses: dict[Key, _Stresses],
) -> float:
    """Return the error of a number by its difference on two meshes."""
    if np.isinf(number.error):
        return number.error
    if stress_name(number):
        near = stresses.get(number.key)
        return 0.0 if near is None else _stress_change(solution, coarser, number, near)
    if before is None:
        return np.nan
    apart = float(np.abs(number.value - before.value).max())
    return max(apart, number.name in FUNCTIONS and _function_change(solution, coarser, number))


def _end(solution: Evaluated, number: Number) -> StepResult:
    """The last increment of the step that a number belongs to."""
    at = number.step, number.cycle
    return [step for step in solution.steps if (step.step, step.cycle) == at][-1]


def _function_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the error of a maximum of a function whose error is its change."""
    now, before = (
        FUNCTIONS[number.name](_end(each, number).pairs[number.of]) for each in (solution, coarser)
    )
    rows = _end(solution, number).pairs[number.of].state != OPEN
    body, part = solution.sides[number.of]
    nodes, mesh = solution.nodes[number.of][rows], solution.meshes[body]
    # at its place, too, which may lie between nodes
    assert number.place is not None
    x, now = np.vstack([mesh.x[nodes], number.place]), np.append(now[rows], number.value)
    change = np.abs(_carried(coarser, number.of, before, x) - now)
    if not np.isfinite(change).any():
        return float(now.max(initial=0.0))
    at = located(mesh, x[-1:], part, within=sizes(mesh))[0]
    return _of_maximum(now, np.nan_to_num(change), np.append(mesh.element[nodes], at))


def _carried(solution: Evaluated, name: str, values: Array, x: Array) -> Array:
    """Return values (m,) at the nodes of a pair at points of its secondary, NaN off it."""
    body, part = solution.sides[name]
    mesh = solution.meshes[body]
    element, place = located(mesh, x, part, within=sizes(mesh))
    whole, result = np.zeros(mesh.n_nodes), np.full(len(x), np.nan)
    whole[solution.nodes[name]] = values
    on_part = element >= 0
    result[on_part] = mesh.basis_at(element[on_part], place[on_part]) @ whole
    return result


def _of_maximum(values: Array, change: Array, element: Index) -> float:
    """Return the error of the maximum of values that have errors up to a change each."""
    _, row = np.unique(element, return_inverse=True)
    largest = np.zeros(int(row.max()) + 1)
    np.maximum.at(largest, row, change)
    top, off = float(values.max()), largest[row]
    least, most = float((values - off).max()), float((values + off)[values > 0.0].max(initial=top))
    return max(most - top, top - least)


@frozen
class _Stresses:
    """A largest stress and the stress around it.

    Attributes
    ----------
    x, parts : (q, d), (q,) arrays
        The place, places beside it, and those of the surface at which the stress is more than half
        as large and has a bound; and their parts, empty inside the body.
    values : (q,) array
        The stress there [stress].
    count : int
        How many are the place and those beside it.
    at_corner : bool
        Whether the place is a corner.
    """

    x: Array
    parts: Any
    values: Array
    count: int
    at_corner: bool


def _stresses_near(solution: Evaluated, numbers: Sequence[Number]) -> dict[Key, _Stresses]:
    """Return the stress around each largest stress that has a place."""
    stresses, unbounded = (
        dict[Key, _Stresses](),
        dict[tuple[int, int], dict[str, list[Unbounded]]](),
    )
    for number in numbers:
        place = number.place if stress_name(number) and number.size != 0.0 else None
        if place is None or np.isinf(number.error):
            continue
        end = _end(solution, number)
        if (at := (end.step, end.cycle)) not in unbounded:
            unbounded[at] = unbounded_places(solution, end)
        x, parts, count = _places(solution, number, unbounded[at][number.of])
        mesh = solution.meshes[number.of]
        corners = corners_of(mesh)
        away = np.linalg.norm(corners.x - place, axis=1)
        at_corner = (away < FINEST * sizes(mesh)[corners.element[:, 0]]).any()
        values = _stress_at(solution, number, x, parts)
        stresses[number.key] = _Stresses(x, parts, values, count, bool(number.part and at_corner))
    return stresses


def _stress_change(
    solution: Evaluated, coarser: Evaluated, number: Number, near: _Stresses
) -> float:
    """Return the error of a largest stress: its change at its place, around it and elsewhere.

    At a corner the stress may go on changing as slowly as it does in the last element. In an
    element that both meshes have, it has the relative error of the solution.
    """
    now, count = near.values, near.count
    change = np.abs(now - _stress_at(coarser, number, near.x, near.parts))
    if np.isnan(change[:count]).all():
        return np.nan
    rivals = np.nan_to_num(now + change, nan=-np.inf)[count:]
    off = max(np.nanmax(change[:count]), rivals.max(initial=-np.inf) - float(number.value[0]))
    if near.at_corner:
        off = max(off, np.ptp(now[:count]))
    if number.part:
        (nodes, size), (before, size_before) = (
            _element_at(each, number) for each in (solution, coarser)
        )
        # Where the element gains nothing on the other mesh, the difference tells no error: both
        # owe it to the same data, or to panels that were not refined.
        if nodes <= before and size > 0.8 * size_before:
            off = np.fmax(off, solution.accuracy.error * number.size)
    return float(off)


def _element_at(solution: Evaluated, number: Number) -> tuple[int, float]:
    """The number of nodes and the size of the element that holds the place of a number."""
    mesh, place = solution.meshes[number.of], number.place
    assert place is not None, "largest stresses lie somewhere"
    (element,), _ = located(mesh, place[None], number.part, within=sizes(mesh))
    return int(np.diff(mesh.first_node)[element]), float(sizes(mesh)[element])


def _places(
    solution: Evaluated, number: Number, unbounded: Sequence[Unbounded]
) -> tuple[Array, Any, int]:
    """The places of `_Stresses`, their parts, and how many are the place and those beside it."""
    mesh, place = solution.meshes[number.of], number.place
    assert place is not None, "largest stresses lie somewhere"
    if not number.part:
        reach = INSIDE * float(np.linalg.norm(mesh.x - place, axis=1).min())
        ways = np.eye(mesh.dim)
        x = np.asarray(place + reach * np.vstack([0.0 * ways[:1], ways, -ways]))
        return x, np.full(len(x), ""), len(x)
    element, state = solution.boundary_state(number.of, _end(solution, number))
    parts = np.array(mesh.part_names)[mesh.part[element]]
    away = np.linalg.norm(state.x - place, axis=1)
    rival = 2.0 * getattr(state, stress_name(number)) > number.value[0]
    for each in unbounded:
        rival &= np.linalg.norm(state.x - each.x, axis=1) > hill_reach(mesh)
        rival &= ~np.isin(element, each.elements)
    beside = np.where(parts == number.part, away, np.inf).argsort()[:BESIDE]
    rows = np.append(beside, np.flatnonzero(rival))
    return np.vstack([place, state.x[rows]]), np.append(number.part, parts[rows]), 1 + len(beside)


def _stress_at(solution: Evaluated, number: Number, x: Array, parts: Any) -> Array:
    """The stress that a number is the largest of, at points inside, or on parts of the surface; nan
    off the body."""
    mesh, key = solution.meshes[number.of], stress_name(number)
    fields = solution.body_fields(number.of, _end(solution, number))
    if not number.part:
        return np.asarray(getattr(fields.at(x, outside=np.nan), key))
    stress = np.full(len(x), np.nan)
    for part in np.unique(parts).tolist():
        rows = np.flatnonzero(parts == part)
        element, place = located(mesh, x[rows], part, within=sizes(mesh))
        on = element >= 0
        stress[rows[on]] = getattr(fields.on_boundary(element[on], place[on]), key)
    return stress


def _by_tails(solution: Evaluated, number: Number) -> Number:
    """Return a number with its error on one surface mesh."""
    if np.isinf(number.error):
        return number
    accuracy = solution.accuracy
    pairs = _end(solution, number).pairs
    pair = pairs.get(number.of)
    size = number.size
    if number.unit in ("force", "moment", "rad") or number.name == "moved":
        error = accuracy.resultants * _acting(pairs, number)
    elif number.name == "largest p" and pair is not None and pair.pressure_error is not None:
        mesh = solution.meshes[solution.sides[number.of][0]]
        element = mesh.element[solution.nodes[number.of]]
        error = _of_maximum(pair.pressure, pair.pressure_error, element)
        error = max(error, accuracy.error * size)
    else:
        error = number.alone - _of_increments(number) + accuracy.error * size
    return number.known_to(error)


def _acting(pairs: dict[str, PairResult], number: Number) -> float:
    """Return the sum of all that acts on the pairs of a number, or its size if that is larger."""
    acting = [pairs[number.of]] if number.of in pairs else list(pairs.values())
    force, moment = np.sum([(0.0, 0.0), *map(resultant, acting)], axis=0).tolist()
    return float(max({"force": force, "moment": moment}.get(number.unit, 0.0), number.size))
