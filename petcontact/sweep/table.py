"""Cases of a sweep as rows, and rows as tables: any coordinates down, any across, iterations in the cells."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError, ResultError
from ..model.base import parse
from ..model.case import Case
from ..results.hdf5 import opened
from .cases import short_number
from .folder import SweepFolder, read_attributes
from .published import published_count
from .results_file import read_index

Key = tuple[Any, ...]
FACTS = ("status", "reason", "iterations", "rho", "residual", "elastic_residual")


@dataclass(frozen=True)
class Row:
    """One case of a sweep.

    Attributes
    ----------
    id : str
    coordinates : dict
        Problem, variant and the crossed keys.
    status : str
        converged | not converged | failed | missing.
    facts : dict
        Reason, iterations, final rho, residuals, and seconds by stage.
    published : int or None
        Iterations in the paper.
    """

    id: str
    coordinates: dict[str, Any]
    status: str
    facts: dict[str, Any]
    published: int | None

    @property
    def iterations(self) -> int | None:
        """Of a case that converged."""
        return int(self.facts["iterations"]) if self.status == "converged" else None


def read_rows(path: str | Path) -> tuple[str, list[Row]]:
    """Title and cases of a sweep's folder (finished or not) or of its results.h5.

    Raises
    ------
    ResultError
        If it is neither.
    """
    index, path = read_index(path), Path(path)
    if path.is_dir():
        cases = SweepFolder(path).cases
        attributes = {e["id"]: _attributes_or_none(cases / f"{e['id']}.h5") for e in index["cases"]}
    else:
        with opened(path) as file:
            attributes = {e["id"]: dict(file[e["id"]].attrs) if e["id"] in file else None for e in index["cases"]}
    return index["title"], [_row(e["id"], e["coordinates"], attributes[e["id"]]) for e in index["cases"]]


def _attributes_or_none(path: Path) -> dict[str, Any] | None:
    return read_attributes(path) if path.exists() else None


def _row(id_: str, coordinates: dict[str, Any], attributes: dict[str, Any] | None) -> Row:
    if attributes is None:
        return Row(id_, coordinates, "missing", {}, None)
    try:
        case: Case = parse(Case, tomllib.loads(attributes["config"]), id_)
        facts = {key: _plain(attributes[key]) for key in FACTS if key in attributes}
        facts["seconds"] = json.loads(attributes.get("timings", "{}"))
        return Row(id_, coordinates, str(attributes["status"]), facts, published_count(case))
    except (KeyError, ValueError) as error:
        raise ResultError(f"{id_}: not a case of a sweep ({error})") from None


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


@dataclass(frozen=True)
class Cell:
    """Some cases in one place of a table.

    Attributes
    ----------
    ours, published : float or None
        Mean iterations of the cases that converged, and the published mean of the same cases.
    note : str
        The status of a single case that did not converge, or how many did not.
    """

    ours: float | None
    published: float | None
    note: str

    @property
    def parts(self) -> tuple[str, str, str]:
        """Ours, published and note as texts; empty where there is nothing to say."""
        return _number(self.ours), _number(self.published), self.note

    def text(self) -> str:
        """`40 / 62` (ours / published), `failed / 62`, `40.5 / 62 (1 missed)`, `40`, `missing`."""
        ours, published, note = self.parts
        beside = f" / {published}" if published else ""
        return f"{ours}{beside} ({note})" if ours and note else f"{ours or note}{beside}"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.0f}" if value == round(value) else f"{value:.1f}"


def make_cell(rows: Sequence[Row]) -> Cell:
    """Of some rows."""
    good = [row for row in rows if row.iterations is not None]
    missed = len(rows) - len(good)
    compared = good or rows
    known = [row.published for row in compared if row.published is not None]
    note = "" if not missed else rows[0].status if len(rows) == 1 else f"{missed} missed"
    # a mean of some is not compared with a mean of others
    published = mean(known) if len(known) == len(compared) else None
    return Cell(mean([row.iterations for row in good if row.iterations is not None]), published, note)


def mean(values: Sequence[float]) -> float | None:
    """None of nothing."""
    return sum(values) / len(values) if values else None


@dataclass(frozen=True)
class Table:
    """One table: cells by row and column key, both in the order of the sweep.

    Attributes
    ----------
    title : str
    row_names, column_names : tuple of str
        Coordinates down and across.
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


def make_tables(rows: Sequence[Row], down: Sequence[str] | None = None, across: Sequence[str] | None = None) -> list[Table]:
    """Tables of a sweep; what is neither down nor across makes a table each, or is averaged where down is given.

    Parameters
    ----------
    rows : sequence of Row
    down, across : sequence of str, optional
        Coordinates; rho down, rule and element_size across by default, as in the paper.

    Raises
    ------
    InputError
        If the sweep has no such coordinate.
    """
    names = list(dict.fromkeys(name for row in rows for name in row.coordinates))
    for name in [*(down or ()), *(across or ())]:
        if name not in names:
            raise InputError(f"{name}: not a coordinate of this sweep; there are {', '.join(names)}")
    averaging = down is not None
    if across is None:
        across = [name for name in ("rule", "element_size") if name in names and name not in (down or ())]
    if down is None:
        free = [name for name in names if name not in across]
        down = ["rho"] if "rho" in free else free[-1:]
    apart = [] if averaging else [name for name in names if name not in down and name not in across]
    tables = []
    for key in _keys(rows, apart):
        some = [row for row in rows if _key(row, apart) == key]
        title = ", ".join(f"{name} {text(value)}" if name != "problem" else text(value)
                          for name, value in zip(apart, key, strict=True))  # fmt: skip
        tables.append(_table(title, some, tuple(down), tuple(across)))
    return tables


def _table(title: str, rows: Sequence[Row], down: tuple[str, ...], across: tuple[str, ...]) -> Table:
    cells: dict[tuple[Key, Key], list[Row]] = {}
    for row in rows:
        cells.setdefault((_key(row, down), _key(row, across)), []).append(row)
    columns = _keys(rows, across)
    lines = _keys(rows, down)
    numbers = len(lines) > 1 and all(isinstance(value, (int, float)) for value in lines[0])
    means = [make_cell([row for row in rows if _key(row, across) == column]) for column in columns if numbers]
    return Table(title, down, across, lines, columns, {k: make_cell(v) for k, v in cells.items()}, means)


def _key(row: Row, names: Iterable[str]) -> Key:
    """Values of some coordinates; one that is a list or a table stands as its text."""
    values = (row.coordinates.get(name) for name in names)
    return tuple(json.dumps(value) if isinstance(value, (list, dict)) else value for value in values)


def _keys(rows: Iterable[Row], names: Sequence[str]) -> list[Key]:
    """Without repetition, in the order in which they come."""
    return list(dict.fromkeys(_key(row, names) for row in rows))


def text(value: Any) -> str:
    """A coordinate for people."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return short_number(value)
    return "–" if value is None else str(value)
