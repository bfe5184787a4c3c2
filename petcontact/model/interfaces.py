"""The interfaces of a problem: which parts may touch, and under which law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from .bodies import Contact, Periodic


@dataclass(frozen=True)
class PosedInterface:
    """One interface as the config has it.

    Attributes
    ----------
    name, key : str
        Name, and the place in the config for errors.
    body : int
        Number of the body of the secondary.
    part : str
        Part of the secondary.
    primary : (int, str), optional
        Body and part of the primary.
    obstacle : int, optional
        Number of the obstacle; with neither a body nor an obstacle the primary is fixed ground.
    law : Contact or Pair
        Holds the normal condition, the gap and the friction.
    direction : (d,) array, optional
        Unit vector from the secondary to the primary.
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
    def ends(self) -> list[tuple[int, str]]:
        """Body and part of the secondary, and of the primary where that is a body."""
        return [end for end in ((self.body, self.part), self.primary) if end is not None]

    @property
    def bodies(self) -> list[int]:
        """Numbers of the bodies that meet."""
        return [number for number, _ in self.ends]

    @property
    def holds_normal(self) -> bool:
        """Whether u_n = gap is known data of the body, as in the paper.

        This is so in contact with fixed ground that the body cannot leave, under friction that
        does not depend on pressure. A method looks for tangential tractions only then.
        """
        return (
            self.primary is None
            and self.obstacle is None
            and self.direction is None
            and self.law.normal != "unilateral"
            and self.law.friction_coefficient is None
        )


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
            law = Contact(condition.part, normal="bonded") if periodic else condition
            interfaces.append(
                PosedInterface(name, place, b, condition.part, primary, None, law, None, periodic)
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
            PosedInterface(pair.name, key, body, part, primary, obstacle, pair, direction)
        )
    return interfaces
