"""Checks of a problem's parts and vectors, and one body with a condition on each part."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from ...bem.compatibility import check_revolution
from ...errors import InputError, in_body, the_body
from ...geometry.gmsh import UNNAMED
from ...geometry.meridian import Meridian
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...given.conditions import Condition, Contact, Periodic, Traction
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...given.values import Number
from ...model.problem import Problem
from ...runtime.hints import demand_name
from .load_states import check_components


def check_parts(problem: Problem, boundaries: list[Boundary]) -> None:
    """Refuse parts that do not exist or have two conditions, bodies of different dimensions, and
    vectors that do not fit.

    Raises
    ------
    InputError
    """
    d = boundaries[0].dim
    for number, boundary in enumerate(boundaries):
        if boundary.dim != d:
            name, first = problem.body[number].name, problem.body[0].name
            raise InputError(
                f"{in_body(name)}has {boundary.dim} dimensions, {the_body(first)} has {d}"
            )
        _check_loads(problem.bodies[number], boundary)
        if isinstance(boundary, Meridian):
            check_revolution(problem.bodies[number], boundary)
    for obstacle in () if problem.interfaces else problem.obstacle:
        raise InputError(
            f"obstacle {obstacle.name!r}: no part is in contact; a [[contact]] says what it touches"
        )
    for side in problem.interfaces:
        if side.direction is not None:
            check_components(f"{side.key}.direction", side.direction, d)
    for k, step in enumerate(problem.step):
        for j, force in enumerate(step.point_force):
            key = f"step[{k}].point_force[{j}].force"
            check_components(key, force.force, boundaries[0].components)
    for number, boundary in enumerate(boundaries):
        _check_conditions(problem, number, boundary)


def _check_loads(body: Body, boundary: Boundary) -> None:
    """Refuse loads inside a body that may not have them, or whose components do not fit."""
    d = boundary.dim
    for k, point in enumerate(body.forces[0]):
        check_components(f"{in_body(body.name)}point_force[{k}].at", point.at, d)
        key = f"{in_body(body.name)}point_force[{k}].force"
        check_components(key, point.force, boundary.components)
    if not boundary.has_inside and (body.points or not body.volume.is_none):
        key = "point_force" if body.points else "loads"
        raise InputError(
            f"{in_body(body.name)}{key}: loads inside a superelement belong into its file, as "
            "force or u_0"
        )
    for loads in [loads for loads in body.loads if not loads.is_none]:
        if boundary.exterior:
            raise InputError(f"{in_body(body.name)}loads: an infinite plate has no volume loads")
        if d == 2 and loads.axis is not None:
            raise InputError(
                f"{in_body(body.name)}loads.axis: a plane body turns about its normal, one of "
                f"revolution about its axis; leave it out"
            )
        for key, value in loads.vectors.items():
            check_components(f"{in_body(body.name)}loads.{key}", value, d)


def _check_conditions(problem: Problem, number: int, boundary: Boundary) -> None:
    """Refuse parts of a body that do not exist, or that have no condition or several."""
    body, taken = problem.body[number], list[str]()
    for k, condition in enumerate(body.boundary):
        _known_part(f"{in_body(body.name)}boundary[{k}].part", condition.part, boundary.parts)
        if condition.part in taken:
            raise InputError(
                f"{in_body(body.name)}boundary[{k}].part: {condition.part!r} has a condition "
                f"already, boundary[{taken.index(condition.part)}]"
            )
        taken.append(condition.part)
    ends = [
        (side, role, part)
        for side in problem.interfaces
        for role, (owner, part) in zip(("secondary", "primary"), side.ends, strict=False)
        if owner == number
    ]
    for side, role, part in ends:
        if side.periodic and boundary.dim > 2:
            raise InputError(f"{side.key}: periodic sides are those of plane bodies")
        # the secondary of a condition is its own part
        if side.is_condition and role == "secondary":
            continue
        key = f"{side.key}.{'partner' if side.periodic else role}"
        noun = _end_in_words(problem, side, role)
        _known_part(f"{key}: {in_body(body.name)}".removesuffix(": "), part, boundary.parts, noun)
        if part in taken:
            raise InputError(
                f"{key}: {part!r} of {the_body(body.name)} has a boundary condition already"
            )
    _check_changes(problem, number, boundary, [(side, part) for side, _, part in ends])
    if problem.is_flat:
        _check_missing(boundary, [*taken, *(part for _, _, part in ends)])


def _check_missing(boundary: Boundary, met: Collection[str]) -> None:
    """Refuse parts without a condition or a contact."""
    missing = [part for part in boundary.parts if part not in (*met, UNNAMED)]
    has, it_is = ("have", "they are") if len(missing) > 1 else ("has", "it is")
    if missing:
        raise InputError(
            f"boundary: part{'s' * (len(missing) > 1)} {', '.join(map(repr, missing))} {has} no "
            f'condition; if {it_is} free write [[boundary]] part = "{missing[0]}", condition = '
            f'"traction", value = {[0.0] * boundary.dim}'
        )


def _check_changes(
    problem: Problem, number: int, boundary: Boundary, ends: list[tuple[PosedInterface, str]]
) -> None:
    """Refuse steps that change parts of a body that do not exist, or are in contact."""
    body, touching = problem.body[number], {part for side, part in ends if not side.is_condition}
    changes = [
        (f"step[{s}].boundary[{k}].part", change.part)
        for s, step in enumerate(problem.step)
        for k, change in enumerate(step.boundary)
        if change.body == body.name or not (change.body or number)
    ]
    for key, part in changes:
        _known_part(f"{key}: {in_body(body.name)}".removesuffix(": "), part, boundary.parts)
        if part in touching:
            raise InputError(
                f"{key}: {part!r} of {the_body(body.name)} is in contact, and cannot be held or "
                "loaded"
            )


def _end_in_words(problem: Problem, side: PosedInterface, role: str) -> str:
    """Return what an end of an interface may name: without bodies its primary is an obstacle or a
    part; a partner is a part."""
    is_primary = role == "primary" and not side.periodic
    return "part or [[obstacle]]" if is_primary and problem.is_flat else "part"


def _known_part(key: str, part: str, parts: tuple[str, ...], noun: str = "part") -> None:
    demand_name(f"{key}: no {noun}", part, parts, "parts are")


def body_alone(posed: Posed, number: int, boundary: Boundary) -> Body:
    """Return one body with a condition on each of its parts.

    A contact condition stands for each interface, and free parts have a traction of zero. It serves
    callers that need to know only which parts are held, loaded or in contact.
    """
    body = posed.bodies[number]
    touching: dict[str, Contact] = {}
    for side in posed.interfaces:
        zero = Number(f"{side.key}.gap", 0.0)
        own = side.law if side.law.gap is not None else replace(side.law, gap=zero)
        flush = replace(own, gap=zero, interference=None, clearance=None)
        if side.primary and side.primary[0] == number:
            touching[side.primary[1]] = Contact(side.primary[1], flush)
        if side.body == number:
            touching[side.part] = Contact(side.part, own)
    # the body's own conditions come first, because messages name them by number
    conditions: list[Condition] = [
        touching.pop(c.part) if isinstance(c, Contact | Periodic) else c for c in body.boundary
    ]
    conditions += [touching[part] for part in boundary.parts if part in touching]
    named = {c.part for c in conditions}
    free = (Number("traction", 0.0),) * boundary.components
    conditions += [Traction(part, free) for part in boundary.parts if part not in named]
    return replace(body, boundary=tuple(conditions))
