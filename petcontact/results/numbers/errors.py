"""The errors of the numbers of a solution.

Where the solution on the mesh before is at hand each number is compared as itself: what the two
differ by is the error of the one before. A maximum is off by as much as the function is wherever it
may be largest. Each element has the largest of the changes at its nodes, so that one node at which
the change has no sign says nothing. On one surface mesh the errors follow from the tails of the
tractions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array, Index, Mask
from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN, SLIP
from ...fields.boundary.places import located, sizes
from ...linalg.nearest import within
from ...refinement.levels import LEAST_GAIN, MOST_GAIN
from ...round_off import CHAINED, EPS
from ..contact_zones import in_doubt
from ..evaluated import Evaluated, displacement_scale
from ..records import PairResult
from ..strength.singular_places import singular_places
from ..strength.strengths import beside
from .balance import balanced
from .number import DISPLACEMENT, ENERGY, Key, Number
from .peaks import stress_name
from .printed import end_of, numbers_of, resultant
from .stress_errors import NearStress, stress_change, stresses_near

FUNCTIONS: dict[str, Callable[[PairResult], Array]] = {
    "largest p": lambda pair: pair.pressure,
    "largest q": lambda pair: lengths(pair.sigma_t),
    "largest slip": lambda pair: lengths(pair.slip),
    "worn depth": lambda pair: np.zeros(1) if pair.wear is None else pair.wear.sum(axis=1),
}
"""Of a pair, at its nodes, whose maxima in contact are numbers."""
STATES: dict[str, Callable[[PairResult], Mask]] = {
    "contact area": lambda pair: np.asarray(pair.state != OPEN),
    "slipping": lambda pair: np.asarray(pair.state == SLIP),
}
"""Of a pair, at its nodes: whether they are in the area of that name."""


def with_errors(solution: Evaluated) -> list[Number]:
    """The numbers of a solution with their errors."""
    numbers = numbers_of(solution)
    if solution.coarser is not None:
        numbers = _of_meshes(solution, numbers)
    elif not np.isnan(solution.accuracy.resultants):
        numbers = [_by_tails(solution, number) for number in numbers]
    by_path = path_errors(solution, numbers)
    return [number.known_to(number.error + by_path[number.key]) for number in numbers]


def path_errors(solution: Evaluated, numbers: Sequence[Number]) -> dict[Key, float]:
    """Return the errors of numbers that the increments of the path cause.

    An error is what a number differs by on other paths at the end of the same step. It is at least
    the error that the increments of the path itself show.
    """
    last = solution.tracked or solution
    errors = {number.key: 0.0 for number in numbers if not np.isinf(number.error)}
    now = {number.key: number for number in numbers}
    now |= {} if last is solution else _by_key(last)
    for other in last.paths:
        there = _by_key(other)
        ends = {(step.step, step.cycle) for step in other.steps}
        stresses = stresses_near(last, [each for each in numbers if each.key[2:] in ends])
        # errors fall like √h of the increments h at least; of two increments one is made
        left = 1.0 / (max(2.0, len(last.steps) / len(other.steps)) ** 0.5 - 1.0)
        for key in errors:
            here = key[2:] in ends
            change = _path_change(last, other, now[key], there, stresses) if here else np.nan
            errors[key] += left * change
        now, last = now | there, other
    return {
        number.key: float(np.maximum(errors.get(number.key, 0.0), _of_increments(number)))
        for number in numbers
    }


def _path_change(
    solution: Evaluated,
    other: Evaluated,
    number: Number,
    there: dict[Key, Number],
    stresses: dict[Key, NearStress],
) -> float:
    """Return the difference of a number on another path.

    A maximum differs by the largest difference of its function, and an area by at least that of the
    nodes whose state differs. Where tractions are the same, states that differ are ties.
    """
    name, least = number.name, 0.0
    if number.key in there and name in {*FUNCTIONS, *STATES}:
        one, two = (end_of(each, number).pairs[number.of] for each in (solution, other))
        if name in FUNCTIONS:
            first, second = (FUNCTIONS[name](pair) for pair in (one, two))
            rows = _counted(solution, number)
            return float(np.abs(first - second)[rows].max(initial=0.0))
        apart = lengths(one.sigma_t - two.sigma_t) + np.abs(one.pressure - two.pressure)
        if apart.max(initial=0.0) <= CHAINED * one.size.max(initial=0.0):
            return 0.0
        least = float(one.weight @ (STATES[name](one) != STATES[name](two)))
    change = _change(solution, other, number, there.get(number.key), stresses)
    return float(np.maximum(least, change))


def _of_meshes(solution: Evaluated, numbers: Sequence[Number]) -> list[Number]:
    """Return numbers with the errors of their mesh, which solutions with equal increments show."""
    alike = solution.undivided
    if alike is None:
        return _compared(solution, numbers)
    there = {number.key: number for number in numbers_of(alike, peaks=False)}
    own = [replace(there.get(number.key, number), error=number.error) for number in numbers]
    known = zip(numbers, _compared(alike, own), strict=True)
    return [
        number.known_to(float(np.maximum(other.error, number.alone - _of_increments(number))))
        for number, other in known
    ]


def _compared(solution: Evaluated, numbers: Sequence[Number]) -> list[Number]:
    stresses = stresses_near(solution, numbers)
    others = [(each, gain, _by_key(each)) for each, gain in _coarser(solution)]
    result = list[Number]()
    for number in numbers:
        error, before = number.error, others[0][2].get(number.key)
        power = _power(solution, number) if solution.accuracy.estimates else 1.0
        for other, gain, there in others:
            change = _change(solution, other, number, there.get(number.key), stresses)
            error = np.fmax(error, change / (max(gain**power, LEAST_GAIN) - 1.0))
        counted = (
            number.is_resultant or not np.isnan(number.exponent) or _at_singular(solution, number)
        )
        if counted and before is not None and not solution.accuracy.estimates:
            apart = float(np.abs(number.value - before.value).max())
            error = np.fmax(error, apart / (LEAST_GAIN - 1.0))
        if not np.isnan(number.exponent) and np.isnan(error):
            error = number.size  # the other mesh is too coarse for a K
        error += _shared(solution, number)
        # what the increments of an energy leave is an error of the path
        alone = _of_slip(solution, number) if number.name == ENERGY else number.alone
        # the fit of a K is off besides what the mesh is off
        error = np.maximum(error, alone) if np.isnan(number.exponent) else np.hypot(error, alone)
        result.append(number.known_to(float(error)))
    return balanced(result, supports=solution.problem.kind == "bilateral")


def _by_key(other: Evaluated) -> dict[Key, Number]:
    """The numbers of another mesh or path, with which those of a solution are compared."""
    return {each.key: each for each in numbers_of(other, peaks=False, compared=True)}


def _shared(solution: Evaluated, number: Number) -> float:
    """Return the error that meshes share, which their difference does not show."""
    size = number.scale if number.is_resultant else number.size
    counts = np.isfinite(size) and number.error != 0.0
    return solution.accuracy.shared * size if counts else 0.0


def _power(solution: Evaluated, number: Number) -> float:
    """Return the power of an error in L2 that is the error of a number on panels.

    By an edge of contact or of stick it is 1/2: tractions are like √s there, and their largest
    error falls like the root of that in L2. A maximum lies there if nodes of two states are within
    twice the size of its element.
    """
    side = solution.sides.get(number.of, (number.of, number.part))
    if number.place is None or not side[1] or np.isinf(number.error):
        return 1.0
    mesh, place = solution.meshes[side[0]], number.place[None]
    reach = 2.0 * sizes(mesh)[located(mesh, place, side[1], within=sizes(mesh))[0]]
    states = (
        set(pair.state[within(pair.x, place, reach)[1]])
        for pair in end_of(solution, number).pairs.values()
    )
    return 0.5 if any(len(each) > 1 for each in states) else 1.0


def _at_singular(solution: Evaluated, number: Number) -> bool:
    """Return whether a slip or a depth is largest at tractions without a bound: its error falls as
    slowly there as that of a force."""
    place = number.place if number.name in FUNCTIONS and number.unit != "stress" else None
    if place is None or not number.size:
        return False
    (body, part), end = solution.sides[number.of], end_of(solution, number)
    mesh = solution.meshes[body]
    element = located(mesh, place[None], part, within=sizes(mesh))[0][0]
    return any(element in each.elements for each in singular_places(solution, end)[body])


def _of_slip(solution: Evaluated, number: Number) -> float:
    """Return the error of an energy by that of p and q, or of u_t, in L2, where two meshes agree by
    chance.

    By Cauchy and Schwarz slip that is wrong by a norm takes up to the product of that and the norm
    of the shear.
    """
    pair = end_of(solution, number).pairs[number.of]
    most = number.size
    if solution.problem.kind == "bilateral":
        slips = pair.state == SLIP
        shear = np.sqrt(pair.weight[slips] @ np.sum(pair.sigma_t[slips] ** 2, axis=1))
        most = max(most, float(shear) * displacement_scale(solution))
    return float(np.fmax(0.0, min(solution.accuracy.error, 1.0) * most))


def _coarser(solution: Evaluated) -> Iterator[tuple[Evaluated, float]]:
    """The solutions on the two meshes before, and their errors over that of this one, the gain: it
    is off by 1/(gain - 1) times what it differs by from each.

    Panels are refined where errors are largest: neighbouring meshes have most of them in common,
    and no number gains more than the estimates do. Along curves each mesh is another one, and two
    may agree by chance: the two before say how much they gain at most. Away from corners errors
    fall with twice the power of a force there; beside a mesh that a user gave there is one other
    one, and nothing says that they do.
    """
    most, other = 1.0 + MOST_GAIN, solution.coarser
    alone = other is None or other.coarser is None
    gains = np.array([LEAST_GAIN if alone else LEAST_GAIN**2, most])
    if len(estimates := np.array(solution.accuracy.estimates)) > 1:
        gains = estimates[-2:-4:-1] / max(estimates[-1], EPS)
    for gain in np.clip(gains, LEAST_GAIN, most).tolist():
        if other is not None:
            yield other, gain
            other = other.coarser


def _of_increments(number: Number) -> float:
    """What of `alone` lies between increments, where that is not between nodes."""
    return number.alone if number.name == ENERGY else 0.0


def _change(
    solution: Evaluated,
    coarser: Evaluated,
    number: Number,
    before: Number | None,
    stresses: dict[Key, NearStress],
) -> float:
    """Return the error of a number by its difference on two meshes."""
    if np.isinf(number.error):
        return number.error
    if stress_name(number):
        near = stresses.get(number.key)
        return 0.0 if near is None else stress_change(solution, coarser, number, near)
    if before is None:
        return np.nan
    apart = float(np.abs(number.value - before.value).max())
    if number.name == DISPLACEMENT:
        return max(apart, _displacement_change(solution, coarser, number))
    if number.name in STATES:
        return max(apart, _in_doubt(solution, coarser, number))
    return max(apart, number.name in FUNCTIONS and _function_change(solution, coarser, number))


def _in_doubt(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the area of a pair that may be open, though its nodes are closed."""
    opens = (side.name for side in solution.posed.interfaces if side.law.normal == "unilateral")
    if number.of not in opens:
        return 0.0
    pair, before = (end_of(each, number).pairs[number.of] for each in (solution, coarser))
    mesh, nodes = solution.meshes[solution.sides[number.of][0]], solution.nodes[number.of]
    change = np.abs(_carried(coarser, number.of, before.pressure, mesh.x[nodes]) - pair.pressure)
    return in_doubt(mesh, nodes, pair, STATES[number.name](pair), np.nan_to_num(change))


def _displacement_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the error of a largest displacement by the change of u at the nodes of its body."""
    mesh, other = (each.meshes[number.of] for each in (solution, coarser))
    now, before = (end_of(each, number).bodies[number.of].u for each in (solution, coarser))
    element, place = located(other, mesh.x, within=sizes(other))
    rows = np.flatnonzero(element >= 0)
    if not len(rows):
        return 0.0
    change = np.linalg.norm(other.basis_at(element[rows], place[rows]) @ before - now[rows], axis=1)
    return _of_maximum(np.linalg.norm(now[rows], axis=1), change, mesh.element[rows])


def _function_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the error of a maximum of a function whose error is its change."""
    now, before = (
        FUNCTIONS[number.name](end_of(each, number).pairs[number.of])
        for each in (solution, coarser)
    )
    rows = _counted(solution, number)
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


def _counted(solution: Evaluated, number: Number) -> Mask:
    """The nodes of a pair whose values count for a maximum: those that are closed, tractions but
    beside places without a bound."""
    end = end_of(solution, number)
    pair = end.pairs[number.of]
    closed: Mask = np.asarray(pair.state != OPEN)
    key = {"largest p": "pressure", "largest q": "shear"}.get(number.name)
    if key is None:
        return closed
    values = FUNCTIONS[number.name](pair) * closed
    return np.asarray(closed & ~beside(solution, end, number.of, key, values).hidden)


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


def _by_tails(solution: Evaluated, number: Number) -> Number:
    """Return a number with its error on one surface mesh."""
    if not np.isnan(number.error):
        return number
    accuracy = solution.accuracy
    pairs = end_of(solution, number).pairs
    pair = pairs.get(number.of)
    size = number.size
    if number.is_resultant or number.unit == "rad" or number.name == "moved":
        error = accuracy.resultants * _acting(pairs, number)
    elif number.name == "largest p" and pair is not None and pair.pressure_error is not None:
        mesh = solution.meshes[solution.sides[number.of][0]]
        element = mesh.element[solution.nodes[number.of]]
        error = _of_maximum(pair.pressure, pair.pressure_error, element)
        error = max(error, accuracy.error * size)
    else:
        share = accuracy.error ** _power(solution, number)
        error = number.alone - _of_increments(number) + share * size
    return number.known_to(error)


def _acting(pairs: dict[str, PairResult], number: Number) -> float:
    """Return the sum of all that acts on the pairs of a number, or its size if that is larger."""
    acting = [pairs[number.of]] if number.of in pairs else list(pairs.values())
    force, moment = np.sum([(0.0, 0.0), *map(resultant, acting)], axis=0).tolist()
    return float(max({"force": force, "moment": moment}.get(number.unit, 0.0), number.size))
