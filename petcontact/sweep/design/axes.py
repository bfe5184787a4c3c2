"""Axes of a sweep: keys whose values change together, what they are called, and the words that they
give to the ids."""

from __future__ import annotations

import json
import re
from collections.abc import Hashable, Mapping, Sequence
from decimal import Decimal
from typing import Any

from ...errors import InputError
from ...geometry.smooth_curve import quiet
from ...model.case import KEYS, whole_key
from ...record import record
from .sweep_file import Sample, SweepFile

SHORT = {"method.rule": "", "method.rho": "rho", "mesh.element_size": "h"}
"""What stands before the value in an id, where that is not the name of the key."""


@record
class Axis:
    """Keys that change together.

    Attributes
    ----------
    keys : tuple of str
        Dotted keys.
    values : list of tuple
        One an entry, one value a key.
    words : list of str
        What each entry is called in an id.
    """

    keys: tuple[str, ...]
    values: list[tuple[Any, ...]]
    words: list[str]


def make_axes(
    file: SweepFile, problems: Sequence[Mapping[str, object]], source: str
) -> tuple[list[Axis], dict[str, str]]:
    """Return the axes of a sweep, and names of their keys. `cross` has an axis a key; `zip`,
    `sample` and `points` have one each.

    Raises
    ------
    InputError
        If a key is given twice, its entries cannot be distinguished, or a name is given to a key
        that does not vary.
    """
    tables = [*({key: values} for key, values in file.cross.items()), file.zip]
    worded = [(table, "") for table in tables if table]
    for word, table in (("sample", sampled(file.sample)), ("point", file.points)):
        if isinstance(table, Mapping) and table:
            worded.append((table, word))
    keys = [tuple(full_key(key, source) for key in table) for table, _ in worded]
    given = {full_key(key, source): name for key, name in file.names.items()}
    keys_of_axes = [key for some in keys for key in some]
    names = names_of(keys_of_axes, problems, given)
    if unknown := set(given) - set(keys_of_axes):
        raise InputError(f"{source}: names: {min(unknown)} does not vary")
    axes = [
        Axis(some, list(zip(*table.values(), strict=True)), _entries(some, names, table, word))
        for some, (table, word) in zip(keys, worded, strict=True)
    ]
    return axes, names


def _entries(
    keys: Sequence[str], names: Mapping[str, str], table: Mapping[str, list[object]], word: str
) -> list[str]:
    """What the entries of an axis are called: by their values, or by a word and a number."""
    if word:
        count = len(next(iter(table.values())))
        return [f"{word}{number}" for number in range(1, count + 1)]
    columns = [
        _words(SHORT.get(key, names[key].replace("_", "")), some)
        for key, some in zip(keys, table.values(), strict=True)
    ]
    return ["-".join(some) for some in zip(*columns, strict=True)]


def sampled(sample: Sample | None) -> dict[str, list[float]]:
    """Points of a design by key, the same for the same seed."""
    if sample is None:
        return {}
    from scipy.stats import qmc

    kind = {"latin-hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}[sample.method]
    engine = kind(d=len(sample.range), seed=sample.seed)
    # scipy warns of a number of Sobol points that is no power of two
    unit = quiet(engine.random, sample.points)
    return {
        key: (
            low * (high / low) ** part if key in sample.log else low + (high - low) * part
        ).tolist()
        for (key, (low, high)), part in zip(sample.range.items(), unit.T, strict=True)
    }


def full_key(key: str, source: str) -> str:
    """The dotted key of a short one: rho is method.rho, element_size is mesh.element_size.

    Raises
    ------
    InputError
        If there is no such key.
    """
    full = whole_key(key)
    if "." not in full and full not in KEYS:
        raise InputError(
            f"{source}: {key}: neither a key of [method], [mesh] or [bem] nor a dotted key"
        )
    return full


def names_of(
    keys: Sequence[str], problems: Sequence[Mapping[str, object]], given: Mapping[str, str] = {}
) -> dict[str, str]:
    """What keys are called: as is `given`, by their last word where that is unique, else by
    `speaking`.

    >>> case = {"boundary": [{"part": "left", "value": [1.0, 0.0]}]}
    >>> names_of(["method.rho", "boundary.0.value.1"], [case])
    {'method.rho': 'rho', 'boundary.0.value.1': 'left.value.y'}
    """
    spoken = {key: {speaking(key, data) for data in problems} for key in keys}
    whole = {key: words.pop() if len(words) == 1 else key for key, words in spoken.items()}
    last = [name.rsplit(".", 1)[-1] for name in whole.values()]
    short = {
        key: word
        if last.count(word) == 1 and not re.fullmatch(r"[xyz]|value|\d+", word)
        else whole[key]
        for key, word in zip(whole, last, strict=True)
    }
    return {**short, **given}


def speaking(key: str, data: Any) -> str:
    """A dotted key with names of bodies, parts, pairs and steps in the place of their numbers, and
    x, y, z of components."""
    words: list[str] = []
    for step in key.split("."):
        inside = isinstance(data, (list, tuple)) and step.isdecimal() and int(step) < len(data)
        entry = data[int(step)] if inside else data.get(step) if isinstance(data, Mapping) else None
        if inside and isinstance(entry, Mapping) and (entry.get("name") or entry.get("part")):
            words[-1] = ".".join(
                value_word(entry[name]) for name in ("body", "name", "part") if entry.get(name)
            )
        else:
            words.append(
                "xyz"[int(step)]
                if inside and not isinstance(entry, Mapping) and len(data) <= 3
                else step
            )
        data = entry
    return ".".join(words)


def _words(name: str, values: Sequence[object]) -> list[str]:
    """A key and its values in ids: `rho1e3`, `poissonratio0.2`; a rule stands for itself."""
    words = list(map(value_word, values))
    different = len(
        {
            value if isinstance(value, Hashable) else json.dumps(value, default=str)
            for value in values
        }
    )
    # entries are numbered where a value is long, or values look alike
    if max(map(len, words)) > 24 or len(set(words)) < different:
        words = [f"{number}" for number in range(1, len(words) + 1)]
    return [name + word for word in words]


def value_word(value: object) -> str:
    """A value as part of an id; different numbers give different texts."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return short_number(value)
    text = value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=str)
    return re.sub(r"[^\w.+]+", "-", text).strip("-.") or "empty"


def short_number(value: float) -> str:
    """The shorter of 1000.0 and 1e3 without what says nothing."""
    scientific = f"{Decimal(repr(value)).normalize():e}".replace("e+", "e")
    return min(repr(value).removesuffix(".0"), scientific, key=len)
