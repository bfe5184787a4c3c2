"""A sweep as text: Markdown tables, CSV; and Parquet, for programs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...errors import MissingPackage
from ...runtime.atomic_write import temporary_name
from ...runtime.terminal import printable
from ...runtime.text_table import aligned, as_csv
from ..published import SOURCE
from ..quantities import OUTCOME
from ..store.case_table import CaseTable, plain
from ..store.columns import texts
from .pivot import ITERATIONS, Facts, Table, text

LISTED = 100
"""Cases that did not converge that a report names."""


def counts_line(table: CaseTable) -> str:
    """How many cases there are, of each status."""
    counts = Counter(table.status)
    order = ("converged", "not converged", "failed", "missing")
    return f"{len(table)} cases: " + ", ".join(
        f"{counts[name]} {name}" for name in order if counts[name]
    )


def legend(table: CaseTable, quantities: Sequence[str], tables: Sequence[Table] = ()) -> str:
    """A line that says what the cells hold, what they are means over, and what no table shows."""
    if ITERATIONS not in quantities:
        shown = {"id", *table.coordinates, *OUTCOME, *quantities}
        left = [name for name in table.names if name not in shown]
        others = f" Others: {', '.join(left)}; --cells NAME,... shows them." if left else ""
        mean = f"the mean {_over(table, tables)}of the cases that converged."
        return f"Cells: {', '.join(quantities)}, {mean}{others}"
    whole = Facts(table, ITERATIONS).cell(range(len(table)))
    if whole.published is None or whole.ours is None:
        return "Cells: iterations."
    return (
        f"Cells: iterations / published ({SOURCE}). Mean of all: {whole.ours:.1f} / "
        f"{whole.published:.1f}."
    )


def _over(table: CaseTable, tables: Sequence[Table]) -> str:
    """What cells are means over: coordinates that differ, and stand in no table and no title."""
    shown = {name for each in tables for name in (*each.row_names, *each.column_names)}
    several = [name for name in table.coordinates if len({*table.values(name)}) > 1]
    over = [name for name in several if name not in shown]
    alone = bool(over and tables) and not any(each.title for each in tables)
    return f"over {', '.join(over)} " if alone else ""


def bad_cases(table: CaseTable) -> list[str]:
    """`id: status: reason` of the cases that did not converge, the first hundred of them."""
    bad = [k for k, status in enumerate(table.status) if status not in ("converged", "missing")]
    ids, reasons = (texts(table.columns[name][bad[:LISTED]]) for name in ("id", "reason"))
    lines = [
        f"{id_}: {table.status[k]}: {reason}"
        for k, id_, reason in zip(bad, ids, reasons, strict=False)
    ]
    return [*lines, *([f"... and {len(bad) - LISTED} more"] if len(bad) > LISTED else [])]


def markdown(
    table: CaseTable, tables: Sequence[Table], quantities: Sequence[str] = (ITERATIONS,)
) -> str:
    """Title, counts, and the tables, aligned so that they read well as plain text too."""
    title = printable(table.title) or "Sweep"
    parts = [f"# {title}", counts_line(table), legend(table, quantities, tables)]
    for pivot in tables:
        if pivot.title:
            parts.append(f"## {pivot.title}")
        parts.append("\n".join(aligned(_grid(pivot, quantities))))
    if bad := bad_cases(table):
        parts.append("## Not converged")
        parts.append("\n".join(f"- {printable(line)}" for line in bad))
    return "\n\n".join(parts) + "\n"


def _grid(table: Table, quantities: Sequence[str]) -> list[list[str]]:
    head = [*table.row_names, *column_heads(table, quantities)]
    body = [
        [*map(text, row), *(table.text(row, column) for column in table.columns)]
        for row in table.rows
    ]
    mean = ["mean", *[""] * (len(table.row_names) - 1), *(cell.text() for cell in table.means)]
    return [head, *body, *([mean] if table.means else [])]


def column_heads(table: Table, quantities: Sequence[str]) -> list[str]:
    """The head of each column."""
    labels = (
        ", ".join(label(n, v) for n, v in zip(table.column_names, key, strict=True))
        for key in table.columns
    )
    return [found or quantities[0] for found in labels]


def label(name: str, value: object) -> str:
    """A coordinate and its value: `h = 0.1`, `modified`, `tau 2`."""
    short = {"element_size": "h = ", "rho": "rho = "}
    return short.get(name, "" if isinstance(value, str) else f"{name} ") + text(value)


def user_columns(table: CaseTable) -> dict[str, list[Any]]:
    """Id, coordinates, how the solve ended, quantities; in this order, values as Python's."""
    first = ["id", *table.coordinates, *OUTCOME]
    names = [*first, *(name for name in table.names if name not in first)]
    there = {
        name: plain(table.columns[name]) if name in table.columns else [None] * len(table)
        for name in names
    }
    for name in ("iterations", "published"):
        there[name] = [None if value is None else int(value) for value in there[name]]
    return there


def csv_text(table: CaseTable) -> str:
    """The table as CSV, a line for each case."""
    columns = user_columns(table)
    return as_csv(list(columns), zip(*columns.values(), strict=True))


def write_parquet(path: str | Path, table: CaseTable) -> None:
    """The columns of the CSV with their types.

    Raises
    ------
    InputError
        If polars is not installed.
    OutputError
        If the file cannot be written.
    """
    try:
        import polars
    except ImportError:
        raise MissingPackage("--parquet", "polars", "tables") from None
    with temporary_name(path) as temporary:
        polars.DataFrame(user_columns(table)).write_parquet(temporary)
