"""Tables of a sweep: any coordinates or quantities down, any across, any quantity in the cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ..design.axes import short_number
from ..store.case_table import CaseTable

Key = tuple[Any, ...]
Grouping = tuple[tuple[str, ...], list[Key], Index]
"""Names of columns, their different values, and which one each case has."""
ITERATIONS = "iterations"
"""What cells hold unless something else is asked for; the one quantity with published values."""


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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
        One a column, over all its cases; none where the rows are no parameter that one averages over.
    """

    title: str
    row_names: tuple[str, ...]
    column_names: tuple[str, ...]
    rows: list[Key]
    columns: list[Key]
    cells: dict[tuple[Key, Key], Cell]
    means: list[Cell]

    def text(self, row: Key, column: Key) -> str:
        """A cell's text."""
        cell = self.cells.get((row, column))
        return cell.text() if cell is not None else ""


class Facts:
    """The columns that cells are made of: the quantity, which cases converged, what was published."""

    def __init__(self, table: CaseTable, quantity: str) -> None:
        self.count = quantity == ITERATIONS
        self.status = table.status
        nothing = self.count and quantity not in table.columns
        value = np.full(len(table), np.nan) if nothing else table.numbers(quantity)
        self.good: Index = (np.array(table.status) == "converged") & np.isfinite(value)
        self.value = np.where(self.good, value, 0.0)
        there = self.count and "published" in table.columns
        self.published: Array = table.numbers("published") if there else np.full(len(table), np.nan)

    def cells(self, group: Index, groups: int) -> list[Cell]:
        """A cell for each of some groups of cases; `group` (n,) says which one a case belongs to, -1 for none."""
        mine = group >= 0

        def total(values: Any) -> Array:
            return np.bincount(group[mine], np.asarray(values, float)[mine], groups).astype(float)

        sizes, good = total(np.ones(len(group))), total(self.good)
        mean = total(self.value) / np.maximum(good, 1.0)
        # compared with the published counts are the cases that converged; where none did, all of them
        compared = self.good | (good == 0.0)[group] if len(group) else self.good
        known = compared & np.isfinite(self.published)
        published = total(np.where(known, self.published, 0.0)) / np.maximum(total(known), 1.0)
        whole = (total(known) == total(compared)) & (total(known) > 0)
        first = np.full(groups, -1)
        first[group[mine][::-1]] = np.flatnonzero(mine)[::-1]
        return [
            Cell(float(mean[k]) if good[k] else None, float(published[k]) if whole[k] else None,
                 self._note(int(sizes[k]), int(sizes[k] - good[k]), int(first[k])), self.count)
            for k in range(groups)
        ]  # fmt: skip

    def _note(self, size: int, missed: int, first: int) -> str:
        return "" if not missed else self.status[first] if size == 1 else f"{missed} missed"

    def cell(self, some: Index | None = None) -> Cell:
        """Of some cases, all by default."""
        group = np.zeros(len(self.good), np.int64) if some is None else np.where(some, 0, -1)
        return self.cells(group, 1)[0]


def grouped(table: CaseTable, names: Sequence[str]) -> tuple[list[Key], Index]:
    """The different values of some columns, in the order in which they come, and which one each case has."""
    if not len(table):
        return [], np.zeros(0, np.int64)
    number = np.zeros(len(table), np.int64)
    columns = [table.values(name) for name in names]
    for values in columns:
        seen: dict[Any, int] = {}
        codes = np.array([seen.setdefault(value, len(seen)) for value in values], np.int64)
        # gone over again and again, so that the product of many columns fits 64 bits
        number = np.unique(number * len(seen) + codes, return_inverse=True)[1].ravel()
    _, first, inverse = np.unique(number, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return [tuple(values[k] for values in columns) for k in first[order]], rank[inverse.ravel()]


def make_tables(
    table: CaseTable, down: Sequence[str] | None = None, across: Sequence[str] | None = None, quantity: str = ITERATIONS
) -> list[Table]:
    """Tables of a sweep; what is neither down nor across makes a table each, or is averaged where down is given.

    Parameters
    ----------
    table : CaseTable
    down, across : sequence of str, optional
        Coordinates or quantities; rho down, rule and element_size across by default, as in the paper.
    quantity : str
        In the cells.

    Raises
    ------
    InputError
        If the sweep has no such column.
    """
    names, facts = table.coordinates, Facts(table, quantity)
    for name in [*(down or ()), *(across or ())]:
        table.values(name)
    averaging = down is not None
    if across is None:
        across = [name for name in ("rule", "element_size") if name in names and name not in (down or ())]
    if down is None:
        free = [name for name in names if name not in across]
        down = ["rho"] if "rho" in free else free[-1:]
    apart = [] if averaging else [name for name in names if name not in down and name not in across]
    tables = []
    titles, of_case = grouped(table, apart)
    lines, columns = grouped(table, down), grouped(table, across)
    for number, key in enumerate(titles):
        title = ", ".join(f"{name} {text(value)}" if name != "problem" else text(value)
                          for name, value in zip(apart, key, strict=True))  # fmt: skip
        tables.append(_table(title, of_case == number, facts, (tuple(down), *lines), (tuple(across), *columns)))
    return tables


def _table(title: str, some: Index, facts: Facts, down: Grouping, across: Grouping) -> Table:
    (down_names, down_keys, line), (across_names, across_keys, column) = down, across
    pairs, group = np.unique(np.where(some, line * len(across_keys) + column, -1), return_inverse=True)
    group = group.ravel() - int(pairs[0] < 0)
    pairs = pairs[pairs >= 0]
    cells = {
        (down_keys[pair // len(across_keys)], across_keys[pair % len(across_keys)]): cell
        for pair, cell in zip(pairs.tolist(), facts.cells(group, len(pairs)), strict=True)
    }
    rows, columns = (_in_order(keys, numbers[some]) for keys, numbers in ((down_keys, line), (across_keys, column)))
    means = []
    if len(rows) > 1 and all(isinstance(value, (int, float)) for value in rows[0]):
        of_column = facts.cells(np.where(some, column, -1), len(across_keys))
        means = [of_column[k] for k in _first_seen(column[some])]
    return Table(title, down_names, across_names, rows, columns, cells, means)


def _first_seen(numbers: Index) -> list[int]:
    values, first = np.unique(numbers, return_index=True)
    found: list[int] = values[np.argsort(first, kind="stable")].tolist()
    return found


def _in_order(keys: list[Key], numbers: Index) -> list[Key]:
    return [keys[k] for k in _first_seen(numbers)]


def text(value: Any) -> str:
    """A coordinate for people."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return short_number(value)
    return "–" if value is None or value == "" else str(value)


def names_in(words: str | None) -> list[str] | None:
    """NAME,... of a command line."""
    return None if words is None else [word.strip() for word in words.split(",") if word.strip()]
