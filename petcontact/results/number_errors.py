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
from .evaluated import Evaluated
from .numbers import Number, numbers_of, resultant, stress_name
from .records import PairResult, StepResult

FUNCTIONS: dict[str, Callable[[PairResult], Array]] = {
    "largest p": lambda pair: pair.pressure,
    "largest slip": lambda pair: lengths(pair.slip),
    "worn depth": lambda pair: np.zeros(1) if pair.wear is None else pair.wear.sum(axis=1),
}
"""Of a pair, at its nodes, whose maxima in contact are numbers."""


def with_errors(solution: Evaluated, coarser: Evaluated | None) -> list[Number]:
    """The numbers of a solution with their errors; `coarser` is the solution on another mesh."""
    numbers = numbers_of(solution)
    if coarser is not None:
        return _compared(solution, coarser, numbers)
    if not np.isnan(solution.accuracy.resultants):
        return [_by_tails(solution, number) for number in numbers]
    return numbers


def _compared(
    solution: Evaluated, coarser: Evaluated, numbers: Sequence[Number]
) -> list[Number]:
    before = {number.key: number for number in numbers_of(coarser, peaks=False)}
    return [
        number.known_to(_change(solution, coarser, number, before.get(number.key)))
        for number in numbers
    ]


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
    if number.name in FUNCTIONS:
        return _function_change(solution, coarser, number)
    apart = float(np.abs(number.value - before.value).max())
    # increments leave an error of energies, too
    return max(apart, number.alone) if number.name == "dissipated energy" else apart


def _end(solution: Evaluated, number: Number) -> StepResult:
    """The last increment of the step that a number belongs to."""
    at = number.step, number.cycle
    return [step for step in solution.steps if (step.step, step.cycle) == at][-1]


def _function_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """By how much a maximum may be off where the function is off by what it changes by."""
    body, part = solution.sides[number.of]
    mesh, old = solution.meshes[body], coarser.meshes[body]
    pairs = [_end(each, number).pairs[number.of] for each in (solution, coarser)]
    rows = pairs[0].state != OPEN
    nodes = solution.nodes[number.of][rows]
    now, before = (FUNCTIONS[number.name](pair) for pair in pairs)
    element, place = located(old, mesh.x[nodes], part, within=sizes(old))
    found = element >= 0
    if not found.any():
        return float(now.max(initial=0.0))
    whole = np.zeros(old.n_nodes)
    whole[coarser.nodes[number.of]] = before
    change = np.zeros(len(nodes))
    change[found] = np.abs(old.basis_at(element[found], place[found]) @ whole - now[rows][found])
    return _of_maximum(now[rows], change, mesh.element[nodes])


def _of_maximum(values: Array, change: Array, element: Index) -> float:
    """How far the maximum of values may be off that are off by up to a change each."""
    _, row = np.unique(element, return_inverse=True)
    largest = np.zeros(int(row.max()) + 1)
    np.maximum.at(largest, row, change)
    top, off = float(values.max()), largest[row]
    return max(
        float((values + off)[values > 0.0].max(initial=top)) - top,
        top - float((values - off).max()),
    )


def _stress_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """What a largest stress changes by where it lies and around it."""
    if number.place is None or number.size == 0.0:
        return 0.0
    steps = [_end(each, number) for each in (solution, coarser)]
    states = []
    mesh = solution.meshes[number.of]
    if number.part:
        element, state = solution.boundary_state(number.of, steps[0])
        mine = np.flatnonzero(mesh.part[element] == mesh.part_names.index(number.part))
        near = mine[np.linalg.norm(state.x[mine] - number.place, axis=1).argsort()[:4]]
        x = state.x[near]
    else:
        d = mesh.dim
        reach = 0.2 * float(np.linalg.norm(mesh.x - number.place, axis=1).min())
        x = number.place + reach * np.vstack([np.zeros(d), np.eye(d), -np.eye(d)])
    for each, step in zip((solution, coarser), steps, strict=True):
        fields, own = each.body_fields(number.of, step), each.meshes[number.of]
        if number.part:
            element, place = located(own, x, number.part, within=sizes(own))
            if np.any(element < 0):
                return np.nan
            states.append(fields.on_boundary(element, place))
        else:
            states.append(fields.at(x, outside=np.nan))
    one, other = (getattr(state, stress_name(number)) for state in states)
    return float(np.abs(one - other).max())


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
        error = number.alone + accuracy.error * size
    return number.known_to(error)


def _acting(pairs: dict[str, PairResult], number: Number) -> float:
    """All that acts on the pairs of a number, or its size where that is larger."""
    mine = [pairs[number.of]] if number.of in pairs else list(pairs.values())
    force, moment = np.sum([(0.0, 0.0), *map(resultant, mine)], axis=0).tolist()
    return max({"force": force, "moment": moment}.get(number.unit, 0.0), number.size)
