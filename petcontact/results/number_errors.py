"""The errors of the numbers of a solution.

Where the solution on the mesh before is at hand each number is compared as itself: what the two
differ by is the error of the one before. A maximum is off by as much as the function is wherever it
may be largest. Each element has the largest of the changes at its nodes, so that one node at which
the change has no sign says nothing. On one surface mesh the errors follow from the tails of the
tractions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..arrays import Array, Index
from ..contact.friction_law import lengths
from ..contact.law_protocol import OPEN
from ..fields.boundary.places import located, sizes
from ..refinement.levels import LEAST_GAIN, MOST_GAIN
from ..round_off import SINGLE
from .evaluated import Evaluated
from .numbers import Number, numbers_of, resultant, stress_name
from .records import PairResult, StepResult
from .unbounded import corners_of

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


def with_errors(solution: Evaluated, coarser: Evaluated | None) -> list[Number]:
    """The numbers of a solution with their errors; `coarser` is the solution on another mesh."""
    numbers = numbers_of(solution)
    if coarser is not None:
        numbers = _compared(solution, coarser, numbers)
    elif not np.isnan(solution.accuracy.resultants):
        numbers = [_by_tails(solution, number) for number in numbers]
    by_path = path_errors(solution, numbers)
    return [number.known_to(number.error + by_path[number.key]) for number in numbers]


def path_errors(solution: Evaluated, numbers: Sequence[Number]) -> dict[Key, float]:
    """How far numbers of a solution may be off by its increments: what they differ by on other
    paths, step end by step end, and at least what their increments leave by themselves."""
    now, last = {number.key: number for number in numbers}, solution
    errors = dict.fromkeys(now, 0.0)
    for factor, other in solution.paths:
        there = {number.key: number for number in numbers_of(other, peaks=False)}
        ends = {(step.step, step.cycle) for step in other.steps}
        for key, error in errors.items():
            number = now[key]
            if not np.isinf(number.error):
                change = np.nan if key[2:] not in ends else _path_change(last, other, number, there)
                errors[key] = error + factor * change
        now, last = now | there, other
    return {
        number.key: float(np.maximum(errors[number.key], _of_increments(number)))
        for number in numbers
    }


def _path_change(
    solution: Evaluated, other: Evaluated, number: Number, there: dict[Key, Number]
) -> float:
    """What a number differs by on another path; a maximum by what its function does anywhere."""
    if number.name not in FUNCTIONS or number.key not in there:
        return _change(solution, other, number, there.get(number.key))
    pairs = [_end(each, number).pairs[number.of] for each in (solution, other)]
    one, two = (FUNCTIONS[number.name](pair) for pair in pairs)
    return float(np.abs(one - two)[pairs[0].state != OPEN].max(initial=0.0))


def _compared(solution: Evaluated, coarser: Evaluated, numbers: Sequence[Number]) -> list[Number]:
    before = {number.key: number for number in numbers_of(coarser, peaks=False)}
    # two meshes may agree by chance: what the two before differ by says how much they gain at most
    earlier = numbers_of(coarser.coarser, peaks=False) if coarser.coarser is not None else []
    last_but_one = {number.key: number.value for number in earlier}
    found = list[Number]()
    for number in numbers:
        old = before.get(number.key)
        alone = number.alone - _of_increments(number)
        error = max(_change(solution, coarser, number, old), alone)
        if old is not None:
            one, other, share = old.value, last_but_one.get(number.key), 1.0 / MOST_GAIN
            if other is None:
                one, other, share = number.value, old.value, 1.0 / (LEAST_GAIN - 1.0)
            error = max(error, share * float(np.abs(one - other).max()))
        found.append(number.known_to(error))
    return found


def _of_increments(number: Number) -> float:
    """What of `alone` lies between increments, where that is not between nodes."""
    return number.alone if number.name == "dissipated energy" else 0.0


def _change(
    solution: Evaluated, coarser: Evaluated, number: Number, before: Number | None
) -> float:
    """How far a number may be off, by what two meshes differ by."""
    if np.isinf(number.error):
        return number.error
    if stress_name(number):
        return _stress_change(solution, coarser, number)
    if before is None:
        return np.nan
    apart = float(np.abs(number.value - before.value).max())
    return max(apart, number.name in FUNCTIONS and _function_change(solution, coarser, number))


def _end(solution: Evaluated, number: Number) -> StepResult:
    """The last increment of the step that a number belongs to."""
    at = number.step, number.cycle
    return [step for step in solution.steps if (step.step, step.cycle) == at][-1]


def _function_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """By how much a maximum may be off where the function is off by what it changes by."""
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
    """Values (m,) at the nodes of a pair to values at points of its secondary; nan off it."""
    body, part = solution.sides[name]
    mesh = solution.meshes[body]
    element, place = located(mesh, x, part, within=sizes(mesh))
    whole, result = np.zeros(mesh.n_nodes), np.full(len(x), np.nan)
    whole[solution.nodes[name]] = values
    found = element >= 0
    result[found] = mesh.basis_at(element[found], place[found]) @ whole
    return result


def _of_maximum(values: Array, change: Array, element: Index) -> float:
    """How far the maximum of values may be off that are off by up to a change each."""
    _, row = np.unique(element, return_inverse=True)
    largest = np.zeros(int(row.max()) + 1)
    np.maximum.at(largest, row, change)
    top, off = float(values.max()), largest[row]
    least, most = float((values - off).max()), float((values + off)[values > 0.0].max(initial=top))
    return max(most - top, top - least)


def _stress_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """What a largest stress changes by where it lies and around it. At a corner it may go on
    changing as slowly as it does in the last element on either mesh."""
    if number.place is None or number.size == 0.0:
        return 0.0
    x, change = _around(solution, number), np.nan
    meshes = [solution, coarser, *filter(None, [coarser.coarser])]
    stress = [_stress_at(each, number, x) for each in meshes]
    for one, other, gain in zip(stress, stress[1:], (1.0, MOST_GAIN), strict=False):
        change = np.fmax(change, np.nan_to_num(np.abs(one - other), nan=-1.0).max() / gain)
    mesh = solution.meshes[number.of]
    if number.part and np.linalg.norm(corners_of(mesh).x - x[0], axis=1).min() < SINGLE * np.ptp(
        mesh.x
    ):
        change = np.fmax(change, np.ptp(stress[0]))
    return float(change) if change >= 0.0 else np.nan


def _around(solution: Evaluated, number: Number) -> Array:
    """The place of a largest stress and places beside it, on its part or inside."""
    mesh, place = solution.meshes[number.of], number.place
    assert place is not None, "largest stresses lie somewhere"
    if number.part:
        element, state = solution.boundary_state(number.of, _end(solution, number))
        mine = state.x[mesh.part[element] == mesh.part_names.index(number.part)]
        beside = mine[np.linalg.norm(mine - place, axis=1).argsort()[:BESIDE]]
        return np.vstack([place, beside])
    reach = INSIDE * float(np.linalg.norm(mesh.x - place, axis=1).min())
    ways = np.eye(mesh.dim)
    return np.asarray(place + reach * np.vstack([0.0 * ways[:1], ways, -ways]))


def _stress_at(solution: Evaluated, number: Number, x: Array) -> Array:
    """The stress that a number is the largest of, at points; nan off the body."""
    mesh = solution.meshes[number.of]
    fields = solution.body_fields(number.of, _end(solution, number))
    if not number.part:
        state = fields.at(x, outside=np.nan)
    else:
        element, place = located(mesh, x, number.part, within=sizes(mesh))
        if np.any(element < 0):
            return np.full(len(x), np.nan)
        state = fields.on_boundary(element, place)
    return np.asarray(getattr(state, stress_name(number)))


def _by_tails(solution: Evaluated, number: Number) -> Number:
    """The error on one surface mesh."""
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
    """All that acts on the pairs of a number, or its size where that is larger."""
    mine = [pairs[number.of]] if number.of in pairs else list(pairs.values())
    force, moment = np.sum([(0.0, 0.0), *map(resultant, mine)], axis=0).tolist()
    return float(max({"force": force, "moment": moment}.get(number.unit, 0.0), number.size))
