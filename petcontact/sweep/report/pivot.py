"""Tables of a sweep: any coordinates or quantities down, any across, any quantity in the cells."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...given.tables.solver_options import Method
from ...record import record
from ..design.axes import short_number
from ..store.case_table import CaseTable

Key = tuple[Any, ...]
ITERATIONS = "iterations"
"""The one quantity with published values."""
OF_CONTACT = ("max_pressure", "contact_area", "slip_length", "max_u_t")
"""What one asks about the same contact under other loads, shapes or materials."""


@record
class Cell:
    """The cases that share one place of a table.

    Attributes
    ----------
    ours, published : float or None
        Mean of the cases that converged, and the published mean of the same cases.
    note : str
        Why a single case has no number: its status, or what the number is; or how many have none.
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


@record
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


TOLD = ("von_mises_", "worn_", "load_factor")
"""How names of columns begin that are told where a sweep has them."""


def asked_about(table: CaseTable, words: str | None = None) -> Sequence[str]:
    """What a report shows: the quantities NAME,... that are named.  Where none is, iterations if
    methods or their parameters are compared, else the contact itself, or bodies without it, and
    what the sweep asks for."""
    from ..quantities import PEAKS, is_column

    if named := names_in(words):
        return named
    compared = {*Method.model_fields} & {*table.coordinates}
    if compared or not {*OF_CONTACT} <= {*table.columns}:
        return (ITERATIONS,)
    trust = [name for name in ("estimated_error", "warnings") if name in table.columns]
    known = [name for name in trust if np.isfinite(table.numbers(name)).any()]
    asked = [
        name
        for name in table.names
        if name not in table.coordinates
        and (not is_column(name) or name in PEAKS or name.startswith(TOLD))
    ]
    alone = "max_displacement" in table.columns and not (table.numbers("contact_area") > 0.0).any()
    return (*(("max_displacement",) if alone else OF_CONTACT), *asked, *known)


class Facts:
    """What cells are made of: the quantity of the cases that converged, and what was published."""

    def __init__(self, table: CaseTable, quantity: str) -> None:
        self._count = quantity == ITERATIONS
        names = [quantity, "published"] if self._count else [quantity]
        nothing = np.full(len(table), np.nan)
        self._value, self._published = [
            nothing if self._count and name not in table.columns else table.numbers(name)
            for name in names
        ] + [nothing] * (2 - len(names))
        solved = np.array(table.status) == "converged"
        self._good = solved & np.isfinite(self._value)
        why = np.where(np.isinf(self._value), "without a bound", "not known")
        self._notes = np.where(solved, why, table.status).tolist()

    def cell(self, cases: Sequence[int]) -> Cell:
        """A cell for some cases, by their places.

        The published counts are those of the cases that converged; where none did, of all.
        """
        good = [case for case in cases if self._good[case]]
        missed = len(cases) - len(good)
        return Cell(
            _mean([self._value[case] for case in good]),
            _mean([self._published[case] for case in good or cases]),
            "" if not missed else f"{missed} missed" if len(cases) > 1 else self._notes[cases[0]],
            self._count,
        )


def _mean(values: Sequence[float]) -> float | None:
    """Return the mean of numbers; None where one of them is not there."""
    total = float(sum(values))
    return total / len(values) if values and math.isfinite(total) else None


def make_tables(
    table: CaseTable,
    down: Sequence[str] | None = None,
    across: Sequence[str] | None = None,
    quantities: Sequence[str] = (ITERATIONS,),
) -> list[Table]:
    """Tables of a sweep; what is neither down nor across makes a table each, or is averaged where
    down is given.

    Parameters
    ----------
    table : CaseTable
    down, across : sequence of str, optional
        Coordinates or quantities; of one quantity rho down, rule and element_size across by
        default, as in the paper, of several all coordinates that differ down.
    quantities : sequence of str
        In the cells; several of them are columns.

    Raises
    ------
    InputError
        If the sweep has no such column.
    """
    several, facts = len(quantities) > 1, {name: Facts(table, name) for name in quantities}
    layout = _layout(table, down, across, several)
    keys = [
        zip(*(table.values(name) for name in some), strict=True) if some else [()] * len(table)
        for some in layout
    ]
    tables: dict[Key, dict[tuple[Key, Key], list[int]]] = {}
    for case, (row, column, title) in enumerate(zip(*keys, strict=True)):
        for name in quantities:
            place = row, (*column, *[name] * several)
            tables.setdefault(title, {}).setdefault(place, []).append(case)
    rows, columns, apart = layout
    return [
        _table(
            ", ".join(
                text(value) if name == "problem" else f"{name} {text(value)}"
                for name, value in zip(apart, title, strict=True)
            ),
            (rows, (*columns, *["quantity"] * several)),
            cases,
            facts,
        )
        for title, cases in tables.items()
    ]


def _layout(
    table: CaseTable, down: Sequence[str] | None, across: Sequence[str] | None, several: bool
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Names down, across, and of those that make a table each; see `make_tables`."""
    if across is None:
        first = () if several else ("rule", "element_size")
        across = [name for name in first if name in {*table.coordinates} - {*(down or ())}]
    free = [name for name in table.coordinates if name not in across]
    if down is not None:
        return tuple(down), tuple(across), ()
    differ = [name for name in free if len({*table.values(name)}) > 1] or free[-1:]
    down = differ if several else ["rho"] if "rho" in free else free[-1:]
    return tuple(down), tuple(across), tuple(name for name in free if name not in down)


def _table(
    title: str,
    names: tuple[tuple[str, ...], tuple[str, ...]],
    cases: Mapping[tuple[Key, Key], list[int]],
    facts: Mapping[str, Facts],
) -> Table:
    """A table of the cases in each of its cells."""
    rows = list(dict.fromkeys(row for row, _ in cases))
    columns: dict[Key, list[int]] = {}
    for (_, column), some in cases.items():
        columns.setdefault(column, []).extend(some)
    parameters = all(isinstance(value, (int, float)) for value in rows[0])
    averaged = len(rows) > 1 and len(facts) == 1 and parameters
    (first, *_) = facts.values()
    return Table(
        title,
        *names,
        rows,
        list(columns),
        {
            place: facts.get(place[1][-1] if place[1] else "", first).cell(some)
            for place, some in cases.items()
        },
        [first.cell(some) for some in columns.values()] if averaged else [],
    )


def text(value: object) -> str:
    """A coordinate as it is printed."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return short_number(value)
    return "–" if value is None or value == "" else str(value)


def names_in(words: str | None) -> list[str] | None:
    """Split NAME,NAME,... of a command line into names."""
    return None if words is None else [word.strip() for word in words.split(",") if word.strip()]
