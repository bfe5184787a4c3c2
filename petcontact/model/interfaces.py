"""The interfaces of a problem, whose gaps, friction and wear become functions of the place."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..given.interfaces import Law, PosedInterface
from ..given.values import Given, as_given
from .bodies import Contact, Periodic


def posed_interfaces(problem: Any) -> tuple[PosedInterface, ...]:
    """The contact conditions and the contact pairs of a `Problem`, in the order of the config."""
    return (*_conditions(problem), *_pairs(problem))


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
                    name, place, b, condition.part, primary, None, law, None, periodic, True
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
        interfaces.append(
            PosedInterface(
                pair.name, key, body, part, primary, obstacle, _law(key, pair), direction
            )
        )
    return interfaces


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
    )
