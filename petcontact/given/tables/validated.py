"""A check of a whole model again, whatever way it was made."""

from __future__ import annotations

from typing import Any, TypeVar, cast, get_args

from .base import Model, checked, plain_values

M = TypeVar("M", bound=Model)


def validated(model: M) -> M:
    """A model of the same values, all of which are checked: a copy with other values is not.

    Raises
    ------
    InputError
        One line: key, what was given, what is allowed.
    """
    data = _unfolded(model)
    bodies = data.get("body")
    if isinstance(bodies, (list, tuple)) and len(bodies) == 1 and isinstance(bodies[0], dict):
        body = dict(bodies[0])
        if body.pop("name", "body") == "body":  # as it is given and read without [[body]]
            data = body | {key: value for key, value in data.items() if key != "body"}
    return cast(M, checked(type(model), lambda: type(model).model_validate(data), data))


def _unfolded(value: object) -> Any:
    """The values that a model was given, and the words that tell its kind, as plain tables."""
    if isinstance(value, Model):
        fields, given = type(value).model_fields, value.model_fields_set
        return {
            name: _unfolded(value.__dict__[name])
            for name, field in fields.items()
            if name in value.__dict__ and (name in given or len(get_args(field.annotation)) == 1)
        }
    plain = plain_values(value)
    return type(plain)(map(_unfolded, plain)) if type(plain) in (list, tuple) else plain
