"""Reports of a sweep: Markdown tables, CSV, and one HTML page that needs no other file."""

from __future__ import annotations

import base64
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..results.hdf5 import read_solution
from ..runtime.terminal import printable
from ..runtime.text_table import aligned, as_csv
from .published import SOURCE, example_number
from .table import Row, Table, make_cell, text

DRAWN = {
    "deformed": "initial and deformed outline",
    "displacement": "tangential displacement on the contact part",
    "traction": "tangential traction on the contact part",
    "history": "convergence",
}


def counts_line(rows: Sequence[Row]) -> str:
    """How many cases there are, of each status."""
    counts = Counter(row.status for row in rows)
    order = ("converged", "not converged", "failed", "missing")
    return f"{len(rows)} cases: " + ", ".join(f"{counts[name]} {name}" for name in order if counts[name])


def legend(rows: Sequence[Row]) -> str:
    """What the cells are."""
    whole = make_cell(rows)
    if whole.published is None or whole.ours is None:
        return "Cells: iterations."
    return (
        f"Cells: iterations / published ({SOURCE}). "
        f"Mean of all: {whole.ours:.1f} / {whole.published:.1f}."
    )


def markdown(title: str, rows: Sequence[Row], tables: Sequence[Table]) -> str:
    """Title, counts, and the tables, aligned so that they read well as plain text too."""
    parts = [f"# {printable(title) or 'Sweep'}", counts_line(rows), legend(rows)]
    for table in tables:
        if table.title:
            parts.append(f"## {table.title}")
        parts.append("\n".join(aligned(_grid(table))))
    if bad := _bad(rows):
        parts.append("## Not converged")
        parts.append("\n".join(f"- {row.id}: {row.status}: {row.facts.get('reason', '')}" for row in bad))
    return "\n\n".join(parts) + "\n"


def _bad(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row.status not in ("converged", "missing")]


def _grid(table: Table) -> list[list[str]]:
    head = [*table.row_names, *_heads(table, 0)]
    body = [[*map(text, row), *(table.text(row, column) for column in table.columns)] for row in table.rows]
    mean = ["mean", *[""] * (len(table.row_names) - 1), *(cell.text() for cell in table.means)]
    return [head, *body, *([mean] if table.means else [])]


def _heads(table: Table, skip: int) -> list[str]:
    """What stands above each column: its coordinates but the first `skip`."""
    names = table.column_names[skip:]
    labels = (", ".join(_label(n, v) for n, v in zip(names, key[skip:], strict=True)) for key in table.columns)
    return [label or "iterations" for label in labels]


def _label(name: str, value: Any) -> str:
    short = {"element_size": "h = ", "rho": "rho = "}
    return short.get(name, "" if isinstance(value, str) else f"{name} ") + text(value)


def csv_text(rows: Sequence[Row]) -> str:
    """One line a case: id, coordinates, status, iterations, published, final rho, residuals, seconds of iteration."""
    names = list(dict.fromkeys(name for row in rows for name in row.coordinates))
    facts = ("iterations", "rho", "residual", "elastic_residual")
    heads = ["status", "published", "iterations", "final_rho", *facts[2:], "iterate_seconds", "reason"]
    return as_csv(["id", *names, *heads], ([
        row.id, *(row.coordinates.get(name) for name in names), row.status, row.published,
        *(row.facts.get(name) for name in facts), row.facts.get("seconds", {}).get("iterate"), row.facts.get("reason"),
    ] for row in rows))  # fmt: skip


@dataclass(frozen=True)
class Figure:
    """A picture of the page: caption, and PNG as a data URI."""

    caption: str
    uri: str


def html(path: str | Path, title: str, rows: Sequence[Row], tables: Sequence[Table]) -> str:
    """One page with the tables and the figures of one case a problem; nothing in it refers to another file.

    Parameters
    ----------
    path : str or Path
        Folder or results.h5 of the sweep, for the figures.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__, "data"), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    figures = [(row, _figures(Path(path), row)) for row in representatives(rows)]
    return environment.get_template("report.html").render(
        title=title or "Sweep", counts=counts_line(rows), legend=legend(rows), tables=[_page_table(t) for t in tables],
        figures=figures, bad=_bad(rows),
    )  # fmt: skip


def _page_table(table: Table) -> dict[str, Any]:
    """A table for the template: the first coordinate across spans the columns that share it."""
    spans: list[list[Any]] = []
    for column in table.columns if len(table.column_names) > 1 else []:
        label = _label(table.column_names[0], column[0])
        if spans and spans[-1][0] == label:
            spans[-1][1] += 1
        else:
            spans.append([label, 1])
    heads = _heads(table, 1 if spans else 0)
    body = [([text(v) for v in row], [table.cells.get((row, c)) for c in table.columns]) for row in table.rows]
    return {"title": table.title, "spans": spans, "row_names": table.row_names, "heads": heads, "body": body,
            "means": table.means}  # fmt: skip


def representatives(rows: Sequence[Row]) -> list[Row]:
    """One case a problem (and the first variant): its last rule, smallest h, smallest rho."""
    rules = list(dict.fromkeys(row.coordinates.get("rule") for row in rows))
    best: dict[Any, Row] = {}
    for row in rows:
        if row.status in ("converged", "not converged"):
            problem = row.coordinates.get("problem")
            if problem not in best or _rank(row, rules) < _rank(best[problem], rules):
                best[problem] = row
    return list(best.values())


def _rank(row: Row, rules: list[Any]) -> tuple[float, float, float]:
    c = row.coordinates
    return -rules.index(c.get("rule")), float(c.get("element_size", 0.0)), float(c.get("rho", 0.0))


def _figures(path: Path, row: Row) -> list[Figure]:
    from ..results.figures import plot_all

    solution = read_solution(path / "cases" / f"{row.id}.h5") if path.is_dir() else read_solution(path, row.id)
    number = example_number(solution.case)
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        for picture in plot_all(solution, folder, "figure"):
            kind = picture.stem.removeprefix("figure-")
            caption = DRAWN.get(kind, kind)
            if number is not None and kind != "history" and kind in DRAWN:
                caption = f"Figure {3 * (number - 1) + 1 + list(DRAWN).index(kind)} of the paper: {caption}"
            data = base64.b64encode(picture.read_bytes()).decode("ascii")
            figures.append(Figure(caption, f"data:image/png;base64,{data}"))
    return figures
