"""Tables of a sweep as Markdown on standard output; beside the published counts where the cases are the paper's."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact report`."""
    parser.add_argument("sweep", metavar="DIR", help="folder of a sweep, finished or not, or its results.h5")
    parser.add_argument("--csv", metavar="FILE", help="write one line a case")
    parser.add_argument("--html", metavar="FILE", help="write one page with tables and figures that needs no other file")
    parser.add_argument("--rows", metavar="NAME,...",
                        help="coordinates down, for example variant; cells are then means over what is left")  # fmt: skip
    parser.add_argument("--columns", metavar="NAME,...", help="coordinates across (default: rule,element_size)")


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print and write; needs no PETSc."""
    from ..runtime.atomic_write import check_target, write_text
    from ..sweep.report import csv_text, html, markdown
    from ..sweep.table import make_tables, read_rows

    for name in filter(None, (arguments.csv, arguments.html)):
        check_target(Path(name), replace=True)
    title, rows = read_rows(arguments.sweep)
    tables = make_tables(rows, _names(arguments.rows), _names(arguments.columns))
    print(markdown(title, rows, tables), end="")
    if arguments.csv:
        write_text(arguments.csv, csv_text(rows))
    if arguments.html:
        write_text(arguments.html, html(arguments.sweep, title, rows, tables))
    return 0


def _names(words: str | None) -> list[str] | None:
    return None if words is None else [word.strip() for word in words.split(",") if word.strip()]
