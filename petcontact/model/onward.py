"""Displacements in a step that go on from where the step before has left them."""

from __future__ import annotations

from typing import Any

import pydantic

from ..errors import InputError
from ..given.posed import HOLD
from .bodies import Displacement, Traction

Values = tuple[Any, ...]


class Onward(Displacement):
    """A displacement in a step of which some components go on from where the step before has left
    them; `value` has by how much they do.

    Attributes
    ----------
    onward : a bool a component
        Whether `value` is added to what the step before has left.
    """

    onward: tuple[bool, ...] = pydantic.Field(kw_only=True)


def at_rest(condition: object) -> Any:
    """Return a condition in a later step that does not change it: what went on stays."""
    if not isinstance(condition, Onward):
        return condition
    pairs = zip(condition.value, condition.onward, strict=True)
    still = tuple(0.0 if onward else value for value, onward in pairs)
    if still == condition.value:
        return condition
    return condition.model_copy(update={"value": still})


def moved_on(old: Any, change: Any, key: str) -> Onward:
    """The condition of a part that a step holds where it is, or moves on from there.

    Parameters
    ----------
    old : Displacement, Traction or None
        The condition until then; None of a part that is free.
    change : BoundaryChange
    key : str
        The key of the change.

    Raises
    ------
    InputError
        If the components do not fit, or a pressure would stay on some of them.
    """
    value, by = ways_of(change.value, change.by)
    if old is not None and not isinstance(old, Displacement | Traction):
        raise InputError(f"{key}.part: a {old.condition} condition cannot go on from where it is")
    known = getattr(old, "value", None) or value
    if len(value) != len(known):
        raise InputError(
            f"{key}.value: the condition of {change.part!r} has {len(known)} components, got "
            f"{len(value)}"
        )
    kept = "free" in value and not change.traction
    if kept and getattr(old, "pressure", None) is not None:
        raise InputError(
            f"{key}.value: the pressure on {change.part!r} cannot stay on some components; hold "
            f"all, or give the traction of those that are free"
        )
    nothing = (0.0,) * len(value)
    load = _where("free", value, change.traction or _load(old) or nothing, nothing)
    return Onward(
        part=change.part,
        value=_where(HOLD, value, by, value),
        traction=load if any(load) else None,
        onward=_where(HOLD, value, (True,) * len(value), (False,) * len(value)),
    )


def _where(word: str, value: Values, these: Values, those: Values) -> Values:
    """Take these components where a value is a word, and those elsewhere."""
    return tuple(
        this if component == word else that
        for component, this, that in zip(value, these, those, strict=True)
    )


def _load(old: Displacement | Traction | None) -> tuple[object, ...] | None:
    """The traction that acts on free components, if there is one."""
    return getattr(old, "traction" if isinstance(old, Displacement) else "value", None)


def ways_of(value: Values | None, by: Values | None) -> tuple[Values, Values]:
    """Components of a change, and by how much each moves on, of which one may be missing.

    >>> ways_of(None, ("free", 0.1)), ways_of(("hold", 2.0), None)
    ((('free', 'hold'), (0.0, 0.1)), (('hold', 2.0), (0.0, 0.0)))
    """
    by = by or (0.0,) * len(value or ())
    value = value or _where("free", by, by, (HOLD,) * len(by))
    return value, _where("free", by, (0.0,) * len(by), by)


def check_by(key: str, value: object, by: object) -> None:
    """Refuse `by` for components that do not go on from where they are.

    Raises
    ------
    InputError
        One line that names the key.
    """
    if not isinstance(value, tuple) or not isinstance(by, tuple):
        return
    if len(by) != len(value):
        raise InputError(f"by: must have as many components as {key}, {len(value)}, got {len(by)}")
    for c, (component, way) in enumerate(zip(value, by, strict=True)):
        if way != 0.0 and component != HOLD and not way == component == "free":
            raise InputError(f'by[{c}]: must be 0 where {key}[{c}] is not "hold", got {way!r}')
