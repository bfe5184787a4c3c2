"""The interfaces of a problem, whose gaps, friction and wear become functions of the place."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from ..arrays import Array
from ..errors import InputError
from ..geometry.outline import Outline
from ..geometry.surface import Boundary
from ..given import splines  # noqa: F401 (it registers a kind of datum)
from ..given.interface_data import FRICTION, PLACED, Law, PosedInterface
from ..given.values import Given, as_given
from ..runtime.hints import demand_name
from .bodies import Contact, Pair, Periodic, names_of, part_name
from .description import value_text
from .obstacles import Obstacle
from .setting import Bodies


def posed_interfaces(problem: Bodies) -> tuple[PosedInterface, ...]:
    """The contact conditions and the contact pairs of a `Problem`, in the order of the config.

    Raises
    ------
    InputError
        If a step changes a contact that there is not, or gives it what it cannot take.
    """
    interfaces = [*_conditions(problem), *_pairs(problem)]
    names = list(dict.fromkeys(side.group for side in interfaces if not side.periodic))
    changes = dict[str, list[tuple[int, str, object]]]()
    for s, step in enumerate(problem.step):
        for k, change in enumerate(step.contact):
            key = f"step[{s}].contact[{k}]"
            demand_name(f"{key}.name: no contact", change.name, names, "contacts are")
            changes.setdefault(change.name, []).append((s, key, change))
    count = max(1, len(problem.step))
    return tuple(_in_steps(side, changes.get(side.group, []), count) for side in interfaces)


def _in_steps(
    side: PosedInterface, changes: list[tuple[int, str, object]], count: int
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
        laws.append(law)
    return replace(side, laws=tuple(laws))


def _changed(side: PosedInterface, key: str, change: object) -> Iterator[tuple[str, Any]]:
    """What a step changes of a law."""
    for name in (*PLACED, "preload"):
        value = getattr(change, name)
        if value is None:
            continue
        if name in FRICTION and side.law.normal == "bonded":
            raise InputError(f"{key}.{name}: contact {side.name!r} is bonded and does not slip")
        yield name, value if name == "preload" else as_given(value, f"{key}.{name}")


def _conditions(problem: Bodies) -> Iterator[PosedInterface]:
    for b, body in enumerate(problem.body):
        for k, condition in enumerate(body.boundary):
            if not isinstance(condition, Contact | Periodic):
                continue
            name = condition.part if problem.is_flat else f"{body.name}.{condition.part}"
            key = f"boundary[{k}] ({condition.part})"
            place = key if problem.is_flat else f"body[{b}].{key}"
            primary = (b, condition.partner) if isinstance(condition, Periodic) else None
            bonded = Contact(condition.part, normal="bonded")
            law = _law(place, condition if isinstance(condition, Contact) else bonded)
            yield PosedInterface(
                name,
                place,
                b,
                condition.part,
                primary,
                None,
                law,
                None,
                (),
                primary is not None,
                True,
            )


def _pairs(problem: Bodies) -> list[PosedInterface]:
    return [
        _pair(problem, k, pair, secondary, choice)
        for k, pair in enumerate(problem.contact)
        for secondary in names_of(pair.secondary)
        for choice in range(len(names_of(pair.primary)))
    ]


def check_pairs(problem: Bodies) -> None:
    """Refuse a part that meets itself or another one twice, and obstacles that none can choose.

    Raises
    ------
    InputError
    """
    stated, obstacles = dict[frozenset[object], str](), [o.name for o in problem.obstacle]
    for k, pair in enumerate(problem.contact):
        for own, other in itertools.product(names_of(pair.secondary), names_of(pair.primary)):
            secondary = problem.side(f"contact[{k}].secondary", own)
            primary = (
                other
                if other in obstacles
                else problem.side(f"contact[{k}].primary", other, obstacles)
            )
            if secondary == primary:
                raise InputError(f"contact[{k}].primary: {other!r} is the secondary side itself")
            name = part_name(pair.name, own, other)
            first = stated.setdefault(frozenset((secondary, primary)), name)
            if first != name:
                raise InputError(
                    f"contact[{k}]: {own!r} and {other!r} are in contact already, "
                    f"as {first.partition(': ')[0]!r}; each would carry a part of the pressure"
                )
        _check_choice(f"contact[{k}]", pair, problem.obstacle)


def _check_choice(key: str, pair: Pair, obstacles: Sequence[Obstacle]) -> None:
    """Refuse an obstacle among several primaries that nodes cannot choose by its distance."""
    names = names_of(pair.primary)
    for obstacle in (o for o in obstacles if o.name in names and len(names) > 1):
        if obstacle.shape is None:
            raise InputError(
                f"{key}.primary: obstacle {obstacle.name!r} has no shape, so that every node would "
                f"meet it; of several primaries an obstacle needs one, as in shape = 'circle'"
            )
        for name, allowed in (("gap", "geometry"), ("normal", "unilateral")):
            if (given := getattr(pair, name)) != allowed:
                raise InputError(
                    f"{key}.{name}: several primaries with an obstacle take {allowed!r} only, "
                    f"got {value_text(given)}; give each pair a [[contact]] of its own"
                )


def _pair(problem: Bodies, k: int, pair: Pair, secondary: str, choice: int) -> PosedInterface:
    """The interface of one secondary part with one primary of a contact."""
    key, along, several = f"contact[{k}]", pair.direction, pair.has_several
    other, obstacles = names_of(pair.primary)[choice], [o.name for o in problem.obstacle]
    body, part = problem.side(f"{key}.secondary", secondary)
    rigid = other in obstacles
    obstacle = obstacles.index(other) if rigid else None
    primary = None if rigid else problem.side(f"{key}.primary", other, obstacles)
    direction = None if along is None else np.array(along) / np.linalg.norm(along)
    law = _law(key, pair)
    if obstacle is not None and law.gap is None and law.normal == "unilateral":
        law = replace(law, gap=_distance(problem, obstacle, f"{key}.gap", direction))
    name = part_name(pair.name, secondary, other) if several else pair.name
    posed = PosedInterface(name, key, body, part, primary, obstacle, law, direction, ())
    return replace(posed, contact=pair.name, choice=choice) if several else posed


def within_reach(
    interfaces: Iterable[PosedInterface], boundaries: Sequence[Boundary]
) -> Iterator[PosedInterface]:
    """Yield the interfaces, of a contact of several parts those that may touch.

    A secondary part leaves out a plane part that lies farther away than the nearest one by more
    than its own size: small displacements do not reach over that.
    """
    for _, group in itertools.groupby(interfaces, lambda side: (side.group, side.ends[0])):
        sides = list(group)
        apart = [_apart(side, boundaries) for side in sides]
        nearest = min(distance for distance, _ in apart)
        yield from (
            side
            for side, (distance, size) in zip(sides, apart, strict=True)
            if not distance > nearest + size
        )


def _apart(side: PosedInterface, boundaries: Sequence[Boundary]) -> tuple[float, float]:
    """The distance of two plane parts, 0 of others, and the size of the secondary [length]."""
    points = [
        np.array([s.point(np.linspace(0.0, 1.0, 9)) for s in outline.sides if s.part == part])
        for outline, part in ((boundaries[b], part) for b, part in side.ends)
        if isinstance(outline, Outline)
    ]
    if len(points) < 2 or not all(map(len, points)):  # a part that does not exist is refused later
        return 0.0, 0.0
    own, other = (each.reshape(-1, 2) for each in points)
    size = float(np.linalg.norm(np.ptp(own, axis=0)))
    return float(scipy.spatial.distance.cdist(own, other).min()), size


def _distance(problem: Bodies, number: int, key: str, direction: Array | None) -> Given | None:
    """The distance to an obstacle along a direction, None if it has no shape."""
    obstacle, ray = problem.obstacle[number], None if direction is None else direction.tolist()
    if obstacle.shape is None:
        return None
    from .tools import aimed

    return as_given(aimed(obstacle, ray and tuple(ray), axial=problem.symmetry == "axial"), key)


def _law(place: str, law: Contact | Pair) -> Law:
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
