"""The errors of the numbers of a solution.

Where the solution on the mesh before is at hand each number is compared as itself: what the two
differ by is the error of the one before. A maximum is off by as much as the function is wherever it
may be largest. Each element has the largest of the changes at its nodes, so that one node at which
the change has no sign says nothing. On one surface mesh the errors follow from the tails of the
tractions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...contact.law_protocol import SLIP
from ...fields.boundary.places import located, sizes
from ...refinement.levels import LEAST_GAIN, MOST_GAIN
from ...round_off import EPS
from ..evaluated import Evaluated, displacement_scale
from ..records import SLIDING_WITHIN, PairResult
from ..strength.singular_places import singular_places
from .balance import balanced
from .changes import FUNCTIONS, STATES, change_of, error_of_maximum, tail_of_shared
from .number import ENERGY, Key, Number
from .path_errors import of_increments, path_errors
from .peaks import stress_name
from .printed import End, by_key, end_of, numbers_of, resultant
from .stress_errors import Left, at_edges, stresses_near, unseen

AT_EDGE = 0.5
"""Power of an error in L2 that is the largest error by an edge of contact or of stick [-]."""


def with_errors(solution: Evaluated) -> list[Number]:
    """The numbers of a solution with their errors."""
    numbers = numbers_of(solution)
    if solution.coarser is not None:
        numbers = _of_meshes(solution, numbers)
    elif not np.isnan(solution.accuracy.resultants):
        numbers = [_by_tails(solution, number) for number in numbers]
    by_path = path_errors(solution, numbers)
    known = [number.known_to(number.error + by_path[number.key]) for number in numbers]
    return [*_all_of_what_slides(solution, known)]


def _all_of_what_slides(solution: Evaluated, numbers: Sequence[Number]) -> Iterator[Number]:
    """Yield numbers of which what slips at the end of a step that sliding ends is what touches:
    each mesh and each path has all of it in slip there, but for what the search leaves.

    Resultants there are off by the share of the load to which the search finds it.
    """
    groups = {side.name: side.group for side in solution.posed.interfaces}
    touching = {number.key[1:]: number for number in numbers if number.name == "contact area"}
    for number in numbers:
        if number.is_resultant and end_of(solution, number).sliding:
            yield number.known_to(number.error + SLIDING_WITHIN * number.size)
        elif number.name == "slipping" and end_of(solution, number).sliding == groups[number.of]:
            yield replace(touching[number.key[1:]], name=number.name)
        else:
            yield number


def _of_meshes(solution: Evaluated, numbers: Sequence[Number]) -> list[Number]:
    """Return numbers with the errors of their mesh, which solutions with equal increments show."""
    alike = solution.undivided
    if alike is None:
        return _compared(solution, numbers)
    there = {number.key: number for number in numbers_of(alike, peaks=False)}
    own = [replace(there.get(number.key, number), error=number.error) for number in numbers]
    known = zip(numbers, _compared(alike, own), strict=True)
    return [
        number.known_to(float(np.maximum(other.error, number.alone - of_increments(number))))
        for number, other in known
    ]


def _compared(solution: Evaluated, numbers: Sequence[Number]) -> list[Number]:
    stresses = stresses_near(solution, numbers)
    others, result = [*_others(solution, numbers)], list[Number]()
    for number in numbers:
        error, before = number.error, others[0][2].get(number.key)
        power = _power(solution, number) if solution.accuracy.estimates else 1.0
        for other, gain, there, moved in others:
            left = _left(gain, power, moved.get(number.key[2:], 0.0))
            change = change_of(solution, other, number, there.get(number.key), stresses, left)
            error = np.fmax(error, change * left.own)
        error = np.fmax(error, tail_of_shared(solution, others[0][0], number))
        counted = (
            number.is_resultant or not np.isnan(number.exponent) or _at_singular(solution, number)
        )
        if counted and before is not None and not solution.accuracy.estimates:
            error = np.fmax(error, np.abs(number.value - before.value).max() / (LEAST_GAIN - 1.0))
        if not np.isnan(number.exponent) and np.isnan(error):
            error = number.size  # the other mesh is too coarse for a K
        error += _shared(solution, number)
        # what the increments of an energy leave is an error of the path
        alone = _of_slip(solution, number) if number.name == ENERGY else number.alone
        # the fit of a K is off besides what the mesh is off
        error = np.maximum(error, alone) if np.isnan(number.exponent) else np.hypot(error, alone)
        result.append(number.known_to(float(error)))
    return [*balanced(result, supports=solution.problem.kind == "bilateral")]


def _others(
    solution: Evaluated, numbers: Sequence[Number]
) -> Iterator[tuple[Evaluated, float, dict[Key, Number], dict[End, float]]]:
    """`_coarser` with the numbers there, and how far edges have moved."""
    for other, gain in _coarser(solution):
        there = by_key(other)
        yield other, gain, there, _moved(numbers, there)


def _left(gain: float, power: float, moved: float) -> Left:
    """What is left of the differences of two meshes on the finer one, whose errors are less by a
    gain, and those of a number by a power of it."""
    own, usual, at_edge = (
        1.0 / (max(gain**each, LEAST_GAIN) - 1.0) for each in (power, 1.0, AT_EDGE)
    )
    return Left(own, usual, at_edge, moved)


def _moved(numbers: Sequence[Number], there: dict[Key, Number]) -> dict[End, float]:
    """How far edges lie apart on two meshes after increments, by the areas that they are around, as
    of circles [length]; those of narrow areas less."""
    apart = dict[End, float]()
    for each in numbers:
        if each.name in STATES and each.key in there:
            off = abs(math.sqrt(each.size) - math.sqrt(there[each.key].size)) / math.sqrt(math.pi)
            apart[each.key[2:]] = max(off, apart.get(each.key[2:], 0.0))
    return apart


def _shared(solution: Evaluated, number: Number) -> float:
    """Return the error that meshes share, which their difference does not show."""
    size = number.scale if number.is_resultant else number.size
    counts = np.isfinite(size) and number.error != 0.0
    return solution.accuracy.shared * size if counts else 0.0


def _power(solution: Evaluated, number: Number) -> float:
    """Return the power of an error in L2 that is the error of a number on panels.

    By an edge of contact or of stick it is `AT_EDGE`: tractions are like √s there, and their
    largest error falls like the root of that in L2.
    """
    side = solution.sides.get(number.of, (number.of, number.part))
    if number.place is None or not side[1] or np.isinf(number.error):
        return 1.0
    mesh, place = solution.meshes[side[0]], number.place[None]
    element = located(mesh, place, side[1], within=sizes(mesh))[0]
    at_edge = at_edges(solution, end_of(solution, number), side[0], place, element)
    return AT_EDGE if at_edge[0] else 1.0


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


def _by_tails(solution: Evaluated, number: Number) -> Number:
    """Return a number with its error on one surface mesh."""
    if not np.isnan(number.error):
        return number
    accuracy = solution.accuracy
    whole, of_resultants = accuracy.pairs.get(number.of, (accuracy.error, accuracy.resultants))
    pairs = end_of(solution, number).pairs
    pair = pairs.get(number.of)
    size = number.size
    if number.is_resultant or number.unit == "rad" or number.name == "moved":
        error = of_resultants * _acting(pairs, number)
    elif number.name == "largest p" and pair is not None and pair.pressure_error is not None:
        mesh = solution.meshes[solution.sides[number.of][0]]
        element = mesh.element[solution.nodes[number.of]]
        error = error_of_maximum(pair.pressure, pair.pressure_error, element)
        error = max(error, whole * size) + _shared(solution, number)
    else:
        share = whole ** _power(solution, number)
        error = number.alone - of_increments(number) + share * size + _shared(solution, number)
        error += float(unseen(solution, number, [""])[0]) if stress_name(number) else 0.0
    return number.known_to(error)


def _acting(pairs: dict[str, PairResult], number: Number) -> float:
    """Return the sum of all that acts on the pairs of a number, or its size if that is larger."""
    acting = [pairs[number.of]] if number.of in pairs else list(pairs.values())
    force, moment = np.sum([(0.0, 0.0), *map(resultant, acting)], axis=0).tolist()
    return float(max({"force": force, "moment": moment}.get(number.unit, 0.0), number.size))
