"""Exponents of the singularities at the corners of a body, from the conditions on their sides."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from ..geometry.outline import Outline, Side
from ..given.bodies import Body
from ..given.conditions import (
    Condition,
    Contact,
    Displacement,
    Periodic,
    Symmetry,
    Traction,
)
from ..given.interfaces import Law
from ..mesh.grading import at_ends, turn
from .corner_exponents import (
    CLAMPED,
    FREE,
    SLIDING,
    SideKind,
    corner_exponent,
    shear_exponent,
)


def corner_exponents(body: Body, outline: Outline) -> list[tuple[float, float]]:
    """Return λ in (0, 1] at the start and the end of each side; displacements behave like r^λ
    there.

    A contact side may stick, slip or open. It is tried as clamped, sliding and free, and the least
    λ is taken.
    """
    conditions = {condition.part: condition for condition in body.boundary}
    kappa = 3.0 - 4.0 * body.material.plane_strain_ratio

    def kinds(side: Side, leaving: float) -> tuple[SideKind, ...]:
        return kinds_seen(conditions.get(side.part), leaving, 2)

    def exponent(before: Side, after: Side) -> float:
        angle = round(math.pi - turn(before, after), 9)
        seen = [
            kinds(after, direction(after, 0.0)),
            kinds(before, direction(before, 1.0) + math.pi),
        ]
        least = min(corner_exponent(angle, kappa, *pair) for pair in itertools.product(*seen))
        if outline.components == 2:
            return least
        given = [conditions.get(side.part) for side in (after, before)]
        return min(least, torsion_exponent(angle, given, seen))

    return at_ends(outline, exponent)


def kinds_seen(condition: Condition | None, leaving: float, dim: int) -> tuple[SideKind, ...]:
    """Return what a side may be, seen from a corner that it leaves in a direction [rad].

    In the plane the direction decides what a single held component means.
    """
    if dim > 2 or not isinstance(condition, Displacement):
        return kinds_of(condition)
    free = condition.free[:dim]
    if len(set(free)) == 1:
        return (FREE,) if free[0] else (CLAMPED,)
    axis = math.pi / 2.0 if free[0] else 0.0
    held = round(math.remainder(axis - leaving, math.pi), 9)
    return (SLIDING if abs(abs(held) - SLIDING) < 1e-8 else held,)


def kinds_of(condition: Condition | None) -> tuple[SideKind, ...]:
    """Return what a side under a condition may be.

    One with some components held is tried as sliding and as clamped.
    """
    if condition is None or isinstance(condition, Traction):
        return (FREE,)
    if isinstance(condition, Contact):
        return _of_contact(condition.law)
    if isinstance(condition, Symmetry):
        return (SLIDING,)
    if isinstance(condition, Periodic):
        return (CLAMPED,)
    free = condition.free
    return (FREE,) if all(free) else (CLAMPED, SLIDING) if any(free) else (CLAMPED,)


def torsion_exponent(
    angle: float, given: Sequence[Condition | None], kinds: Sequence[tuple[SideKind, ...]]
) -> float:
    """Return λ of the displacement around the axis at a corner, from the conditions on its two
    sides.

    A displacement condition decides itself whether that component is held. Other sides follow from
    `kinds`.
    """
    held = [
        {not condition.free[2]}
        if isinstance(condition, Displacement)
        else {kind == CLAMPED for kind in sides}
        for condition, sides in zip(given, kinds, strict=True)
    ]
    return min(shear_exponent(angle, *pair) for pair in itertools.product(*held))


def _of_contact(law: Law) -> tuple[SideKind, ...]:
    """Return what a contact side may be: it sticks, slips or opens."""
    if law.normal == "bonded":
        return (CLAMPED,)
    friction = law.friction_coefficient is not None or not (
        law.friction_bound is None or law.friction_bound.is_zero
    )
    return (
        SLIDING,
        *((CLAMPED,) if friction else ()),
        *((FREE,) if law.normal == "unilateral" else ()),
    )


def direction(side: Side, fraction: float) -> float:
    """Return the angle of the tangent at a fraction of a side [rad]."""
    chord = side.end - side.start
    return math.atan2(chord[1], chord[0]) + side.half_angle * (2.0 * fraction - 1.0)
