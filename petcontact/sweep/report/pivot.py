"""Tables of a sweep: any coordinates or quantities down, any across, any quantity in the cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...frozen import frozen
from ..design.axes import short_number
from ..store.case_table import CaseTable

Key = tuple[Any, ...]
ITERATIONS = "iterations"
"""What cells hold unless something else is asked for; the one quantity with published values."""


@frozen
class Cell:
    """Some cases in one place of a table.

    Attributes
    ----------
    ours, published : float or None
        Mean of the cases that converged, and the published mean of the same cases.
    note : str
        The status of a single case that did not converge, or how many did not.
    count : bool
        Whether the numbers are counts.
    """

    ours: float | None
    published: float | None
    note: str
    count: bool = True

    @property
    def parts(self) -> tuple[str, str, str]:
        """Ours, published and note as texts; empty where there is nothing to say."""
        return self._number(self.ours), self._number(self.published), self.note

    def text(self) -> str:
        """`40 / 62` (ours / published), `failed / 62`, `40.5 / 62 (1 missed)`, `40`, `missing`."""
        ours, published, note = self.parts
        beside = f" / {published}" if published else ""
        return f"{ours}{beside} ({note})" if ours and note else f"{ours or note}{beside}"

    def _number(self, value: float | None) -> str:
        if value is None or not self.count:
            return "" if value is None else f"{value:.5g}"
        return f"{value:.0f}" if value == round(value) else f"{value:.1f}"


@frozen
class Table:
    """One table: cells by row and column key, both in the order of the sweep.

    Attributes
    ----------
    title : str
    row_names, column_names : tuple of str
        Down and across.
    rows, columns : list of tuple
        Their values.
    cells : dict of (row, column) to Cell
    means : list of Cell
        One a column, over all its cases; none where the rows are no parameter that one averages
        over.
    """

    title: str
    row_names: tuple[str, ...]
    column_names: tuple[str, ...]
    rows: list[Key]
    columns: list[Key]
    cells: dict[tuple[Key, Key], Cell]
    means: list[Cell]

    def text(self, row: Key, column: Key) -> str:
        """Text of a cell of the table."""
        cell = self.cells.get((row, column))
        return cell.text() if cell is not None else ""


class Facts:
    """The columns that cells are made of: the quantity, which cases converged, what was
    published."""

    def __init__(self, table: CaseTable, quantity: str) -> None:
        self.count, self.status = quantity == ITERATIONS, table.status
        nothing = np.full(len(table), np.nan)
        value = nothing if self.count and quantity not in table.columns else table.numbers(quantity)
        self.good: Index = (np.array(table.status) == "converged") & np.isfinite(value)
        self.value = np.where(self.good, value, 0.0)
        self.published: Array = (
            table.numbers("published") if self.count and "published" in table.columns else nothing
        )

    def cells(self, group: Index, groups: int) -> list[Cell]:
        """A cell for each of some groups of cases; `group` (n,) says which one a case belongs to,
        -1 for none."""

        def total(values: Any) -> Array:
            return np.bincount(group + 1, values, groups + 1)[1:].astype(float)

        sizes, good = total(np.ones(len(group))), total(self.good)
        mean = total(self.value) / np.maximum(good, 1.0)
        # compared with the published counts are the cases that converged; where none did, all of
        # them
        compared = self.good | (np.append(good, 0.0)[group] == 0.0)
        known = compared & np.isfinite(self.published)
        published = total(np.where(known, self.published, 0.0)) / np.maximum(total(known), 1.0)
        whole = (total(known) == total(compared)) & (total(known) > 0)
        last = np.zeros(groups + 1, np.int64)
        last[group] = np.arange(len(group))
        return [
            Cell(
                float(mean[k]) if good[k] else None,
                float(published[k]) if whole[k] else None,
                ""
                if good[k] == n
                else self.status[last[k]]
                if n == 1
                else f"{n - good[k]:.0f} missed",
                self.count,
            )
            for k, n in enumerate(sizes)
        ]

    def cell(self) -> Cell:
        """A single cell for all cases."""
        return self.cells(np.zeros(len(self.good), np.int64), 1)[0]


def numbered(codes: Index) -> tuple[Index, Index]:
    """Codes (n,) renumbered from 0 in the order in which they come, and where each comes first."""
    _, first, inverse = np.unique(codes, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    return np.argsort(order)[inverse.ravel()], first[order]


def grouped(table: CaseTable, names: Sequence[str]) -> tuple[list[Key], Index]:
    """The different values of some columns, in the order in which they come, and which one each
    case has."""
    number, first = numbered(np.zeros(len(table), np.int64))
    columns = [table.values(name) for name in names]
    for values in columns:
        seen: dict[Any, int] = {}
        codes = np.array([seen.setdefault(value, len(seen)) for value in values], np.int64)
        # renumbered again and again, so that the product of many columns fits 64 bits
        number, first = numbered(number * len(seen) + codes)
    return [tuple(values[k] for values in columns) for k in first], number


def make_tables(
    table: CaseTable,
    down: Sequence[str] | None = None,
    across: Sequence[str] | None = None,
    quantity: str = ITERATIONS,
) -> list[Table]:
    """Tables of a sweep; what is neither down nor across makes a table each, or is averaged where
    down is given.

    Parameters
    ----------
    table : CaseTable
    down, across : sequence of str, optional
        Coordinates or quantities; rho down, rule and element_size across by default, as in the
        paper.
    quantity : str
        In the cells.

    Raises
    ------
    InputError
        If the sweep has no such column.
    """
    names, facts, averaging = table.coordinates, Facts(table, quantity), down is not None
    for name in [*(down or ()), *(across or ())]:
        table.values(name)
    if across is None:
        across = [
            name for name in ("rule", "element_size") if name in names and name not in (down or ())
        ]
    if down is None:
        free = [name for name in names if name not in across]
        down = ["rho"] if "rho" in free else free[-1:]
    apart = [] if averaging else [name for name in names if name not in down and name not in across]
    (titles, of_case), (rows, line), (columns, column) = (
        grouped(table, some) for some in (apart, down, across)
    )
    tables = []
    for number, key in enumerate(titles):
        title = ", ".join(
            f"{name} {text(value)}" if name != "problem" else text(value)
            for name, value in zip(apart, key, strict=True)
        )
        some = np.flatnonzero(of_case == number)
        group = np.full(len(table), -1)
        group[some], first = numbered(line[some] * len(columns) + column[some])
        places = [(rows[line[k]], columns[column[k]]) for k in some[first]]
        cells = dict(zip(places, facts.cells(group, len(places)), strict=True))
        mine, heads = (
            list(dict.fromkeys(row for row, _ in places)),
            list(dict.fromkeys(head for _, head in places)),
        )
        means = []
        if len(mine) > 1 and all(isinstance(value, (int, float)) for value in mine[0]):
            group[some], _ = numbered(column[some])
            means = facts.cells(group, len(heads))
        tables.append(Table(title, tuple(down), tuple(across), mine, heads, cells, means))
    return tables


def text(value: Any) -> str:
    """A coordinate as it is printed."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return short_number(value)
    return "–" if value is None or value == "" else str(value)


def names_in(words: str | None) -> list[str] | None:
    """NAME,... of a command line."""
    return None if words is None else [word.strip() for word in words.split(",") if word.strip()]
