"""Points of a file or an array, through which a function or a side goes."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pydantic

from ...arrays import LARGEST_COORDINATE, Array
from ...errors import InputError
from ...geometry.smooth_curve import SmoothCurve
from ...round_off import WRITTEN
from ...runtime.hints import number_refused
from .base import Expression, Model, NotNegative, regular_file

LARGEST_FILE = 4_000_000
"""Bytes of a file of points: as of a config, which keeps them."""
FEWEST = 4
"""Points that determine a cubic."""


def _read(value: object) -> tuple[tuple[float, ...], ...]:
    """The rows of a file of columns, or of an array."""
    if isinstance(value, (str, Path)):
        return tuple(rows_of(regular_file(value, LARGEST_FILE)))
    try:
        rows = np.array(value, dtype=float)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.ndim != 2:
        raise InputError("must be the name of a file of columns, or rows of numbers")
    return tuple(map(tuple, rows.tolist()))


def rows_of(path: Path) -> list[tuple[float, ...]]:
    """The rows of a file, below lines of names and units, in which nothing begins as a number.

    The last line shows what is between columns; blanks may stand for it in some. Beside semicolons
    or tabs a comma is a decimal point.
    """
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    last = next(filter(None, reversed(lines)), "")
    between = next((mark for mark in ";\t" if mark in last), None)
    cells = {number: _cells(line, between) for number, line in enumerate(lines, 1) if line}
    begun = (k for k in cells if any(re.match(r"\s*[-+.]*\d", cell) for cell in cells[k]))
    first = next(begun, max(cells, default=0))
    rows = {
        number: _row(f"line {number} of {path}", own, lines[number - 1])
        for number, own in cells.items()
        if number >= first
    }
    for number, row in rows.items():
        if len(row) != len(rows[first]):
            raise InputError(
                f"line {number} of {path} has {len(row)} columns, those before have "
                f"{len(rows[first])}"
            )
    return [*rows.values()]


def _row(where: str, cells: list[str], line: str) -> tuple[float, ...]:
    try:
        return tuple(map(float, cells))
    except ValueError:
        refused = next((f"; {why}" for why in map(number_refused, cells) if why), "")
        raise InputError(f"{where} is no row of numbers: {line!r:.40}{refused}") from None


def _cells(line: str, between: str | None) -> list[str]:
    """What a line has in its columns; some files have tabs in some lines and blanks in others."""
    if between:
        return line.replace(",", ".").split(between if between in line else None)
    return line.split("," if "," in line else None)


Rows = Annotated[
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
"""A file of columns, or rows of numbers."""
Columns = tuple[Annotated[int, pydantic.Field(strict=True, ge=0)], ...]
"""Numbers of columns, from 0 on."""


def table_of(rows: Sequence[Sequence[float]], columns: Columns | None, *names: str) -> Array:
    """The columns of rows that are used (n, k), finite; `names` are what they may be, by number.

    Raises
    ------
    InputError
        If there are no such columns, too few rows, or a number is not finite.
    """
    counts = [name.count(",") + 1 for name in names]
    count = len(rows[0]) if rows else 0
    if count < min(counts):
        raise InputError(
            f"points: must have at least {min(counts)} columns, {names[0]}; has {count}"
        )
    chosen = list(range(count) if columns is None else columns)
    if len(chosen) not in counts or max(chosen) >= count or len({*chosen}) < len(chosen):
        allowed = " or ".join(f"{k} {name}" for k, name in zip(counts, names, strict=True))
        allowed = allowed.replace(" (", " columns (", 1)
        raise InputError(f"columns: must be {allowed} of 0 to {count - 1}, got {chosen}")
    if len(rows) < (fewest := FEWEST ** (len(chosen) - 1)):
        raise InputError(f"points: needs at least {fewest} rows, got {len(rows)}")
    table = np.array(rows)[:, chosen]
    if not (right := np.isfinite(table) & (np.abs(table) <= LARGEST_COORDINATE)).all():
        row = int(right.all(axis=1).argmin())
        raise InputError(f"points: must be finite numbers, row {row + 1} is {table[row].tolist()}")
    return table


@functools.lru_cache(maxsize=16)
def curve_of(
    rows: tuple[tuple[float, ...], ...],
    smooth: float,
    closed: bool | None = None,
    axial: bool = False,
) -> SmoothCurve:
    """The smooth curve through points of the plane, or near them.

    Parameters
    ----------
    rows : tuple of (x, y)
        [length]
    smooth : float
        Largest distance from them [length].
    closed : bool, optional
        By default, whether the last point is the first one. A closed curve that ends elsewhere
        goes on to its first point.
    axial : bool
        Whether ends on x = 0 lie on an axis of revolution.

    Raises
    ------
    InputError
        If there are too few points, one repeats the one before, or the curve crosses itself.
    """
    import shapely

    if len(rows) < FEWEST:
        raise InputError(f"points: needs at least {FEWEST} rows, got {len(rows)}")
    meets = rows[0] == rows[-1]
    closed = meets if closed is None else closed
    table = np.array([*rows, *rows[:1]] if closed and not meets else rows)
    if not (moves := (np.diff(table, axis=0) != 0.0).any(axis=1)).all():
        row = int(moves.argmin())
        raise InputError(f"points: row {row + 2} repeats the one before, {table[row].tolist()}")
    near = np.abs(table[[0, -1], 0]) <= WRITTEN * np.abs(table).max()
    ends = near & axial & (not closed)
    points = tuple(map(tuple, table.tolist()))
    curve = SmoothCurve(points, smooth, closed, (bool(ends[0]), bool(ends[1])))
    line = curve.at(np.linspace(*curve.reach, 4 * len(table)))
    line[-1] = line[0] if closed else line[-1]
    if not shapely.LineString(line).is_simple:
        raise InputError(
            "points: the curve crosses itself; rows must be in their order along it, and noise "
            "needs a value of smooth"
        )
    return curve


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
        line, with commas, blanks, semicolons or tabs between columns; beside the last two a decimal
        comma is read. Its path is relative to the
        config's folder.
    columns : list of int
        Which columns these are, from 0 on; all by default.
    smooth : float
        The spline is at most so far away from the points; with 0 it goes through all [length].
    """

    points: Rows
    columns: Columns | None = None
    smooth: NotNegative = 0.0

    @pydantic.model_validator(mode="after")
    def _make_a_function(self) -> Points:
        rows = self.table
        if rows.shape[1] == 2 and not (rises := np.diff(rows[:, 0]) > 0.0).all():
            row = int(rises.argmin())
            raise InputError(
                f"points: x must increase from row to row; row {row + 1} has {rows[row, 0]:g}, the "
                f"next one {rows[row + 1, 0]:g}"
            )
        return self

    @property
    def table(self) -> Array:
        """The columns that are used, (n, 2) or (n, 3)."""
        return table_of(self.points, self.columns, "(x, value)", "(x, y, value)")

    def __str__(self) -> str:
        return f"a spline of {len(self.points)} points"


def _kind(value: object) -> str:
    return "table of points" if isinstance(value, (dict, Points)) else "expression"


ExpressionOrPoints = Annotated[
    Annotated[Expression, pydantic.Tag("expression")]
    | Annotated[Points, pydantic.Tag("table of points")],
    pydantic.Discriminator(_kind),
]
"""An `Expression`, or a table of `Points`."""
