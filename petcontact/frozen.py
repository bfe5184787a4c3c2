"""Dataclasses whose fields are set once, made and filled several times as fast as by
`dataclass(frozen=True)`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields
from typing import Any, NoReturn, TypeVar, dataclass_transform

T = TypeVar("T")
_PARAMS = "__dataclass_params__"


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(cls: type[T]) -> type[T]:
    """A dataclass that is compared, hashed and printed by its fields, which cannot be set again.

    `dataclass` writes source for each of these methods and compiles it, for each class, whenever
    the program starts: nearly all that a class costs. Here classes share them, and `__init__` is
    compiled when the first record is made; a method that a class or its base has is kept.

    >>> @frozen
    ... class Load:
    ...     part: str
    ...     value: float = 0.0
    >>> Load("top") == Load("top", 0.0), Load("top")
    (True, Load(part='top', value=0.0))
    """
    bases = [
        params for base in cls.__mro__[1:] if (params := vars(base).get(_PARAMS)) and params.frozen
    ]
    for params in bases:
        params.frozen = False
    try:
        made = dataclass(init=False, eq=False, repr=False)(cls)
    finally:
        for params in bases:
            params.frozen = True
    # so that classes of a user's own, which are `dataclass(frozen=True)`, may inherit from this
    vars(made)[_PARAMS].init = vars(made)[_PARAMS].frozen = True
    if "__init__" not in vars(made):
        setattr(made, "__init__", _Init(made))  # noqa: B010
    for name, method in _SHARED.items():
        if getattr(made, name) is getattr(object, name):
            setattr(made, name, method)
    return made


class _Init:
    """An `__init__` that takes its own place in the class as soon as it is asked for."""

    def __init__(self, cls: type) -> None:
        self._cls = cls

    def __get__(self, record: Any, owner: type | None = None) -> Callable[..., None]:
        init: Any = vars(self._cls)["__init__"]
        if init is self:
            init = _init_of(self._cls)
            setattr(self._cls, "__init__", init)  # noqa: B010
        return init.__get__(record, owner)  # type: ignore[no-any-return]


def _init_of(cls: type) -> Callable[..., None]:
    """As that of `dataclass`, but for `InitVar`; it fills the record's dictionary itself, as
    nothing in it is to be kept."""
    known: dict[str, Any] = {"_absent": MISSING}
    order = sorted((item for item in fields(cls) if item.init), key=lambda item: bool(item.kw_only))
    words, lines = ["self"], ["_record = self.__dict__"]
    for item in order:
        if item.kw_only and "*" not in words:
            words.append("*")
        words.append(item.name + _default(item, known))
    for item in fields(cls):
        value = item.name
        if item.default_factory is not MISSING:
            known["_make_" + value] = item.default_factory
            value = f"_make_{value}()" + (
                f" if {value} is _absent else {value}" if item.init else ""
            )
        elif not item.init:
            continue
        lines.append(f"_record[{item.name!r}] = {value}")
    lines += ["self.__post_init__()"] * hasattr(cls, "__post_init__")
    exec(f"def __init__({', '.join(words)}):\n " + "\n ".join(lines), known)
    init = known["__init__"]
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__annotations__ = {**{item.name: item.type for item in order}, "return": None}
    return init  # type: ignore[no-any-return]


def _default(item: Field[Any], known: dict[str, Any]) -> str:
    """What follows the name of a parameter."""
    if item.default_factory is not MISSING:
        return "=_absent"
    if item.default is MISSING:
        return ""
    known["_default_" + item.name] = item.default
    return f"=_default_{item.name}"


def _compared(record: Any) -> tuple[Any, ...]:
    return tuple(getattr(record, item.name) for item in fields(record) if item.compare)


def _eq(self: Any, other: Any) -> bool:
    return (
        _compared(self) == _compared(other) if other.__class__ is self.__class__ else NotImplemented
    )


def _hash(self: Any) -> int:
    return hash(_compared(self))


def _repr(self: Any) -> str:
    shown = ", ".join(
        f"{item.name}={getattr(self, item.name)!r}" for item in fields(self) if item.repr
    )
    return f"{type(self).__qualname__}({shown})"


def _set_once(self: Any, name: str, value: Any) -> None:
    declared = name in self.__dataclass_fields__
    # a subclass that is no dataclass may have attributes of its own, as those of `dataclass` may
    if (declared and name in self.__dict__) or (
        not declared and "__dataclass_fields__" in type(self).__dict__
    ):
        raise FrozenInstanceError(f"cannot assign to field {name!r}")
    self.__dict__[name] = value


def _keep(self: Any, name: str) -> NoReturn:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


_SHARED = {
    "__eq__": _eq,
    "__hash__": _hash,
    "__repr__": _repr,
    "__setattr__": _set_once,
    "__delattr__": _keep,
}
