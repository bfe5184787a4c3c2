"""Checks that given data do not contradict each other where parts meet."""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array, shown
from ..errors import InputError, in_body
from ..geometry.meridian import Meridian
from ..geometry.outline import Outline, Side
from ..geometry.rotation import lifted
from ..geometry.surface import Boundary
from ..given.body_data import Body, Loads
from ..given.conditions import Condition, Contact, Displacement, Periodic
from ..given.sites import Sites
from ..round_off import SINGLE


@functools.singledispatch
def check_compatible(boundary: Boundary, body: Body) -> None:
    """Refuse a displacement that moves the end of a contact part of an outline along its normal,
    where bilateral contact has u_n = 0.

    Raises
    ------
    InputError
        One line that names both parts and the place.
    """


@check_compatible.register
def _(outline: Outline, body: Body) -> None:
    conditions = {
        condition.part: (number, condition) for number, condition in enumerate(body.boundary)
    }
    for k, following in enumerate(outline.neighbours[1].tolist()):
        if following != k:
            _check_end(conditions, outline, (k, 1.0), (following, -1.0))
            _check_end(conditions, outline, (following, -1.0), (k, 1.0))


def _check_end(
    conditions: dict[str, tuple[int, Condition]],
    outline: Outline,
    end: tuple[int, float],
    meeting: tuple[int, float],
) -> None:
    """Refuse an end of a side, by its number and its ξ, that moves along the normal of the side
    which it meets."""
    side, met = outline.sides[end[0]], outline.sides[meeting[0]]
    number, moved = conditions.get(side.part, (0, None))
    contact = conditions.get(met.part, (0, None))[1]
    if not (isinstance(moved, Displacement) and isinstance(contact, Contact)):
        return
    if not contact.law.is_paper:
        return
    normal = lifted(_at(met, meeting[1])[1], len(moved.value))
    u = _displacement(moved, side, outline.offsets[end[0]], end[1], normal)
    least = 1e-12 * outline.diameter
    if u is not None and abs(u @ normal) > SINGLE * np.linalg.norm(u) + least:
        raise InputError(
            f"boundary[{number}] ({side.part}).value: has u·n = {u @ normal:g} at "
            f"{shown(_at(side, end[1])[0])}, where it meets the contact part {met.part!r}, whose "
            "u_n is 0"
        )


def check_revolution(body: Body, outline: Meridian) -> None:
    """Refuse data of a body of revolution, in any step, that are not the same all around its axis.

    Raises
    ------
    InputError
        One line that names the key, what was given and what is allowed.
    """
    name = in_body(body.name)
    try:
        _check_axis(body, outline)
        for conditions in body.conditions:
            for condition in conditions.values():
                if isinstance(condition, Periodic):
                    _check_periodic(condition, outline)
        for loads in body.loads:
            _check_loads(loads)
        for forces in body.forces:
            for k, force in enumerate(forces):
                across = [c for c in range(0, len(force.force), 2) if force.force[c] != 0.0]
                if force.at[0] == 0.0 and across:
                    c = across[0]
                    raise InputError(
                        f"point_force[{k}].force[{c}]: is {force.force[c]:g} on the axis, where a "
                        f"force acts along the axis only"
                    )
    except InputError as error:
        raise InputError(f"{name}{error}") from None


def _check_axis(body: Body, outline: Meridian) -> None:
    """Refuse displacements that move the axis along r."""
    for conditions in body.conditions:
        for k, end in outline.axis_ends:
            side, xi = outline.sides[k], 2.0 * end - 1.0
            moved = conditions.get(side.part)
            if not isinstance(moved, Displacement):
                continue
            u = _displacement(moved, side, outline.offsets[k], xi, np.zeros(3))
            for c, name in zip(range(0, len(moved.value), 2), ("u_r", "u_θ"), strict=False):
                if u is not None and abs(u[c]) > 1e-12 * outline.diameter:
                    raise InputError(
                        f"{side.part}.value[{c}]: is {u[c]:g} at {shown(_at(side, xi)[0])}, on "
                        f"the axis, where {name} is 0"
                    )


def _check_periodic(condition: Periodic, outline: Meridian) -> None:
    """Refuse parts that are not the same rings at another height."""
    own, partner = (
        [side.start[0] for side in outline.sides if side.part == part]
        + [side.end[0] for side in outline.sides if side.part == part]
        for part in (condition.part, condition.partner)
    )
    if not np.allclose(sorted(own), sorted(partner), rtol=0.0, atol=SINGLE * outline.diameter):
        raise InputError(
            f"{condition.part}.partner: {condition.partner!r} lies at other radii; periodic "
            f"parts of a body of revolution are one the other moved along the axis"
        )
    if condition.jump[0] != 0.0:
        raise InputError(
            f"{condition.part}.jump[0]: u_r does not grow along the axis; must be 0, got "
            f"{condition.jump[0]:g}"
        )


def _check_loads(loads: Loads) -> None:
    """Refuse volume loads across the axis."""
    across = next(iter(loads.acceleration), None)
    if across is not None and not across.varies and not across.is_zero:
        raise InputError(
            f"loads.acceleration[0]: is {across.source:g}; weight acts along the axis, so it must "
            "be 0 or an expression"
        )
    if loads.centre is not None and loads.centre[0] != 0.0:
        raise InputError(
            f"loads.centre[0]: is {loads.centre[0]:g}; a body of revolution turns about its axis "
            "x = 0"
        )


def _at(side: Side, xi: float) -> tuple[Array, Array]:
    """Return point and outward normal at the start (ξ = -1) or end (ξ = 1) of a side."""
    fraction = np.array([0.5 * (1.0 + xi)])
    x, y = side.tangents(fraction)[0]
    return side.point(fraction)[0], np.array([y, -x])


def _displacement(
    condition: Displacement, side: Side, start: float, xi: float, normal: Array
) -> Array | None:
    """Return u at an end of a side, or None where it does not fix u·n or cannot be evaluated."""
    s = start + 0.5 * (1.0 + xi) * side.length
    point, outward = _at(side, xi)
    place = Sites(point[None], outward[None], np.array([s]))
    u = np.zeros(len(condition.value))
    for c, datum in enumerate(condition.value):
        if datum is not None:
            try:
                u[c] = datum.at(place)[0]
            except InputError:
                # nodes lie inside elements: an expression need not be finite at their ends
                return None
        elif abs(normal[c]) > SINGLE:
            return None
    return u
