"""Data that contradict each other where parts meet."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..geometry.arcs import on_arcs
from ..geometry.meridian import Meridian
from ..geometry.outline import Outline, Side, shown
from ..model.expressions import evaluate
from ..model.problem import Contact, Displacement, Problem
from ..round_off import SINGLE


def check_compatible(problem: Problem, outline: Outline) -> None:
    """Refuse a displacement that moves the end of a contact part along its normal, where bilateral
    contact has u_n = 0.

    Raises
    ------
    InputError
        One line that names both parts and the place.
    """
    conditions = {
        condition.part: (number, condition) for number, condition in enumerate(problem.boundary)
    }
    along = outline.offsets
    _, after = outline.neighbours
    for k, next_ in enumerate(after.tolist()):
        if next_ == k:
            continue
        ends = ((outline.sides[k], along[k], 1.0), (outline.sides[next_], along[next_], -1.0))
        for (side, start, xi), (other, _, place) in (ends, ends[::-1]):
            number, moved = conditions.get(side.part, (0, None))
            _, contact = conditions.get(other.part, (0, None))
            if isinstance(moved, Displacement) and isinstance(contact, Contact) and contact.plain:
                normal = _at(other, place)[1]
                u = _displacement(moved, side, start, xi, normal)
                if (
                    u is not None
                    and abs(u @ normal) > SINGLE * np.hypot(*u) + 1e-12 * outline.diameter
                ):
                    raise InputError(
                        f"boundary[{number}] ({side.part}).value: has u·n = {u @ normal:g} at "
                        f"{shown(_at(side, xi)[0])}, "
                        f"where it meets the contact part {other.part!r}, whose u_n is 0"
                    )


def check_axis(problem: Problem, number: int, outline: Meridian) -> None:
    """Refuse a displacement of a body of revolution, in any step, that moves the axis along r.

    Raises
    ------
    InputError
        One line that names the part and the place.
    """
    before, after = outline.neighbours
    own, name = np.arange(len(outline.sides)), problem.body[number].name
    for conditions in problem.conditions(number):
        for k, at in [
            *((k, -1.0) for k in own[before == own]),
            *((k, 1.0) for k in own[after == own]),
        ]:
            side = outline.sides[k]
            moved = conditions.get(side.part)
            if isinstance(moved, Displacement) and moved.value[0] != "free":
                u = _displacement(moved, side, outline.offsets[k], at, np.zeros(2))
                if u is not None and abs(u[0]) > 1e-12 * outline.diameter:
                    raise InputError(
                        f"body {name!r}: {side.part}.value[0]: is {u[0]:g} at "
                        f"{shown(_at(side, at)[0])}, on the axis, where u_r is 0"
                    )


def _at(side: Side, xi: float) -> tuple[Array, Array]:
    """Point and outward normal at the start (ξ = -1) or end (ξ = 1) of a side."""
    point, normal = on_arcs(side.start, side.end, side.half_angle, np.array([xi]))
    return point[0], normal[0]


def _displacement(
    condition: Displacement, side: Side, start: float, xi: float, normal: Array
) -> Array | None:
    """u at an end of a side, None where it does not say what u·n is or cannot be evaluated."""
    (x, y), (nx, ny) = _at(side, xi)
    s = start + 0.5 * (1.0 + xi) * side.length
    variables = {
        name: np.array([value])
        for name, value in zip(("x", "y", "nx", "ny", "s"), (x, y, nx, ny, s), strict=True)
    }
    u = np.zeros(len(condition.value))
    for c, component in enumerate(condition.value):
        if component != "free":
            try:
                u[c] = evaluate(component, variables, 1, f"{condition.part}.value[{c}]")[0]
            except InputError:
                # nodes lie inside elements: an expression need not be finite at their ends
                return None
        elif abs(normal[c]) > SINGLE:
            return None
    return u
