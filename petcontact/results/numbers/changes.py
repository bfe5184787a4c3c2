"""What numbers of two solutions differ by.

A maximum is off by as much as the function is wherever it may be largest. Each element has the
largest of the changes at its nodes, so that one node at which the change has no sign says nothing.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arrays import Array, Index, Mask, largest_by, scattered
from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN, SLIP
from ...fields.boundary.places import located, sizes
from ..contact_zones import hidden_slip, in_doubt
from ..evaluated import Evaluated
from ..records import PairResult
from ..strength.strengths import beside, growth
from .number import DISPLACEMENT, ENERGY, Key, Number
from .peaks import stress_name
from .printed import contact_of, end_of
from .stress_errors import Left, NearStress, stress_change

FUNCTIONS: dict[str, Callable[[PairResult], Array]] = {
    "largest p": lambda pair: pair.pressure,
    "largest q": lambda pair: lengths(pair.sigma_t),
    "largest slip": lambda pair: lengths(pair.slip),
    "worn depth": lambda pair: np.zeros(1) if pair.wear is None else pair.wear.sum(axis=1),
}
"""Of a pair, at its nodes, whose maxima in contact are numbers."""
HALVED = 0.63
"""Diagonal of a panel over that of the one before, below which its longer sides were halved: these
have half, a square that is halved along one direction .79 and a longer panel more [-]."""
HIDDEN = "slipping", "largest slip", ENERGY
"""Numbers of what `hidden_slip` tells, in its order."""
STATES: dict[str, Callable[[PairResult], Mask]] = {
    "contact area": lambda pair: np.asarray(pair.state != OPEN),
    "slipping": lambda pair: np.asarray(pair.state == SLIP),
}
"""Of a pair, at its nodes: whether they are in the area of that name."""


def change_of(
    solution: Evaluated,
    coarser: Evaluated,
    number: Number,
    before: Number | None,
    stresses: dict[Key, NearStress],
    left: Left,
) -> float:
    """Return the error of a number by its difference on two meshes; `left` is how much of that is
    taken to be left on the finer one."""
    if np.isinf(number.error):
        return number.error
    if stress_name(number):
        near = stresses.get(number.key)
        return 0.0 if near is None else stress_change(solution, coarser, number, near, left)
    if before is None:
        return np.nan
    apart = float(np.abs(number.value - before.value).max())
    if not number.size and number.name in HIDDEN:
        return max(apart, _may_slip(solution, coarser, number))
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
    pair, change = _changed(solution, coarser, number, "largest p")
    mesh, nodes = solution.meshes[solution.sides[number.of][0]], solution.nodes[number.of]
    return in_doubt(mesh, nodes, pair, STATES[number.name](pair), change)


def _may_slip(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the area, the slip or the energy of what may slip, though all that touches sticks: q,
    with its change, is more than friction bears."""
    pair, change = _changed(solution, coarser, number, "largest q")
    mesh, nodes, _, compliance, endless = contact_of(
        solution, end_of(solution, number), number.of, pair
    )
    doubted = mesh.element[nodes[lengths(pair.sigma_t) + change > pair.bound]].tolist()
    hidden = hidden_slip(mesh, nodes, pair, compliance, [*endless, *doubted])
    return hidden[HIDDEN.index(number.name)]


def _changed(
    solution: Evaluated, coarser: Evaluated, number: Number, name: str
) -> tuple[PairResult, Array]:
    """Return a pair, and how much a function of it changes at its nodes, where that is known."""
    pair, before = (end_of(each, number).pairs[number.of] for each in (solution, coarser))
    there = _carried(coarser, number.of, FUNCTIONS[name](before), pair.x)
    return pair, np.nan_to_num(np.abs(there - FUNCTIONS[name](pair)))


def _displacement_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the error of a largest displacement by the change of u at the nodes of its body."""
    mesh, other = (each.meshes[number.of] for each in (solution, coarser))
    now, before = (end_of(each, number).bodies[number.of].u for each in (solution, coarser))
    element, place = located(other, mesh.x, within=sizes(other))
    rows = np.flatnonzero(element >= 0)
    if not len(rows):
        return 0.0
    change = np.linalg.norm(other.basis_at(element[rows], place[rows]) @ before - now[rows], axis=1)
    return error_of_maximum(np.linalg.norm(now[rows], axis=1), change, mesh.element[rows])


def _function_change(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the error of a maximum of a function whose error is its change."""
    now, before = (
        FUNCTIONS[number.name](end_of(each, number).pairs[number.of])
        for each in (solution, coarser)
    )
    rows = counted(solution, number)
    body, part = solution.sides[number.of]
    nodes, mesh = solution.nodes[number.of][rows], solution.meshes[body]
    # at its place, too, which may lie between nodes
    assert number.place is not None
    x, now = np.vstack([mesh.x[nodes], number.place]), np.append(now[rows], number.value)
    change = np.abs(_carried(coarser, number.of, before, x) - now)
    if number.unit == "stress":
        change *= np.fmax(growth(solution, end_of(solution, number), body, x)[1], 1.0)
    if not np.isfinite(change).any():
        return float(now.max(initial=0.0))
    at = located(mesh, x[-1:], part, within=sizes(mesh))[0]
    return error_of_maximum(now, np.nan_to_num(change), np.append(mesh.element[nodes], at))


def tail_of_shared(solution: Evaluated, coarser: Evaluated, number: Number) -> float:
    """Return the error of a largest traction by its tails on panels that are as long on the coarser
    mesh: the difference of two meshes does not show what neither of them resolves."""
    errors = {"largest p": "pressure_error", "largest q": "sigma_t_error"}
    pair = end_of(solution, number).pairs[number.of] if number.name in errors else None
    tail = None if pair is None else getattr(pair, errors[number.name])
    if pair is None or tail is None or np.isinf(number.error):
        return 0.0
    (body, part), rows = solution.sides[number.of], counted(solution, number)
    mesh, before = solution.meshes[body], coarser.meshes[body]
    element = mesh.element[solution.nodes[number.of][rows]]
    there, _ = located(before, pair.x[rows], part, within=sizes(before))
    was = np.where(there >= 0, before.spheres[1][there], np.inf)
    values = FUNCTIONS[number.name](pair)[rows]
    off = tail[rows] * (mesh.spheres[1][element] > HALVED * was)
    return error_of_maximum(values, off, element) if len(values) else 0.0


def counted(solution: Evaluated, number: Number) -> Mask:
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
    whole, on = scattered(values, solution.nodes[name], mesh.n_nodes), element >= 0
    there = mesh.basis_at(element[on], place[on]) @ whole
    return scattered(there, on, len(x), np.nan)


def error_of_maximum(values: Array, change: Array, element: Index) -> float:
    """Return the error of the maximum of values that have errors up to a change each."""
    _, row = np.unique(element, return_inverse=True)
    top, off = float(values.max()), largest_by(row, change, int(row.max()) + 1)[row]
    least, most = float((values - off).max()), float((values + off)[values > 0.0].max(initial=top))
    return max(most - top, top - least)
