"""The interfaces of a problem, whose gaps, friction and wear become functions of the place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..given import splines  # noqa: F401 (it registers a kind of datum)
from ..given.interfaces import FRICTION, PLACED, Law, PosedInterface
from ..given.values import Given, as_given
from ..runtime.hints import demand_name
from .bodies import Contact, Periodic


def posed_interfaces(problem: Any) -> tuple[PosedInterface, ...]:
    """The contact conditions and the contact pairs of a `Problem`, in the order of the config.

    Raises
    ------
    InputError
        If a step changes a contact that there is not, or gives it what it cannot take.
    """
    interfaces = [*_conditions(problem), *_pairs(problem)]
    names, changes = [side.name for side in interfaces if not side.periodic], dict[str, list[Any]]()
    for s, step in enumerate(problem.step):
        for k, change in enumerate(step.contact):
            key = f"step[{s}].contact[{k}]"
            demand_name(f"{key}.name: no contact", change.name, names, "contacts are")
            changes.setdefault(change.name, []).append((s, key, change))
    count = max(1, len(problem.step))
    return tuple(_in_steps(side, changes.get(side.name, []), count) for side in interfaces)


def _in_steps(
    side: PosedInterface, changes: list[tuple[int, str, Any]], count: int
) -> PosedInterface:
    """The interface with its law in each load state; an overlap is taken up in the first step."""
    law, laws = side.law, [replace(side.law, interference=None, preload=None)]
    for number in range(count):
        for key, change in [each[1:] for each in changes if each[0] == number]:
            new = dict(_changed(side, key, change))
            if not law.has_friction:  # that of the first step that has some counts from then on
                mu, bound = map(new.get, FRICTION)
                union = replace(side.law, friction_coefficient=mu, friction_bound=bound)
                side = replace(side, law=union)
            elif odd := [k for k in FRICTION if k in new and getattr(side.law, k) is None]:
                raise InputError(
                    f"{key}.{odd[0]}: contact {side.name!r} has none until then, and what is "
                    f"infinite is not reached linearly; give it a {odd[0]} from the beginning"
                )
            if new.get("preload") == "locked" and laws[-1].preload is None:
                raise InputError(
                    f"{key}.preload: no step before this one gives contact {side.name!r} a "
                    'preload that could be "locked"'
                )
            law = replace(law, **new)
        _demand_effect(side.name, law, laws[-1])
        laws.append(law)
    return replace(side, laws=tuple(laws))


def _demand_effect(name: str, law: Law, before: Law) -> None:
    """Refuse a new uniform interference under a preload, which finds the uniform overlap."""
    new = law.interference
    if not isinstance(law.preload, float) or new is None or new == before.interference:
        return
    if not (new.varies or new.is_zero):
        raise InputError(
            f"{new.key}: a uniform interference has no effect while a preload gives the force of "
            f"contact {name!r}; give one of the two"
        )


def _changed(side: PosedInterface, key: str, change: Any) -> Iterator[tuple[str, Any]]:
    """What a step changes of a law."""
    for name in (*PLACED, "preload"):
        value = getattr(change, name)
        if value is None:
            continue
        if name in FRICTION and side.law.normal == "bonded":
            raise InputError(f"{key}.{name}: contact {side.name!r} is bonded and does not slip")
        yield name, value if name == "preload" else as_given(value, f"{key}.{name}")


def _conditions(problem: Any) -> list[PosedInterface]:
    interfaces = []
    for b, body in enumerate(problem.body):
        for k, condition in enumerate(body.boundary):
            if not isinstance(condition, Contact | Periodic):
                continue
            name = condition.part if problem.is_flat else f"{body.name}.{condition.part}"
            key = f"boundary[{k}] ({condition.part})"
            place = key if problem.is_flat else f"body[{b}].{key}"
            periodic = isinstance(condition, Periodic)
            primary = (b, condition.partner) if isinstance(condition, Periodic) else None
            law = _law(place, Contact(condition.part, normal="bonded") if periodic else condition)
            interfaces.append(
                PosedInterface(
                    name, place, b, condition.part, primary, None, law, None, (), periodic, True
                )
            )
    return interfaces


def _pairs(problem: Any) -> list[PosedInterface]:
    interfaces, obstacles = [], [o.name for o in problem.obstacle]
    for k, pair in enumerate(problem.contact):
        key, along = f"contact[{k}]", pair.direction
        body, part = problem.side(f"{key}.secondary", pair.secondary)
        rigid = pair.primary in obstacles
        obstacle = obstacles.index(pair.primary) if rigid else None
        primary = None if rigid else problem.side(f"{key}.primary", pair.primary, obstacles)
        direction = None if along is None else np.array(along) / np.linalg.norm(along)
        law = _law(key, pair)
        if obstacle is not None and law.gap is None and law.normal == "unilateral":
            law = replace(law, gap=_distance(problem, obstacle, f"{key}.gap", direction))
        interfaces.append(
            PosedInterface(pair.name, key, body, part, primary, obstacle, law, direction, ())
        )
    return interfaces


def _distance(problem: Any, number: int, key: str, direction: Array | None) -> Given | None:
    """The distance to an obstacle along a direction, None if it has no shape."""
    obstacle, ray = problem.obstacle[number], None if direction is None else direction.tolist()
    if obstacle.shape is None:
        return None
    aimed = obstacle.aimed(ray and tuple(ray), axial=problem.symmetry == "axial")
    return as_given(aimed, key)


def _law(place: str, law: Any) -> Law:
    """The law of a `Contact` or a `Pair`, whose place in the config errors name."""

    def datum(key: str) -> Given | None:
        value = getattr(law, key)
        return None if value is None or value == "geometry" else as_given(value, f"{place}.{key}")

    return Law(
        law.normal,
        datum("gap"),
        datum("friction_coefficient"),
        datum("friction_bound"),
        datum("wear_coefficient"),
        law.wear_share,
        datum("interference"),
        datum("clearance"),
        law.preload,
    )
