"""/numbers of a result file: what the verdict prints, with its errors, a JSON table each."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import h5py
import numpy as np

from ...mesh.storage import demand
from ...untyped import Group, Keyed
from ..numbers.number import Number

KINDS: Keyed = {
    "str": str,
    "int": int,
    "float": (int, float),
    "Array": list,
    "Array | None": list,
}
"""What JSON has for the fields of a number, by their annotations; null where there is none."""


def as_json(number: Number) -> str:
    """A number as a table; null stands for what is not known, or has no bound."""
    table = {each.name: plain(getattr(number, each.name)) for each in fields(number)}
    return json.dumps(table | {"bounded": not math.isinf(number.error)})


def plain(value: object) -> object:
    """A value as JSON has it: lists, and None for what is not finite."""
    if isinstance(value, np.ndarray):
        return [plain(each) for each in value.tolist()]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_numbers(group: Group, numbers: Sequence[Number]) -> None:
    """Write the dataset "numbers", each number as a text in JSON."""
    rows = np.array([as_json(number) for number in numbers], dtype=object)
    group.create_dataset("numbers", data=rows, dtype=h5py.string_dtype())


def read_numbers(group: Group, source: str) -> tuple[Number, ...] | None:
    """The numbers that a file holds; None where it holds none."""
    if "numbers" not in group:
        return None
    return tuple(_number(json.loads(row), source) for row in group["numbers"].asstr()[()])


def _number(row: Any, source: str) -> Number:
    row = {"beside": None, "exponent": None} | row  # files of earlier versions lack these two
    values: Keyed = {each.name: row[each.name] for each in fields(Number)}
    for each in fields(Number):
        value, kinds = values[each.name], KINDS[str(each.type)]
        good = value is None or (isinstance(value, kinds) and not isinstance(value, bool))
        demand(good, f"{source}: numbers: {each.name} is {value!r}")
    demand(values["value"] is not None, f"{source}: numbers: a value is missing")
    unknown = np.nan if row["bounded"] else np.inf
    values["error"] = unknown if values["error"] is None else float(values["error"])
    values["value"] = np.array(values["value"], dtype=float)
    values["exponent"] = np.nan if row["exponent"] is None else float(row["exponent"])
    for key in ("place", "beside"):
        values[key] = None if row[key] is None else np.array(row[key], dtype=float)
    return Number(**values)
