"""A sweep as one HTML page that needs no other file."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...model.case import Case
from ...results.solution import Solution
from ..published import example_number
from ..store.case_table import CaseTable
from ..store.columns import texts
from .pivot import ITERATIONS, Table, text
from .plots import Plot, write_plots
from .text import bad_cases, column_heads, counts_line, label, legend

DRAWN = {
    "deformed": "initial and deformed outline",
    "displacement": "tangential displacement on the contact part",
    "traction": "tangential traction on the contact part",
    "normal": "normal traction on the contact part",
    "history": "convergence",
}
OF_THE_PAPER = ("deformed", "displacement", "traction")
"""Figures 1 to 3 of the first example, 4 to 6 of the second."""


@dataclass(frozen=True)
class Figure:
    """A picture of the page: caption, and PNG as a data URI."""

    caption: str
    uri: str


def html(table: CaseTable, tables: Sequence[Table], quantity: str = ITERATIONS, plots: Sequence[Plot] = ()) -> str:
    """One page with tables, plots, and the figures of one case a problem where its fields are kept whole."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__, ""), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template("report.html").render(
        title=table.title or "Sweep", counts=counts_line(table), legend=legend(table, quantity),
        tables=[_page_table(one, quantity) for one in tables], quantity=quantity, plots=_plots(table, plots),
        figures=_figures_of_cases(table), bad=bad_cases(table),
    )  # fmt: skip


def _page_table(table: Table, quantity: str) -> dict[str, Any]:
    """A table for the template: the first coordinate across spans the columns that share it."""
    spans: list[list[Any]] = []
    for column in table.columns if len(table.column_names) > 1 else []:
        name = label(table.column_names[0], column[0])
        if spans and spans[-1][0] == name:
            spans[-1][1] += 1
        else:
            spans.append([name, 1])
    heads = column_heads(table, 1 if spans else 0, quantity)
    body = [([text(v) for v in row], [table.cells.get((row, c)) for c in table.columns]) for row in table.rows]
    return {"title": table.title, "spans": spans, "row_names": table.row_names, "heads": heads, "body": body,
            "means": table.means}  # fmt: skip


def representatives(table: CaseTable) -> list[int]:
    """A case a problem (and the first variant), by its place: its last rule, smallest h, smallest rho."""
    def column(name: str) -> list[Any]:
        return table.values(name) if name in table.coordinates else [None] * len(table)

    rules = list(dict.fromkeys(column("rule")))
    best: dict[Any, tuple[tuple[float, float, float], int]] = {}
    facts = zip(table.status, column("problem"), column("rule"), column("element_size"), column("rho"), strict=True)
    for place, (status, problem, rule, size, rho) in enumerate(facts):
        if status in ("converged", "not converged"):
            rank = (-rules.index(rule), _number(size), _number(rho))
            if problem not in best or rank < best[problem][0]:
                best[problem] = rank, place
    return [place for _, place in best.values()]


def _number(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) else 0.0


def _figures_of_cases(table: CaseTable) -> list[tuple[str, list[Figure]]]:
    found = []
    for place in representatives(table):
        solution = table.solution(place)
        if solution is not None:
            id_ = texts(table.columns["id"][place : place + 1])[0]
            problem = table.values("problem")[place] if "problem" in table.coordinates else ""
            found.append((f"{problem}: {id_}", _figures(solution)))
    return found


def _figures(solution: Solution) -> list[Figure]:
    from ...results.figures.plots import plot_all

    number = example_number(solution.case) if isinstance(solution.case, Case) else None
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        for picture in plot_all(solution, folder, "figure"):
            kind = picture.stem.removeprefix("figure-")
            caption = DRAWN.get(kind, kind)
            if number is not None and kind in OF_THE_PAPER:
                caption = f"Figure {3 * (number - 1) + 1 + OF_THE_PAPER.index(kind)} of the paper: {caption}"
            figures.append(_embedded(picture, caption))
    return figures


def _plots(table: CaseTable, plots: Sequence[Plot]) -> list[Figure]:
    with tempfile.TemporaryDirectory() as folder:
        return [_embedded(path, plot.caption) for path, plot in zip(write_plots(table, plots, folder), plots, strict=True)]


def _embedded(picture: Path, caption: str) -> Figure:
    data = base64.b64encode(picture.read_bytes()).decode("ascii")
    return Figure(caption, f"data:image/png;base64,{data}")
