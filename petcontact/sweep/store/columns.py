"""Rows as columns: numbers as numbers, texts as UTF-8 bytes, as they lie in the table of a
sweep."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Mask

Column = NDArray[Any]
Columns = dict[str, Column]
BLOCK = 1000
"""Rows that are held as Python objects at once."""


def columns_of(rows: Iterable[Mapping[str, Any]]) -> Columns:
    """Columns of some rows in their order; memory stays near that of the columns."""
    rest, blocks = iter(rows), []
    while block := list(itertools.islice(rest, BLOCK)):
        names = dict.fromkeys(name for row in block for name in row)
        blocks.append({name: column([row.get(name) for row in block]) for name in names})
    return stacked(blocks)


def column(values: Sequence[object]) -> Column:
    """Integers, floats with NaN for None, or else texts with "" for None; lists and tables become
    JSON."""
    kinds = set(map(type, values))
    if kinds == {int}:
        try:
            return np.array(values, np.int64)
        except OverflowError:
            return np.array(values, float)
    if kinds and kinds <= {int, float, type(None)}:
        return np.array([np.nan if value is None else value for value in values], float)
    return np.array([_text(value).encode() for value in values] or [b""], "S")[: len(values)]


def _text(value: object) -> str:
    return (
        value
        if isinstance(value, str)
        else ""
        if value is None
        else json.dumps(value, sort_keys=True)
    )


def stacked(blocks: Sequence[Columns]) -> Columns:
    """Columns below one another; where one is missing stands NaN or ""."""
    names = dict.fromkeys(name for block in blocks for name in block)
    sizes = [size_of(block) for block in blocks]
    return {name: _joined([block.get(name) for block in blocks], sizes) for name in names}


def _joined(parts: Sequence[Column | None], sizes: Sequence[int]) -> Column:
    kinds = {part.dtype.kind for part in parts if part is not None}
    if len(kinds) > 1 and "S" in kinds:
        parts = [
            column([json.dumps(v) for v in part.tolist()])
            if part is not None and part.dtype.kind != "S"
            else part
            for part in parts
        ]
    nothing: Column = np.array([b""]) if "S" in kinds else np.array([np.nan])
    return np.concatenate(
        [
            nothing.repeat(size) if part is None else part
            for part, size in zip(parts, sizes, strict=True)
        ]
    )


def size_of(columns: Columns) -> int:
    """Number of rows."""
    return len(next(iter(columns.values()))) if columns else 0


def taken(columns: Columns, rows: Index | Mask) -> Columns:
    """Return the columns of some rows, given by their numbers or a mask."""
    return {name: values[rows] for name, values in columns.items()}


def texts(values: Column) -> list[str]:
    """A column of texts as Python's."""
    return [value.decode() for value in values.tolist()]
