"""Mistakes in a model's data as one line: key, what was given, what is allowed, what is most often
meant."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import pydantic
from pydantic_core import ErrorDetails

from ...runtime.hints import nearest, number_refused
from .model_tree import instead, models_at

NAME, WORD, FUNCTION = r"^[^./]+$", r"^[^\W\d][\w.]*$", r"^[^\W\d][\w.]*:[^\W\d][\w.]*$"
MATCHED = {
    NAME: "must have no '.' and no '/'",
    WORD: "must be a word of letters, digits, '_' and '.'",
    FUNCTION: "must be 'module:function'",
}
"""What is allowed, by the pattern of a text."""
SHOWN = 3
"""Mistakes of a file that are named at once: more would not be one line."""


def one_line(error: pydantic.ValidationError, cls: type, data: object) -> str:
    """The first mistakes of a report as `key: what is allowed, got what was given`, and how many
    more there are."""
    errors = error.errors(include_url=False)
    keys = [_key(list(m["loc"]), data) for m in errors]
    # an array whose entries are wrong is also called too short, or no table
    mistakes = [
        m
        for m, key in zip(errors, keys, strict=True)
        if not (m["type"].endswith(("_type", "too_short")) and _has_inner(key, keys))
    ]
    # a mistyped key is unknown and, under its right name, missing: the first of the two says what
    # happened
    telling = [m for m in mistakes if m["type"] == "extra_forbidden"] or mistakes
    lines = "; ".join(" ".join(_mistake(mistake, cls, data).split()) for mistake in telling[:SHOWN])
    return lines + (f"; and {len(telling) - SHOWN} more" if len(telling) > SHOWN else "")


def _has_inner(key: str, keys: Sequence[str]) -> bool:
    """Whether one of the keys lies inside of a key."""
    return any(other.startswith((f"{key}[", f"{key}.")) for other in keys)


def _mistake(mistake: ErrorDetails, cls: type, data: object) -> str:
    kind, loc, context = mistake["type"], list(mistake["loc"]), mistake.get("ctx", {})
    given = f", got {shown(mistake['input'])}"
    if kind == "control":
        return f"{_key([*loc, context['key']], data)}: {mistake['msg']}"
    if kind == "extra_forbidden":
        return f"{_key(loc, data)}: unknown key{instead(cls, loc, data)}"
    if kind.startswith("union_tag"):
        name = context["discriminator"].strip("'")
        tags = sorted({model.model_fields[name].default for model in models_at(cls, loc)})
        allowed = f"must be one of {', '.join(map(repr, tags))}"
        key = _joined(_key(loc, data), name)
        if kind == "union_tag_not_found":
            named = {k: v for k, v in dict(mistake["input"]).items() if v in tags}
            hint = "".join(f'; write {name} = "{v}", not {k}' for k, v in named.items())
            return f"{key}: this key is required, {allowed}{hint}"
        return f"{key}: {_no_tag(context['tag'], tags, allowed)}"
    if kind == "missing":
        if isinstance(loc[-1], int):
            return f"{_key(loc[:-1], data)}: needs {loc[-1] + 1} numbers{given}"
        return f"{_joined(_key(loc[:-1], data), loc[-1])}: this key is required"
    stated = MATCHED.get(str(context.get("pattern")), str(mistake["msg"]))
    message = str(context["error"]) if kind == "value_error" else _allowed(stated)
    key = _key(loc, data)
    # a model's own check names its values itself
    if not (kind == "value_error" and isinstance(mistake["input"], dict)):
        message += given + _meant(mistake, message, re.sub(r"\[\d+\]", "", key), cls)
    return ": ".join(filter(None, [key, message]))


def _no_tag(given: str, tags: list[str], allowed: str) -> str:
    """What is allowed in the place of a word; what is said of it names that, if anything is."""
    hint = nearest(given, tags)
    return f"{'' if hint.startswith(';') else f'{allowed}, '}got {shown(given)}{hint}"


def _meant(mistake: ErrorDetails, message: str, table: str, cls: type) -> str:
    """What a value that is not allowed most often means."""
    given, loc = mistake["input"], list(mistake["loc"])
    if message == "must be a table":
        keys = [key for model in models_at(cls, loc) for key in model.model_fields]
        return _table(given, table, keys, named=isinstance(loc[-1], str))
    if message == "must be an array":
        models = [m for m in models_at(cls, loc[:-1]) if loc[-1] in m.model_fields]
        return _array(given, table, models, of_tables=models != models_at(cls, loc))
    if isinstance(given, list | tuple):
        return _not_this_array(mistake["type"], given)
    if mistake["type"] == "literal_error":
        words = mistake["ctx"]["expected"].replace(" or ", ", ").replace("'", "")
        return nearest(given, words.split(", "))
    is_file = loc[-1:] == ["points"]  # a text there is its name
    return _not_this_text(given, message) if isinstance(given, str) and not is_file else ""


def _not_this_text(given: str, message: str) -> str:
    """What a text in the place of a number most often means."""
    refused, words = number_refused(given) * ("number" in message), nearest(given, [])
    if not refused and not words and message == "must be a number" and given.isidentifier():
        refused = f"[variables] has no {given}"
    return f"; {refused}" if refused and refused not in message else words


def _not_this_array(kind: str, given: Sequence[object]) -> str:
    """What an array of another length, or in the place of a text, most often means."""
    if kind == "too_short" and len(given) == 1 and isinstance(given[0], list):
        return f"; in single brackets: {shown(given[0])}"
    if kind == "too_long" and all(isinstance(each, int) for each in given):
        comma = "a number has a decimal point, not a comma"
        return f"; {comma if len(given) % 2 == 0 else '2D has x and y only'}"
    return "; one text, with a table for each" if kind == "string_type" else ""


def _table(given: object, table: str, keys: Sequence[str], *, named: bool) -> str:
    """How something that is no table is written as one; a text may be its name."""
    if named and "name" in keys and isinstance(given, str):
        return f'; write {table}.name = "{given}"'
    filled = nearest(given, []) or f"; as {{ {', '.join(f'{key} = ...' for key in keys[:SHOWN])} }}"
    return f"; in single brackets, [{table}]" if isinstance(given, list) else filled


def _array(given: object, table: str, models: list[Any], *, of_tables: bool) -> str:
    """How something that is no array is written as one, in a table of these models."""
    if (models and of_tables) or isinstance(given, (dict, pydantic.BaseModel)):
        return f"; in double brackets, [[{table}]], each time; in Python in a list"
    if not (isinstance(given, (int, float)) and models):
        return f"; in brackets: [{shown(given)}, ...]"
    vectors = f"; one number a direction: [{given}, 0.0] is along x, [0.0, {given}] along y"
    pressed = any("pressure" in model.model_fields for model in models)
    return vectors + f"; pressure = {abs(given)} presses" * pressed


def _allowed(message: str) -> str:
    """Pydantic's message in the words of a TOML file."""
    for theirs, ours in _WORDS:
        message = re.sub(theirs, ours, message)
    return re.sub(r"\d{16,}", lambda digits: f"{float(digits[0]):g}", message)


_WORDS = (
    ("Input should be", "must be"),
    ("should have", "must have"),
    (r"\w+ must have at least 1 item.*", "must not be empty"),
    (" after validation", ""),
    ("a valid dictionary.*", "a table"),
    ("a valid (tuple|list)", "an array"),
    ("a valid integer", "an integer"),
    ("valid ", ""),
    ("Tuple", "array"),
    ("String", "text"),
)


def _key(loc: list[int | str], data: object) -> str:
    """`boundary[2].friction_bound`; the union branches that pydantic puts in are what is not in the
    data."""
    text, value = "", data
    for step in loc:
        if isinstance(step, int):
            text += f"[{step}]"
            value = value[step] if isinstance(value, (list, tuple)) and step < len(value) else None
        elif isinstance(value, dict) and step in value:
            text, value = _joined(text, step), value[step]
    return text


def _joined(table: str, name: str) -> str:
    """A dotted key as TOML writes it."""
    name = name if name.isascii() and name.replace("-", "_").isidentifier() else shown(name)
    return f"{table}.{name}" if table else name


def shown(value: object) -> str:
    """A value as Python writes it, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
