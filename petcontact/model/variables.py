"""Variables of a config: numbers by name, of which any number of the file may be an expression."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import simpleeval

from ..errors import InputError
from ..given.expressions import FUNCTIONS, parse_expression, plain_value
from ..given.tables.mistakes import WORD, shown
from ..given.tables.model_tree import Class, models_below
from ..runtime.hints import nearest, number_refused
from ..untyped import Keyed

TAKEN = frozenset(("x", "y", "z", "nx", "ny", "nz", "s", "pi", "e", *FUNCTIONS))
"""Names that expressions know already."""
Replaced = Callable[[str, str], Any]
"""What a text at a place of the file stands for."""
WORDS = re.compile(r"(?<![\w.])[^\W\d]\w*")


def with_values(data: Keyed, models: tuple[Class, ...], source: str) -> Keyed:
    """Return plain data whose numbers are no expressions any more, of variables or of none.

    Parameters
    ----------
    data : dict
        A config with the table "variables", numbers or expressions of those before them.
    models : tuple of models
        What the config may be: keys that take no number stay as they are.
    source : str
        Named in errors.

    Raises
    ------
    InputError
        If a variable has no name that expressions can use, or no value.
    """
    given, values = data.get("variables", {}), dict[str, float]()
    if not isinstance(given, dict):
        return data
    for name, value in given.items():
        key = f"{source}: variables.{name}"
        if not re.fullmatch(WORD, name) or "." in name or name in TAKEN:
            known = f"; expressions know {name} already" if name in TAKEN else ""
            raise InputError(f"{key}: must be a word of letters, digits and _{known}")
        _demand_names(value, given, frozenset(), key)
        value = _replaced(value, values) if isinstance(value, str) else value
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            refused = number_refused(value) if isinstance(value, str) else ""
            raise InputError(
                f"{key}: must be a number or an expression of those before it, got {shown(value)}"
                f"{f'; {refused}' if refused else nearest(value, [])}"
            )
        values[name] = value
    keys, words = _numeric(models)
    rest = {key: value for key, value in data.items() if key != "variables"}

    def replaced(text: str, place: str) -> Any:
        _demand_names(text, values, words, f"{source}: {place}")
        return _replaced(text, values)

    given_too = dict.fromkeys(data.keys() & {"variables"}, values)
    return {**_walked(rest, replaced, keys), **given_too}


@functools.cache
def _numeric(models: tuple[Class, ...]) -> tuple[frozenset[str], frozenset[str]]:
    """Keys that take a number, alone or in arrays and tables, and all words that are keys or
    values."""
    fields = [
        (name, str(field.annotation))
        for root in models
        for model in models_below(root)
        for name, field in model.model_fields.items()
    ]
    words = {word for _, kind in fields for word in re.findall(r"'(\w+)'", kind)}
    keys = {name for name, kind in fields if re.search(r"\b(float|int|Callable)\b", kind)}
    return frozenset(keys), frozenset({*words, *(name for name, _ in fields)})


def _walked(table: object, replaced: Replaced, keys: frozenset[str], place: str = "") -> Any:
    """The data with the values of expressions; `keys` are those that take numbers."""
    if isinstance(table, list):
        return [_walked(each, replaced, keys, f"{place}[{k}]") for k, each in enumerate(table)]
    if not isinstance(table, dict):
        return table
    return {
        key: (_in_numbers if key in keys else _walked)(
            value, replaced, keys, f"{place}.{key}".removeprefix(".")
        )
        for key, value in table.items()
    }


def _in_numbers(value: object, replaced: Replaced, keys: frozenset[str], place: str) -> object:
    if isinstance(value, list):
        return [_in_numbers(each, replaced, keys, f"{place}[{k}]") for k, each in enumerate(value)]
    if isinstance(value, dict) and keys & value.keys():
        return _walked(value, replaced, keys, place)
    if isinstance(value, dict):
        return {
            name: _in_numbers(each, replaced, keys, f"{place}.{name}")
            for name, each in value.items()
        }
    return replaced(value, place) if isinstance(value, str) else value


def _demand_names(text: object, variables: Iterable[str], words: frozenset[str], key: str) -> None:
    """Refuse a word of an expression that is near a variable and nothing else."""
    if not isinstance(text, str) or number_refused(text):
        return
    known = {*variables, *TAKEN, *words}
    for word in (word for word in WORDS.findall(text) if word not in known):
        if (hint := nearest(word, [*variables])).startswith(","):
            raise InputError(f"{key}: unknown name {shown(word)} in expression {shown(text)}{hint}")


def _replaced(text: str, values: Mapping[str, float]) -> Any:
    """The value of an expression of variables, pi and functions alone, else the text with the
    values of variables."""
    used = {*WORDS.findall(text)}
    if not used & {*values, "pi", *FUNCTIONS} or text.strip() in FUNCTIONS:
        return text
    # Python reads other letters for some names, such as Greek mu for the sign of micro
    own = WORDS.sub(lambda word: f"({values[word[0]]!r})" if word[0] in values else word[0], text)
    if not used <= {*values, "pi", "e", *FUNCTIONS}:
        return own
    try:
        number = float(plain_value(parse_expression(own), {}, 1)[0])
    except (InputError, simpleeval.InvalidExpression):
        number = math.nan
    if not math.isfinite(number):
        return text  # what its key takes is said where that is read
    return int(number) if number == round(number) and abs(number) < 1e15 else number
