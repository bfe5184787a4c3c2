"""Rows as columns: numbers as numbers, texts as UTF-8 bytes, as they lie in the table of a sweep."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Column = NDArray[Any]
Columns = dict[str, Column]
BLOCK = 1000
"""Rows that are held as Python objects at once."""


def columns_of(rows: Iterable[Mapping[str, Any]]) -> Columns:
    """Columns of some rows in their order; memory stays near that of the columns."""
    blocks, block = list[Columns](), list[Mapping[str, Any]]()
    for row in rows:
        block.append(row)
        if len(block) == BLOCK:
            blocks.append(_columns(block))
            block = []
    if block or not blocks:
        blocks.append(_columns(block))
    return stacked(blocks)


def _columns(rows: Sequence[Mapping[str, Any]]) -> Columns:
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: column([row.get(name) for row in rows]) for name in names}


def column(values: Sequence[Any]) -> Column:
    """Integers, floats with NaN for None, or else texts with "" for None; lists and tables become JSON."""
    kinds = set(map(type, values))
    if kinds == {int}:
        try:
            return np.array(values, np.int64)
        except OverflowError:
            return np.array(values, float)
    if kinds and kinds <= {int, float, type(None)}:
        return np.array([np.nan if value is None else value for value in values], float)
    return np.array([_text(value).encode() for value in values] or [b""], "S")[: len(values)]


def _text(value: Any) -> str:
    return value if isinstance(value, str) else "" if value is None else json.dumps(value, sort_keys=True)


def stacked(blocks: Sequence[Columns]) -> Columns:
    """Columns below one another; where one is missing stands NaN or ""."""
    names = dict.fromkeys(name for block in blocks for name in block)
    sizes = [size_of(block) for block in blocks]
    return {name: _joined([block.get(name) for block in blocks], sizes) for name in names}


def _joined(parts: Sequence[Column | None], sizes: Sequence[int]) -> Column:
    there = [part for part in parts if part is not None and len(part)]
    if len({part.dtype.kind for part in there}) > 1 and any(part.dtype.kind == "S" for part in there):
        there_as_text = [None if part is None else part if part.dtype.kind == "S" else
                         column([json.dumps(v) for v in part.tolist()]) for part in parts]  # fmt: skip
        return _joined(there_as_text, sizes)
    texts = bool(there) and there[0].dtype.kind == "S"
    filled = [
        part if part is not None else np.zeros(size, "S1") if texts else np.full(size, np.nan)
        for part, size in zip(parts, sizes, strict=True) if size
    ]  # fmt: skip
    return np.concatenate(filled) if filled else np.zeros(0)


def size_of(columns: Columns) -> int:
    """Number of rows."""
    return len(next(iter(columns.values()))) if columns else 0


def taken(columns: Columns, rows: Any) -> Columns:
    """Some rows, by their numbers or by a mask."""
    return {name: values[rows] for name, values in columns.items()}


def texts(values: Column) -> list[str]:
    """A column of texts as Python's."""
    return [value.decode() for value in values.tolist()]


def checksum(columns: Columns) -> str:
    """Of names, types and every value."""
    digest = hashlib.blake2b(digest_size=16)
    for name, values in columns.items():
        digest.update(f"{name} {values.dtype} {values.shape}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
