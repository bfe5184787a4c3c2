"""Exponents of the singularities at the corners of a body, from the conditions on their sides."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..geometry.outline import Outline, Side
from ..given.body_data import Body
from ..given.conditions import (
    Condition,
    Contact,
    Displacement,
    Periodic,
    Symmetry,
    Traction,
)
from ..given.interface_data import Law
from ..mesh.grading import at_ends, turn
from ..round_off import SINGLE
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
        along = np.array([math.cos(leaving), math.sin(leaving)])
        return kinds_seen(conditions.get(side.part), along, np.array([-along[1], along[0]]))

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


def kinds_seen(condition: Condition | None, along: Array, across: Array) -> tuple[SideKind, ...]:
    """Return what a side may be, seen from a corner in a plane of two unit vectors (d,).

    They lie along the side, away from the corner, and across it. Components that a displacement
    condition holds count as these vectors have them.
    """
    if not isinstance(condition, Displacement):
        return kinds_of(condition)
    held = ~np.array(condition.free[: len(along)])
    axes = np.column_stack([along, across])[held]
    size, rows = np.linalg.svd(np.vstack([axes, np.zeros((2, 2))]))[1:]
    if (size > SINGLE).sum() != 1:
        return (CLAMPED,) if size[0] > SINGLE else (FREE,)
    way = round(math.remainder(math.atan2(rows[0, 1], rows[0, 0]), math.pi), 9)
    return (SLIDING if abs(abs(way) - SLIDING) < 1e-8 else way,)


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
    x, y = side.tangents(np.array([fraction]))[0]
    return math.atan2(y, x)
