"""Which parts of a problem are in contact, and whether its parts and vectors fit the bodies."""

from __future__ import annotations

from collections.abc import Sized
from typing import Any

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...frozen import frozen
from ...geometry.superelement import CondensedSurface
from ...geometry.surface import Boundary
from ...model.base import nearest
from ...model.loads import loads_by_step
from ...model.problem import ONE_BODY, Body, Contact, Periodic, Problem, Traction


@frozen
class InterfaceSpec:
    """One interface as the config has it.

    Attributes
    ----------
    name, key : str
        Name, and the place in the config for errors.
    body : int
    part : str
    primary : (int, str), optional
        Body and part of the primary.
    obstacle : int, optional
    law : Contact or Pair
        Whose normal, gap and friction it has.
    direction : (d,) array, optional
    periodic : bool
        Whether the primary is the secondary moved along.
    """

    name: str
    key: str
    body: int
    part: str
    primary: tuple[int, str] | None
    obstacle: int | None
    law: Any
    direction: Array | None
    periodic: bool = False

    @property
    def holds_normal(self) -> bool:
        """Whether it is in contact with fixed ground that it cannot leave, and its friction does
        not depend on pressure.

        Then u_n = gap is known data of the body, and a method looks for tangential tractions only,
        as in the paper.
        """
        return (
            self.primary is None
            and self.obstacle is None
            and self.direction is None
            and self.law.normal != "unilateral"
            and self.law.friction_coefficient is None
        )


def interfaces_of(problem: Problem) -> list[InterfaceSpec]:
    """Contact conditions and contact pairs, in the order of the config."""
    result = []
    several = len(problem.body) > 1 or problem.body[0].name != ONE_BODY
    for b, body in enumerate(problem.body):
        for k, condition in enumerate(body.boundary):
            if isinstance(condition, Contact | Periodic):
                name = f"{body.name}.{condition.part}" if several else condition.part
                key = f"body[{b}].boundary[{k}]" if several else f"boundary[{k}]"
                place = f"{key} ({condition.part})"
                if isinstance(condition, Periodic):
                    bonded = Contact(condition.part, normal="bonded")
                    partner = b, condition.partner
                    result.append(
                        InterfaceSpec(
                            name, place, b, condition.part, partner, None, bonded, None, True
                        )
                    )
                else:
                    result.append(
                        InterfaceSpec(name, place, b, condition.part, None, None, condition, None)
                    )
    obstacles = [o.name for o in problem.obstacle]
    for k, pair in enumerate(problem.contact):
        key = f"contact[{k}]"
        a, part = problem.side(f"{key}.secondary", pair.secondary)
        direction = (
            None
            if pair.direction is None
            else np.array(pair.direction) / np.linalg.norm(pair.direction)
        )
        if pair.primary in obstacles:
            result.append(
                InterfaceSpec(
                    pair.name, key, a, part, None, obstacles.index(pair.primary), pair, direction
                )
            )
        else:
            primary = problem.side(f"{key}.primary", pair.primary, obstacles)
            result.append(InterfaceSpec(pair.name, key, a, part, primary, None, pair, direction))
    return result


def check_parts(problem: Problem, boundaries: list[Boundary], sides: list[InterfaceSpec]) -> None:
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
                f"body {name!r}: has {boundary.dim} dimensions, body {first!r} has {d}"
            )
        _check_loads(problem, number, boundary)
    for side in sides:
        if side.direction is not None:
            _check_components(f"{side.key}.direction", side.direction, d)
    for k, step in enumerate(problem.step):
        for j, force in enumerate(step.point_force):
            _check_components(f"step[{k}].point_force[{j}].force", force.force, d)
    for number, boundary in enumerate(boundaries):
        _check_conditions(problem, number, boundary, sides)


def _check_loads(problem: Problem, number: int, boundary: Boundary) -> None:
    """Loads inside of a body: whether it may have them, and their components."""
    body, d = problem.body[number], boundary.dim
    for k, point in enumerate(body.point_force):
        _check_components(f"body {body.name!r}: point_force[{k}].at", point.at, d)
        _check_components(f"body {body.name!r}: point_force[{k}].force", point.force, d)
    if isinstance(boundary, CondensedSurface) and (body.point_force or body.loads):
        key = "point_force" if body.point_force else "loads"
        raise InputError(
            f"body {body.name!r}: {key}: loads inside a superelement belong into its file, as "
            f"force or u_0"
        )
    for loads in [loads for loads in loads_by_step(problem, number) if not loads.is_none]:
        if boundary.exterior:
            raise InputError(f"body {body.name!r}: loads: an infinite plate has no volume loads")
        if d == 2 and loads.axis is not None:
            raise InputError(
                f"body {body.name!r}: loads.axis: a plane body turns about its normal; leave it out"
            )
        for key, value in loads.vectors():
            _check_components(f"body {body.name!r}: loads.{key}", value, d)


def _check_conditions(
    problem: Problem, number: int, boundary: Boundary, sides: list[InterfaceSpec]
) -> None:
    """Parts of a body: whether those that are named exist, and each has one condition or
    contact."""
    body, taken = problem.body[number], list[str]()
    for k, condition in enumerate(body.boundary):
        _known_part(f"body {body.name!r}: boundary[{k}].part", condition.part, boundary.parts)
        if condition.part in taken:
            raise InputError(
                f"body {body.name!r}: boundary[{k}].part: {condition.part!r} has a condition "
                f"already"
            )
        taken.append(condition.part)
    ends = [
        (side, what, end)
        for side in sides
        for what, end in (("secondary", (side.body, side.part)), ("primary", side.primary))
        if end and end[0] == number
    ]
    for side, what, (_, part) in ends:
        if side.primary is None and isinstance(side.law, Contact):
            continue
        if side.periodic and boundary.dim > 2:
            raise InputError(f"{side.key}: periodic sides are those of plane bodies")
        if side.periodic and what == "secondary":
            continue  # it is the part of the condition itself
        _known_part(
            f"{side.key}.{'partner' if side.periodic else what}: body {body.name!r}",
            part,
            boundary.parts,
        )
        if part in taken:
            raise InputError(
                f"{side.key}.{'partner' if side.periodic else what}: {part!r} of body "
                f"{body.name!r} has a "
                "boundary condition already"
            )
    met = [*taken, *(part for _, _, (_, part) in ends)]
    missing = [part for part in boundary.parts if part not in met]
    if missing and body.name == ONE_BODY and len(problem.body) == 1:
        raise InputError(
            f"boundary: part {missing[0]!r} has no condition; each of {', '.join(boundary.parts)} "
            f"needs one "
            "or a [[contact]] (only parts of a [[body]] of another name are free without)"
        )


def _known_part(key: str, part: str, parts: tuple[str, ...]) -> None:
    if part not in parts:
        raise InputError(
            f"{key}: no part "
            f"{part!r}{nearest(part, list(parts)) or '; parts are ' + ', '.join(parts)}"
        )


def _check_components(key: str, value: Sized, d: int) -> None:
    if len(value) != d:
        raise InputError(f"{key}: the body has {d} dimensions, got {len(value)} components")


def as_problem(body: Body, boundary: Boundary, sides: list[InterfaceSpec], number: int) -> Problem:
    """One body as a problem of its own, for what only needs to know which parts are held, loaded or
    in contact."""
    contact = Contact.model_construct  # of values that were checked
    touching: dict[str, Contact] = {}
    for side in sides:
        law = side.law
        given = {
            key: getattr(law, key) for key in ("normal", "friction_coefficient", "friction_bound")
        }
        if side.primary and side.primary[0] == number:
            touching[side.primary[1]] = contact(part=side.primary[1], **given)
        if side.body == number:
            gap = 0.0 if law.gap == "geometry" else law.gap
            touching[side.part] = contact(part=side.part, **given, gap=gap)
    # messages count the conditions as the body's own
    conditions: list[Any] = [
        touching.pop(c.part) if isinstance(c, Contact | Periodic) else c for c in body.boundary
    ]
    conditions += [touching[part] for part in boundary.parts if part in touching]
    named = {c.part for c in conditions}
    conditions += [
        Traction(part=part, value=(0.0,) * boundary.dim)
        for part in boundary.parts
        if part not in named
    ]
    return Problem(
        material=body.material,
        geometry=body.geometry,
        mesh=body.mesh,
        boundary=tuple(conditions),
        loads=body.loads,
    )
