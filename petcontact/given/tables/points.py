"""Points of a file or an array, through which a function or a side goes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pydantic

from ...arrays import LARGEST_COORDINATE, Array
from ...errors import InputError
from .base import Expression, Model, NotNegative, regular_file

LARGEST_FILE = 4_000_000
"""Bytes of a file of points: as of a config, which keeps them."""
FEWEST = 4
"""Points that determine a cubic."""


def _read(value: Any) -> tuple[tuple[float, ...], ...]:
    """The rows of a file of columns, or of an array."""
    if isinstance(value, (str, Path)):
        return tuple(_rows_of(regular_file(value, LARGEST_FILE)))
    try:
        rows = np.array(value, dtype=float)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.ndim != 2:
        raise InputError("must be the name of a file of columns, or rows of numbers")
    return tuple(map(tuple, rows.tolist()))


def _rows_of(path: Path) -> list[tuple[float, ...]]:
    rows = list[tuple[float, ...]]()
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].strip()
        if not words:
            continue
        try:
            between = r"\s*;\s*" if ";" in words else r"\s*,\s*|\s+"
            row = tuple(float(word) for word in re.split(between, words))
        except ValueError:
            if not rows and number == 1:  # names of the columns
                continue
            raise InputError(
                f"line {number} of {path} is no row of numbers: {words!r:.40}"
            ) from None
        if rows and len(row) != len(rows[0]):
            raise InputError(
                f"line {number} of {path} has {len(row)} columns, those before have {len(rows[0])}"
            )
        rows.append(row)
    return rows


class Points(Model):
    """A smooth function through points, or near them, in the place of an expression.

    In a config::

        [[contact]]
        name = "scanned"
        secondary = "plate.top"
        primary = "tool"
        gap = { points = [[-2, 0.4], [-1, 0.1], [0, 0], [1, 0.1], [2, 0.4]], smooth = 0.002 }

    Attributes
    ----------
    points : file or rows of numbers
        Columns x and the value, in 3D x, y and the value, in increasing x. The file has one row a
        line, with commas, semicolons or blanks between columns; its path is relative to the
        config's folder.
    columns : list of int
        Which columns these are, from 0 on; all by default.
    smooth : float
        The spline is at most so far away from the points; with 0 it goes through all [length].
    """

    points: Annotated[
        Any,
        pydantic.PlainValidator(_read),
        pydantic.WithJsonSchema(
            {
                "anyOf": [
                    {"type": "string"},
                    {"type": "array", "items": {"type": "array", "items": {"type": "number"}}},
                ]
            }
        ),
    ]
    columns: tuple[Annotated[int, pydantic.Field(strict=True, ge=0)], ...] | None = None
    smooth: NotNegative = 0.0

    @pydantic.model_validator(mode="after")
    def _make_a_function(self) -> Points:
        count = len(self.points[0]) if self.points else 0
        if count < 2:
            raise InputError(f"points: must have at least 2 columns, x and the value; has {count}")
        columns = self.columns or range(count)
        if len(columns) not in (2, 3) or max(columns) >= count or len({*columns}) < len(columns):
            raise InputError(
                f"columns: must be 2 columns (x, value) or 3 (x, y, value) of 0 to {count - 1}, "
                f"got {list(columns)}"
            )
        if len(self.points) < FEWEST ** (len(columns) - 1):
            raise InputError(
                f"points: must be at least {FEWEST ** (len(columns) - 1)}, got {len(self.points)}"
            )
        rows = self.table
        if not (wrong := np.isfinite(rows) & (np.abs(rows) <= LARGEST_COORDINATE)).all():
            row = int(wrong.all(axis=1).argmin())
            raise InputError(
                f"points: must be finite numbers, row {row + 1} is {rows[row].tolist()}"
            )
        if len(columns) == 2 and not (rises := np.diff(rows[:, 0]) > 0.0).all():
            row = int(rises.argmin())
            raise InputError(
                f"points: x must increase from row to row; row {row + 1} has {rows[row, 0]:g}, the "
                f"next one {rows[row + 1, 0]:g}"
            )
        return self

    @property
    def table(self) -> Array:
        """The columns that are used, (n, 2) or (n, 3)."""
        rows = np.array(self.points)
        return rows if self.columns is None else rows[:, list(self.columns)]

    def __str__(self) -> str:
        return f"a spline of {len(self.points)} points"


def _kind(value: Any) -> str:
    return "table of points" if isinstance(value, (dict, Points)) else "expression"


ExpressionOrPoints = Annotated[
    Annotated[Expression, pydantic.Tag("expression")]
    | Annotated[Points, pydantic.Tag("table of points")],
    pydantic.Discriminator(_kind),
]
"""An `Expression`, or a table of `Points`."""
