"""Records: classes of named fields that do not change, made quickly, and what dataclasses has for
them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from dataclasses import field as field
from dataclasses import fields as fields
from dataclasses import replace as replace
from typing import Any, TypeVar, cast, dataclass_transform

from .untyped import Keyed

Class = TypeVar("Class", bound=type)
Value = TypeVar("Value")


def _compared(record: Any) -> tuple[object, ...]:
    return tuple(getattr(record, key.name) for key in fields(record) if key.compare)


def _equal(self: object, other: object) -> bool:
    return _compared(self) == _compared(other) if type(self) is type(other) else NotImplemented


def _hash(self: object) -> int:
    return hash(_compared(self))


def _shown(self: Any) -> str:
    values = (f"{key.name}={getattr(self, key.name)!r}" for key in fields(self) if key.repr)
    return f"{type(self).__qualname__}({', '.join(values)})"


METHODS = {"__eq__": _equal, "__hash__": _hash, "__repr__": _shown}
"""Methods that all records share."""


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def record(cls: Class) -> Class:
    """A frozen dataclass, equal by value, whose class is made in a fifth of the time.

    ``dataclass(frozen=True)`` writes and compiles six methods for each class, which was a tenth of
    a small solve. Here it writes ``__init__`` only; the others are the same for all records. That
    nothing assigns to a field is asked of the types (mypy), not at each assignment.
    """
    dataclass(eq=False, repr=False, match_args=False)(cls)
    for name, method in METHODS.items():
        if name not in vars(cls):
            setattr(cls, name, method)
    return cls


class Keeping:
    """Base of what computes things once; what is kept is not pickled."""

    @functools.cached_property
    def _kept(self) -> dict[Hashable, object]:
        """What was computed, by its key."""
        return {}

    def once(self, key: Hashable, compute: Callable[[], Value]) -> Value:
        """Return what follows from this and a key alone."""
        if key not in self._kept:
            self._kept[key] = compute()
        return cast(Value, self._kept[key])

    def __getstate__(self) -> Keyed:
        return {name: value for name, value in self.__dict__.items() if name != "_kept"}
