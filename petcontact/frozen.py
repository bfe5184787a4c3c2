"""Dataclasses whose fields are set once, made several times as fast as by `dataclass(frozen=True)`."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, dataclass, field, fields
from typing import Any, NoReturn, TypeVar, dataclass_transform

T = TypeVar("T")
_PARAMS = "__dataclass_params__"


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(cls: type[T]) -> type[T]:
    """A dataclass that is compared, hashed and printed by its fields, which cannot be set again.

    `dataclass` writes source for each of these methods and compiles it, for each class, whenever the program starts:
    three quarters of what a class costs. Here classes share them; a method that a class or its base has is kept.

    >>> @frozen
    ... class Load:
    ...     part: str
    ...     value: float = 0.0
    >>> Load("top") == Load("top", 0.0), Load("top")
    (True, Load(part='top', value=0.0))
    """
    bases = [params for base in cls.__mro__[1:] if (params := vars(base).get(_PARAMS)) and params.frozen]
    for params in bases:
        params.frozen = False
    try:
        made = dataclass(eq=False, repr=False)(cls)
    finally:
        for params in bases:
            params.frozen = True
    # so that classes of a user's own, which are `dataclass(frozen=True)`, may inherit from this
    vars(made)[_PARAMS].frozen = True
    for name, method in _SHARED.items():
        if getattr(made, name) is getattr(object, name):
            setattr(made, name, method)
    return made


def _compared(record: Any) -> tuple[Any, ...]:
    return tuple(getattr(record, item.name) for item in fields(record) if item.compare)


def _eq(self: Any, other: Any) -> bool:
    return _compared(self) == _compared(other) if other.__class__ is self.__class__ else NotImplemented


def _hash(self: Any) -> int:
    return hash(_compared(self))


def _repr(self: Any) -> str:
    shown = ", ".join(f"{item.name}={getattr(self, item.name)!r}" for item in fields(self) if item.repr)
    return f"{type(self).__qualname__}({shown})"


def _set_once(self: Any, name: str, value: Any) -> None:
    declared = name in self.__dataclass_fields__
    # a subclass that is no dataclass may have attributes of its own, as those of `dataclass` may
    if (declared and name in self.__dict__) or (not declared and "__dataclass_fields__" in type(self).__dict__):
        raise FrozenInstanceError(f"cannot assign to field {name!r}")
    self.__dict__[name] = value


def _keep(self: Any, name: str) -> NoReturn:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


_SHARED = {"__eq__": _eq, "__hash__": _hash, "__repr__": _repr, "__setattr__": _set_once, "__delattr__": _keep}
