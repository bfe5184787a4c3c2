"""Cycles: a range of load steps that is done again and again while contacts wear."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

from ..errors import InputError
from ..given import posed
from ..given.tables.base import Model, Positive, whole_or_auto
from ..runtime.hints import among

MOST_CYCLES = 10**12
"""Cycles, at most."""


class Cycle(Model):
    """Steps that are done again and again while contacts wear.

    In a config::

        [cycle]
        first = "push"
        last = "pull"
        count = 10_000

    Attributes
    ----------
    first, last : str
        Names of the steps that a cycle begins and ends with.
    count : int
        How often the cycle is done, the first time included.
    jump : int or "auto"
        Cycles taken at once; "auto" keeps the change of p in a jump below the tolerance.
    tolerance : float
        With jump = "auto": largest change of p in a jump over p, in L2 of the contacts that wear
        [-].
    """

    first: str
    last: str
    count: Annotated[int, pydantic.Field(strict=True, ge=1, le=MOST_CYCLES)]
    jump: Annotated[int | Literal["auto"], whole_or_auto(MOST_CYCLES)] = "auto"
    tolerance: Annotated[Positive, pydantic.Field(le=1.0)] = 0.02

    def posed(self, steps: range) -> posed.Cycle:
        """The cycle with the numbers of its steps, as it is solved."""
        return posed.Cycle(steps, self.count, self.jump, self.tolerance)


def cycle_steps(problem: Any) -> range:
    """Numbers, from 1, of the steps of the cycle of a problem; none where it has no cycle."""
    if problem.cycle is None:
        return range(0)
    names = [step.name for step in problem.step]
    return range(names.index(problem.cycle.first) + 1, names.index(problem.cycle.last) + 2)


def check_cycle(problem: Any, cycle: Cycle) -> None:
    """Whether the steps of a cycle exist, lead back to where they ended the first time, and wear
    something.

    Raises
    ------
    ValueError
        One line that names the key.
    """
    names = [step.name for step in problem.step]
    for key in ("first", "last"):
        if names.count(name := getattr(cycle, key)) != 1:
            trouble = (
                f"no step {name!r}{among(name, [*filter(None, names)], 'names of steps are')}"
                if name not in names
                else f"{names.count(name)} steps are called {name!r}"
            )
            raise ValueError(f"cycle.{key}: {trouble}")
    steps = cycle_steps(problem)
    if not steps:
        raise InputError(f"cycle.last: step {cycle.last!r} comes before step {cycle.first!r}")
    laws = [*problem.contact, *(condition for body in problem.body for condition in body.boundary)]
    if all(getattr(law, "wear_coefficient", None) is None for law in laws):
        raise InputError(
            "cycle: nothing changes from cycle to cycle; give a contact a wear_coefficient"
        )
    _check_values(problem, steps)
    again = problem.step[steps[0] - 1 : steps[-1]]
    ends = _ends(problem.model_copy(update={"step": problem.step[: steps[-1]] + again}))
    for k, number in enumerate(steps):
        if ends[steps[-1] + k] != ends[number - 1]:
            raise InputError(
                f"cycle: does not close: step {names[number - 1]!r} ends elsewhere the second "
                "time; all that steps of a cycle change has to be brought back by its other steps"
            )
    if all(end == ends[-1] for end in ends[steps[0] - 1 : steps[-1]]):
        raise InputError(
            "cycle: does not close: from the second time on nothing moves in step "
            f"{names[steps[0] - 1]!r}; a cycle has a step to and one back"
        )


def _check_values(problem: Any, steps: range) -> None:
    """Refuse steps of a cycle whose ends depend on where they begin."""
    for number in steps:
        step = problem.step[number - 1]
        if any(change.goes_on for change in (*step.boundary, *step.obstacle)):
            raise InputError(
                f'cycle: step {step.name or number!r} has "hold" or by, which need not lead back; '
                "a cycle has values"
            )


def _ends(problem: Any) -> list[Any]:
    """All that steps may change, at the end of each step."""
    bodies = [
        states for body in problem.bodies for states in (body.conditions, body.loads, body.forces)
    ]
    return [list(end) for end in zip(*bodies, problem.obstacles_at[1:], strict=True)]
