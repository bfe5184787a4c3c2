"""Base of all input models: validated once, frozen, and every mistake reported in one line."""

from __future__ import annotations

import inspect
import keyword
import re
import stat
from collections.abc import Callable, Collection
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    TypeGuard,
    dataclass_transform,
    get_origin,
)

import numpy as np
import pydantic
import pydantic_core
from pydantic.fields import FieldInfo

from ...arrays import LARGEST_COORDINATE, LARGEST_NUMBER
from ...errors import InputError
from ...runtime.file_kinds import like
from ...runtime.hints import Hinted, known_key
from ...untyped import Keyed
from ..expressions import parse_expression
from .frozen import Frozen
from .mistakes import NAME, one_line, shown

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(pydantic.BaseModel)  # its module is private and may move


def _within_limits(value: float) -> float:
    # a smaller number has lost digits, and its inverse is infinite
    if value != 0.0 and not np.finfo(float).tiny <= abs(value) <= LARGEST_NUMBER:
        raise InputError(
            "must be 0 or at least 2.23e-308 in size"
            if abs(value) < 1.0
            else f"must be at {'most ' if value > 0.0 else 'least -'}{LARGEST_NUMBER:g}"
        )
    return value


_Limited = pydantic.AfterValidator(_within_limits)
Finite = Annotated[float, pydantic.Field(strict=True, allow_inf_nan=False), _Limited]
Positive = Annotated[float, pydantic.Field(strict=True, gt=0.0, allow_inf_nan=False), _Limited]
NotNegative = Annotated[float, pydantic.Field(strict=True, ge=0.0, allow_inf_nan=False), _Limited]
Share = Annotated[float, pydantic.Field(strict=True, ge=0.0, le=1.0)]
Coordinate = Annotated[
    float,
    pydantic.Field(strict=True, ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE, allow_inf_nan=False),
]
Point = tuple[Coordinate, Coordinate]
SpacePoint = tuple[Coordinate, Coordinate, Coordinate]
Name = Annotated[str, pydantic.Field(min_length=1, pattern=NAME)]
Vector = pydantic.Field(min_length=2, max_length=3)
"""As many components as the body has dimensions."""
LONGEST_EXPRESSION = 500
NOT_IN_NAMES, NOT_IN_LINES = re.compile(r"[\x00-\x1f]"), re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
NOT_IN_TITLES = re.compile(r"\x00")


def _expression(value: object) -> float | str | tuple[float, ...] | Callable[..., object]:
    """One check instead of a union, whose report would name every branch."""
    if isinstance(value, str) and value.strip() and len(value) <= LONGEST_EXPRESSION:
        if not value.startswith("<function "):  # as files have it, see `_in_file`
            parse_expression(value)
        return value
    if callable(value):
        return value
    if _is_number(value):
        return float(value)
    if isinstance(value, (list, tuple)) and value and all(map(_is_number, value)):
        return tuple(map(float, value))
    raise ValueError(
        f"must be a finite number or an expression in quotes (from {-LARGEST_NUMBER:g} to "
        f"{LARGEST_NUMBER:g}, at most {LONGEST_EXPRESSION} characters)"
    )


def _is_number(value: object) -> TypeGuard[float]:
    return (
        isinstance(value, (int, float))
        and not isinstance(value, bool)
        and abs(value) <= LARGEST_NUMBER
    )


def _in_file(value: object) -> object:
    """What a result file says of an expression: a function has no text."""
    return (
        f"<function {getattr(value, '__name__', type(value).__name__)}>"
        if callable(value)
        else value
    )


def _something(value: tuple[float, ...]) -> tuple[float, ...]:
    if not 1e-300 < sum(component**2 for component in value) < 1e300:
        raise InputError("must be a vector other than zero")
    return value


Directed = pydantic.AfterValidator(_something)
"""Refuses vectors of no length, which have no direction."""
Direction = Annotated[tuple[Finite, Finite, Finite], Directed]


def whole_or_auto(most: int) -> pydantic.BeforeValidator:
    """Check that a value is a whole number from 1 to a largest one, or "auto".

    This is one check in place of a union, whose report would name every branch.
    """

    def check(value: object) -> object:
        whole = isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= most
        if not whole and value != "auto":
            raise InputError(f'must be a whole number from 1 to {most}, or "auto"')
        return value

    return pydantic.BeforeValidator(check)


def one_of(names: Collection[str]) -> pydantic.BeforeValidator:
    """Check that a text is one of some names, with the words of a literal."""

    def check(value: object) -> object:
        if value is not None and value not in list(names):
            allowed = " or ".join(
                filter(None, [", ".join(map(repr, [*names][:-1])), repr([*names][-1])])
            )
            raise pydantic_core.PydanticKnownError("literal_error", {"expected": allowed})
        return value

    return pydantic.BeforeValidator(check)


Expression = Annotated[
    float | str | tuple[float, ...] | Callable[..., object],
    pydantic.PlainValidator(_expression),
    pydantic.PlainSerializer(_in_file, when_used="json"),
    pydantic.WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]}),
]
"""A number, or an expression in x, y, nx, ny, s (see `petcontact.given.expressions`); in Python
also a function of some of these by name, or one value a node of the part."""


def plain_values(value: Any) -> Any:
    """numpy's arrays and scalars as Python's, which is what a file would hold."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return type(value)(map(plain_values, value)) if type(value) in (list, tuple) else value


@dataclass_transform(field_specifiers=(pydantic.Field,))
class _OneLine(ModelMetaclass):
    """Turns pydantic's report into an `InputError` of one line, for the outermost model only;
    values may be given by place.

    Nested models are built inside pydantic's core and not through this call, so that the place of a
    mistake in the whole input is known when the line is written.
    """

    def __call__(cls, *args: object, **kwargs: object) -> object:
        kwargs = {
            name.removesuffix("_") if keyword.iskeyword(name[:-1]) else name: value
            for name, value in kwargs.items()
        }
        kwargs = {
            name: plain_values(value)
            for name, value in (cls._by_place(args, kwargs) | kwargs).items()
        }
        return checked(cls, lambda: super(_OneLine, cls).__call__(**kwargs), kwargs)

    @property
    def __signature__(cls: Any) -> inspect.Signature:
        """Fields by place or by name, as values may be given; `help` and editors show it. `from` is
        `from_` in Python, and `...` the default of what one spelling has and another has not."""
        kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        spelled = cls.spelling({}).model_fields
        fields = [
            (bool(field.kw_only) or name not in cls.model_fields, name, field)
            for name, field in (cls.model_fields | spelled).items()
        ]
        texts = {
            name: text
            for base in (*reversed(cls.__mro__), cls.spelling({}))
            for name, text in vars(base).get("__annotations__", {}).items()
        }
        return inspect.Signature(
            [
                inspect.Parameter(
                    name + "_" * keyword.iskeyword(name),
                    kinds[by_name],
                    default=_default(field, name in cls.model_fields and name in spelled),
                    annotation=texts[name],
                )
                for by_name, name, field in sorted(fields, key=lambda item: item[0])
            ]
        )

    @__signature__.setter
    def __signature__(cls, value: object) -> None:
        """Ignore pydantic's own signature, in which arguments have names only."""

    def __dir__(cls) -> list[str]:
        """Names of ours: in `help` and completion those of pydantic's base would bury them."""
        return [name for name in super().__dir__() if not _hidden(name)]

    def _by_place(cls: Any, values: tuple[object, ...], named: Keyed) -> Keyed:
        """Values without a name, by the fields in their order."""
        if not values:
            return {}
        names = [name for name, field in cls.model_fields.items() if not field.kw_only]
        if len(values) > len(names):
            raise InputError(
                f"{cls.__name__}: takes {', '.join(names)} in this order, got {len(values)} values"
            )
        if twice := [name for name in names[: len(values)] if name in named]:
            raise InputError(f"{cls.__name__}: {twice[0]} is given twice")
        return dict(zip(names, values, strict=False))


_PYDANTICS = frozenset(dir(pydantic.BaseModel))


def _hidden(name: str) -> bool:
    """Whether a name is pydantic's or Python's, and not one of ours."""
    return name in _PYDANTICS or name.startswith("__")


def _default(field: FieldInfo, everywhere: bool) -> object:
    """The default of a parameter; `...` where the field is one of some spellings only and they
    require it."""
    if field.is_required():
        return inspect.Parameter.empty if everywhere else ...
    return field.get_default(call_default_factory=True)


class Model(Hinted, Frozen, metaclass=_OneLine):
    """A frozen input model; unknown keys are errors."""

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", defer_build=True)

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not _hidden(name)]

    @pydantic.model_validator(mode="before")
    @classmethod
    def _without_control_characters(cls, data: object) -> object:
        """Names go into files and file names; expressions may have several lines, and a title is
        printed with all that is no letter written out. The other spelling of a key is taken."""
        if not isinstance(data, dict):
            return data
        data = {known_key(key, cls.model_fields, data): data[key] for key in data}
        cls._refuse_one_of_several(data)
        for key, value in data.items():
            field = cls.model_fields.get(key)
            lines = field and any(isinstance(m, pydantic.PlainValidator) for m in field.metadata)
            refused = NOT_IN_TITLES if key == "title" else NOT_IN_LINES if lines else NOT_IN_NAMES
            for text in value if isinstance(value, (list, tuple, dict)) else (value,):
                if isinstance(text, str) and refused.search(text):
                    raise pydantic_core.PydanticCustomError(
                        "control", f"has a character below 32, got {shown(text)}", {"key": key}
                    )
        return data

    @classmethod
    def _refuse_one_of_several(cls, data: Keyed) -> None:
        """Refuse a model where a list of them is wanted: its fields would be taken for entries."""
        for key in data.keys() & cls.model_fields.keys():
            several = get_origin(cls.model_fields[key].annotation) is tuple
            if several and isinstance(data[key], Model):
                kind = type(data[key]).__name__
                text = f"must be an array, got one {kind}; in Python in a list: [{kind}(...)]"
                raise pydantic_core.PydanticCustomError(
                    "control", "{text}", {"key": key, "text": text}
                )

    @classmethod
    def spelling(cls, data: object) -> type[Model]:
        """The model whose keys the data have, for reports of mistakes in them."""
        return cls


class Shape(Model):
    """The geometry of a body.

    Attributes
    ----------
    has_inside : bool
        Whether its inside is known: not that of a superelement.
    """

    has_inside: ClassVar[bool] = True


def regular_file(path: str | Path, largest: int) -> Path:
    """The path of a file that a config names: no device, no pipe, not larger than so many bytes.

    Raises
    ------
    InputError
        One line that names the file.
    """
    try:
        state = Path(path).stat()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}){like(path)}") from None
    except ValueError:  # a null byte, which no file name has
        raise InputError(f"{str(path)!r}: is no file name") from None
    if not stat.S_ISREG(state.st_mode):
        raise InputError(f"{path}: not a regular file")
    if state.st_size > largest:
        raise InputError(f"{path}: {state.st_size} bytes, larger than the {largest} that are read")
    return Path(path)


def parse(cls: type[Model], data: Keyed, source: str) -> Any:
    """An instance of `cls` from plain data.

    Raises
    ------
    InputError
        One line: source, key, what was given, what is allowed.
    """
    return checked(cls, lambda: cls.model_validate(data), data, f"{source}: ")


def checked(cls: Any, build: Callable[[], object], data: object, head: str = "") -> Any:
    """What `build` makes; a mistake in the data is an `InputError` of one line."""
    try:
        return build()
    except pydantic.ValidationError as error:
        raise InputError(head + one_line(error, cls.spelling(data), data)) from None
    except (OverflowError, RecursionError) as error:
        raise InputError(f"{head}a value is out of range or nested too deeply ({error})") from None
